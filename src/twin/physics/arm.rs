//! The arm as the physics needs it: bodies with inertia and shapes, joined in a tree, read from a URDF.
//!
//! Links that fixed joints weld together become one [`Body`]. Joints with a `mimic`, and the joint they
//! follow, are jaws; every other moving joint belongs to the arm, in the order of the file. Nothing here
//! names the physics engine. Errors of a real arm that are geometry (zero offsets, a bent link) are
//! made by changing the joint origins of the model.
//!
//! Source: the URDF specification (origins are `Rz(yaw) Ry(pitch) Rx(roll)`; inertia about the centre
//! of mass).

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use super::super::Error;

/// Mass, centre of mass and rotational inertia of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m, in the body's frame.
    pub com: Vector3<f64>,
    /// Rotational inertia about the centre of mass, kg·m², axes of the body's frame.
    pub about_com: Matrix3<f64>,
}

impl Inertia {
    /// Returns the inertia of nothing.
    pub fn zero() -> Self {
        Self { mass: 0.0, com: Vector3::zeros(), about_com: Matrix3::zeros() }
    }

    /// Returns this inertia as seen from a frame in which the body's frame stands at `pose`.
    #[must_use]
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            com: pose.rotation * self.com + pose.translation.vector,
            about_com: r.matrix() * self.about_com * r.matrix().transpose(),
        }
    }

    /// Returns the inertia of two bodies welded together, both given in the same frame.
    ///
    /// Source: parallel axis theorem.
    #[must_use]
    pub fn welded(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self::zero();
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let shifted = |part: &Self| {
            let d = part.com - com;
            part.about_com
                + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass
        };
        Self { mass, com, about_com: shifted(self) + shifted(other) }
    }
}

/// A solid that can be touched, centred on its own pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solid {
    /// Half edge lengths, m.
    Box(Vector3<f64>),
    /// About z: radius and half height, m.
    Cylinder(f64, f64),
    /// A cylinder about z with half balls at its ends: radius and half height of the cylinder, m.
    Capsule(f64, f64),
    /// Radius, m.
    Ball(f64),
}

/// A link of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkModel {
    /// Its name.
    pub name: String,
    /// Its inertia, zero for frames without a body.
    pub inertia: Inertia,
    /// What can be touched, each with its pose in the link's frame.
    pub shapes: Vec<(Isometry3<f64>, Solid)>,
}

/// What a joint lets move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Nothing.
    Fixed,
    /// A turn about the axis, rad.
    Revolute,
    /// A shift along the axis, m.
    Prismatic,
}

/// A joint of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct JointModel {
    /// Its name.
    pub name: String,
    /// Index of the link nearer the base.
    pub parent: usize,
    /// Index of the link it carries.
    pub child: usize,
    /// Pose of the child in the parent at joint coordinate 0.
    pub origin: Isometry3<f64>,
    /// Axis in the child's frame.
    pub axis: Unit<Vector3<f64>>,
    /// What it lets move.
    pub kind: JointKind,
    /// Lowest and highest coordinate, rad or m; infinite when the joint turns on and on.
    pub limits: [f64; 2],
    /// Largest torque or force, N·m or N.
    pub effort: f64,
    /// Largest speed, rad/s or m/s.
    pub velocity: f64,
    /// The joint it follows, with factor and offset.
    pub mimic: Option<(usize, f64, f64)>,
}

impl JointModel {
    /// Returns the pose of the child in the parent at coordinate `q`, rad or m.
    pub fn parent_from_child(&self, q: f64) -> Isometry3<f64> {
        match self.kind {
            JointKind::Fixed => self.origin,
            JointKind::Revolute => self.origin * UnitQuaternion::from_axis_angle(&self.axis, q),
            JointKind::Prismatic => self.origin * Translation3::from(self.axis.into_inner() * q),
        }
    }
}

/// A robot arm with a parallel gripper.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmModel {
    /// Links in the order of the file.
    pub links: Vec<LinkModel>,
    /// Joints, each after the one that carries it.
    pub joints: Vec<JointModel>,
    /// The arm's joints, base first, as indices into `joints`.
    pub arm: Vec<usize>,
    /// The jaws' joints, the leading one first, as indices into `joints`.
    pub jaws: Vec<usize>,
    /// Index of the link that carries everything.
    pub base: usize,
    /// Index of the tool centre point's link.
    pub tool: usize,
}

