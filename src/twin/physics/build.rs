//! Putting arm, table and objects into the engine.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::{
    CoefficientCombineRule, GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis,
    MassProperties, MotorModel, MultibodyDofCoupling, MultibodyJointHandle, MultibodyLink,
    RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d_f64::geometry::{
    ColliderBuilder, Group, InteractionGroups, InteractionTestMode, SharedShape,
};
use rapier3d_f64::pipeline::ActiveHooks;

use super::super::convert::{inertia_to_engine, pose_to_engine, to_engine};
use super::super::{Error, Settings};
use super::{Body, Joint, Physics};
use crate::motion::Robot;
use crate::motion::robot::{self, Motion};
use crate::motion::solid::Solid;
use crate::world::{Object, Profile, Scene, Shape, WorldState, drawer};

/// Sides of the polygon that stands for a round wall.
const SIDES: usize = 16;
/// Corners of the polygons that stand for circles: as many as the feet have, twice.
const CORNERS: usize = 24;
/// Squares of which a round foot is made: a polygon of 12 corners tips 3 % earlier than the circle.
const SQUARES: usize = 3;
/// How thick the feet of a solid cylinder are, m: what lies on its side touches along all the rest.
const FOOT: f64 = 1e-3;

/// What stands, and no point of which has moved faster than this (m/s) for so long (s), is left out until something
/// touches it or its water moves. A thing that tips over from rest is faster after 0.1 mm.
const STILL: f64 = 1e-3;
const STILL_FOR: f64 = 0.1;

const TABLE: Group = Group::GROUP_1;
const ARM: Group = Group::GROUP_2;
const OBJECT: Group = Group::GROUP_3;

/// The arm is not tested against itself: its planner keeps it clear, and its neighbours overlap.
fn groups(member: Group) -> InteractionGroups {
    let all = TABLE | ARM | OBJECT;
    let filter = if member == OBJECT { all } else { all & !member };
    InteractionGroups::new(member, filter, InteractionTestMode::And)
}

/// Surface coefficients whose products are the pairs' coefficients.
struct Roughness {
    pad: f64,
    table: f64,
    object: f64,
}

impl Roughness {
    fn new(settings: &Settings) -> Self {
        let friction = &settings.friction;
        // With a frictionless object no product could give the other pairs any friction.
        let object = friction.object_object.max(1e-6).sqrt();
        Self { pad: friction.pad_object / object, table: friction.table_object / object, object }
    }
}

/// Gives a collider its friction and its groups.
fn surface(builder: ColliderBuilder, roughness: f64, member: Group) -> ColliderBuilder {
    builder
        .friction(roughness)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .restitution(0.0)
        .collision_groups(groups(member))
}

impl Physics {
    /// Adds the table slab, its top the plane z = 0.
    pub(super) fn add_table(&mut self, scene: &Scene, settings: &Settings) -> RigidBodyHandle {
        let half = scene.table.size / 2.0;
        let [x, y] = scene.table.centre;
        let pose = Isometry3::translation(x, y, -half.z);
        let body = self.bodies.insert(RigidBodyBuilder::fixed().pose(pose_to_engine(&pose)));
        let slab = ColliderBuilder::cuboid(half.x, half.y, half.z);
        let slab = surface(slab, Roughness::new(settings).table, TABLE);
        self.colliders.insert_with_parent(slab, body, &mut self.bodies);
        body
    }

    /// Adds the arm as one multibody in the state's configuration.
    pub(super) fn add_arm(
        &mut self,
        robot: &Robot,
        scene: &Scene,
        state: &WorldState,
        settings: &Settings,
    ) -> Result<(), Error> {
        check_lengths(robot, state, settings)?;
        self.add_bodies(robot, scene, state, settings);
        self.join_bodies(robot, settings);
        if let Some(first) = self.arm.first().map(|joint| joint.handle) {
            self.set_up_multibody(first, state, settings);
        }
        Ok(())
    }

    /// Adds the arm's bodies, each where the state has it, with their surfaces.
    fn add_bodies(
        &mut self,
        robot: &Robot,
        scene: &Scene,
        state: &WorldState,
        settings: &Settings,
    ) {
        let tree = self.tree.clone();
        let mut poses: Vec<Isometry3<f64>> = Vec::new();
        for (i, body) in tree.bodies.iter().enumerate() {
            let pose = match (body.parent, &body.joint) {
                (Some(parent), Some(joint)) => {
                    poses[parent] * joint.parent_from_link(coordinate(body, state))
                }
                _ => *scene.world_from_base.isometry(),
            };
            poses.push(pose);
            let builder = if body.parent.is_none() {
                RigidBodyBuilder::fixed()
            } else {
                RigidBodyBuilder::dynamic()
                    .gravity_scale(settings.arm.uncompensated)
                    .additional_mass_properties(inertia_to_engine(&body.inertial))
            };
            let builder = builder.pose(pose_to_engine(&pose)).can_sleep(false);
            let handle = self.bodies.insert(builder);
            self.links.push(handle);
            self.add_surfaces(robot, body, handle, tree.jaws.contains(&i), settings);
        }
    }

