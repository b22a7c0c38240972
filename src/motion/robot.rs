//! A robot: links, joints and limits, read from a URDF and constant from then on.
//!
//! Joint positions `q` are those of the moving joints between the root link and the *tip*, base first.
//! Joints off that path are the gripper's jaws: they are not part of `q` but follow one number, the
//! opening. Where links are for some `q` is [`super::kinematics`]; torques are [`super::dynamics`].
//!
//! Source: the URDF specification, <http://wiki.ros.org/urdf/XML>; fixed-axis roll, pitch, yaw.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use super::error::Error;
use super::solid::{Placed, Solid, merge_capsules};
use super::tree;
use crate::world::frame::{Flange, Pose, Tool};

/// The stdlib Gen3 with a 2F-85 gripper.
const GEN3_URDF: &str = include_str!("../../stdlib/robots/gen3_2f85/gen3_2f85.urdf");
/// What its URDF has no place for.
const GEN3_SIDE: &str = include_str!("../../stdlib/robots/gen3_2f85/robot.toml");
/// A joint without an acceleration limit reaches its speed limit in this time, s. Chosen: it is what
/// the Gen3's large joints need (1.4 rad/s at 4.94 rad/s²), rounded down.
const TIME_TO_FULL_SPEED: f64 = 0.25;

/// Mass and how it is spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, axes of the link frame, kg·m².
    pub inertia: Matrix3<f64>,
}

/// How a joint lets its child move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// Turns about its axis; rad.
    Turn,
    /// Slides along its axis; m.
    Slide,
}

/// What a joint's value follows: `multiplier × source + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing: the joint is fixed.
    None,
    /// Entry `index` of `q`.
    Joint {
        /// Which entry.
        index: usize,
        /// Factor; 1 unless the joint mimics another.
        multiplier: f64,
        /// Summand, rad or m.
        offset: f64,
    },
    /// The gripper's opening.
    Jaw {
        /// Share of the opening, m/m; 0 for a part that is not moved.
        multiplier: f64,
        /// Summand, rad or m.
        offset: f64,
    },
}

/// The joint that carries a link, seen from the link.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name; empty for the root.
    pub name: String,
    /// Carries points of the link into its parent when the joint is at 0.
    pub parent_from_link: Isometry3<f64>,
    /// How it moves.
    pub motion: Motion,
    /// About or along what, in the link frame.
    pub axis: Unit<Vector3<f64>>,
    /// What moves it.
    pub drive: Drive,
    /// Lowest and highest value, rad or m.
    pub range: (f64, f64),
}

/// One rigid body of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// Index of the parent link; `None` for the root. Parents come before their children.
    pub parent: Option<usize>,
    /// The joint to the parent.
    pub joint: Joint,
    /// Its mass, if it has any.
    pub inertial: Option<Inertial>,
    /// What is drawn, in the link frame.
    pub visual: Vec<Placed>,
    /// What must not touch anything, in the link frame.
    pub collision: Vec<Placed>,
}

/// Limits of one entry of `q`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointLimits {
    /// The joint's name.
    pub name: String,
    /// Index of the link it carries.
    pub link: usize,
    /// Whether it may turn without end; then `lower` and `upper` are infinite.
    pub continuous: bool,
    /// Lowest position, rad or m.
    pub lower: f64,
    /// Highest position, rad or m.
    pub upper: f64,
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Highest torque or force, N·m or N; infinite if the file says none.
    pub effort: f64,
}

/// A robot, constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<JointLimits>,
    pub(super) tip: usize,
    /// Links from the root's child to the tip.
    pub(super) path: Vec<usize>,
    pub(super) flange_from_tool: Pose<Flange, Tool>,
    pub(super) tool: Option<usize>,
    pub(super) unchecked: Vec<(usize, usize)>,
    pub(super) poses: BTreeMap<String, Vec<f64>>,
    pub(super) max_opening: f64,
    pub(super) notes: Vec<String>,
    pub(super) has_side_file: bool,
}

impl Robot {
    /// Returns the stdlib robot: a Kinova Gen3 with seven joints and a Robotiq 2F-85.
    pub fn gen3() -> Self {
        Self::from_urdf_with(GEN3_URDF, GEN3_SIDE, None)
            .expect("the embedded robot is read by the tests")
    }

