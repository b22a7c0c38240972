//! What touches others of links and objects, as the engine's shapes, and what objects weigh.
//!
//! Vessels are thin walls on a floor; what is round stands on polygons. Where a thing is, is not known here.

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::dynamics::MassProperties;
use rapier3d_f64::geometry::SharedShape;

use super::super::convert::{pose_to_engine, to_engine};
use crate::motion::solid::Solid;
use crate::world::{Object, Profile, Scene, Shape, drawer};

/// Sides of the polygon that stands for a round wall.
const SIDES: usize = 16;
/// Corners of the polygons that stand for circles: as many as the feet have, twice.
const CORNERS: usize = 24;
/// Squares of which a round foot is made: a polygon of 12 corners tips 3 % earlier than the circle.
const SQUARES: usize = 3;
/// How thick the feet of a solid cylinder are, m: what lies on its side touches along all the rest.
const FOOT: f64 = 1e-3;

/// Returns the engine's shape of a solid, and how the solid must be turned: the engine's cylinders and
/// capsules stand along y, ours along z.
pub(super) fn shape(solid: &Solid) -> (Isometry3<f64>, SharedShape) {
    match *solid {
        Solid::Cuboid { half } => {
            (Isometry3::identity(), SharedShape::cuboid(half.x, half.y, half.z))
        }
        Solid::Sphere { radius } => (Isometry3::identity(), SharedShape::ball(radius)),
        Solid::Cylinder { radius, half } => (y_to_z(), SharedShape::cylinder(half, radius)),
        Solid::Capsule { radius, half } => (y_to_z(), SharedShape::capsule_y(half, radius)),
    }
}

fn y_to_z() -> Isometry3<f64> {
    Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2)
}

/// A shape and where it is in its object's frame.
type Part = (Isometry3<f64>, SharedShape);

/// Returns what touches others of an object, in its own frame: thin walls when it is a vessel, else a solid.
fn object_shape(object: &Object) -> SharedShape {
    compound(match (object.cavity, &object.shape) {
        (Some(cavity), shape) => {
            let body = vessel(&shape.body(), cavity.wall, foot);
            body.into_iter().chain(handle(shape)).collect()
        }
        (None, &Shape::Cylinder { radius, height }) => {
            let up = |z: f64| Isometry3::translation(0.0, 0.0, z);
            let between = round(radius, 0.5 * height - FOOT, 0.5 * height);
            let feet = [0.5 * FOOT, height - 0.5 * FOOT].map(|z| foot(radius, 0.5 * FOOT, up(z)));
            between.into_iter().chain(feet.into_iter().flatten()).collect()
        }
        (None, Shape::Lathe { profile }) => turned(profile),
        (None, Shape::Mesh { mesh }) => {
            mesh.parts().iter().flat_map(|part| hull(part.iter().copied())).collect()
        }
        (None, shape) => solid(shape),
    })
}

/// As [`object_shape`], with what a drawer is besides a box: the bar of a tray and its posts, the hollow of a case.
pub(super) fn shape_in(scene: &Scene, object: &Object) -> SharedShape {
    if let Some(drawer) = scene.drawer(&object.name) {
        let mut parts = match object.cavity {
            Some(cavity) => vessel(&object.shape, cavity.wall, foot),
            None => solid(&object.shape),
        };
        for (at, shape) in drawer.handle(object) {
            let at = Isometry3::from(at);
            parts.extend(solid(&shape).into_iter().map(|(within, shape)| (at * within, shape)));
        }
        return compound(parts);
    }
    let inside = scene.drawers.iter().find(|drawer| drawer.case == object.name);
    let inside = inside.and_then(|drawer| scene.object(&drawer.tray));
    match (&object.shape, inside.map(|tray| &tray.shape)) {
        (Shape::Cuboid { size }, Some(Shape::Cuboid { size: inner })) => {
            compound(case(size, inner))
        }
        _ => object_shape(object),
    }
}

/// Returns a box that is open at its +x side, for a tray in the middle of its height: back, sides, top and floor.
fn case(size: &Vector3<f64>, inner: &Vector3<f64>) -> Vec<Part> {
    let board = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| {
        let middle = |[low, high]: [f64; 2]| f64::midpoint(low, high);
        let half = |[low, high]: [f64; 2]| 0.5 * (high - low);
        let at = Isometry3::translation(middle(x), middle(y), middle(z));
        (at, SharedShape::cuboid(half(x), half(y), half(z)))
    };
    let (hx, hy) = (0.5 * size.x, 0.5 * size.y);
    let side = hy - 0.5 * (size.y - inner.y) + drawer::ROOM;
    let (low, high) =
        (0.5 * (size.z - inner.z) - drawer::ROOM, 0.5 * (size.z + inner.z) + drawer::ROOM);
    let back = (-hx + (size.x - inner.x).max(drawer::ROOM)).min(hx);
    let all = [-hx, hx];
    vec![
        board(all, [-hy, hy], [0.0, low.max(1e-4)]),
        board(all, [-hy, hy], [high.min(size.z - 1e-4), size.z]),
        board([-hx, back - drawer::ROOM + 1e-4], [-hy, hy], [low, high]),
        board(all, [side - 1e-4, hy], [low, high]),
        board(all, [-hy, -side + 1e-4], [low, high]),
    ]
}