    /// Adds the collision shapes of one of the arm's bodies; `pad` says whether it is a jaw.
    fn add_surfaces(
        &mut self,
        robot: &Robot,
        body: &Body,
        handle: RigidBodyHandle,
        pad: bool,
        settings: &Settings,
    ) {
        let roughness = Roughness::new(settings);
        let rough = if pad { roughness.pad } else { roughness.object };
        let hooks = if pad { ActiveHooks::MODIFY_SOLVER_CONTACTS } else { ActiveHooks::empty() };
        for &(link, body_from_link) in &body.links {
            for placed in &robot.links()[link].collision {
                let (turned, shape) = shape(&placed.solid);
                let pose = body_from_link * placed.pose * turned;
                let collider = ColliderBuilder::new(shape).density(0.0);
                let collider = collider.position(pose_to_engine(&pose));
                let collider = surface(collider, rough, ARM).active_hooks(hooks);
                self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
            }
        }
    }

    /// Joins each of the arm's bodies to its parent, and keeps which joints are the arm's and which the jaws'.
    fn join_bodies(&mut self, robot: &Robot, settings: &Settings) {
        let tree = self.tree.clone();
        for (i, body) in tree.bodies.iter().enumerate() {
            let (Some(parent), Some(moved)) = (body.parent, &body.joint) else { continue };
            let limits = tree.arm.iter().position(|&arm| arm == i).map(|i| &robot.joints()[i]);
            let (range, effort) = match limits {
                Some(limits) => ([limits.lower, limits.upper], limits.effort),
                None => ([moved.range.0, moved.range.1], settings.gripper.force),
            };
            let joint = engine_joint(moved, range, effort);
            let (a, b) = (self.links[parent], self.links[i]);
            let handle = self
                .multibody_joints
                .insert(a, b, joint, true)
                .expect("each body of a tree is joined to one parent");
            let axis = joint_axis(moved);
            let range = range.iter().all(|limit| limit.is_finite()).then_some(range);
            let joint = Joint { handle, axis, body: i, range, effort };
            if limits.is_some() { self.arm.push(joint) } else { self.jaws.push(joint) }
        }
    }

    /// Couples the jaws, gives each degree of freedom its friction and rotor inertia, and moves the arm, to
    /// which the joint `first` belongs, to the state's configuration.
    fn set_up_multibody(
        &mut self,
        first: MultibodyJointHandle,
        state: &WorldState,
        settings: &Settings,
    ) {
        // The coordinates and the order of the engine's degrees of freedom are final only after a
        // first pass of forward kinematics.
        let (multibody, _) = self.multibody_joints.get_mut(first).expect("just inserted");
        multibody.set_self_contacts_enabled(false);
        multibody.forward_kinematics(&self.bodies, true);
        let mut displacement = vec![0.0; multibody.ndofs()];
        let mut ids = Vec::new();
        for joint in self.arm.iter().chain(&self.jaws) {
            let (multibody, link) = self.multibody_joints.get(joint.handle).expect("just inserted");
            let dof = multibody.link(link).map_or(0, MultibodyLink::assembly_id);
            displacement[dof] = coordinate(&self.tree.bodies[joint.body], state);
            ids.push((link, dof));
        }
        let n = self.arm.len();
        let (multibody, _) = self.multibody_joints.get_mut(first).expect("just inserted");
        for (i, &(_, dof)) in ids.iter().enumerate() {
            let arm = i < n;
            multibody.damping_mut()[dof] = if arm { settings.arm.viscous[i] } else { 0.0 };
            multibody.frictions_mut()[dof] = if arm { settings.arm.coulomb[i] } else { 0.0 };
            multibody.armature_mut()[dof] =
                if arm { settings.arm.armature[i] } else { settings.gripper.armature };
        }
        let [(first, _), (last, _)] = ids[n..] else { unreachable!("a tree has two jaws") };
        multibody.add_dof_coupling(alike(last, first));
        multibody.apply_displacements(&displacement);
        multibody.forward_kinematics(&self.bodies, false);
        multibody.update_rigid_bodies(&mut self.bodies, true);
    }

