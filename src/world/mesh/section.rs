//! What of a mesh is between two fingers: where they touch it, and how far apart.
//!
//! Two fingers close level, along an axis, on the band of heights that they cover. They hold what has a flat place on
//! either side there, one opposite the other. Whether the hand gets there is the planner's.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};

use super::Mesh;

/// A place is held when it faces the finger within this angle, as a cosine: 14 deg, the slope on which a skittle leant in
/// the hand and fell (`execution::plan::grasp`).
const FACES: f64 = 0.970;
/// What lies so far behind the foremost place still touches, m: rubber pads give way as much.
const GIVES: f64 = 1.5e-3;
/// A place is held when it is so high at least, m: a quarter of a pad of 22 mm.
const HIGH: f64 = 5.5e-3;
/// Axes nearer than this are one, rad: 5 deg.
const ONE_AXIS: f64 = 5.0 * PI / 180.0;
/// So many axes are looked at, those with the most surface first: as many headings as round things are taken from.
const AXES: usize = 16;
/// Half the height of a finger's pad, m, and in how many steps of the height the narrowest place is looked for: pads of a
/// 2F-85 are 22 mm high, and a step of a thing of 15 cm is as much.
const PAD: f64 = 0.011;
const HEIGHTS: u32 = 8;
/// How much a face may lean to be a side, as the height of its normal: 14 deg.
const UPRIGHT: f64 = 0.25;

/// What is between two fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Between {
    /// The way from one finger to the other, rad about z.
    pub axis: f64,
    /// How far apart they are when they touch, m.
    pub width: f64,
    /// The middle between them, as near to the middle of the mesh as they hold it, m.
    pub middle: Vector2<f64>,
}

/// A place that a finger touches: where along the axis, and from where to where across it, m.
struct Side {
    at: f64,
    across: [f64; 2],
}

impl Mesh {
    /// Returns the axes, rad about z from 0 to π, along which it has sides, those with the most surface first.
    pub fn axes(&self) -> Vec<f64> {
        // Direction, doubled so that both sides count, and surface.
        let mut found: Vec<(Vector2<f64>, f64)> = Vec::new();
        for (t, normal) in self.triangles().iter().zip(self.normals()) {
            let Some(level) = normal.xy().try_normalize(1e-9).filter(|_| normal.z.abs() < UPRIGHT)
            else {
                continue;
            };
            let [a, b, c] = t.map(|corner| self.corners()[corner as usize]);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            let twice =
                Vector2::new(level.x * level.x - level.y * level.y, 2.0 * level.x * level.y);
            let same = found.iter_mut().find(|(way, _)| way.angle(&twice) < 2.0 * ONE_AXIS);
            match same {
                Some((_, sum)) => *sum += area,
                None => found.push((twice, area)),
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let axis = |(way, _): &(Vector2<f64>, f64)| (0.5 * way.y.atan2(way.x)).rem_euclid(PI);
        found.iter().take(AXES).map(axis).collect()
    }

    /// Returns what two fingers hold that cover the heights within `reach` of `height`, m, and close along an axis, rad;
    /// `None` where they do not find two sides opposite each other.
    pub fn between(&self, height: f64, reach: f64, axis: f64) -> Option<Between> {
        let along = Vector3::new(axis.cos(), axis.sin(), 0.0);
        let across = Vector3::new(-along.y, along.x, 0.0);
        let band: Vec<(usize, Vec<Vector3<f64>>)> = (0..self.triangles().len())
            .filter_map(|face| {
                let corners = self.triangles()[face].map(|c| self.corners()[c as usize]);
                let below = clipped(&corners, height - reach, 1.0);
                let cut = clipped(&below, height + reach, -1.0);
                (!cut.is_empty()).then_some((face, cut))
            })
            .collect();
        let side = |hand: f64| -> Option<Side> {
            let out = |p: &Vector3<f64>| hand * along.dot(p);
            let most = band.iter().flat_map(|(_, cut)| cut).map(out).fold(f64::MIN, f64::max);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut of = [f64::INFINITY, f64::NEG_INFINITY];
            for (face, cut) in &band {
                if hand * along.dot(&self.normals()[*face]) < FACES {
                    continue;
                }
                for p in cut.iter().filter(|p| out(p) > most - GIVES) {
                    (low, high) = (low.min(p.z), high.max(p.z));
                    of = [of[0].min(across.dot(p)), of[1].max(across.dot(p))];
                }
            }
            (high - low >= HIGH).then_some(Side { at: hand * most, across: of })
        };
        let (left, right) = (side(-1.0)?, side(1.0)?);
        let held = [left.across[0].max(right.across[0]), left.across[1].min(right.across[1])];
        if held[0] > held[1] {
            return None;
        }
        let middle = across.dot(&self.middle()).clamp(held[0], held[1]);
        let at = along * (0.5 * (left.at + right.at)) + across * middle;
        Some(Between { axis, width: right.at - left.at, middle: at.xy() })
    }

    /// Returns the smallest distance of two fingers that hold it somewhere, m.
    pub fn least_between(&self) -> Option<f64> {
        *self.least_between.get_or_init(|| {
            let axes = self.axes();
            let heights = (1..HEIGHTS).map(|k| self.size().z * f64::from(k) / f64::from(HEIGHTS));
            heights
                .flat_map(|z| axes.iter().filter_map(move |axis| self.between(z, PAD, *axis)))
                .map(|between| between.width)
                .min_by(f64::total_cmp)
        })
    }
}

/// Returns the part of a polygon above (`side` 1) or below (-1) a height.
///
/// Source: Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
fn clipped(polygon: &[Vector3<f64>], height: f64, side: f64) -> Vec<Vector3<f64>> {
    let over = |p: &Vector3<f64>| side * (p.z - height);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, here) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (a, b) = (over(here), over(next));
        if a >= 0.0 {
            kept.push(*here);
        }
        if a * b < 0.0 {
            kept.push(here + (next - here) * (a / (a - b)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, drawn_out, step};
    use super::*;

    #[test]
    fn fingers_hold_a_step_across_and_above_its_tread_along_too() {
        let step = step();
        let axes = step.axes();
        assert!(axes.len() == 2, "{axes:?}");
        let low = step.between(0.0125, PAD, PI / 2.0).unwrap();
        assert!((low.width - 0.05).abs() < 1e-9);
        // As near to its middle as they hold it.
        assert!((low.middle - Vector2::new(step.middle().x, 0.0)).norm() < 1e-9);
        let high = step.between(0.045, PAD, 0.0).unwrap();
        assert!((high.width - 0.03).abs() < 1e-9 && (high.middle.x + 0.025).abs() < 1e-9);
        assert!((step.between(0.0125, PAD, 0.0).unwrap().width - 0.08).abs() < 1e-9);
        assert!((step.least_between().unwrap() - 0.03).abs() < 1e-9);
    }

    #[test]
    fn a_wedge_is_not_held_by_its_slopes() {
        let wedge = drawn_out(&[(0.0, 0.0), (60.0, 0.0), (30.0, 60.0)], 50.0);
        let wedge = Mesh::new("wedge.stl", &wedge, 1e-3).unwrap();
        assert!(wedge.between(0.03, PAD, 0.0).is_none());
        assert!((wedge.between(0.03, PAD, PI / 2.0).unwrap().width - 0.05).abs() < 1e-9);
    }
}
