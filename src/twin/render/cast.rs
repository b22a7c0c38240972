//! Which stretch of a row of parallel rays meets a solid: shadows on the table, without a ray for each place.
//!
//! Seen along the rays a convex solid is a flat figure and the row a line across it. What of the line is in the figure is told
//! from the figure's corners and round ends.

use nalgebra::{Vector2, Vector3};

use super::solid::Solid;

/// Rays from `origin + k step`, all along one direction, in the frame of a solid.
pub(super) struct Row {
    origin: Vector3<f64>,
    /// Axes of the plane across the rays: along the row, and across it.
    along: Vector3<f64>,
    across: Vector3<f64>,
    /// How far a step goes in that plane.
    stride: f64,
}

/// The part of the row that was found in a figure so far: least and greatest distance along it.
#[derive(Clone, Copy)]
struct Found {
    low: f64,
    high: f64,
}

impl Found {
    const NOTHING: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    fn add(&mut self, at: f64) {
        (self.low, self.high) = (self.low.min(at), self.high.max(at));
    }

    /// Adds where the line between two points is on the row.
    fn add_edge(&mut self, a: Vector2<f64>, b: Vector2<f64>) {
        if (a.y <= 0.0) != (b.y <= 0.0) {
            self.add(a.x + (b.x - a.x) * (a.y / (a.y - b.y)));
        }
    }

    /// Adds the edges of a figure with four corners.
    fn add_four(&mut self, corners: [Vector2<f64>; 4]) {
        for k in 0..4 {
            self.add_edge(corners[k], corners[(k + 1) % 4]);
        }
    }
}

impl Row {
    /// Makes a row ready; `None` when its places lie behind each other, seen along the rays.
    pub(super) fn new(origin: Vector3<f64>, step: Vector3<f64>, d: Vector3<f64>) -> Option<Self> {
        let flat = step - d * step.dot(&d);
        let stride = flat.norm();
        if stride < 1e-9 {
            return None;
        }
        let along = flat / stride;
        Some(Self { origin, along, across: d.cross(&along), stride })
    }

    /// Returns from where to where, in steps, rays of the row meet a solid, ahead or behind, the first greater than the second
    /// when none does; `None` when the solid is of a kind for which each ray must be asked.
    pub(super) fn through(&self, solid: &Solid) -> Option<(f64, f64)> {
        let mut found = Found::NOTHING;
        match *solid {
            Solid::Cuboid { centre, half } => self.cuboid(centre, half, &mut found),
            Solid::Cylinder { radius, bottom, top } => {
                self.cylinder(radius, [bottom, top], &mut found);
            }
            Solid::Capsule { radius, bottom, top } => {
                self.capsule(radius, [bottom, top], &mut found);
            }
            Solid::Lathe { .. } | Solid::Ellipsoid { .. } => return None,
        }
        Some((found.low / self.stride, found.high / self.stride))
    }

    /// Returns where a point is seen: along the row from its first place, and beside it.
    fn seen(&self, p: Vector3<f64>) -> Vector2<f64> {
        self.turned(p - self.origin)
    }

    fn turned(&self, d: Vector3<f64>) -> Vector2<f64> {
        Vector2::new(d.dot(&self.along), d.dot(&self.across))
    }

    fn cuboid(&self, centre: Vector3<f64>, half: Vector3<f64>, found: &mut Found) {
        let middle = self.seen(centre);
        let edge = |axis: usize| {
            Vector2::new(self.along[axis] * half[axis], self.across[axis] * half[axis])
        };
        let edges = [edge(0), edge(1), edge(2)];
        if middle.y.abs() > edges.iter().map(|edge| edge.y.abs()).sum() {
            return;
        }
        for [a, b, c] in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            let (a, b, c) = (edges[a], edges[b], edges[c]);
            for side in [b + c, b - c, c - b, -b - c] {
                found.add_edge(middle + side - a, middle + side + a);
            }
        }
    }

    fn capsule(&self, radius: f64, ends: [f64; 2], found: &mut Found) {
        let ends = ends.map(|z| self.seen(Vector3::z() * z));
        for end in ends {
            let left = radius * radius - end.y * end.y;
            if left >= 0.0 {
                found.add(end.x - left.sqrt());
                found.add(end.x + left.sqrt());
            }
        }
        let [a, b] = ends;
        if let Some(way) = (b - a).try_normalize(1e-12) {
            let side = Vector2::new(-way.y, way.x) * radius;
            found.add_four([a + side, b + side, b - side, a - side]);
        }
    }

    fn cylinder(&self, radius: f64, ends: [f64; 2], found: &mut Found) {
        let [a, b] = ends.map(|z| self.seen(Vector3::z() * z));
        // The end's rim is seen as r (cos φ u + sin φ v).
        let (u, v) = (self.turned(Vector3::x()), self.turned(Vector3::y()));
        let rise = Vector2::new(u.y, v.y);
        let reach = rise.norm();
        if reach > 1e-12 {
            let (rise, over) = (rise / reach, Vector2::new(-rise.y, rise.x) / reach);
            for end in [a, b] {
                let part = -end.y / (radius * reach);
                let left = 1.0 - part * part;
                if left >= 0.0 {
                    for turn in [left.sqrt(), -left.sqrt()] {
                        let at = (rise * part + over * turn) * radius;
                        found.add(end.x + u.x * at.x + v.x * at.y);
                    }
                }
            }
        }
        if let Some(way) = (b - a).try_normalize(1e-12) {
            // Where the rim is farthest to the side of the way from end to end.
            let normal = Vector2::new(-way.y, way.x);
            let at = Vector2::new(u.dot(&normal), v.dot(&normal));
            if let Some(at) = at.try_normalize(1e-12) {
                let side = (u * at.x + v * at.y) * radius;
                found.add_four([a + side, b + side, b - side, a - side]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asks each ray of many rows, and the row as a whole.
    #[test]
    fn a_row_meets_what_its_rays_meet() {
        let solids = [
            Solid::Cuboid {
                centre: Vector3::new(0.1, -0.05, 0.2),
                half: Vector3::new(0.3, 0.02, 0.1),
            },
            Solid::Cylinder { radius: 0.2, bottom: -0.1, top: 0.6 },
            Solid::Cylinder { radius: 0.3, bottom: 0.1, top: 0.11 },
            Solid::Capsule { radius: 0.15, bottom: -0.2, top: 0.3 },
            Solid::Capsule { radius: 0.25, bottom: 0.0, top: 0.0 },
        ];
        let (mut met, mut total) = (0, 0);
        for solid in solids {
            for i in 0..300 {
                let a = f64::from(i) * 0.618;
                let wave = |k: f64| (k * a + k).sin();
                let d = Vector3::new(wave(1.3), wave(2.7), wave(3.9)).normalize();
                let step = Vector3::new(wave(0.7), wave(4.1), wave(5.3)).normalize() * 0.01;
                let aim = Vector3::new(wave(1.1), wave(2.3), wave(3.1)) * 0.3;
                let origin = aim - d * 2.0 - step * 50.0;
                let row = Row::new(origin, step, d).unwrap();
                let (low, high) = row.through(&solid).unwrap();
                for k in 0..100 {
                    let place = origin + step * f64::from(k);
                    let is_met = solid.span(place, d).is_some();
                    let is_in = (low..=high).contains(&f64::from(k));
                    assert_eq!(is_met, is_in, "{solid:?} {i} {k} {low} {high}");
                    (met, total) = (met + usize::from(is_met), total + 1);
                }
            }
        }
        assert!(met > total / 10 && met < total, "{met} of {total}");
    }
}
