//! What a solid covers of a level plane, seen along parallel rays: shadows on the table, without a ray for each place.
//!
//! Along the rays a convex solid is a flat figure of straight edges and ovals. It is worked out once and then cut by the rows of
//! the plane.

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};

use super::solid::Solid;

/// The figure of a solid on a plane, m.
pub(super) struct Figure {
    edges: Vec<Edge>,
    ovals: Vec<Oval>,
    low: f64,
    high: f64,
}

/// A straight edge between two rows, `x = start + y slope`.
struct Edge {
    low: f64,
    high: f64,
    start: f64,
    slope: f64,
}

/// An oval: in row `y` its middle is at `x + (y - middle) slope`, and it reaches `half` to either side of that in its middle row.
struct Oval {
    x: f64,
    middle: f64,
    reach: f64,
    slope: f64,
    half: f64,
}

impl Figure {
    /// Returns the figure on the plane `z = height` of a solid placed at `origin` and turned by `turn` (world from local), seen along
    /// `d`, which rises; `None` when the solid is of a kind for which each ray must be asked.
    pub(super) fn new(
        solid: &Solid,
        (turn, origin): (&Matrix3<f64>, &Vector3<f64>),
        d: Vector3<f64>,
        height: f64,
    ) -> Option<Self> {
        let (x, y) = (d.x / d.z, d.y / d.z);
        let seen = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y);
        let (axes, start) = (seen * turn, seen * (origin - Vector3::z() * height));
        let axis = |k: usize| -> Vector2<f64> { axes.column(k).into_owned() };
        let place = |p: Vector3<f64>| start + axes * p;
        let mut figure = Self {
            edges: Vec::new(),
            ovals: Vec::new(),
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        match *solid {
            Solid::Cuboid { centre, half } => {
                figure
                    .add_box(place(centre), [axis(0) * half.x, axis(1) * half.y, axis(2) * half.z]);
            }
            Solid::Cylinder { radius, bottom, top } => {
                let ends = [bottom, top].map(|z| place(Vector3::z() * z));
                figure.add_round(ends, [axis(0) * radius, axis(1) * radius, Vector2::zeros()]);
            }
            Solid::Capsule { radius, bottom, top } => {
                let ends = [bottom, top].map(|z| place(Vector3::z() * z));
                figure.add_round(ends, [axis(0) * radius, axis(1) * radius, axis(2) * radius]);
            }
            Solid::Lathe { .. } | Solid::Ellipsoid { .. } => return None,
        }
        Some(figure)
    }

