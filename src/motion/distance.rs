//! Signed distances between solids: positive apart, negative by the depth of overlap.
//!
//! Segments thickened by a radius (balls, capsules) against each other and against boxes are exact and
//! in closed form, since planning asks for little else. Cylinders and pairs of boxes go to parry's GJK, which
//! counts its steps; how deep they overlap is [`super::depth`]'s.
//!
//! Source: Ericson, *Real-Time Collision Detection*, 2005, §5.1.9 (two segments).

use nalgebra::Vector3;
use rapier3d_f64::parry::glamx::{DMat3, DQuat, DVec3};
use rapier3d_f64::parry::math::Pose as EnginePose;
use rapier3d_f64::parry::query;
use rapier3d_f64::parry::shape::{Ball, Capsule, Cuboid, Cylinder, Shape};

use super::body::Body;
use super::depth::Difference;
use super::frames::Frame;

/// Returns the signed distance between two bodies given in the same frame, m.
pub(super) fn signed_distance(first: &Body, second: &Body) -> f64 {
    apart_or_closed_form(first, second).unwrap_or_else(|| -depth(first, second))
}

/// As [`signed_distance`], but `None` for an overlap that has no closed form.
pub(super) fn distance_or_overlap(first: &Body, second: &Body) -> Option<f64> {
    /// What touches overlaps, m.
    const TOUCHING: f64 = 1e-9;
    apart_or_closed_form(first, second).or_else(|| {
        // GJK says 0 also where it did not converge. A direction in which the two are apart is proof.
        let depth = depth(first, second);
        (depth < -TOUCHING).then_some(-depth)
    })
}

/// Returns whether two bodies are certainly farther apart than `limit` m (true) or certainly not (false); `None` where
/// only [`distance_or_overlap`] can tell. Cheap: boxes by the planes that may part them, cylinders by the capsules
/// inside and around them.
pub(super) fn is_beyond(first: &Body, second: &Body, limit: f64) -> Option<bool> {
    /// Far more than rounding, m.
    const SURE: f64 = 1e-9;
    match (first, second) {
        (Body::Cuboid { frame: a, half: x }, Body::Cuboid { frame: b, half: y }) => {
            let gap = parted(a, x, b, y);
            if gap > limit + SURE {
                Some(true)
            } else {
                (limit >= 0.0 && gap < -SURE).then_some(false)
            }
        }
        (Body::Cylinder { .. }, other) | (other, Body::Cylinder { .. }) => {
            let cylinder = if matches!(first, Body::Cylinder { .. }) { first } else { second };
            let Body::Cylinder { frame, radius, half } = cylinder else { return None };
            let within = (half - radius).max(0.0);
            let capsule = |half: f64, radius: f64| Body::Round {
                a: frame.origin - frame.z * half,
                b: frame.origin + frame.z * half,
                radius,
            };
            let (around, inside) = (capsule(*half, *radius), capsule(within, radius.min(*half)));
            let closed = |body: &Body| match other {
                Body::Cylinder { .. } => None,
                _ => apart_or_closed_form(body, other),
            };
            if let Body::Cylinder { frame: g, radius: r, half: h } = other {
                // Two cylinders, each by its own capsule.
                let (a, b) = (frame.z * *half, g.z * *h);
                let (o, p) = (frame.origin, g.origin);
                let gap = segments(&(o - a), &(o + a), &(p - b), &(p + b)) - radius - r;
                return (gap > limit + SURE).then_some(true);
            }
            if closed(&around)? > limit + SURE {
                Some(true)
            } else {
                (closed(&inside)? <= limit.min(0.0) - SURE).then_some(false)
            }
        }
        _ => None,
    }
}

/// Returns how far apart two boxes are at least, by the planes of their faces and of pairs of their edges, m; below
/// zero where none of these parts them: then they overlap.
///
/// Source: Gottschalk, Lin and Manocha, "`OBBTree`", 1996.
fn parted(a: &Frame, x: &Vector3<f64>, b: &Frame, y: &Vector3<f64>) -> f64 {
    let between = a.local(&(b.origin - a.origin));
    let turn = [a.local(&b.x), a.local(&b.y), a.local(&b.z)];
    let mut most = f64::NEG_INFINITY;
    for i in 0..3 {
        let reach = y.x * turn[0][i].abs() + y.y * turn[1][i].abs() + y.z * turn[2][i].abs();
        most = most.max(between[i].abs() - x[i] - reach);
    }
    for (i, axis) in turn.iter().enumerate() {
        most = most.max(between.dot(axis).abs() - y[i] - x.dot(&axis.abs()));
    }
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        for (m, axis) in turn.iter().enumerate() {
            // e_i × axis, in the first box's frame.
            let size = axis[j].hypot(axis[k]);
            if size < 1e-6 {
                continue;
            }
            let own = x[j] * axis[k].abs() + x[k] * axis[j].abs();
            let (n, o) = ((m + 1) % 3, (m + 2) % 3);
            // The other box's edges across: |e_i × axis · b_n| = |b_o,i|.
            let other = y[n] * turn[o][i].abs() + y[o] * turn[n][i].abs();
            let gap = (between[k] * axis[j] - between[j] * axis[k]).abs();
            most = most.max((gap - own - other) / size);
        }
    }
    most
}

