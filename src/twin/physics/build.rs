//! Putting arm, table and objects into the engine: bodies, joints and surfaces. Their shapes are `shapes.rs`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::{
    CoefficientCombineRule, GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis,
    MotorModel, MultibodyDofCoupling, MultibodyJointHandle, MultibodyLink, RigidBodyBuilder,
    RigidBodyHandle,
};
use rapier3d_f64::geometry::{ColliderBuilder, Group, InteractionGroups, InteractionTestMode};
use rapier3d_f64::pipeline::ActiveHooks;

use super::super::convert::{inertia_to_engine, pose_to_engine};
use super::super::{Error, Settings};
use super::shapes::{object_mass, shape, shape_in};
use super::{Body, Joint, Physics};
use crate::motion::Robot;
use crate::motion::robot::{self, Motion};
use crate::world::{Scene, WorldState};

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
