//! Reading a URDF into a [`Robot`]: links, joints, solids, and what drives each joint.
//!
//! The only file of the program that reads the format. Meshes become the solids that cover them ([`super::cover`]); a
//! link that is drawn as a mesh is drawn as its collision solids. What was left out or assumed is said in
//! [`Robot::notes`].
//!
//! Source: the URDF specification, <http://wiki.ros.org/urdf/XML>; fixed-axis roll, pitch, yaw; inertia
//! about the centre of mass.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use super::cover::cover;
use super::error::Error;
use super::fault::{MeshFault, Note, UrdfFault};
use super::inertial::Inertial;
use super::jaw;
use super::knuckle::Knuckle;
use super::mesh;
use super::mimic::{Lead, Roles};
use super::robot::{Drive, Joint, JointLimits, Link, Motion, Robot, Visual};
use super::solid::{Placed, Solid, merge_capsules};
use super::tree;
use crate::world::mesh::read;

/// A joint without an acceleration limit reaches its speed limit in this time, s. Chosen: it is what
/// the Gen3's large joints need (1.4 rad/s at 4.94 rad/s²), rounded down.
const TIME_TO_FULL_SPEED: f64 = 0.25;

impl Robot {
    /// Adds the links in an order with parents first.
    pub(super) fn add_links(
        &mut self,
        urdf: &urdf_rs::Robot,
        order: &[tree::Step],
        meshes: &mesh::Source<'_>,
    ) -> Result<(), Error> {
        let materials: BTreeMap<&str, &urdf_rs::Material> =
            urdf.materials.iter().map(|material| (material.name.as_str(), material)).collect();
        for step in order {
            let link = &urdf.links[step.link];
            let joint = match step.joint {
                None => Joint {
                    name: String::new(),
                    parent_from_link: Isometry3::identity(),
                    motion: Motion::Fixed,
                    axis: Vector3::z_axis(),
                    drive: Drive::None,
                    range: (0.0, 0.0),
                },
                Some(at) => joint_of(&urdf.joints[at])?,
            };
            let mut collision = Vec::new();
            for part in &link.collision {
                check_sizes(&link.name, &part.geometry)?;
                match solids_of(&part.geometry, meshes) {
                    Ok(solids) => collision.extend(placed(&part.origin, solids)),
                    Err((file, what)) => {
                        let link = link.name.clone();
                        self.notes.push(Note::Mesh { link, file, what });
                    }
                }
            }
            let collision = merge_capsules(collision);
            self.links.push(Link {
                name: link.name.clone(),
                parent: step.parent,
                joint,
                inertial: inertial_of(&link.inertial, &link.name)?,
                visual: visual_of(link, &collision, &materials),
                collision,
            });
        }
        Ok(())
    }

    /// Says for every moving joint whether `q` or the opening drives it.
    pub(super) fn drive_joints(
        &mut self,
        urdf: &urdf_rs::Robot,
        order: &[tree::Step],
        roles: &Roles<'_>,
    ) -> Result<(), Error> {
        for &link in &roles.entries {
            if let Some(at) = order[link].joint {
                self.add_entry(&urdf.joints[at], link);
            }
        }
        if self.joints.is_empty() {
            return Err(Error::NoJoints { tip: self.links[self.tip].name.clone() });
        }
        self.drive_by_entries(roles);
        self.drive_by_opening(urdf, order, roles);
        Ok(())
    }

    /// Makes the joint that carries a link the next entry of q.
    fn add_entry(&mut self, joint: &urdf_rs::Joint, link: usize) {
        let limit = &joint.limit;
        let continuous = joint.joint_type == urdf_rs::JointType::Continuous;
        let (mut lower, mut upper) = self.links[link].joint.range;
        if lower >= upper {
            // The format's default is 0 to 0; a joint that may not move would be fixed.
            (lower, upper) = (f64::NEG_INFINITY, f64::INFINITY);
            self.notes.push(Note::NoRange { joint: joint.name.clone() });
        }
        let velocity = if limit.velocity > 0.0 { limit.velocity } else { f64::INFINITY };
        if velocity.is_infinite() {
            self.notes.push(Note::NoSpeed { joint: joint.name.clone() });
        }
        let velocity = if velocity.is_finite() { velocity } else { 1.0 };
        let acceleration = if limit.acceleration.is_finite() && limit.acceleration > 0.0 {
            limit.acceleration
        } else {
            self.states_accelerations = false;
            velocity / TIME_TO_FULL_SPEED
        };
        self.joints.push(JointLimits {
            name: joint.name.clone(),
            link,
            continuous,
            lower,
            upper,
            velocity,
            acceleration,
            jerk: None,
            effort: if limit.effort > 0.0 { limit.effort } else { f64::INFINITY },
        });
    }