    /// Adds the objects whose poses are known.
    pub(super) fn add_objects(
        &mut self,
        scene: &Scene,
        state: &WorldState,
        settings: &Settings,
    ) -> Result<(), Error> {
        let roughness = Roughness::new(settings);
        for object in &scene.objects {
            let pose = state.object(&object.name).and_then(|state| state.world_from_object);
            let Some(pose) = pose else {
                self.objects.push(None);
                continue;
            };
            if object.mass.is_nan() || object.mass <= 0.0 {
                return Err(Error::Massless(object.name.clone()));
            }
            let fixed = scene.is_fixed(&object.name);
            let body = if fixed { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
            let body = body.pose(pose_to_engine(pose.isometry()));
            let handle = self.bodies.insert(body);
            let activation = self.bodies[handle].activation_mut();
            activation.normalized_linear_threshold = STILL;
            activation.time_until_sleep = STILL_FOR;
            let collider = ColliderBuilder::new(shape_in(scene, object));
            let collider = collider.mass_properties(object_mass(object));
            let collider = surface(collider, roughness.object, OBJECT);
            self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
            self.objects.push(Some(handle));
        }
        self.add_rails(scene, state, settings);
        Ok(())
    }

    /// Joins each tray to its case: it slides as far as it may be drawn, against friction that does not depend on its speed.
    fn add_rails(&mut self, scene: &Scene, state: &WorldState, settings: &Settings) {
        let body = |name: &str| {
            let at = scene.objects.iter().position(|object| object.name == name)?;
            self.objects[at]
        };
        let rails: Vec<_> = (scene.drawers.iter())
            .filter_map(|drawer| {
                let closed = drawer.case_from_tray(scene, 0.0)?;
                let drawn = drawer.drawn_in(scene, state)?.clamp(0.0, drawer.travel);
                Some((body(&drawer.case)?, body(&drawer.tray)?, closed, drawer.travel, drawn))
            })
            .collect();
        for (case, tray, closed, travel, drawn) in rails {
            let locked = JointAxesMask::all() & !JointAxesMask::from(JointAxis::LinX);
            let joint = GenericJointBuilder::new(locked)
                .local_frame1(pose_to_engine(&closed))
                .contacts_enabled(false)
                .limits(JointAxis::LinX, [0.0, travel])
                .build();
            let Some(handle) = self.multibody_joints.insert(case, tray, joint, true) else {
                continue;
            };
            let Some((multibody, _)) = self.multibody_joints.get_mut(handle) else { continue };
            multibody.set_self_contacts_enabled(false);
            multibody.forward_kinematics(&self.bodies, true);
            // The case is fixed, so that the way along the rail is all that is free.
            multibody.damping_mut().fill(0.0);
            multibody.frictions_mut().fill(settings.friction.drawer);
            let displacement = vec![drawn; multibody.ndofs()];
            multibody.apply_displacements(&displacement);
            multibody.forward_kinematics(&self.bodies, false);
            multibody.update_rigid_bodies(&mut self.bodies, true);
        }
    }
}

/// Returns where the joint of a body is in a state, rad or m; 0 for a body without one.
fn coordinate(body: &Body, state: &WorldState) -> f64 {
    body.joint.as_ref().map_or(0.0, |joint| joint.value(&state.q, state.opening))
}

/// Returns what makes two sliding jaws, by their links, move alike. The engine goes through it after the motor of `lead`,
/// which must be the later of the two links: what comes after it moves one jaw alone, by 0.1 mm when they press with 40 N.
fn alike(lead: usize, follow: usize) -> MultibodyDofCoupling {
    MultibodyDofCoupling {
        link1: lead,
        dof1: 0,
        axis1: JointAxis::LinX as usize,
        link2: follow,
        dof2: 0,
        axis2: JointAxis::LinX as usize,
        coeff: 1.0,
        offset: 0.0,
    }
}

/// Checks that every list that goes by joints has an entry for each.
fn check_lengths(robot: &Robot, state: &WorldState, settings: &Settings) -> Result<(), Error> {
    let n = robot.n_joints();
    let arm = &settings.arm;
    for (what, list) in [
        ("q", &state.q),
        ("kp", &arm.kp),
        ("kd", &arm.kd),
        ("armature", &arm.armature),
        ("coulomb", &arm.coulomb),
        ("viscous", &arm.viscous),
        ("compliance", &arm.compliance),
    ] {
        check_length(what, n, list.len())?;
    }
    Ok(())
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found { Ok(()) } else { Err(Error::WrongLength { what, expected, found }) }
}

/// Returns the engine's number of the joint's free axis.
fn joint_axis(moved: &robot::Joint) -> JointAxis {
    if moved.motion == Motion::Slide { JointAxis::LinX } else { JointAxis::AngX }
}

/// Returns the engine's joint: its free axis is local x, so both frames are turned to the robot's axis.
///
/// `range` in rad or m; `effort`, the motor's limit, in N·m or N.
fn engine_joint(moved: &robot::Joint, range: [f64; 2], effort: f64) -> GenericJoint {
    let axis = joint_axis(moved);
    let turn = UnitQuaternion::rotation_between(&Vector3::x(), &moved.axis).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI)
    });
    let turn = Isometry3::from_parts(Translation3::identity(), turn);
    let locked = JointAxesMask::all() & !JointAxesMask::from(axis);
    let mut builder = GenericJointBuilder::new(locked)
        .local_frame1(pose_to_engine(&(moved.parent_from_link * turn)))
        .local_frame2(pose_to_engine(&turn))
        .contacts_enabled(false)
        .motor_model(axis, MotorModel::ForceBased)
        .motor_max_force(axis, effort.min(f64::MAX));
    if range.iter().all(|limit| limit.is_finite()) {
        builder = builder.limits(axis, range);
    }
    builder.build()
}

/// Returns the engine's shape of a solid, and how the solid must be turned: the engine's cylinders and
/// capsules stand along y, ours along z.
fn shape(solid: &Solid) -> (Isometry3<f64>, SharedShape) {
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
fn shape_in(scene: &Scene, object: &Object) -> SharedShape {
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
fn object_mass(object: &Object) -> MassProperties {
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
