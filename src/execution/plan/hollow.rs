//! A vessel as its walls and its floor, for a hand that reaches into it. Elsewhere a vessel is solid to the planner.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::motion::solid::Solid;
use crate::world::{Object, Shape};

/// Slabs that stand for the wall of a round vessel: at 16 the corners stand out by 2 % of the radius (1/cos(pi/16)).
const SLABS: u32 = 16;

/// Returns the floor and the walls of a vessel in its own frame, each thicker by `doubt` m on every side; nothing for what
/// has no inside.
pub(super) fn walls(object: &Object, doubt: f64) -> Vec<(Solid, Isometry3<f64>)> {
    let Some(inside) = object.inside() else { return Vec::new() };
    let height = object.shape.height();
    let floor = height - inside.height();
    let slab = |x: f64, y: f64, z: f64, yaw: f64, size: Vector3<f64>| {
        let half = 0.5 * size + Vector3::repeat(doubt);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        (Solid::Cuboid { half }, Isometry3::from_parts(Translation3::new(x, y, z), turn))
    };
    let around = |count: u32, reach: &dyn Fn(f64) -> (f64, f64, f64)| {
        (0..count)
            .map(|k| {
                let yaw = TAU * f64::from(k) / f64::from(count);
                let (middle, thick, long) = reach(yaw);
                let (x, y) = (middle * yaw.cos(), middle * yaw.sin());
                slab(x, y, 0.5 * height, yaw, Vector3::new(thick, long, height))
            })
            .collect::<Vec<_>>()
    };
    // A handle is outside: it is kept clear of as it is.
    let body = object.shape.body();
    let (mut walls, under) = match (&body, &inside) {
        (Shape::Cuboid { size }, Shape::Cuboid { size: inner }) => {
            let walls = around(4, &|yaw| {
                let (out, gap, along) = if yaw.cos().abs() > 0.5 {
                    (size.x, size.x - inner.x, size.y)
                } else {
                    (size.y, size.y - inner.y, size.x)
                };
                (0.5 * out - 0.25 * gap, 0.5 * gap, along)
            });
            (walls, Vector3::new(size.x, size.y, floor))
        }
        (round, inner) if round.faces().is_none() => {
            let radius = round.outer_radius();
            let thick = radius - inner.inner_radius();
            let long = 2.0 * radius * (0.5 * TAU / f64::from(SLABS)).tan();
            let walls = around(SLABS, &|_| (radius - 0.5 * thick, thick, long));
            (walls, Vector3::new(2.0 * radius, 2.0 * radius, floor))
        }
        _ => return Vec::new(),
    };
    walls.push(slab(0.0, 0.0, 0.5 * floor, 0.0, under));
    if let Shape::Mug { mug } = &object.shape {
        let (middle, half) = mug.around_handle();
        walls.push(slab(middle.x, middle.y, middle.z, 0.0, 2.0 * half));
    }
    walls
}

/// As [`walls`], without the floor: what stands beside a hand that sets something down on it.
pub(super) fn sides(object: &Object, doubt: f64) -> Vec<(Solid, Isometry3<f64>)> {
    let under = object.inside().map_or(0.0, |inside| object.shape.height() - inside.height());
    walls(object, doubt).into_iter().filter(|(_, at)| at.translation.z > under).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::object::vessel;

    #[test]
    fn the_inside_is_free_and_the_walls_are_not() {
        for shape in [
            Shape::Cylinder { radius: 0.08, height: 0.06 },
            Shape::Cuboid { size: Vector3::new(0.12, 0.16, 0.06) },
        ] {
            let walls = walls(&vessel(shape.clone(), 1e-3), 0.0);
            let hit = |x: f64, y: f64, z: f64| {
                walls.iter().any(|(solid, pose)| {
                    let Solid::Cuboid { half } = solid else { panic!() };
                    let at = pose.inverse_transform_point(&nalgebra::Point3::new(x, y, z));
                    (0..3).all(|axis| at[axis].abs() <= half[axis] + 1e-9)
                })
            };
            assert!(!hit(0.0, 0.0, 0.03) && !hit(0.04, 0.03, 0.03));
            assert!(hit(0.0, 0.0, 0.001), "the floor");
            let edge = shape.inner_radius();
            assert!(hit(edge - 0.001, 0.0, 0.03) && hit(-edge + 0.001, 0.0, 0.05), "the walls");
        }
    }
}
