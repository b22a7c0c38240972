//! What views of a planar target lack, and which picture to take next.
//!
//! In comes a calibration and its views, out come how the target was held, where in the picture it was, and advice
//! in the order of what it is worth. What is said is in each advice's `Display`.
//!
//! Source: Zhang, "A Flexible New Technique for Camera Calibration", PAMI 2000, §5.1 (the number of planes and their
//! tilt).

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use super::{Calibration, OFF_CENTRE, View, ViewFit, lens};
use crate::alignment::picture::median;

/// How the target was held in one view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Between the target's normal and the optical axis, rad: 0 is face-on.
    pub tilt: f64,
    /// Which way it leans in the picture, rad from u towards v, modulo half a turn.
    pub direction: f64,
}

/// Where the corners are and how the target was held.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// View by view.
    pub held: Vec<Held>,
    /// Whether the lens can be undone everywhere in the picture.
    pub is_one_to_one: bool,
    /// Points in each ninth of the picture, rows from the top, columns from the left.
    pub ninths: [[usize; 3]; 3],
    /// What the target has otherwise than was said, where somebody looked.
    pub other_gap: Option<OtherGap>,
}

/// Tags that are printed farther apart, or less far, than was said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherGap {
    /// The gap that was said, as a part of a tag.
    pub said: f64,
    /// The one that the pictures show.
    pub seen: f64,
    /// Root mean square reprojection error with the one said, px.
    pub rms_px: f64,
    /// The same with the one seen.
    pub better_px: f64,
}

/// What a further picture should show.
#[derive(Debug, Clone, PartialEq)]
pub enum Advice {
    /// The target is not what was said.
    OtherGap(OtherGap),
    /// Few pictures.
    FewViews {
        /// How many there are.
        views: usize,
    },
    /// One view: the principal point is not measured.
    OneView,
    /// The target is nearly face-on in all of them.
    FaceOn {
        /// The largest tilt, rad.
        tilt: f64,
    },
    /// The target leans to one side and its opposite only.
    OneDirection {
        /// Whether it leans left or right; otherwise up or down.
        is_sideways: bool,
    },
    /// Parts of the picture with few corners or none.
    Empty {
        /// Rows and columns of the ninths, from the top and the left.
        places: Vec<(usize, usize)>,
    },
    /// The lens, where no corner was, shows one place twice.
    Folds,
    /// The focal length is loosely held.
    Unsure {
        /// Its standard deviation as a part of it.
        relative: f64,
    },
    /// A picture that fits worse than the others.
    Poor {
        /// Its name.
        view: String,
        /// Its root mean square error, px.
        rms_px: f64,
        /// The median of all views', px.
        median_px: f64,
    },
}

/// Fewer views than this are few: Zhang's errors (§5.1, Fig. 2) fall fast to five planes and slowly after.
const FEW: usize = 5;
/// A target that is nowhere tilted by this is face-on, rad (15°): Zhang's error at 20° (§5.1, Fig. 3) is twice that at
/// 45°, and below it grows without bound.
pub(super) const FACE_ON: f64 = 0.262;
/// Planes that give a camera without any assumption (Zhang, §3.1).
pub(super) const PLANES: usize = 3;
/// Directions within this of each other are one, rad (30°). Chosen: a third of the way to the other axis.
const ALIKE: f64 = 0.524;
/// A ninth of the picture with less than this part of an even share of the corners is bare. Chosen: with half of it a
/// row of corners at the rim of a ninth hides that the rest is empty.
const BARE: f64 = 0.1;
/// A focal length less sure than this is said to be, as a part. Chosen: 1 cm at a distance of 1 m.
const UNSURE: f64 = 0.01;
/// A view that fits so many times worse than the median. Chosen: noise of 50 corners alters its rms by a tenth.
const POOR: f64 = 2.5;

/// Returns how the target was held in a view.
pub(super) fn held(view: &ViewFit) -> Held {
    let normal = view.camera_from_world.rotation() * nalgebra::Vector3::z();
    Held {
        tilt: normal.z.abs().min(1.0).acos(),
        direction: normal.y.atan2(normal.x).rem_euclid(PI),
    }
}

impl Coverage {
    /// Returns what the views show.
    pub fn of(calibration: &Calibration, views: &[View]) -> Self {
        let held = calibration.views.iter().map(held);
        let (w, h) = (calibration.intrinsics.width, calibration.intrinsics.height);
        let third = |at: f64, size: u32| {
            (3.0 * (at + 0.5) / f64::from(size.max(1))).clamp(0.0, 2.0) as usize
        };
        let mut ninths = [[0; 3]; 3];
        for (_, pixel) in views.iter().flat_map(|view| &view.points) {
            ninths[third(pixel.v, h)][third(pixel.u, w)] += 1;
        }
        let is_one_to_one = lens::is_one_to_one(&calibration.intrinsics, views);
        Self { held: held.collect(), is_one_to_one, ninths, other_gap: None }
    }