/// Returns the signed distance, or `None` where GJK finds no gap.
fn apart_or_closed_form(first: &Body, second: &Body) -> Option<f64> {
    match (first, second) {
        (Body::Round { a, b, radius }, Body::Round { a: c, b: d, radius: other }) => {
            Some(segments(a, b, c, d) - radius - other)
        }
        (Body::Round { a, b, radius }, Body::Cuboid { frame, half })
        | (Body::Cuboid { frame, half }, Body::Round { a, b, radius }) => {
            let a = frame.local(&(a - frame.origin));
            let b = frame.local(&(b - frame.origin));
            Some(segment_and_box(&a, &b, half) - radius)
        }
        _ => Some(apart(first, second)).filter(|distance| *distance > 0.0),
    }
}

/// Returns the distance of two segments, m.
fn segments(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.norm_squared(), v.norm_squared(), u.dot(&v));
    let (uw, vw) = (u.dot(&w), v.dot(&w));
    let (s, t);
    if uu < 1e-18 {
        s = 0.0;
        t = if vv < 1e-18 { 0.0 } else { (vw / vv).clamp(0.0, 1.0) };
    } else if vv < 1e-18 {
        t = 0.0;
        s = (-uw / uu).clamp(0.0, 1.0);
    } else {
        let denominator = uu * vv - uv * uv;
        let free = if denominator > 1e-15 * uu * vv {
            ((uv * vw - uw * vv) / denominator).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let along = (uv * free + vw) / vv;
        t = along.clamp(0.0, 1.0);
        s = if (0.0..=1.0).contains(&along) { free } else { ((uv * t - uw) / uu).clamp(0.0, 1.0) };
    }
    (w + u * s - v * t).norm()
}

/// Returns the signed distance of a segment and a box about the origin, m.
///
/// The squared distance of a point of the segment to the box is convex and, between the places where the
/// segment crosses the planes of the faces, quadratic: its least value is found by looking at each stretch.
fn segment_and_box(a: &Vector3<f64>, b: &Vector3<f64>, half: &Vector3<f64>) -> f64 {
    let u = b - a;
    let mut knots = [0.0; 8];
    let mut n = 1;
    for i in 0..3 {
        if u[i].abs() > 1e-12 {
            for face in [-half[i], half[i]] {
                let t = (face - a[i]) / u[i];
                if t > 0.0 && t < 1.0 {
                    knots[n] = t;
                    n += 1;
                }
            }
        }
    }
    knots[n] = 1.0;
    knots[1..n].sort_unstable_by(f64::total_cmp);
    let squared = |t: f64| {
        let p = a + u * t;
        (p.abs() - half).map(|x| x.max(0.0)).norm_squared()
    };
    let mut least = f64::INFINITY;
    for k in 0..n {
        let (from, to) = (knots[k], knots[k + 1]);
        // Which faces the stretch lies beyond does not change on it.
        let middle = a + u * (0.5 * (from + to));
        let (mut slope, mut curve) = (0.0, 0.0);
        for i in 0..3 {
            let side = middle[i].signum();
            if middle[i].abs() > half[i] {
                slope += u[i] * (a[i] - side * half[i]);
                curve += u[i] * u[i];
            }
        }
        let t = if curve > 0.0 { (-slope / curve).clamp(from, to) } else { from };
        let value = squared(t);
        if value >= least {
            // Convex: past its least value it only grows.
            break;
        }
        least = value;
    }
    // Rounding leaves a segment that crosses a face some 1e-17 m outside.
    if least > 1e-24 {
        return least.sqrt();
    }
    // They overlap. The depth is the least shift along a face normal of their difference: a box axis,
    // or an edge of the box crossed with the segment.
    let mut depth = f64::INFINITY;
    let (centre, reach) = ((a + b) / 2.0, u / 2.0);
    let mut shift_along = |axis: &Vector3<f64>| {
        let own = half.x * axis.x.abs() + half.y * axis.y.abs() + half.z * axis.z.abs();
        depth = depth.min(own + reach.dot(axis).abs() - centre.dot(axis).abs());
    };
    for i in 0..3 {
        let mut e = Vector3::zeros();
        e[i] = 1.0;
        shift_along(&e);
        if let Some(across) = e.cross(&u).try_normalize(1e-9) {
            shift_along(&across);
        }
    }
    -depth.max(0.0)
}

