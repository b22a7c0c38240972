//! Solids that stand for a mesh: few capsules and boxes that together contain all of its surface.
//!
//! One solid contains a part whole: the smaller of a capsule and a box along the part's own axes. Where two solids for
//! two halves are much smaller than one, the part is cut across its longest side, its triangles exactly, and each half
//! is covered by itself. What is covered is the surface; what is solid behind it is covered with it, since every solid
//! is convex and holds the hull of its half.

use nalgebra::{Isometry3, Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector2, Vector3};

use super::hull;
use super::solid::{Placed, Solid};
use crate::world::mesh::read::Triangle;

/// As often a part is halved: up to four solids. Chosen: a link is two housings and a tube between them.
const HALVINGS: usize = 2;
/// Two halves are taken when they have at most this share of the volume of one. Chosen: every solid costs as much in a
/// search as the next, so 10 % less is not worth another one.
const WORTH: f64 = 0.75;
/// Where a part is cut, as shares of its longest side.
const CUTS: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// A capsule is taken for a box that is so much smaller: its distances are found faster.
const ROUND_IS_QUICKER: f64 = 1.15;
/// Rounds of finding the smallest circle about points: its radius is at most `1/60` too large.
const ROUNDS: usize = 60;
/// Solids are larger by this than they need, m: rounding.
const MARGIN: f64 = 1e-7;

/// Returns solids that contain the triangles, in their frame.
pub(super) fn cover(triangles: &[Triangle]) -> Vec<Placed> {
    best(triangles, HALVINGS).map_or_else(Vec::new, |(_, solids)| solids)
}

/// Returns the one solid that contains all points, in their frame; `None` without points.
pub(super) fn around(points: &[Vector3<f64>]) -> Option<Placed> {
    Some(one(points, &axes(points)?).1)
}

/// Returns the cover with the least volume that is found, m³, and it.
fn best(triangles: &[Triangle], halvings: usize) -> Option<(f64, Vec<Placed>)> {
    let points: Vec<Vector3<f64>> = triangles.iter().flatten().copied().collect();
    let frame = axes(&points)?;
    let (whole, solid) = one(&points, &frame);
    let mut found = (whole, vec![solid]);
    if halvings == 0 {
        return Some(found);
    }
    let (low, high) = corners(&points, &frame);
    let longest = (high - low).imax();
    let axis: Vector3<f64> = frame.column(longest).into();
    let cut = CUTS.into_iter().filter_map(|share| {
        let at = low[longest] + share * (high[longest] - low[longest]);
        let (below, above) = halves(triangles, &axis, at);
        let total = [&below, &above].into_iter().map(|half| {
            let points: Vec<Vector3<f64>> = half.iter().flatten().copied().collect();
            axes(&points).map(|frame| one(&points, &frame).0)
        });
        Some((total.sum::<Option<f64>>()?, below, above))
    });
    if let Some((_, below, above)) = cut.min_by(|a, b| a.0.total_cmp(&b.0))
        && let (Some(below), Some(above)) = (best(&below, halvings - 1), best(&above, halvings - 1))
        && below.0 + above.0 < WORTH * whole
    {
        let solids = below.1.into_iter().chain(above.1).collect();
        found = (below.0 + above.0, solids);
    }
    Some(found)
}

/// Returns the frame's axes along which the points are spread, as columns; `None` without points.
fn axes(points: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    if points.is_empty() {
        return None;
    }
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vector3<f64>>() / n;
    let spread: Matrix3<f64> =
        points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>() / n;
    let own = SymmetricEigen::new(spread).eigenvectors;
    let own = Matrix3::from_columns(&[
        own.column(0).into_owned(),
        own.column(1).into_owned(),
        own.column(0).cross(&own.column(1)),
    ]);
    // The mesh's own axes are often those of its part; points that are not spread evenly turn the others.
    let volume = |frame: &Matrix3<f64>| {
        let (low, high) = corners(points, frame);
        (high - low).product()
    };
    let given = Matrix3::identity();
    Some(if volume(&own) < 0.9 * volume(&given) { own } else { given })
}

