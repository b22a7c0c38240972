//! Where the polish of a fisheye begins: a focal length and poses, from views of a plane.
//!
//! Lines are bent too strongly for homographies of the picture. Through the right lens a plane becomes one again: for focal lengths
//! that put the farthest corner at 15 to 100° from the axis, every view is undone as a lens that shows angles as they are
//! (`r = f θ`), a homography is fitted, and how far it leaves the corners from where they were seen says which focal length it is.

use nalgebra::Matrix3;

use super::{Error, View, pose_from_homography};
use crate::alignment::TooAlike;
use crate::alignment::image_map::{self, Model, NoiseIn, Pair};
use crate::world::{Intrinsics, LensModel, Pixel, Pose, frame};

/// Angles from the axis that the farthest corner may be seen at, rad, and how many are tried: 5° apart, since the polish takes the rest.
const ANGLES: (f64, f64, u32) = (0.262, 1.745, 17);
/// Corners farther from the axis than this do not tell the homography, rad (80°): undone, their noise is thirty times as large.
const USED: f64 = 1.396;
/// The part of a view's corners that must be nearer, and how many at least.
const LEAST: (f64, usize) = (0.6, 6);
/// What a view costs that cannot be undone, px² a corner: more than any that can.
const LOST: f64 = 1e6;

type Poses = Vec<Pose<frame::World, frame::Camera>>;

/// Returns the lens to begin with, and where each view was seen from.
pub(super) fn start(views: &[View], (cx, cy): (f64, f64)) -> Result<(Intrinsics, Poses), Error> {
    let middle = Pixel::new(cx, cy);
    let corners = views.iter().flat_map(|view| &view.points);
    let reach = corners.map(|(_, pixel)| pixel.distance(middle)).fold(0.0, f64::max);
    let mut best: Option<(f64, Intrinsics, Poses)> = None;
    for i in 0..=ANGLES.2 {
        let part = f64::from(i) / f64::from(ANGLES.2);
        let focal = reach / (ANGLES.0 + (ANGLES.1 - ANGLES.0) * part);
        let plain = Intrinsics::centred(focal, 0, 0);
        let lens = Intrinsics { cx, cy, model: LensModel::Fisheye, ..plain };
        let seen: Option<Vec<_>> = views.iter().map(|view| from(view, &lens)).collect();
        let Some(seen) = seen else { continue };
        let cost = seen.iter().map(|(cost, _)| cost).sum::<f64>();
        if cost.is_finite() && best.as_ref().is_none_or(|(least, ..)| cost < *least) {
            best = Some((cost, lens, seen.into_iter().map(|(_, pose)| pose).collect()));
        }
    }
    let best = best.map(|(_, lens, poses)| (lens, poses));
    best.ok_or(Error::Views { views: views.len(), why: TooAlike::NoFocalLength })
}

/// Where a view was seen from through a lens, and the mean square of what it leaves, px²; `None` if from nowhere.
fn from(view: &View, lens: &Intrinsics) -> Option<(f64, Pose<frame::World, frame::Camera>)> {
    let near: Vec<_> =
        view.points.iter().filter(|(_, pixel)| lens.direction(*pixel).z > USED.cos()).collect();
    let n = view.points.len();
    let pairs: Vec<Pair> = near
        .iter()
        .map(|(point, pixel)| {
            let (n, p) = (lens.normalise(*pixel) * lens.fx, point.coords());
            Pair { real: Pixel::new(n.x, n.y), twin: Pixel::new(p.x, p.y) }
        })
        .collect();
    let map = image_map::Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let h = image_map::fit_map(&pairs, Model::Projective, &map).ok()?.m;
    let k = Matrix3::new(lens.fx, 0.0, 0.0, 0.0, lens.fx, 0.0, 0.0, 0.0, 1.0);
    let pose = pose_from_homography(&k, &h)?;
    let mut sum = 0.0;
    for (point, pixel) in &near {
        let p = (pose.inverse() * *point).coords();
        sum += lens.shown(p).map_or(LOST, |d| {
            Pixel::new(lens.fx * d.x + lens.cx, lens.fy * d.y + lens.cy).distance(*pixel).powi(2)
        });
    }
    let is_told = near.len() >= LEAST.1 && near.len() as f64 >= LEAST.0 * n as f64;
    Some((if is_told { sum / near.len() as f64 } else { LOST }, pose))
}
