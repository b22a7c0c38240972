//! How far a point is from a solid, which way leads away from it, and how the solid bends there.
//!
//! Distances between solids are in `distance.rs`; here one of the two is a point, and what is asked is what moves it away.

use nalgebra::Vector3;

use super::body::Body;

/// A point nearer to the middle of a solid than this, m, is led away along any direction across it.
const MIDDLE: f64 = 1e-9;

/// A solid as a point sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outward {
    /// Signed distance of the point from the surface, m.
    pub(super) distance: f64,
    /// Unit vector along which the distance grows by one for one.
    pub(super) away: Vector3<f64>,
    /// One over the distance to what the surface bends about, 1/m; none where it is flat.
    pub(super) bend: f64,
    /// The direction in which it does not bend; zero where it bends in all.
    pub(super) along: Vector3<f64>,
}

/// Looks at a body from a point in the same frame.
pub(super) fn outward(body: &Body, p: &Vector3<f64>) -> Outward {
    match body {
        Body::Round { a, b, radius } => {
            let axis = b - a;
            let square = axis.norm_squared();
            let t = if square > 0.0 { (p - a).dot(&axis) / square } else { 0.0 };
            let from = p - (a + axis * t.clamp(0.0, 1.0));
            let (far, away) = direction(&from, &axis);
            let along = if t > 0.0 && t < 1.0 { axis / square.sqrt() } else { Vector3::zeros() };
            Outward { distance: far - radius, away, bend: 1.0 / far, along }
        }
        Body::Cuboid { frame, half } => {
            let local = frame.local(&(p - frame.origin));
            let over = local.abs() - half;
            let beyond = over.map(|x| x.max(0.0));
            let outside = (0..3).filter(|&i| over[i] > 0.0).count();
            if outside == 0 {
                let face = over.imax();
                let mut away = Vector3::zeros();
                away[face] = 1.0_f64.copysign(local[face]);
                let away = frame.direction(&away);
                return Outward { distance: over[face], away, bend: 0.0, along: Vector3::zeros() };
            }
            let distance = beyond.norm();
            let away = beyond.zip_map(&local, f64::copysign) / distance;
            // A face is flat; an edge bends across itself, a corner in all directions.
            let mut along = Vector3::zeros();
            if outside == 2 {
                along[over.imin()] = 1.0;
            }
            let bend = if outside > 1 { 1.0 / distance } else { 0.0 };
            let along = frame.direction(&along);
            Outward { distance, away: frame.direction(&away), bend, along }
        }
        Body::Cylinder { frame, radius, half } => {
            let local = frame.local(&(p - frame.origin));
            let flat = Vector3::new(local.x, local.y, 0.0);
            let (from_axis, side) = direction(&flat, &Vector3::z());
            let end = Vector3::z() * 1.0_f64.copysign(local.z);
            let (across, over) = (from_axis - radius, local.z.abs() - half);
            let seen = |distance, away: Vector3<f64>, bend, along: Vector3<f64>| Outward {
                distance,
                away: frame.direction(&away),
                bend,
                along: frame.direction(&along),
            };
            if across > 0.0 && over > 0.0 {
                let distance = across.hypot(over);
                let away = (side * across + end * over) / distance;
                return seen(distance, away, 1.0 / distance, Vector3::zeros());
            }
            if across > over {
                return seen(across, side, 1.0 / from_axis.max(MIDDLE), Vector3::z());
            }
            seen(over, end, 0.0, Vector3::zeros())
        }
    }
}

/// Returns the length of a vector and its direction; where it has none, one across `axis`.
fn direction(v: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let norm = v.norm();
    if norm > MIDDLE {
        return (norm, v / norm);
    }
    let least = axis.map(f64::abs).imin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    let across = axis.cross(&other);
    (MIDDLE, if across.norm() > 0.0 { across.normalize() } else { Vector3::z() })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::motion::distance::signed_distance;
    use crate::motion::solid::{Placed, Solid};

    #[test]
    fn distances_are_those_between_solids_and_the_way_is_their_slope() {
        let mut random = StdRng::seed_from_u64(11);
        for k in 0..400 {
            let mut x = || random.random_range(0.05..0.3);
            let (radius, half) = (x(), x());
            let solid = match k % 4 {
                0 => Solid::Sphere { radius },
                1 => Solid::Capsule { radius, half },
                2 => Solid::Cylinder { radius, half },
                _ => Solid::Cuboid { half: Vector3::new(x(), x(), x()) },
            };
            let mut u = || random.random_range(-1.0..1.0);
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(u(), u(), u()) * 3.0);
            let pose = Isometry3::from_parts(Vector3::new(u(), u(), u()).into(), turn);
            let body = Body::new(&Placed { solid, pose });
            let p = Vector3::new(u(), u(), u()) * 1.5;
            let seen = outward(&body, &p);
            let ball = Body::Round { a: p, b: p, radius: 0.0 };
            let distance = signed_distance(&ball, &body);
            if distance < 1e-3 {
                continue;
            }
            assert!((seen.distance - distance).abs() < 1e-6, "{solid:?} {seen:?} {distance}");
            let mut slope = Vector3::zeros();
            let h = 1e-5;
            for i in 0..3 {
                let mut step = Vector3::zeros();
                step[i] = h;
                let [up, down] = [p + step, p - step].map(|p| outward(&body, &p).distance);
                slope[i] = (up - down) / (2.0 * h);
            }
            assert!((slope - seen.away).norm() < 1e-4, "{solid:?} {seen:?} {slope}");
            // Across the way out the distance bends as said; at the rim of a cylinder more in one direction than in another.
            let is_rim = matches!(solid, Solid::Cylinder { .. })
                && seen.bend > 0.0
                && seen.along == Vector3::zeros();
            if is_rim {
                continue;
            }
            let across = seen.away.cross(&Vector3::new(u(), u(), u())).normalize();
            let straight = across.dot(&seen.along);
            let expected = seen.bend * (1.0 - straight * straight);
            let h = 1e-4;
            let [up, down] = [p + across * h, p - across * h].map(|p| outward(&body, &p).distance);
            let bend = (up + down - 2.0 * seen.distance) / (h * h);
            assert!((bend - expected).abs() < 0.05 + 0.02 * expected, "{solid:?} {seen:?} {bend}");
        }
    }
}