/// Returns the least and the greatest coordinates along the columns of `frame`.
fn corners(points: &[Vector3<f64>], frame: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = -low;
    for point in points {
        let local = frame.tr_mul(point);
        low = low.inf(&local);
        high = high.sup(&local);
    }
    (low, high)
}

/// Returns the volume, m³, of the solid that contains all points, and it.
fn one(points: &[Vector3<f64>], frame: &Matrix3<f64>) -> (f64, Placed) {
    let (low, high) = corners(points, frame);
    let half = (high - low).add_scalar(MARGIN) / 2.0;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*frame));
    let centre = frame * ((low + high) / 2.0);
    let pose = Isometry3::from_parts(centre.into(), turn);
    let boxed = (8.0 * half.product(), Placed { solid: Solid::Cuboid { half }, pose });
    let round = (0..3).map(|along| capsule(points, frame, along));
    match round.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some(round) if round.0 < ROUND_IS_QUICKER * boxed.0 => round,
        _ => boxed,
    }
}

/// Returns the volume, m³, of the smallest capsule found along one column of the frame, and it.
fn capsule(points: &[Vector3<f64>], frame: &Matrix3<f64>, along: usize) -> (f64, Placed) {
    let (across, up) = ((along + 1) % 3, (along + 2) % 3);
    let local: Vec<Vector3<f64>> = points
        .iter()
        .map(|point| {
            let p = frame.tr_mul(point);
            Vector3::new(p[across], p[up], p[along])
        })
        .collect();
    let (low, high) = local.iter().fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(low, high), p| (low.inf(p), high.sup(p)),
    );
    // Badoiu and Clarkson, "Smaller core-sets for balls", 2003: a step towards the farthest, ever shorter.
    let mut centre = (low + high).xy() / 2.0;
    let flat: Vec<Vector2<f64>> = local.iter().map(Vector3::xy).collect();
    let outline = hull::corners(&flat);
    let farthest = |centre: &Vector2<f64>| {
        outline
            .iter()
            .copied()
            .max_by(|a, b| (a - centre).norm_squared().total_cmp(&(b - centre).norm_squared()))
    };
    let mut least = (f64::INFINITY, centre);
    for round in 0..ROUNDS {
        let Some(far) = farthest(&centre) else { break };
        let radius = (far - centre).norm();
        if radius < least.0 {
            least = (radius, centre);
        }
        centre += (far - centre) / (round + 2) as f64;
    }
    let (radius, centre) = (least.0 + MARGIN, least.1);
    // The lower end of the stretch may lie as high as the point that leaves the lower ball first.
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in &local {
        let reach = (radius * radius - (p.xy() - centre).norm_squared()).max(0.0).sqrt();
        from = from.min(p.z + reach);
        to = to.max(p.z - reach);
    }
    if from > to {
        from = f64::midpoint(from, to);
        to = from;
    }
    let at = |z: f64| {
        let mut p = Vector3::zeros();
        (p[across], p[up], p[along]) = (centre.x, centre.y, z);
        frame * p
    };
    let length = to - from;
    let volume = std::f64::consts::PI * radius * radius * (length + 4.0 / 3.0 * radius);
    if length < MARGIN {
        let pose = Isometry3::from_parts(at(from).into(), UnitQuaternion::identity());
        return (volume, Placed { solid: Solid::Sphere { radius: radius + MARGIN }, pose });
    }
    (volume, Placed::capsule(at(from), at(to), radius))
}