impl ArmModel {
    /// Reads the text of a URDF; `tool` names the link at the tool centre point (`tool_frame`).
    ///
    /// # Errors
    ///
    /// [`Error::Robot`] when the text is no URDF, or describes no tree the physics can carry.
    pub fn from_urdf_text(text: &str, tool: &str) -> Result<Self, Error> {
        let robot = urdf_rs::read_from_string(text)
            .map_err(|error| Error::Robot(format!("the robot file cannot be read: {error}")))?;
        Self::from_urdf(&robot, tool)
    }

    /// Takes over a parsed URDF; `tool` names the link at the tool centre point.
    ///
    /// # Errors
    ///
    /// [`Error::Robot`] as in [`Self::from_urdf_text`].
    pub fn from_urdf(robot: &urdf_rs::Robot, tool: &str) -> Result<Self, Error> {
        let links = robot.links.iter().map(link).collect::<Result<Vec<_>, _>>()?;
        let find = |name: &str| {
            links
                .iter()
                .position(|link| link.name == name)
                .ok_or_else(|| Error::Robot(format!("no link is named `{name}`")))
        };
        let mut files = Vec::new();
        for joint in &robot.joints {
            files.push((joint, find(&joint.parent.link)?, find(&joint.child.link)?));
        }
        let is_child = |link: usize| files.iter().any(|&(_, _, child)| child == link);
        let roots: Vec<usize> = (0..links.len()).filter(|&i| !is_child(i)).collect();
        let &[base] = roots.as_slice() else {
            return Err(Error::Robot(format!("{} links have no parent; one should", roots.len())));
        };

        // Sort the joints so that what carries comes before what is carried.
        let (mut reached, mut sorted) = (vec![base], Vec::new());
        while sorted.len() < files.len() {
            let next = files.iter().filter(|f| reached.contains(&f.1) && !reached.contains(&f.2));
            let next: Vec<_> = next.copied().collect();
            if next.is_empty() {
                return Err(Error::Robot("the joints do not form a tree".into()));
            }
            reached.extend(next.iter().map(|f| f.2));
            sorted.extend(next);
        }
        let names: Vec<&str> = sorted.iter().map(|(joint, ..)| joint.name.as_str()).collect();
        let joints = sorted
            .iter()
            .map(|&(file, parent, child)| joint(file, parent, child, &names))
            .collect::<Result<Vec<_>, _>>()?;

        let moving = |i: &usize| joints[*i].kind != JointKind::Fixed;
        let leads = |i: usize| joints.iter().any(|j| j.mimic.is_some_and(|(lead, ..)| lead == i));
        let follows = |i: usize| joints[i].mimic.is_some();
        let all: Vec<usize> = (0..joints.len()).filter(moving).collect();
        let arm = all.iter().copied().filter(|&i| !leads(i) && !follows(i)).collect();
        let mut jaws: Vec<usize> = all.iter().copied().filter(|&i| leads(i)).collect();
        jaws.extend(all.iter().copied().filter(|&i| follows(i)));
        if jaws.len() != 2 || jaws.iter().any(|&i| joints[i].kind != JointKind::Prismatic) {
            return Err(Error::Robot("the gripper is not a pair of coupled sliding jaws".into()));
        }
        let tool = find(tool)?;
        Ok(Self { links, joints, arm, jaws, base, tool })
    }

    /// Returns the names of the links the jaws carry, the leading one first.
    pub fn jaw_links(&self) -> impl Iterator<Item = &str> {
        self.jaws.iter().map(|&joint| self.links[self.joints[joint].child].name.as_str())
    }

    /// Turns each arm joint's zero by `offsets` rad: at coordinate 0 the joint stands at its offset.
    pub fn shift_zeros(&mut self, offsets: &[f64]) {
        for (&i, &offset) in self.arm.iter().zip(offsets) {
            self.joints[i].origin = self.joints[i].parent_from_child(offset);
        }
    }

    /// Returns the poses of all links in the base at the given arm angles, rad, and opening, m.
    pub fn base_from_links(&self, q: &[f64], opening: f64) -> Vec<Isometry3<f64>> {
        let mut coordinates = vec![0.0; self.joints.len()];
        for (&i, &angle) in self.arm.iter().zip(q) {
            coordinates[i] = angle;
        }
        for &i in &self.jaws {
            coordinates[i] = opening / 2.0;
        }
        let mut poses = vec![Isometry3::identity(); self.links.len()];
        for (joint, &coordinate) in self.joints.iter().zip(&coordinates) {
            poses[joint.child] = poses[joint.parent] * joint.parent_from_child(coordinate);
        }
        poses
    }
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let ([x, y, z], [roll, pitch, yaw]) = (pose.xyz.0, pose.rpy.0);
    let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}