    /// As [`Self::gen3`], with `q` and poses up to another link.
    ///
    /// # Errors
    ///
    /// [`Error::NoLink`] if the robot has no link `tip`.
    pub fn gen3_to(tip: &str) -> Result<Self, Error> {
        Self::from_urdf_with(GEN3_URDF, GEN3_SIDE, Some(tip))
    }

    /// Reads a robot from the text of a URDF; `tip` names the link whose pose is meant, and where `q`
    /// ends. Without it: the well-known name for a flange that the file has, else the end of the chain.
    ///
    /// # Errors
    ///
    /// [`Error::Urdf`] for text that is not a URDF of one tree, [`Error::NoLink`] for an unknown tip,
    /// [`Error::Branches`] when the file has several arms and no tip was named.
    pub fn from_urdf(text: &str, tip: Option<&str>) -> Result<Self, Error> {
        Self::from_urdf_with(text, "", tip)
    }

    /// As [`Self::from_urdf`], with a side file (see `stdlib/robots/gen3_2f85/robot.toml`).
    ///
    /// # Errors
    ///
    /// As [`Self::from_urdf`], and [`Error::SideFile`].
    pub fn from_urdf_with(text: &str, side: &str, tip: Option<&str>) -> Result<Self, Error> {
        let side = super::side::SideFile::parse(side)?;
        let mut urdf = urdf_rs::read_from_string(text)
            .map_err(|error| Error::Urdf { what: error.to_string() })?;
        if urdf.links.is_empty() {
            return Err(Error::Urdf { what: "it has no <link>".into() });
        }
        let order = tree::order(&urdf)?;
        let jaws = tree::jaws(&urdf, &order);
        let tip_name = tip.map(str::to_owned).or_else(|| side.tip.clone());
        let tip = match tip_name {
            Some(name) => order
                .iter()
                .position(|step| urdf.links[step.link].name == name)
                .ok_or_else(|| Error::NoLink {
                    name,
                    known: urdf.links.iter().map(|link| link.name.clone()).collect(),
                })?,
            None => tree::default_tip(&urdf, &order, &jaws)?,
        };
        let mut robot = Self {
            name: std::mem::take(&mut urdf.name),
            links: Vec::with_capacity(order.len()),
            joints: Vec::new(),
            tip,
            path: tree::path(&order, tip),
            flange_from_tool: Pose::identity(),
            tool: None,
            unchecked: Vec::new(),
            poses: BTreeMap::new(),
            max_opening: 0.0,
            notes: Vec::new(),
            has_side_file: false,
        };
        robot.add_links(&urdf, &order)?;
        robot.drive_joints(&urdf, &order, &jaws)?;
        side.apply(&mut robot)?;
        robot.place_tool()?;
        Ok(robot)
    }

    /// Reads a robot from a URDF file, and from `robot.toml` beside it if there is one.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if a file cannot be read; otherwise as [`Self::from_urdf_with`].
    pub fn from_file(path: &Path, tip: Option<&str>) -> Result<Self, Error> {
        let read = |path: &Path| {
            std::fs::read_to_string(path).map_err(|error| Error::File {
                path: path.display().to_string(),
                what: error.to_string(),
            })
        };
        let text = read(path)?;
        let beside = path.with_file_name("robot.toml");
        let side = if beside.is_file() { read(&beside)? } else { String::new() };
        Self::from_urdf_with(&text, &side, tip)
    }