    /// Returns what the next pictures should show, most useful first.
    pub fn advice(&self, calibration: &Calibration) -> Vec<Advice> {
        let mut advice: Vec<Advice> = self.other_gap.map(Advice::OtherGap).into_iter().collect();
        let views = self.held.len();
        let tilt = self.held.iter().map(|held| held.tilt).fold(0.0, f64::max);
        if tilt < FACE_ON {
            advice.push(Advice::FaceOn { tilt });
        }
        if views == 1 {
            advice.push(Advice::OneView);
        } else if views < FEW {
            advice.push(Advice::FewViews { views });
        }
        let leaning: Vec<f64> =
            self.held.iter().filter(|h| h.tilt >= FACE_ON).map(|h| h.direction).collect();
        let apart = |a: f64, b: f64| {
            let d = (a - b).abs();
            d.min(PI - d)
        };
        if let Some(&first) = leaning.first()
            && views > 1
            && leaning.iter().all(|&other| apart(first, other) < ALIKE)
        {
            let is_sideways = apart(first, 0.0) < apart(first, FRAC_PI_2);
            advice.push(Advice::OneDirection { is_sideways });
        }
        let places: Vec<_> = (0..9).map(|i| (i / 3, i % 3)).collect();
        let all: usize = self.ninths.iter().flatten().sum();
        let bare = BARE * all as f64 / 9.0;
        let places: Vec<_> =
            places.into_iter().filter(|&(r, c)| (self.ninths[r][c] as f64) < bare).collect();
        if !places.is_empty() {
            advice.push(Advice::Empty { places });
        }
        if !self.is_one_to_one {
            advice.push(Advice::Folds);
        }
        let k = &calibration.intrinsics;
        let relative = (calibration.std[0] / k.fx).max(calibration.std[1] / k.fy).abs();
        if relative > UNSURE {
            advice.push(Advice::Unsure { relative });
        }
        let median_px = median(&mut calibration.views.iter().map(|v| v.rms_px).collect::<Vec<_>>());
        for view in calibration.views.iter().filter(|v| v.rms_px > POOR * median_px) {
            let (view, rms_px) = (view.name.clone(), view.rms_px);
            advice.push(Advice::Poor { view, rms_px, median_px });
        }
        advice
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherGap(OtherGap { said, seen, rms_px, better_px }) => write!(
                f,
                "the gaps between the tags look like {seen:.3} of a tag, not {said}: with that the corners fit to {better_px:.2} px, \
                 not {rms_px:.2} px; say so in `--board`, and calibrate again"
            ),
            Self::FewViews { views } => write!(
                f,
                "only {views} pictures; take {} more, the board tilted by 30 to 45 deg to another side in each",
                2 * FEW - views
            ),
            Self::OneView => write!(
                f,
                "one picture: pixels are taken as square and the principal point as the picture's centre, give or take {:.1} % \
                 of the width, which the ± of the others include; take four or more, the board tilted by 30 to 45 deg to \
                 another side in each, to measure them",
                100.0 * OFF_CENTRE
            ),
            Self::FaceOn { tilt } => write!(
                f,
                "the board is tilted by {:.0} deg at most, so focal length and distance trade; tilt it by 30 to 45 deg \
                 to the left, to the right, up and down",
                tilt.to_degrees()
            ),
            Self::OneDirection { is_sideways: true } => write!(
                f,
                "the board leans to the left or right in all pictures; tilt it up and down as well, by 30 to 45 deg"
            ),
            Self::OneDirection { is_sideways: false } => write!(
                f,
                "the board leans up or down in all pictures; tilt it to the left and right as well, by 30 to 45 deg"
            ),
            Self::Empty { places } => {
                let names: Vec<&str> =
                    places.iter().map(|&(row, column)| PLACES[row][column]).collect();
                write!(
                    f,
                    "few corners or none lie in the {} of the picture, where the lens is hardly measured; hold the board \
                     there",
                    names.join(", ")
                )
            }
            Self::Folds => write!(
                f,
                "where no corner was seen, the lens shows one place twice, so it means nothing there; hold the board \
                 in the picture's corners"
            ),
            Self::Unsure { relative } => write!(
                f,
                "the focal length is known to {:.1} % only; take more pictures with the board tilted by 30 to 45 deg",
                100.0 * relative
            ),
            Self::Poor { view, rms_px, median_px } => write!(
                f,
                "{view} fits to {rms_px:.2} px, the median picture to {median_px:.2} px: is it blurred, or the board \
                 bent? Take it again or leave it out"
            ),
        }
    }
}