/// Asks parry's GJK for the distance apart, m; 0 for an overlap.
fn apart(first: &Body, second: &Body) -> f64 {
    engine(first, |first_pose, first| {
        engine(second, |second_pose, second| {
            query::distance(&first_pose, first, &second_pose, second)
                .map_or(0.0, |found| found.distance)
        })
    })
}

/// Returns how deep two overlapping bodies lie in each other, m: the least shift that parts them. Of bodies that
/// turn out to be apart, a number below zero: they are at least so far apart.
///
/// Parry's EPA would serve, but in double precision it gives up on a good part of deep overlaps (0.31.1).
fn depth(first: &Body, second: &Body) -> f64 {
    let (radius, first, second) =
        (first.rounding() + second.rounding(), first.core(), second.core());
    // What touches by its rounding alone is as deep in as the rounding reaches over the gap.
    let gap = apart(&first, &second);
    if gap > 0.0 {
        return radius - gap;
    }
    radius + difference(&first, &second).depth().0
}

/// Returns the difference of two bodies without their rounding.
fn difference(first: &Body, second: &Body) -> Difference {
    let between = second.bounds().0 - first.bounds().0;
    let mut difference = Difference { between, ..Difference::default() };
    for body in [first, second] {
        match body {
            Body::Round { a, b, .. } if a == b => {}
            Body::Round { a, b, .. } => difference.segments.push((b - a) / 2.0),
            Body::Cuboid { frame, half } => {
                let edges = [frame.x * half.x, frame.y * half.y, frame.z * half.z];
                difference.segments.extend(edges);
            }
            Body::Cylinder { frame, radius, half } => {
                let axis = frame.z;
                difference.segments.push(axis * *half);
                difference.rounds.push((axis, *radius));
            }
        }
    }
    difference
}

