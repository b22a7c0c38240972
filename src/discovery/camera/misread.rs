//! Pixels that say something else than they are taken for: u and v exchanged, a mirrored picture, one of another size.
//!
//! No effect of a camera's does that, and formulas that come near it say nothing. Where the pixels read otherwise are where
//! the known camera shows the points, and as they are far from it, they were written otherwise.

use nalgebra::Vector2;

use super::bent::Bent;
use super::term::Law;
use super::views::Data;

/// How pixels must be read to be where the camera shows the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Reading {
    /// u as v, and v as u.
    Exchanged,
    /// From right to left.
    LeftToRight,
    /// From below upwards.
    UpsideDown,
    /// Both.
    HalfATurn,
    /// As those of a picture so many times as large.
    Times(f64),
}

/// Pixels that are read otherwise, and how far points are from where the camera shows them in the middle, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Misread {
    /// How.
    pub(super) reading: Reading,
    /// As they are.
    pub(super) off_px: f64,
    /// Read otherwise.
    pub(super) then_px: f64,
}

/// Sizes that pictures are made smaller or larger to, and their inverses. Chosen: halves and thirds, as cameras and tools offer.
const SIZES: [f64; 4] = [1.5, 2.0, 3.0, 4.0];
/// Points are far off from this part of the focal length, in the middle. Chosen: 16 px of 800, more than effects do.
const FAR: f64 = 0.02;
/// Read otherwise they must be off by less than this part of it: an effect, and a middle that is not the picture's, may be left.
const NEARER: f64 = 0.1;

impl Reading {
    /// All of them.
    fn all() -> impl Iterator<Item = Self> {
        let turned = [Self::Exchanged, Self::LeftToRight, Self::UpsideDown, Self::HalfATurn];
        let sizes = SIZES.into_iter().flat_map(|size| [size, 1.0 / size]).map(Self::Times);
        turned.into_iter().chain(sizes)
    }

    /// Reads a pixel; `middle` is the picture's.
    fn of(self, pixel: Vector2<f64>, middle: Vector2<f64>) -> Vector2<f64> {
        let across = 2.0 * middle - pixel;
        match self {
            Self::Exchanged => Vector2::new(pixel.y, pixel.x),
            Self::LeftToRight => Vector2::new(across.x, pixel.y),
            Self::UpsideDown => Vector2::new(pixel.x, across.y),
            Self::HalfATurn => across,
            // (0, 0) is the middle of the first pixel.
            Self::Times(by) => (pixel.add_scalar(0.5) * by).add_scalar(-0.5),
        }
    }
}

/// Returns how pixels must be read where that is clearly otherwise; `known` are effects known, and their parameters. `None` where
/// poses are not known, too: then the camera shows points nowhere.
pub(super) fn misread(data: &Data, known: (&[Law], &[f64])) -> Option<Misread> {
    if !data.posed {
        return None;
    }
    let bent = Bent::new(&data.lens, data.up(), known.0, known.1);
    let shown: Vec<(Vector2<f64>, Vector2<f64>)> = data
        .sights
        .iter()
        .filter_map(|sight| {
            let pose = &data.views[sight.view].camera_from_world;
            Some((data.pixel(&bent, pose, sight)?, sight.pixel))
        })
        .collect();
    let middle = Vector2::new(data.lens.cx, data.lens.cy);
    let off = |read: &dyn Fn(Vector2<f64>) -> Vector2<f64>| {
        let mut off: Vec<f64> =
            shown.iter().map(|(shown, pixel)| (read(*pixel) - shown).norm()).collect();
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).copied()
    };
    let off_px = off(&|pixel| pixel)?;
    let (then_px, reading) = Reading::all()
        .filter_map(|reading| Some((off(&|pixel| reading.of(pixel, middle))?, reading)))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_far = off_px > FAR * data.lens.fx.min(data.lens.fy);
    (is_far && then_px < NEARER * off_px).then_some(Misread { reading, off_px, then_px })
}