fn link(file: &urdf_rs::Link) -> Result<LinkModel, Error> {
    let i = &file.inertial.inertia;
    let matrix = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let inertia =
        Inertia { mass: file.inertial.mass.value, com: Vector3::zeros(), about_com: matrix };
    let mut shapes = Vec::new();
    for collision in &file.collision {
        let solid = match collision.geometry {
            urdf_rs::Geometry::Box { size } => Solid::Box(Vector3::from(size.0) / 2.0),
            urdf_rs::Geometry::Cylinder { radius, length } => Solid::Cylinder(radius, length / 2.0),
            urdf_rs::Geometry::Capsule { radius, length } => Solid::Capsule(radius, length / 2.0),
            urdf_rs::Geometry::Sphere { radius } => Solid::Ball(radius),
            urdf_rs::Geometry::Mesh { ref filename, .. } => {
                return Err(Error::Robot(format!(
                    "link `{}` collides with the mesh {filename}; boxes, cylinders and spheres are known",
                    file.name
                )));
            }
        };
        shapes.push((isometry(&collision.origin), solid));
    }
    Ok(LinkModel {
        name: file.name.clone(),
        inertia: inertia.seen_from(&isometry(&file.inertial.origin)),
        shapes: join_capsules(shapes),
    })
}

/// Replaces each cylinder with equal balls at both ends by the capsule they make: one shape in place
/// of three, without seams. URDF has no capsule, so files write them this way.
fn join_capsules(mut shapes: Vec<(Isometry3<f64>, Solid)>) -> Vec<(Isometry3<f64>, Solid)> {
    let mut joined = Vec::new();
    while let Some(at) = shapes.iter().position(|(_, solid)| matches!(solid, Solid::Cylinder(..))) {
        let (pose, solid) = shapes.remove(at);
        let Solid::Cylinder(radius, half) = solid else { continue };
        let ball_at = |shapes: &[(Isometry3<f64>, Solid)], z: f64| {
            let end = pose * nalgebra::Point3::new(0.0, 0.0, z);
            shapes.iter().position(|(p, s)| {
                let near = (p.translation.vector - end.coords).norm() < 0.05 * radius;
                near && matches!(s, Solid::Ball(r) if (r - radius).abs() < 1e-6)
            })
        };
        let ends = (ball_at(&shapes, half), ball_at(&shapes, -half));
        if let (Some(a), Some(b)) = ends {
            shapes.remove(a.max(b));
            shapes.remove(a.min(b));
            joined.push((pose, Solid::Capsule(radius, half)));
        } else {
            joined.push((pose, solid));
        }
    }
    joined.extend(shapes);
    joined
}

fn joint(
    file: &urdf_rs::Joint,
    parent: usize,
    child: usize,
    names: &[&str],
) -> Result<JointModel, Error> {
    use urdf_rs::JointType;
    let kind = match file.joint_type {
        JointType::Fixed => JointKind::Fixed,
        JointType::Revolute | JointType::Continuous => JointKind::Revolute,
        JointType::Prismatic => JointKind::Prismatic,
        ref other => {
            return Err(Error::Robot(format!(
                "joint `{}` is {other:?}; fixed, revolute, continuous and prismatic are known",
                file.name
            )));
        }
    };
    let limits = if file.joint_type == JointType::Continuous {
        [f64::NEG_INFINITY, f64::INFINITY]
    } else {
        [file.limit.lower, file.limit.upper]
    };
    let axis = Unit::try_new(Vector3::from(file.axis.xyz.0), 1e-9)
        .ok_or_else(|| Error::Robot(format!("joint `{}` has no axis", file.name)))?;
    let mimic = match &file.mimic {
        None => None,
        Some(mimic) => {
            let lead = names.iter().position(|name| *name == mimic.joint).ok_or_else(|| {
                Error::Robot(format!("joint `{}` follows no joint `{}`", file.name, mimic.joint))
            })?;
            Some((lead, mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0)))
        }
    };
    Ok(JointModel {
        name: file.name.clone(),
        parent,
        child,
        origin: isometry(&file.origin),
        axis,
        kind,
        limits,
        effort: file.limit.effort,
        velocity: file.limit.velocity,
        mimic,
    })
}