    /// Returns its least and its greatest row.
    pub(super) fn rows(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Returns from where to where row `y` is in it.
    #[inline]
    pub(super) fn on(&self, y: f64) -> Option<(f64, f64)> {
        if y < self.low || y > self.high {
            return None;
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for edge in &self.edges {
            if y >= edge.low && y <= edge.high {
                let at = edge.start + y * edge.slope;
                (low, high) = (low.min(at), high.max(at));
            }
        }
        for oval in &self.ovals {
            let off = y - oval.middle;
            let part = off / oval.reach;
            let left = 1.0 - part * part;
            if left >= 0.0 {
                let (at, half) = (oval.x + off * oval.slope, oval.half * left.sqrt());
                (low, high) = (low.min(at - half), high.max(at + half));
            }
        }
        (low <= high).then_some((low, high))
    }

    /// Adds a box: its middle and half its edges. Of four edges alike those on the outline are the farthest to either side.
    fn add_box(&mut self, middle: Vector2<f64>, edges: [Vector2<f64>; 3]) {
        // Edges that are seen as parallel lie as if the first of them were turned a little.
        let sign = |a: usize, b: usize| if edges[a].perp(&edges[b]) < 0.0 { -1.0 } else { 1.0 };
        let [ab, bc, ac] = [sign(0, 1), sign(1, 2), sign(0, 2)];
        let [a, b, c] = edges;
        for (edge, side) in [(a, b * ab + c * ac), (b, c * bc - a * ab), (c, -a * ac - b * bc)] {
            for side in [middle + side, middle - side] {
                self.add_edge(side - edge, side + edge);
            }
        }
    }

    /// Adds two ovals, each of them the sum of `rays` with squared weights of sum 1, and what is between them.
    fn add_round(&mut self, ends: [Vector2<f64>; 2], rays: [Vector2<f64>; 3]) {
        let sum = |of: fn(&Vector2<f64>) -> f64| rays.iter().map(of).sum::<f64>();
        let (xx, xy, yy) = (sum(|r| r.x * r.x), sum(|r| r.x * r.y), sum(|r| r.y * r.y));
        if yy > 1e-24 {
            let (slope, reach) = (xy / yy, yy.sqrt());
            let half = (xx - xy * slope).max(0.0).sqrt();
            for end in ends {
                self.ovals.push(Oval { x: end.x, middle: end.y, reach, slope, half });
                self.reach_to(end.y - reach);
                self.reach_to(end.y + reach);
            }
        }
        if let Some(way) = (ends[1] - ends[0]).try_normalize(1e-12) {
            // Where the oval is farthest to the side of the way from end to end.
            let normal = Vector2::new(-way.y, way.x);
            let far = rays.map(|ray| ray.dot(&normal));
            let norm = far.iter().map(|far| far * far).sum::<f64>().sqrt().max(1e-12);
            let side: Vector2<f64> =
                rays.iter().zip(far).map(|(ray, far)| ray * (far / norm)).sum();
            self.add_edge(ends[0] + side, ends[1] + side);
            self.add_edge(ends[0] - side, ends[1] - side);
        }
    }

    fn add_edge(&mut self, a: Vector2<f64>, b: Vector2<f64>) {
        let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
        // One along the rows lies between the ends of its neighbours.
        if b.y - a.y > 1e-12 {
            let slope = (b.x - a.x) / (b.y - a.y);
            self.edges.push(Edge { low: a.y, high: b.y, start: a.x - a.y * slope, slope });
            self.reach_to(a.y);
            self.reach_to(b.y);
        }
    }

    fn reach_to(&mut self, y: f64) {
        (self.low, self.high) = (self.low.min(y), self.high.max(y));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    /// Asks the rays through many places, and the figure.
    #[test]
    fn a_figure_covers_what_its_rays_meet() {
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
            for i in 0..100 {
                let a = f64::from(i) * 0.618;
                let wave = |k: f64| (k * a + k).sin();
                let mut d = Vector3::new(wave(1.3), wave(2.7), 1.1 + wave(3.9)).normalize();
                let angles = Vector3::new(wave(0.7), wave(4.1), wave(5.3)) * 3.0;
                let mut turn = *UnitQuaternion::new(angles).to_rotation_matrix().matrix();
                if i % 10 == 0 {
                    // Edges one behind another.
                    (turn, d) = (Matrix3::identity(), Vector3::new(0.0, d.y, d.z).normalize());
                }
                let origin = Vector3::new(wave(1.1), wave(2.3), wave(3.1)) * 0.3;
                let figure = Figure::new(&solid, (&turn, &origin), d, 0.01).unwrap();
                let middle = origin - d * ((origin.z - 0.01) / d.z);
                for row in 0..20 {
                    // Not on an edge of a solid that stands straight.
                    let y = middle.y + f64::from(row) * 0.0497 - 0.4871;
                    let found = figure.on(y);
                    for column in 0..20 {
                        let x = middle.x + f64::from(column) * 0.0497 - 0.4871;
                        let place = Vector3::new(x, y, 0.01) - origin;
                        let is_met =
                            solid.span(turn.transpose() * place, turn.transpose() * d).is_some();
                        let is_in = found.is_some_and(|(low, high)| (low..=high).contains(&x));
                        assert_eq!(is_met, is_in, "{solid:?} {i} {x} {y} {found:?}");
                        (met, total) = (met + usize::from(is_met), total + 1);
                    }
                }
            }
        }
        assert!(met > total / 10 && met < total, "{met} of {total}");
    }
}
