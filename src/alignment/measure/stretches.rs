//! Whether the outline of a thing leaves that of the solid fitted to it over whole stretches: then it is of another form.
//!
//! In: a contour, in order, and the solid's outline. Out: by how much the stretch that is farthest off is off. One number
//! for the whole outline does not tell: a robust fit lets a stretch go, such as the corner that two boxes of different
//! height leave bare, and a can on its side is off at its two round ends only. A single point may be off by noise, by a
//! rounded corner or where the mask took in a shadow that the picture's own edges contradict.

use nalgebra::Vector2;

use crate::alignment::key_points::Contour;
use crate::alignment::picture::Picture;
use crate::alignment::refine::strongest;

/// A stretch, as a part of the outline. Chosen: short beside a side of a box, long beside a rounded corner.
const STRETCH: f64 = 0.05;
/// The shortest stretch, points about a pixel apart: what an edge's blur and a rounded corner span.
const SHORTEST: usize = 10;
/// So far from the solid's outline the picture's edge is looked for, px: as far as the fit first looked for it.
const REACH_PX: f64 = 5.0;

/// Returns how far a contour's stretch that is farthest off leaves a solid's convex outline on the mean, px. `hull` are the
/// corners of the outline, px, in order; `full` is the gradient, CIELAB/px, of an edge that counts in full.
///
/// Where the picture has such an edge nearer to the solid's outline than the contour is, the mask was cut wrongly there
/// and the edge is what counts. What is not the thing's own is left out.
pub(super) fn apart(picture: &Picture, contour: &Contour, hull: &[Vector2<f64>], full: f64) -> f64 {
    let inside = hull.iter().sum::<Vector2<f64>>() / hull.len().max(1) as f64;
    let own = contour.pixels.iter().zip(&contour.own).filter(|(_, own)| **own);
    let offs: Vec<f64> = own
        .filter_map(|(point, _)| {
            let (foot, normal) = nearest(hull, inside, *point)?;
            let off = normal.dot(&(point - foot)).signum() * (point - foot).norm();
            let edge = strongest(picture, foot, normal, (full, REACH_PX, false));
            let shown = edge.filter(|(_, strength)| *strength >= 1.0).map(|(offset, _)| offset);
            Some(shown.filter(|shown| shown.abs() < off.abs()).unwrap_or(off))
        })
        .collect();
    farthest(&offs)
}

/// Returns the largest mean, without its sign, of neighbours on a ring.
fn farthest(offs: &[f64]) -> f64 {
    let n = offs.len();
    let span = ((STRETCH * n as f64).ceil() as usize).max(SHORTEST);
    if n < span {
        return 0.0;
    }
    let mean = |first: usize| {
        let sum: f64 = (first..first + span).map(|i| offs[i % n]).sum();
        (sum / span as f64).abs()
    };
    (0..n).map(mean).fold(0.0, f64::max)
}

/// Returns the nearest place on a polygon's border, px, and the unit normal of its side, away from a point inside.
fn nearest(
    polygon: &[Vector2<f64>],
    inside: Vector2<f64>,
    point: Vector2<f64>,
) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let feet = sides.filter_map(|(a, b)| {
        let along = (b - a).try_normalize(1e-9)?;
        let foot = a + along * along.dot(&(point - a)).clamp(0.0, (b - a).norm());
        let normal = Vector2::new(-along.y, along.x);
        Some((foot, if normal.dot(&(foot - inside)) < 0.0 { -normal } else { normal }))
    });
    feet.min_by(|(a, _), (b, _)| (point - a).norm().total_cmp(&(point - b).norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_counts_and_single_points_do_not() {
        let noise = |i: usize| if i.is_multiple_of(2) { 0.4 } else { -0.4 };
        let mut offs: Vec<f64> = (0..300).map(noise).collect();
        offs[7] = 9.0;
        assert!(farthest(&offs) < 1.0, "{}", farthest(&offs));
        // Twenty points around the ring's beginning.
        for i in 0..20 {
            offs[(290 + i) % 300] = -4.0;
        }
        assert!(farthest(&offs) > 3.5, "{}", farthest(&offs));
        assert!(farthest(&[5.0; 4]).abs() < 1e-12);
    }

    #[test]
    fn the_nearest_place_of_a_border_has_a_normal_that_leaves_it() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(Vector2::from);
        let middle = Vector2::new(5.0, 5.0);
        for (at, foot, out) in
            [([4.0, 1.0], [4.0, 0.0], [0.0, -1.0]), ([12.0, 6.0], [10.0, 6.0], [1.0, 0.0])]
        {
            let (found, normal) = nearest(&square, middle, Vector2::from(at)).unwrap();
            assert!((found - Vector2::from(foot)).norm() < 1e-12, "{found}");
            assert!((normal - Vector2::from(out)).norm() < 1e-12, "{normal}");
        }
    }
}