    /// Works out where the tool sits on the tip; both are rigid, so any `q` tells it.
    fn place_tool(&mut self) -> Result<(), Error> {
        let Some(tool) = self.tool else { return Ok(()) };
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0)?;
        self.flange_from_tool = Pose::new(poses[self.tip].inv_mul(&poses[tool]));
        Ok(())
    }

    fn add_links(&mut self, urdf: &urdf_rs::Robot, order: &[tree::Step]) -> Result<(), Error> {
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
            let mut solids = |origin: &urdf_rs::Pose, geometry: &urdf_rs::Geometry| {
                let solid = solid_of(geometry);
                if solid.is_none() {
                    self.notes.push(format!(
                        "link {}: a mesh is left out; only boxes, cylinders, spheres and capsules count",
                        link.name
                    ));
                }
                Some(Placed { solid: solid?, pose: pose_of(origin) })
            };
            let visual =
                link.visual.iter().filter_map(|v| solids(&v.origin, &v.geometry)).collect();
            let collision =
                link.collision.iter().filter_map(|c| solids(&c.origin, &c.geometry)).collect();
            self.links.push(Link {
                name: link.name.clone(),
                parent: step.parent,
                joint,
                inertial: inertial_of(&link.inertial, &link.name)?,
                visual: merge_capsules(visual),
                collision: merge_capsules(collision),
            });
        }
        Ok(())
    }

    /// Says for every moving joint whether `q` or the opening drives it.
    fn drive_joints(
        &mut self,
        urdf: &urdf_rs::Robot,
        order: &[tree::Step],
        jaws: &[bool],
    ) -> Result<(), Error> {
        let mut on_path = vec![false; order.len()];
        for &link in &self.path {
            on_path[link] = true;
        }
        // Masters on the path first: they are the entries of q, base first.
        for (link, step) in order.iter().enumerate() {
            let Some(joint) = step.joint.map(|at| &urdf.joints[at]) else { continue };
            let moves = self.links[link].joint.motion != Motion::Fixed;
            if !moves || !on_path[link] || jaws[link] || joint.mimic.is_some() {
                continue;
            }
            let index = self.joints.len();
            let limit = &joint.limit;
            let continuous = joint.joint_type == urdf_rs::JointType::Continuous;
            let (mut lower, mut upper) = self.links[link].joint.range;
            if lower >= upper {
                // The format's default is 0 to 0; a joint that may not move would be fixed.
                (lower, upper) = (f64::NEG_INFINITY, f64::INFINITY);
                self.notes.push(format!("joint {} has no position limits", joint.name));
            }
            let velocity = if limit.velocity > 0.0 { limit.velocity } else { f64::INFINITY };
            if velocity.is_infinite() {
                self.notes
                    .push(format!("joint {} has no speed limit; 1 rad/s is used", joint.name));
            }
            let velocity = if velocity.is_finite() { velocity } else { 1.0 };
            let acceleration = if limit.acceleration.is_finite() && limit.acceleration > 0.0 {
                limit.acceleration
            } else {
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
                effort: if limit.effort > 0.0 { limit.effort } else { f64::INFINITY },
            });
            self.links[link].joint.drive = Drive::Joint { index, multiplier: 1.0, offset: 0.0 };
        }
        if self.joints.is_empty() {
            return Err(Error::NoJoints { tip: self.links[self.tip].name.clone() });
        }
        // Followers of an entry of q move with it; everything else that moves is the gripper's.
        let slides = (0..order.len())
            .filter(|&link| {
                self.links[link].joint.motion == Motion::Slide
                    && self.links[link].joint.drive == Drive::None
            })
            .count();
        for (link, step) in order.iter().enumerate() {
            let Some(joint) = step.joint.map(|at| &urdf.joints[at]) else { continue };
            if self.links[link].joint.motion == Motion::Fixed
                || self.links[link].joint.drive != Drive::None
            {
                continue;
            }
            let (multiplier, offset) = joint
                .mimic
                .as_ref()
                .map_or((1.0, 0.0), |m| (m.multiplier.unwrap_or(1.0), m.offset.unwrap_or(0.0)));
            let master = joint.mimic.as_ref().map(|mimic| mimic.joint.as_str());
            let index = master.and_then(|name| self.joints.iter().position(|j| j.name == name));
            if let (Some(name), None) = (master, index)
                && !urdf.joints.iter().any(|other| other.name == name)
            {
                let what = format!("joint {} mimics {name}, which does not exist", joint.name);
                return Err(Error::Urdf { what });
            }
            self.links[link].joint.drive = match index {
                Some(index) => Drive::Joint { index, multiplier, offset },
                // Each of two jaws goes half the opening; a jaw that turns is not modelled.
                None if self.links[link].joint.motion == Motion::Slide => {
                    let share = multiplier / slides as f64;
                    let travel = self.links[link].joint.range.1;
                    let fits = if share > 0.0 { travel / share } else { f64::INFINITY };
                    self.max_opening =
                        if self.max_opening > 0.0 { self.max_opening.min(fits) } else { fits };
                    Drive::Jaw { multiplier: share, offset }
                }
                None => {
                    self.notes.push(format!(
                        "joint {} is not on the way to the tip; it stays put",
                        joint.name
                    ));
                    Drive::Jaw { multiplier: 0.0, offset: 0.0 }
                }
            };
        }
        Ok(())
    }

    /// Returns the robot's name in its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the links, parents before their children; index 0 is the root.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Returns the limits of each entry of `q`.
    pub fn joints(&self) -> &[JointLimits] {
        &self.joints
    }

    /// Returns the number of entries of `q`.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Returns the index of the tip link.
    pub fn tip(&self) -> usize {
        self.tip
    }

    /// Returns the index of the tool link, if the side file names one.
    pub fn tool(&self) -> Option<usize> {
        self.tool
    }

    /// Returns the index of the link of that name.
    ///
    /// # Errors
    ///
    /// [`Error::NoLink`].
    pub fn link(&self, name: &str) -> Result<usize, Error> {
        self.links.iter().position(|link| link.name == name).ok_or_else(|| Error::NoLink {
            name: name.into(),
            known: self.links.iter().map(|link| link.name.clone()).collect(),
        })
    }

    /// Returns a pose the side file names (`home`, `retract`, `zero`), rad.
    ///
    /// # Errors
    ///
    /// [`Error::NoPose`].
    pub fn pose(&self, name: &str) -> Result<&[f64], Error> {
        self.poses.get(name).map(Vec::as_slice).ok_or_else(|| Error::NoPose {
            name: name.into(),
            known: self.poses.keys().cloned().collect(),
        })
    }

    /// Returns the named poses, rad.
    pub fn poses(&self) -> &BTreeMap<String, Vec<f64>> {
        &self.poses
    }

    /// Returns the widest opening between the jaws, m; 0 without jaws.
    pub fn max_opening(&self) -> f64 {
        self.max_opening
    }

    /// Returns pairs of links that need no collision check, besides parents and children.
    pub fn unchecked(&self) -> &[(usize, usize)] {
        &self.unchecked
    }

    /// Returns whether a side file said which pairs need no check.
    pub fn has_side_file(&self) -> bool {
        self.has_side_file
    }

    /// Returns what was left out or assumed when the file was read, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Checks that `q` has one finite entry per joint.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn check(&self, q: &[f64]) -> Result<(), Error> {
        if q.len() != self.n_joints() {
            return Err(Error::WrongLength { expected: self.n_joints(), found: q.len() });
        }
        match q.iter().position(|x| !x.is_finite()) {
            Some(index) => Err(Error::NotFinite { joint: self.joints[index].name.clone() }),
            None => Ok(()),
        }
    }

    /// Returns the first joint that is more than `slack` outside its range, if any.
    pub fn outside_limits(&self, q: &[f64], slack: f64) -> Option<usize> {
        (0..self.n_joints())
            .find(|&i| q[i] < self.joints[i].lower - slack || q[i] > self.joints[i].upper + slack)
    }
}