const PLACES: [[&str; 3]; 3] = [
    ["top left", "top middle", "top right"],
    ["middle left", "middle", "middle right"],
    ["bottom left", "bottom middle", "bottom right"],
];

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    use rand::rngs::StdRng;
    use rand::{RngExt as _, SeedableRng as _};

    use super::super::lens::choose;
    use super::super::{Distortion, Error, Options, calibrate};
    use super::*;
    use crate::world::{Camera, Intrinsics, Point, Pose};

    /// Views of a board of 9 x 6 squares of 25 mm, turned by these angles about the camera's x and y, with noise of
    /// 0.15 px, at 0.4 m in the middle of the picture.
    fn views(turns: &[(f64, f64)], seed: u64) -> Vec<View> {
        let mut random = StdRng::seed_from_u64(seed);
        let mut intrinsics = Intrinsics::centred(540.0, 640, 480);
        (intrinsics.k1, intrinsics.k2) = (-0.25, 0.1);
        let middle = Vector3::new(0.1, 0.0625, 0.0);
        let mut view = |i: usize, &(x, y): &(f64, f64)| {
            let turn = Rotation3::from_euler_angles(x, y, 0.0).inverse();
            let eye = middle - turn * Vector3::new(0.0, 0.0, 0.4);
            let world_from_camera = Pose::from_parts(eye, turn.into());
            let camera = Camera { intrinsics, world_from_camera };
            // Twelve even draws have a variance of 1 and are nearly normal.
            let mut noise = || 0.15 * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
            let points = (0..54).map(|k| {
                let point = Point::new(0.025 * f64::from(k % 9), 0.025 * f64::from(k / 9), 0.0);
                let mut pixel = camera.project(point).unwrap();
                pixel.u += noise();
                pixel.v += noise();
                (point, pixel)
            });
            View { name: format!("{i}"), points: points.collect(), world_from_camera: None }
        };
        turns.iter().enumerate().map(|(i, turn)| view(i, turn)).collect()
    }

    fn options() -> Options {
        Options { skew: Some(false), image_size: Some((640, 480)), ..Options::default() }
    }

    #[test]
    fn one_view_that_is_face_on_is_refused_whatever_the_noise() {
        for seed in 0..40 {
            let refused = choose(&views(&[(0.0, 0.0)], seed), &options());
            assert!(matches!(refused, Err(Error::Views { .. })), "seed {seed}: {refused:?}");
        }
    }

    #[test]
    fn views_of_one_direction_or_of_a_corner_are_told_and_good_ones_are_not() {
        let advice = |turns: &[(f64, f64)]| {
            let views = views(turns, 1);
            let (fit, _) = choose(&views, &options()).unwrap();
            Coverage::of(&fit, &views).advice(&fit)
        };
        let sideways = advice(&[(0.0, 0.5), (0.02, -0.5), (0.0, 0.7), (0.0, -0.4), (0.05, 0.6)]);
        assert!(sideways.contains(&Advice::OneDirection { is_sideways: true }), "{sideways:?}");
        let few = advice(&[(0.5, 0.0), (0.0, 0.6)]);
        assert!(few.contains(&Advice::FewViews { views: 2 }), "{few:?}");
        let good = [(0.5, 0.0), (0.0, 0.6), (-0.6, 0.1), (0.1, -0.5), (0.4, 0.4), (0.1, 0.0)];
        // The board is in the middle of all of them.
        let places = vec![(0, 0), (0, 2), (2, 0), (2, 2)];
        assert_eq!(advice(&good), [Advice::Empty { places }]);
        let one = advice(&[(0.6, 0.3)]);
        assert!(one.contains(&Advice::OneView), "{one:?}");
    }

    #[test]
    fn the_lens_has_the_terms_that_were_planted() {
        let good = [(0.5, 0.0), (0.0, 0.6), (-0.6, 0.1), (0.1, -0.5), (0.4, 0.4), (0.1, 0.0)];
        for seed in 0..5 {
            let (fit, compared) = choose(&views(&good, seed), &options()).unwrap();
            assert_eq!(compared.len(), 12);
            assert!((fit.intrinsics.fx - 540.0).abs() < 4.0 * fit.std[0], "seed {seed}");
            assert!((fit.intrinsics.k1 + 0.25).abs() < 4.0 * fit.std[5], "seed {seed}");
            assert!(fit.intrinsics.is_radial(), "seed {seed}: {:?}", fit.intrinsics);
        }
    }

    /// With `k2` not paid for `k1` was -0.237 ± 0.004 where -0.25 was planted: what a term that is left out would do to the others
    /// is part of their doubt.
    #[test]
    fn the_doubt_includes_that_of_the_lens_that_was_not_chosen() {
        let good = [(0.5, 0.0), (0.0, 0.6), (-0.6, 0.1), (0.1, -0.5), (0.4, 0.4), (0.1, 0.0)];
        for seed in 0..3 {
            let views = views(&good, seed);
            let (fit, _) = choose(&views, &options()).unwrap();
            let alone = Distortion::ALL.into_iter().find_map(|distortion| {
                let alone = calibrate(&views, &Options { distortion, ..options() }).ok()?;
                ((alone.rms_px - fit.rms_px).abs() < f64::EPSILON).then_some(alone)
            });
            let alone = alone.unwrap();
            assert!(fit.std[0] > alone.std[0] && fit.std[5] > alone.std[5], "seed {seed}");
            assert!((fit.intrinsics.k1 + 0.25).abs() < 2.0 * fit.std[5], "seed {seed}");
            // What was not fitted has no doubt.
            let is_fitted = |std: [f64; 11]| std.map(|std| std > 0.0);
            assert_eq!(is_fitted(fit.std), is_fitted(alone.std), "seed {seed}");
        }
    }
}
