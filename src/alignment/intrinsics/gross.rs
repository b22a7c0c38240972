//! Points of a plane that lie far from the map that the others of their view agree on.
//!
//! A corner at the other end of the picture turns the map of all over its horizon, and the closed form begins with these maps. Lines are
//! bent by a lens, so a map tells only what is grossly wrong; whether it is, [`super::strays`] asks the camera.

use super::View;
use crate::alignment::image_map::{self, Model, NoiseIn, Pair};
use crate::alignment::picture::median;
use crate::world::Pixel;

/// Returns the points of a view of a plane as pairs: where each is seen, and its x and y in m.
pub(super) fn pairs(view: &View) -> Vec<Pair> {
    let pairs = view.points.iter().map(|(point, pixel)| {
        let p = point.coords();
        Pair { real: *pixel, twin: Pixel::new(p.x, p.y) }
    });
    pairs.collect()
}

/// Returns which points of which views of a plane, whose place is not given, are suspected: those that lie farther from the
/// consensus of their view than half of its points lie from its middle.
pub(super) fn suspects(views: &[View]) -> Vec<(usize, usize)> {
    let of = |(view, seen): (usize, &View)| {
        let far = if is_plane(seen) { far_off(&pairs(seen)) } else { Vec::new() };
        far.into_iter().map(move |point| (view, point))
    };
    views.iter().enumerate().flat_map(of).collect()
}

fn is_plane(view: &View) -> bool {
    view.world_from_camera.is_none() && view.points.iter().all(|(p, _)| p.coords().z.abs() <= 1e-9)
}

fn far_off(pairs: &[Pair]) -> Vec<usize> {
    let options = image_map::Options { noise: NoiseIn::Real, ..image_map::Options::default() };
    let Ok(map) = image_map::fit_map(pairs, Model::Projective, &options) else {
        return Vec::new();
    };
    let along = |of: fn(Pixel) -> f64| {
        median(&mut pairs.iter().map(|pair| of(pair.real)).collect::<Vec<_>>())
    };
    let middle = Pixel::new(along(|p| p.u), along(|p| p.v));
    let size = median(&mut pairs.iter().map(|pair| pair.real.distance(middle)).collect::<Vec<_>>());
    let is_far =
        |pair: &Pair| map.apply(pair.twin).is_none_or(|shown| shown.distance(pair.real) > size);
    (0..pairs.len()).filter(|&point| is_far(&pairs[point])).collect()
}
