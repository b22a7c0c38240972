//! Spheres that together contain a solid: what a quick look at a robot asks instead of its solids.
//!
//! A sphere is itself. A capsule becomes a row of spheres along its segment: a point of it lies at most its radius `r`
//! beside the segment and at most half the spacing `s` along it from a centre, so `√(r² + s²/4)` reaches it; what is beyond
//! an end is within `r` of it. A box is cut into equal cells and a cylinder lies in a box; half a cell's diagonal reaches
//! all of the cell. What lies outside all spheres lies outside the solid; not the other way round.

use nalgebra::Vector3;

use super::body::Body;

/// Spheres may be larger than a capsule by this share of its radius. Chosen: a tenth takes three spheres for each length of
/// a diameter.
const SWELL: f64 = 0.1;
/// Spheres along any edge of a box, at most: what is large in all three directions is a body and no arm.
const ALONG: f64 = 6.0;
/// Spheres that stand for a capsule at most: only a needle would need more.
const ROW: f64 = 32.0;

/// A centre and a radius, m.
pub(super) type Sphere = (Vector3<f64>, f64);

/// Returns spheres that contain a body, in its frame, and whether they are all it is.
pub(super) fn cover(body: &Body) -> (Vec<Sphere>, bool) {
    match *body {
        Body::Round { a, b, radius } => {
            let length = (b - a).norm();
            if length < 1e-9 {
                return (vec![(a, radius + length)], true);
            }
            let spacing = 2.0 * radius * ((1.0 + SWELL) * (1.0 + SWELL) - 1.0).sqrt();
            let gaps = (length / spacing).ceil().clamp(1.0, ROW);
            let reach = radius.hypot(0.5 * length / gaps);
            let row = (0..=gaps as usize).map(|k| (a + (b - a) * (k as f64 / gaps), reach));
            (row.collect(), false)
        }
        Body::Cuboid { frame, half } => {
            let cells = cells(&half);
            (cells.map(|(centre, radius)| (frame.point(&centre), radius)).collect(), false)
        }
        Body::Cylinder { frame, radius, half } => {
            let around = Vector3::new(radius, radius, half);
            (cells(&around).map(|(centre, radius)| (frame.point(&centre), radius)).collect(), false)
        }
    }
}

/// Returns spheres inside a body that touch much of its surface, in its frame: what a motion keeps away from others.
pub(super) fn inner(body: &Body) -> Vec<Sphere> {
    let within = |half: &Vector3<f64>| {
        let (counts, cell) = grain(half);
        places(counts, cell, *half).map(move |centre| (centre, cell.min())).collect::<Vec<_>>()
    };
    match *body {
        Body::Round { a, b, radius } => {
            let gaps = ((b - a).norm() / radius.max(1e-6)).ceil().clamp(0.0, ROW);
            let at = |k: usize| if gaps > 0.0 { a + (b - a) * (k as f64 / gaps) } else { a };
            (0..=gaps as usize).map(|k| (at(k), radius)).collect()
        }
        Body::Cuboid { frame, half } => {
            within(&half).into_iter().map(|(centre, r)| (frame.point(&centre), r)).collect()
        }
        Body::Cylinder { frame, radius, half } => {
            let inside = Vector3::new(radius, radius, half);
            within(&inside).into_iter().map(|(centre, r)| (frame.point(&centre), r)).collect()
        }
    }
}

/// Returns spheres about the cells of a box, in its frame.
fn cells(half: &Vector3<f64>) -> impl Iterator<Item = Sphere> {
    let (counts, cell) = grain(half);
    places(counts, cell, *half).map(move |centre| (centre, cell.norm()))
}

/// Returns how many cells a box is cut into along each edge, and half the edges of one.
fn grain(half: &Vector3<f64>) -> ([usize; 3], Vector3<f64>) {
    // As near to cubes as can be: as many along an edge as the thinnest goes into it, and at least two along the longest.
    let grain = half.min().max(half.max() / ALONG).min(0.5 * half.max());
    let counts = half.map(|edge| if grain > 0.0 { (edge / grain).ceil().max(1.0) } else { 1.0 });
    ([counts.x, counts.y, counts.z].map(|n| n as usize), half.component_div(&counts))
}

/// Returns the middles of the cells of a box.
fn places(
    [nx, ny, nz]: [usize; 3],
    cell: Vector3<f64>,
    half: Vector3<f64>,
) -> impl Iterator<Item = Vector3<f64>> {
    (0..nx * ny * nz).map(move |k| {
        let at = Vector3::new((k % nx) as f64, (k / nx % ny) as f64, (k / nx / ny) as f64);
        cell.component_mul(&(at * 2.0).add_scalar(1.0)) - half
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::motion::solid::{Placed, Solid};

    #[test]
    fn every_point_of_a_solid_is_in_a_sphere_and_the_spheres_stay_near() {
        let mut random = StdRng::seed_from_u64(3);
        for k in 0..300 {
            let mut x = || random.random_range(0.01..0.3);
            let (radius, half) = (x(), x());
            let solid = match k % 4 {
                0 => Solid::Sphere { radius },
                1 => Solid::Capsule { radius, half },
                2 => Solid::Cylinder { radius, half },
                _ => Solid::Cuboid { half: Vector3::new(x(), x(), x()) },
            };
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x(), x(), x()) * 10.0);
            let pose = Isometry3::from_parts(Vector3::new(x(), x(), x()).into(), turn);
            let (spheres, is_all) = cover(&Body::new(&Placed { solid, pose }));
            assert_eq!(is_all, k % 4 == 0);
            assert!(spheres.len() <= 216, "{solid:?}: {}", spheres.len());
            for _ in 0..300 {
                let mut u = || random.random_range(-1.0..1.0);
                let direction = Vector3::new(u(), u(), u());
                let reach = direction.normalize() * u();
                let p = match solid {
                    Solid::Sphere { radius } => reach * radius,
                    Solid::Capsule { radius, half } => reach * radius + Vector3::z() * (half * u()),
                    Solid::Cylinder { radius, half } => {
                        let flat = direction.xy().normalize() * radius;
                        Vector3::new(flat.x, flat.y, half * u())
                    }
                    Solid::Cuboid { half } => half.component_mul(&direction),
                };
                let p = pose * nalgebra::Point3::from(p);
                let gap = |(c, r): &Sphere| (p.coords - c).norm() - r;
                assert!(spheres.iter().map(gap).fold(1.0, f64::min) < 1e-9, "{solid:?}");
            }
            // No sphere reaches out farther than the solid's own size, and of a capsule a tenth of its radius.
            let size = solid.bounding_radius();
            assert!(
                spheres.iter().all(|(c, r)| (c - pose.translation.vector).norm() + r <= 2.0 * size)
            );
            if let Solid::Capsule { radius, .. } = solid {
                assert!(spheres.iter().all(|(_, r)| *r <= 1.1 * radius + 1e-9));
            }
        }
    }
}