    /// Drives the entries of q and all that has the same lead as one of them, on the way to the tip or beside it.
    fn drive_by_entries(&mut self, roles: &Roles<'_>) {
        for (index, &entry) in roles.entries.iter().enumerate() {
            let own = &roles.leads[entry];
            for (link, lead) in roles.leads.iter().enumerate() {
                let joint = &mut self.links[link].joint;
                if lead.at == own.at && joint.motion != Motion::Fixed {
                    let multiplier = lead.multiplier / own.multiplier;
                    let offset = lead.offset - multiplier * own.offset;
                    joint.drive = Drive::Joint { index, multiplier, offset };
                }
            }
        }
    }

    /// Drives everything else that moves with the gripper.
    fn drive_by_opening(&mut self, urdf: &urdf_rs::Robot, order: &[tree::Step], roles: &Roles<'_>) {
        let slides = (0..order.len())
            .filter(|&link| {
                self.links[link].joint.motion == Motion::Slide
                    && self.links[link].joint.drive == Drive::None
            })
            .count();
        let (mut idle, mut knuckles, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
        for (link, lead) in roles.leads.iter().enumerate() {
            let joint = &mut self.links[link].joint;
            if joint.motion == Motion::Fixed || joint.drive != Drive::None {
                continue;
            }
            let &Lead { at: leader, multiplier, offset } = lead;
            if joint.motion == Motion::Slide {
                // Each of two jaws goes half the opening.
                let lead = order[leader].joint.map(|at| &urdf.joints[at]);
                let is_inwards = lead.is_some_and(|lead| {
                    lead.joint_type == urdf_rs::JointType::Prismatic
                        && jaw::counts_inwards((lead.limit.lower, lead.limit.upper))
                });
                let sign = if is_inwards { -1.0 } else { 1.0 };
                self.drive_jaw(link, sign * multiplier / slides as f64, offset);
                continue;
            }
            joint.drive = Drive::Jaw { multiplier: 0.0, offset: 0.0 };
            idle.push(Note::OffPath { joint: joint.name.clone() });
            if roles.jaws[link] {
                knuckles.push(Knuckle { link, multiplier, offset });
                if leader == link {
                    ranges.push(joint.range);
                }
            }
        }
        self.measure_openings();
        // Jaws that turn: one joint leads, all others follow it.
        let is_gripper = match ranges[..] {
            [range] if slides == 0 && knuckles.len() == idle.len() => self.couple(&knuckles, range),
            _ => false,
        };
        if !is_gripper {
            self.notes.append(&mut idle);
        }
    }
}

pub(super) fn pose_of(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(pose.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

fn joint_of(joint: &urdf_rs::Joint) -> Result<Joint, Error> {
    use urdf_rs::JointType as T;
    let motion = match joint.joint_type {
        T::Fixed => Motion::Fixed,
        T::Revolute | T::Continuous => Motion::Turn,
        T::Prismatic => Motion::Slide,
        T::Floating | T::Planar | T::Spherical => {
            let (joint, kind) = (joint.name.clone(), joint.joint_type.clone());
            return Err(Error::Urdf { what: UrdfFault::JointKind { joint, kind } });
        }
    };
    let axis = Vector3::from(joint.axis.xyz.0);
    let axis = if motion == Motion::Fixed {
        Vector3::z_axis()
    } else {
        let no_axis = || UrdfFault::NoAxis { joint: joint.name.clone() };
        Unit::try_new(axis, 1e-9).ok_or_else(|| Error::Urdf { what: no_axis() })?
    };
    let range = match joint.joint_type {
        T::Revolute | T::Prismatic => (joint.limit.lower, joint.limit.upper),
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    };
    if range.0.is_nan() || range.1.is_nan() || range.0 > range.1 {
        let (lower, upper) = range;
        let what = UrdfFault::Range { joint: joint.name.clone(), lower, upper };
        return Err(Error::Urdf { what });
    }
    let parent_from_link = pose_of(&joint.origin);
    if !parent_from_link.translation.vector.iter().all(|x| x.is_finite())
        || !parent_from_link.rotation.coords.iter().all(|x| x.is_finite())
    {
        return Err(Error::Urdf { what: UrdfFault::Origin { joint: joint.name.clone() } });
    }
    Ok(Joint {
        name: joint.name.clone(),
        parent_from_link,
        motion,
        axis,
        drive: Drive::None,
        range,
    })
}

/// Puts solids, given in the frame of their geometry, into the frame of their link.
fn placed(origin: &urdf_rs::Pose, solids: Vec<Placed>) -> impl Iterator<Item = Placed> {
    let origin = pose_of(origin);
    solids.into_iter().map(move |part| Placed { pose: origin * part.pose, ..part })
}

/// Returns what is drawn of a link: its plain shapes, or where it is drawn as a mesh its collision solids.
fn visual_of(
    link: &urdf_rs::Link,
    collision: &[Placed],
    materials: &BTreeMap<&str, &urdf_rs::Material>,
) -> Vec<Visual> {
    let plain = |visual: &urdf_rs::Visual| {
        let solids =
            vec![Placed { solid: solid_of(&visual.geometry)?, pose: Isometry3::identity() }];
        let placed = placed(&visual.origin, solids).next()?;
        Some(Visual { placed, colour: colour_of(visual, materials) })
    };
    let drawn: Vec<Visual> = link.visual.iter().filter_map(plain).collect();
    let has_mesh = link.visual.iter().any(|visual| solid_of(&visual.geometry).is_none());
    if drawn.is_empty() && has_mesh {
        let colour = link.visual.iter().find_map(|visual| colour_of(visual, materials));
        return collision.iter().map(|&placed| Visual { placed, colour }).collect();
    }
    drawn
}

/// Returns the solids of a geometry in its own frame; of a mesh those that cover it, or its name and why there are none.
fn solids_of(
    geometry: &urdf_rs::Geometry,
    meshes: &mesh::Source<'_>,
) -> Result<Vec<Placed>, (String, MeshFault)> {
    let urdf_rs::Geometry::Mesh { filename, scale } = geometry else {
        let solid = solid_of(geometry);
        return Ok(solid
            .map(|solid| Placed { solid, pose: Isometry3::identity() })
            .into_iter()
            .collect());
    };
    let scale = scale.map_or(Vector3::repeat(1.0), |scale| Vector3::from(scale.0));
    let covered = || {
        // What is not read needs no looking for.
        read::reader_of(filename)?;
        let triangles = read::triangles(filename, &meshes(filename)?, &scale)?;
        Ok(cover(&triangles))
    };
    covered().map_err(|what| (filename.clone(), what))
}

/// Refuses a collision shape that encloses nothing, as URDF 1.2 does: nothing could be kept clear of it.
fn check_sizes(link: &str, geometry: &urdf_rs::Geometry) -> Result<(), Error> {
    use urdf_rs::Geometry as G;
    let (shape, sizes) = match *geometry {
        G::Box { size } => {
            let [x, y, z] = size.0;
            ("box", vec![("side along x", x), ("side along y", y), ("side along z", z)])
        }
        G::Cylinder { radius, length } => {
            ("cylinder", vec![("radius", radius), ("length", length)])
        }
        G::Capsule { radius, length } => ("capsule", vec![("radius", radius), ("length", length)]),
        G::Sphere { radius } => ("sphere", vec![("radius", radius)]),
        G::Mesh { .. } => return Ok(()),
    };
    let is_none = |size: f64| !size.is_finite() || size <= 0.0;
    let Some((side, size)) = sizes.into_iter().find(|&(_, size)| is_none(size)) else {
        return Ok(());
    };
    Err(Error::Urdf { what: UrdfFault::Size { link: link.to_owned(), shape, side, size } })
}

fn solid_of(geometry: &urdf_rs::Geometry) -> Option<Solid> {
    use urdf_rs::Geometry as G;
    Some(match *geometry {
        G::Box { size } => Solid::Cuboid { half: Vector3::from(size.0) / 2.0 },
        G::Cylinder { radius, length } => Solid::Cylinder { radius, half: length / 2.0 },
        G::Capsule { radius, length } => Solid::Capsule { radius, half: length / 2.0 },
        G::Sphere { radius } => Solid::Sphere { radius },
        G::Mesh { .. } => return None,
    })
}

/// Returns a visual's own colour, or that of the material it names.
fn colour_of(
    visual: &urdf_rs::Visual,
    materials: &BTreeMap<&str, &urdf_rs::Material>,
) -> Option<[u8; 3]> {
    let material = visual.material.as_ref()?;
    let named = || materials.get(material.name.as_str())?.color.as_ref();
    let rgba = material.color.as_ref().or_else(named)?.rgba.0;
    Some([0, 1, 2].map(|i| (rgba[i].clamp(0.0, 1.0) * 255.0).round() as u8))
}

fn inertial_of(inertial: &urdf_rs::Inertial, link: &str) -> Result<Option<Inertial>, Error> {
    let mass = inertial.mass.value;
    if !mass.is_finite() || mass < 0.0 {
        return Err(Error::Urdf { what: UrdfFault::Mass { link: link.to_owned(), mass } });
    }
    if mass <= 0.0 {
        return Ok(None);
    }
    let i = &inertial.inertia;
    #[rustfmt::skip]
    let about_com = Matrix3::new(
        i.ixx, i.ixy, i.ixz,
        i.ixy, i.iyy, i.iyz,
        i.ixz, i.iyz, i.izz,
    );
    // The inertia is given in the axes of the inertial frame, which may be turned.
    let here = Inertial { mass, com: Vector3::zeros(), inertia: about_com };
    Ok(Some(here.seen_from(&pose_of(&inertial.origin))))
}