/// Cuts triangles at the plane `axis · p = at`: what lies below, what lies above.
fn halves(triangles: &[Triangle], axis: &Vector3<f64>, at: f64) -> (Vec<Triangle>, Vec<Triangle>) {
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for triangle in triangles {
        for (side, kept) in [(-1.0, &mut below), (1.0, &mut above)] {
            let outline = clipped(triangle, axis, at, side);
            for pair in outline.windows(2).skip(1) {
                kept.push([outline[0], pair[0], pair[1]]);
            }
        }
    }
    (below, above)
}

/// Returns the corners of the part of a triangle on one side of a plane.
///
/// Source: Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
fn clipped(triangle: &Triangle, axis: &Vector3<f64>, at: f64, side: f64) -> Vec<Vector3<f64>> {
    let height = |p: &Vector3<f64>| side * (axis.dot(p) - at);
    let mut outline = Vec::with_capacity(4);
    for (i, here) in triangle.iter().enumerate() {
        let next = &triangle[(i + 1) % 3];
        let (a, b) = (height(here), height(next));
        if a >= 0.0 {
            outline.push(*here);
        }
        if a * b < 0.0 {
            outline.push(here + (next - here) * (a / (a - b)));
        }
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::body::Body;
    use crate::motion::distance::signed_distance;

    /// A tube of 16 sides along x, and a block across its end: as a link is.
    fn link() -> Vec<Triangle> {
        let mut found = Vec::new();
        let ring = |x: f64, k: i32| {
            let a = f64::from(k) * std::f64::consts::TAU / 16.0;
            Vector3::new(x, 0.04 * a.cos(), 0.04 * a.sin())
        };
        for k in 0..16 {
            found.push([ring(0.0, k), ring(0.4, k), ring(0.4, k + 1)]);
            found.push([ring(0.0, k), ring(0.4, k + 1), ring(0.0, k + 1)]);
        }
        let corner = |k: usize| {
            let pick = |bit: usize, low: f64, high: f64| if k & bit == 0 { low } else { high };
            Vector3::new(pick(1, 0.4, 0.5), pick(2, -0.05, 0.05), pick(4, -0.15, 0.05))
        };
        for [a, b, c, d] in
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        {
            found.push([corner(a), corner(b), corner(c)]);
            found.push([corner(a), corner(c), corner(d)]);
        }
        found
    }

    #[test]
    fn every_point_of_the_surface_is_inside_a_solid_and_there_are_few_of_them() {
        let triangles = link();
        let solids = cover(&triangles);
        assert!((2..=4).contains(&solids.len()), "{solids:?}");
        let bodies: Vec<Body> = solids.iter().map(Body::new).collect();
        for [a, b, c] in &triangles {
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.3), (0.5, 0.5), (0.1, 0.7)] {
                let p = a + (b - a) * u + (c - a) * v;
                let point = Body::Round { a: p, b: p, radius: 0.0 };
                let off = bodies.iter().map(|body| signed_distance(body, &point));
                assert!(off.fold(f64::INFINITY, f64::min) < 1e-6, "{p:?} is outside");
            }
        }
        // The whole in one box would have 10 litres; tube and block have 4.
        let volume: f64 = solids
            .iter()
            .map(|placed| match placed.solid {
                Solid::Cuboid { half } => 8.0 * half.product(),
                Solid::Capsule { radius, half } => {
                    std::f64::consts::PI * radius * radius * (2.0 * half + 4.0 / 3.0 * radius)
                }
                Solid::Sphere { radius } => 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
                Solid::Cylinder { radius, half } => {
                    std::f64::consts::PI * radius * radius * 2.0 * half
                }
            })
            .sum();
        assert!(volume < 6e-3, "{volume} m^3");
    }

    #[test]
    fn a_flat_sheet_and_a_single_point_are_covered_too() {
        let (x, y) = (Vector3::x(), Vector3::y());
        assert!(!cover(&[[Vector3::zeros(), x, y]]).is_empty());
        assert_eq!(cover(&[[x, x, x]]).len(), 1);
        assert!(cover(&[]).is_empty());
    }
}