/// Returns mass, centre of mass and inertia of an object, in its own frame.
pub(super) fn object_mass(object: &Object) -> MassProperties {
    let parts = match object.cavity {
        Some(cavity) => {
            let disc =
                |radius: f64, half: f64, at: Isometry3<f64>| round(radius, half, at.translation.z);
            let body = vessel(&object.shape.body(), cavity.wall, disc);
            body.into_iter().chain(handle(&object.shape)).collect()
        }
        None => match &object.shape {
            Shape::Lathe { profile } => turned(profile),
            // Its parts overlap; what it encloses does not.
            Shape::Mesh { mesh } => {
                let corners: Vec<_> = mesh.corners().iter().map(to_engine).collect();
                let mut own = MassProperties::from_trimesh(1.0, &corners, mesh.triangles());
                own.set_mass(object.mass, true);
                return own;
            }
            shape => solid(shape),
        },
    };
    let mut properties = compound(parts).mass_properties(1.0);
    properties.set_mass(object.mass, true);
    properties
}

fn compound(parts: Vec<Part>) -> SharedShape {
    SharedShape::compound(
        parts.into_iter().map(|(at, shape)| (pose_to_engine(&at), shape)).collect(),
    )
}

/// Returns the bars of a handle, if a thing has one.
fn handle(outside: &Shape) -> Vec<Part> {
    let Shape::Mug { mug } = outside else { return Vec::new() };
    let bar = |(middle, half): (Vector3<f64>, Vector3<f64>)| {
        let at = Isometry3::translation(middle.x, middle.y, middle.z);
        (at, SharedShape::cuboid(half.x, half.y, half.z))
    };
    mug.bars().map(bar).to_vec()
}

fn solid(outside: &Shape) -> Vec<Part> {
    let placed = Solid::of_object(outside, 0.0).into_iter();
    placed
        .map(|placed| {
            let (turned, shape) = shape(&placed.solid);
            (placed.pose * turned, shape)
        })
        .collect()
}

/// Returns an upright cylinder with its middle at a height, m.
fn round(radius: f64, half: f64, z: f64) -> Vec<Part> {
    let (turned, shape) = shape(&Solid::Cylinder { radius, half });
    vec![(Isometry3::translation(0.0, 0.0, z) * turned, shape)]
}

/// Returns what a round thing stands on: squares turned against each other, whose corners are a polygon in its edge.
///
/// On a true circle the engine gains energy: the point that touches moves along the edge within a step, the next one is
/// found below the table and is pushed out. A beaker of 64 mm that rocks by 5 deg and turns about its foot rocked
/// by 20 deg after two seconds. A corner stays where it is, and its impacts take energy, as those of real things do.
fn foot(radius: f64, half: f64, at: Isometry3<f64>) -> Vec<Part> {
    let side = radius * std::f64::consts::FRAC_1_SQRT_2;
    let square = |k: usize| {
        let turn = std::f64::consts::FRAC_PI_2 * k as f64 / SQUARES as f64;
        (at * Isometry3::rotation(Vector3::z() * turn), SharedShape::cuboid(side, side, half))
    };
    (0..SQUARES).map(square).collect()
}

/// Returns a round thing whose radius changes as polygons over each other, on a [`foot`]: standing on a polygon of many
/// corners it gains energy as a circle does (a bottle put down leant, rocked and fell).
fn turned(profile: &Profile) -> Vec<Part> {
    let at = Isometry3::translation(0.0, 0.0, 0.5 * FOOT);
    let under =
        if profile.foot() > FOOT { foot(profile.foot(), 0.5 * FOOT, at) } else { Vec::new() };
    let above = profile.points().iter().copied().filter(|[_, z]| *z > FOOT);
    let points: Vec<[f64; 2]> =
        std::iter::once([profile.radius_at(FOOT), FOOT]).chain(above).collect();
    let ring = |[r, z]: [f64; 2]| {
        (0..CORNERS).map(move |k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
            Vector3::new(r * cos, r * sin, z)
        })
    };
    if profile.is_convex() {
        let body = hull(points.iter().flat_map(|point| ring(*point)));
        return under.into_iter().chain(body).collect();
    }
    let body = points.windows(2).flat_map(|pair| hull(ring(pair[0]).chain(ring(pair[1]))));
    under.into_iter().chain(body).collect()
}

/// Returns the convex hull of points, m; nothing where they enclose nothing.
fn hull(points: impl Iterator<Item = Vector3<f64>>) -> Vec<Part> {
    let points: Vec<_> = points.map(|point| to_engine(&point)).collect();
    let hull = SharedShape::convex_hull(&points);
    hull.map(|hull| (Isometry3::identity(), hull)).into_iter().collect()
}