/// Shows a body to `with` as the engine knows it.
fn engine<T>(body: &Body, with: impl FnOnce(EnginePose, &dyn Shape) -> T) -> T {
    let vector = |v: &Vector3<f64>| DVec3::new(v.x, v.y, v.z);
    let pose = |frame: &Frame| {
        let turn = DMat3::from_cols(vector(&frame.x), vector(&frame.y), vector(&frame.z));
        EnginePose::from_parts(vector(&frame.origin), DQuat::from_mat3(&turn))
    };
    match body {
        Body::Round { a, b, radius } if (b - a).norm() < 1e-12 => {
            with(EnginePose::from_translation(vector(a)), &Ball::new(*radius))
        }
        Body::Round { a, b, radius } => {
            with(EnginePose::identity(), &Capsule::new(vector(a), vector(b), *radius))
        }
        Body::Cuboid { frame, half } => with(pose(frame), &Cuboid::new(vector(half))),
        Body::Cylinder { frame, radius, half } => {
            // The engine's cylinders lie along y.
            let upright =
                EnginePose::from_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
            with(pose(frame) * upright, &Cylinder::new(*half, *radius))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::solid::{Placed, Solid};
    use super::*;
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    fn random_pose(random: &mut StdRng) -> Isometry3<f64> {
        let mut x = || random.random_range(-0.4..0.4);
        Isometry3::from_parts(
            Vector3::new(x(), x(), x()).into(),
            UnitQuaternion::from_scaled_axis(Vector3::new(x(), x(), x()) * 8.0),
        )
    }

    /// The closed forms against GJK and the search for the depth on random pairs, apart and overlapping.
    #[test]
    fn closed_forms_agree_with_the_engine() {
        let mut random = StdRng::seed_from_u64(5);
        let (mut clear, mut deep) = (0, 0);
        for _ in 0..2000 {
            let capsule = Body::new(&Placed {
                solid: Solid::Capsule { radius: 0.05, half: random.random_range(0.0..0.3) },
                pose: random_pose(&mut random),
            });
            let other = if random.random_bool(0.5) {
                Solid::Capsule { radius: 0.08, half: 0.2 }
            } else {
                Solid::Cuboid { half: Vector3::new(0.1, 0.2, 0.05) }
            };
            let other = Body::new(&Placed { solid: other, pose: random_pose(&mut random) });
            let ours = signed_distance(&capsule, &other);
            let theirs = apart(&capsule, &other);
            if ours > 0.0 {
                clear += 1;
                // GJK stops some ten micrometres short of the least distance at times.
                assert!(theirs > ours - 1e-9 && theirs < ours + 1e-4, "apart {ours} {theirs}");
            } else if ours > -0.05 {
                // Where the axes themselves cross, the segment's closed form stops at the radii.
                deep += 1;
                let searched = -depth(&capsule, &other);
                // The search finds a shift that parts them, at most a little longer than the least.
                assert!(searched < ours + 1e-9 && searched > ours - 1e-4, "deep {ours} {searched}");
            }
        }
        assert!(clear > 500 && deep > 30, "{clear} {deep}");
    }

    #[test]
    fn simple_cases_have_their_known_distances() {
        let at = |x: f64, solid: Solid| {
            Body::new(&Placed { solid, pose: Isometry3::translation(x, 0.0, 0.0) })
        };
        let ball = Solid::Sphere { radius: 0.1 };
        let cylinder = Solid::Cylinder { radius: 0.2, half: 0.3 };
        let cube = Solid::Cuboid { half: Vector3::repeat(0.1) };
        for (first, second, x, expected) in [
            (ball, ball, 0.5, 0.3),
            (ball, cylinder, 0.5, 0.2),
            (cylinder, cube, 0.5, 0.2),
            (cube, cube, 0.5, 0.3),
            (ball, cube, 0.15, -0.05),
            (cube, cube, 0.15, -0.05),
            (cylinder, cube, 0.25, -0.05),
        ] {
            let found = signed_distance(&at(0.0, first), &at(x, second));
            assert!((found - expected).abs() < 1e-6, "{first:?} {second:?}: {found}");
        }
    }

    fn random_solid(random: &mut StdRng) -> Solid {
        let mut size = || random.random_range(0.01..0.3);
        let (a, b, c) = (size(), size(), size());
        match random.random_range(0..4) {
            0 => Solid::Sphere { radius: a },
            1 => Solid::Capsule { radius: a, half: b },
            2 => Solid::Cylinder { radius: a, half: b },
            _ => Solid::Cuboid { half: Vector3::new(a, b, c) },
        }
    }

    /// The least shift over directions spread over the half sphere, the best of them refined: slow.
    fn scanned(first: &Body, second: &Body) -> f64 {
        const N: u32 = 20_000;
        let difference = difference(first, second);
        let shift = |n: &Vector3<f64>| {
            let segments: f64 = difference.segments.iter().map(|s| s.dot(n).abs()).sum();
            let rounds: f64 = difference.rounds.iter().map(|(a, r)| r * n.cross(a).norm()).sum();
            segments + rounds - difference.between.dot(n).abs()
        };
        let mut all: Vec<(f64, Vector3<f64>)> = (0..N)
            .map(|k| {
                let z = (f64::from(k) + 0.5) / f64::from(N);
                let (sin, cos) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let n = Vector3::new(r * cos, r * sin, z);
                (shift(&n), n)
            })
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut random = StdRng::seed_from_u64(1);
        let refined = all.into_iter().take(10).map(|(mut least, mut n)| {
            let mut step = 0.02;
            for _ in 0..300 {
                let mut x = || random.random_range(-1.0..1.0);
                let next = (n + Vector3::new(x(), x(), x()) * step).normalize();
                if shift(&next) < least {
                    (least, n) = (shift(&next), next);
                } else {
                    step *= 0.97;
                }
            }
            least
        });
        refined.fold(f64::INFINITY, f64::min)
    }

    /// The search for the depth once crept for ever at gains of 1e-15; now it ends after a count, at the least.
    #[test]
    fn a_depth_ends_after_so_many_looks_and_is_the_least() {
        let mut random = StdRng::seed_from_u64(11);
        let (mut deep, mut most) = (0, 0);
        while deep < 150 {
            let solids = [random_solid(&mut random), random_solid(&mut random)];
            // Things stand upright, and above each other, more often than chance has it.
            let (upright, stacked) = (random.random_bool(0.2), random.random_bool(0.2));
            let [first, second] = solids.map(|solid| {
                let mut pose = random_pose(&mut random);
                if upright {
                    pose.rotation = UnitQuaternion::identity();
                }
                if stacked {
                    (pose.translation.x, pose.translation.y) = (0.0, 0.0);
                }
                Body::new(&Placed { solid, pose }).core()
            });
            if apart(&first, &second) > 0.0 {
                continue;
            }
            deep += 1;
            let (found, looks) = difference(&first, &second).depth();
            most = most.max(looks);
            let least = scanned(&first, &second);
            assert!(found <= least * (1.0 + 1e-5) + 1e-9, "{solids:?}: {found} {least}");
        }
        assert!(most <= 300, "{most}");
    }
}