fn pose_of(pose: &urdf_rs::Pose) -> Isometry3<f64> {
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
            return Err(Error::Urdf {
                what: format!(
                    "joint {} is {:?}; only fixed, revolute, continuous and prismatic joints are known",
                    joint.name, joint.joint_type
                ),
            });
        }
    };
    let axis = Vector3::from(joint.axis.xyz.0);
    let axis = if motion == Motion::Fixed {
        Vector3::z_axis()
    } else {
        Unit::try_new(axis, 1e-9)
            .ok_or_else(|| Error::Urdf { what: format!("joint {} has no axis", joint.name) })?
    };
    let range = match joint.joint_type {
        T::Revolute | T::Prismatic => (joint.limit.lower, joint.limit.upper),
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    };
    if range.0.is_nan() || range.1.is_nan() || range.0 > range.1 {
        let what = format!(
            "joint {}: its lower limit {} is above its upper {}",
            joint.name, range.0, range.1
        );
        return Err(Error::Urdf { what });
    }
    let parent_from_link = pose_of(&joint.origin);
    if !parent_from_link.translation.vector.iter().all(|x| x.is_finite())
        || !parent_from_link.rotation.coords.iter().all(|x| x.is_finite())
    {
        return Err(Error::Urdf {
            what: format!("joint {}: its origin is not finite", joint.name),
        });
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

fn inertial_of(inertial: &urdf_rs::Inertial, link: &str) -> Result<Option<Inertial>, Error> {
    let mass = inertial.mass.value;
    if !mass.is_finite() || mass < 0.0 {
        return Err(Error::Urdf { what: format!("link {link}: its mass is {mass} kg") });
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
    let frame = pose_of(&inertial.origin);
    let turn = frame.rotation.to_rotation_matrix();
    let inertia = turn.matrix() * about_com * turn.matrix().transpose();
    Ok(Some(Inertial { mass, com: frame.translation.vector, inertia }))
}