/// Returns the walls over the floor of a round vessel whose radius changes: flat pieces, `thick` m thick, level.
fn leaning_walls(profile: &Profile, thick: f64) -> Vec<Part> {
    let half_angle = std::f64::consts::PI / SIDES as f64;
    let heights = profile.points().iter().map(|[_, z]| *z).filter(|z| *z > thick);
    let heights: Vec<f64> = std::iter::once(thick).chain(heights).collect();
    let mut walls = Vec::new();
    for side in 0..SIDES {
        let turn = Isometry3::rotation(Vector3::z() * (2.0 * half_angle * side as f64));
        for pair in heights.windows(2) {
            let corner = |z: f64, inward: f64, hand: f64| {
                let r = profile.radius_at(z);
                turn * nalgebra::Point3::new(r - inward, hand * r * half_angle.tan(), z)
            };
            let corners = pair.iter().flat_map(|z| {
                [0.0, thick]
                    .into_iter()
                    .flat_map(move |inward| [-1.0, 1.0].map(|hand| corner(*z, inward, hand).coords))
            });
            walls.extend(hull(corners));
        }
    }
    walls
}

/// Returns floor and walls of a vessel; a round floor is made by `disc` of its radius, half its height and its place.
fn vessel(
    outside: &Shape,
    thick: f64,
    disc: impl Fn(f64, f64, Isometry3<f64>) -> Vec<Part>,
) -> Vec<Part> {
    let at = |x: f64, y: f64, z: f64| Isometry3::translation(x, y, z);
    let half_wall = thick / 2.0;
    // Walls stand on the floor, so that only the floor touches the table.
    let wall_half = (outside.height() - thick) / 2.0;
    let wall_z = thick + wall_half;
    match *outside {
        Shape::Cuboid { size } => {
            let (hx, hy) = (size.x / 2.0, size.y / 2.0);
            let floor = (at(0.0, 0.0, half_wall), SharedShape::cuboid(hx, hy, half_wall));
            // Two walls stand between the other two: a pad would touch both where their faces are one.
            let walls = [-1.0, 1.0].into_iter().flat_map(|side| {
                let x = SharedShape::cuboid(half_wall, hy - thick, wall_half);
                let y = SharedShape::cuboid(hx, half_wall, wall_half);
                let (across, along) = (side * (hx - half_wall), side * (hy - half_wall));
                [(at(across, 0.0, wall_z), x), (at(0.0, along, wall_z), y)]
            });
            std::iter::once(floor).chain(walls).collect()
        }
        Shape::Cylinder { radius, .. } => {
            let half_angle = std::f64::consts::PI / SIDES as f64;
            let wall = |side: usize| {
                let turn = Isometry3::rotation(Vector3::z() * (2.0 * half_angle * side as f64));
                let shape = SharedShape::cuboid(half_wall, radius * half_angle.tan(), wall_half);
                (turn * at(radius - half_wall, 0.0, wall_z), shape)
            };
            let floor = disc(radius, half_wall, at(0.0, 0.0, half_wall));
            floor.into_iter().chain((0..SIDES).map(wall)).collect()
        }
        Shape::Lathe { profile } => {
            let floor = disc(profile.foot(), half_wall, at(0.0, 0.0, half_wall));
            floor.into_iter().chain(leaning_walls(&profile, thick)).collect()
        }
        // A mesh holds nothing; a scene says so. What a mug holds is in its body.
        Shape::Mesh { .. } | Shape::Mug { .. } => solid(outside),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::object;
    use rapier3d_f64::math::Pose as EnginePose;

    #[test]
    fn a_vessel_is_open_at_the_top_and_closed_below() {
        for shape in [
            Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) },
            Shape::Cylinder { radius: 0.08, height: 0.095 },
            Shape::Lathe { profile: Profile::cone(0.03, 0.042, 0.1).unwrap() },
        ] {
            let solid = object_shape(&object::vessel(shape.clone(), 2.5e-4));
            let inside = |x: f64, y: f64, z: f64| {
                solid.contains_point(&EnginePose::IDENTITY, to_engine(&Vector3::new(x, y, z)))
            };
            let at_half = match shape {
                Shape::Lathe { profile } => profile.radius_at(0.5 * shape.height()),
                _ => shape.inner_radius(),
            };
            let outer = at_half;
            assert!(inside(0.0, 0.0, 0.001), "the floor is solid");
            assert!(!inside(0.0, 0.0, 0.004), "the cavity is empty");
            assert!(!inside(0.0, 0.0, shape.height() - 1e-4), "the mouth is open");
            assert!(inside(outer - 0.001, 0.0, shape.height() / 2.0), "the wall is solid");
            assert!(!inside(outer + 1e-4, 0.0, shape.height() / 2.0), "the wall ends");
        }
    }
}
