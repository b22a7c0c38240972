//! The rigid bodies of an arm, laid out for speed: inverse dynamics, mass matrix, tip.
//!
//! A gap is judged by simulating an arm hundreds of times, so what [`crate::motion::dynamics`] does for
//! any tree is done here for one chain, in link coordinates and without storage on the heap. Links that
//! do not move against each other are one body; the gripper's jaws count as closed. A test holds it
//! against the general algorithms.
//!
//! Source: Luh, Walker and Paul 1980 (recursive Newton-Euler in link coordinates); Siciliano et al.,
//! *Robotics*, 2009, §7.5.

use nalgebra::{Isometry3, Matrix3, Point3, Unit, UnitQuaternion, Vector3};

use super::error::Misfit;
use crate::motion::robot::{Drive, Motion};
use crate::motion::{Inertial, Robot};
use crate::world::frame::{times, turned_back};

/// Most joints an arm may have here.
pub const MOST_JOINTS: usize = 12;

/// An arm lifts less than this many times what its moving links weigh; the strongest lift about as much as they weigh.
const LIFTS: f64 = 2.0;

/// One moving body with the joint that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Carries points of the body into its parent when the joint is at 0.
    pub parent_from_body: Isometry3<f64>,
    /// The same turn as a matrix.
    turn: Matrix3<f64>,
    /// About or along what the joint moves, body frame.
    pub axis: Unit<Vector3<f64>>,
    /// Whether it slides.
    pub slides: bool,
    /// Mass, kg.
    pub mass: f64,
    /// Mass times centre of mass, kg·m, body frame.
    pub moment: Vector3<f64>,
    /// Inertia about the body frame's origin, kg·m².
    pub inertia: Matrix3<f64>,
    /// The link that gives the body its name.
    pub name: String,
}

/// An arm as a chain of bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The bodies, base first.
    pub bodies: Vec<Body>,
    /// The tip in the last body's frame.
    pub body_from_tip: Isometry3<f64>,
    /// Gravity in base axes, m/s².
    pub gravity: Vector3<f64>,
}

/// A mass at a point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass {
    /// Which body.
    pub body: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Mass times position in the body's frame, kg·m.
    pub moment: Vector3<f64>,
}

/// Where each body of a chain is in its parent, at some joint positions.
#[derive(Debug, Clone)]
pub struct Placed {
    turn: [Matrix3<f64>; MOST_JOINTS],
    place: [Vector3<f64>; MOST_JOINTS],
}

/// How each body of a chain moves, in its own frame: turning, its change, and the acceleration of the origin against a falling one.
#[derive(Debug, Clone)]
pub struct Moved {
    placed: Placed,
    w: [Vector3<f64>; MOST_JOINTS],
    dw: [Vector3<f64>; MOST_JOINTS],
    a: [Vector3<f64>; MOST_JOINTS],
}

/// What a body weighs more than another: mass (kg), mass times its middle (kg·m) and inertia about the frame's origin (kg·m²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    mass: f64,
    moment: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl Excess {
    /// Returns what `body` weighs more than `other`.
    pub fn of(body: &Body, other: &Body) -> Self {
        Self {
            mass: body.mass - other.mass,
            moment: body.moment - other.moment,
            inertia: body.inertia - other.inertia,
        }
    }
}

/// Returns the force and the couple about its origin that it takes to move something as body `i` moves, in its frame.
fn borne(
    moved: &Moved,
    i: usize,
    (mass, moment, inertia): (f64, &Vector3<f64>, &Matrix3<f64>),
) -> (Vector3<f64>, Vector3<f64>) {
    let (w, dw, a) = (&moved.w[i], &moved.dw[i], &moved.a[i]);
    let force = mass * a + dw.cross(moment) + w.cross(&w.cross(moment));
    let couple = times(inertia, dw) + w.cross(&times(inertia, w)) + moment.cross(a);
    (force, couple)
}

/// Returns moment and inertia about its origin of something with a mass, carried from a body's frame into that of its parent.
fn seen_from_parent(
    turn: &Matrix3<f64>,
    place: &Vector3<f64>,
    mass: f64,
    moment: &Vector3<f64>,
    inertia: &Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let turned = times(turn, moment);
    let mut here = turn * inertia * turn.transpose();
    let round = 2.0 * place.dot(&turned) + mass * place.norm_squared();
    for r in 0..3 {
        for c in 0..3 {
            here[(r, c)] -=
                place[r] * turned[c] + turned[r] * place[c] + mass * place[r] * place[c];
        }
        here[(r, r)] += round;
    }
    (turned + mass * place, here)
}

impl Chain {
    /// Lays out a robot; `tip` is the link whose position is recorded, the robot's own tip if `None`.
    /// Everything the arm carries counts, the gripper included. `gravity` is in m/s², in the base's axes.
    ///
    /// # Errors
    ///
    /// A [`Misfit`] for a robot with more than [`MOST_JOINTS`] joints, with a joint that follows another,
    /// or without the link.
    pub fn new(robot: &Robot, tip: Option<&str>, gravity: Vector3<f64>) -> Result<Self, Misfit> {
        let n = robot.n_joints();
        if n > MOST_JOINTS {
            return Err(Misfit::TooManyJoints { n, most: MOST_JOINTS });
        }
        let tip = match tip {
            Some(name) => robot.link(name).map_err(Misfit::NoTip)?,
            None => robot.tip(),
        };
        // For each link: the body it belongs to (none for the base) and its pose in that body.
        let mut place: Vec<(Option<usize>, Isometry3<f64>)> = Vec::new();
        let mut bodies: Vec<Body> = Vec::with_capacity(n);
        let zero = vec![0.0; n];
        for link in robot.links() {
            let Some(parent) = link.parent else {
                place.push((None, Isometry3::identity()));
                continue;
            };
            let (body, body_from_parent) = place[parent];
            let joint = &link.joint;
            let here = match joint.drive {
                Drive::Joint { index, multiplier, offset } => {
                    let alone = (multiplier - 1.0).abs() < 1e-12 && offset.abs() < 1e-12;
                    let in_order = index == bodies.len() && body == index.checked_sub(1);
                    if !alone || !in_order {
                        return Err(Misfit::NoChain { joint: joint.name.clone() });
                    }
                    let parent_from_body = body_from_parent * joint.parent_from_link(0.0);
                    bodies.push(Body {
                        parent_from_body,
                        turn: parent_from_body.rotation.to_rotation_matrix().into_inner(),
                        axis: joint.axis,
                        slides: joint.motion == Motion::Slide,
                        mass: 0.0,
                        moment: Vector3::zeros(),
                        inertia: Matrix3::zeros(),
                        name: link.name.clone(),
                    });
                    (Some(index), Isometry3::identity())
                }
                Drive::None | Drive::Jaw { .. } | Drive::Knuckle { .. } => {
                    let step = joint.parent_from_link(joint.value(&zero, 0.0));
                    (body, body_from_parent * step)
                }
            };
            place.push(here);
            if let (Some(inertial), (Some(body), body_from_link)) = (link.inertial, here) {
                bodies[body].add(&inertial.seen_from(&body_from_link));
            }
        }
        let body_from_tip = match place[tip] {
            (Some(body), pose) if body + 1 == n => pose,
            _ => return Err(Misfit::TipElsewhere),
        };
        Ok(Self { bodies, body_from_tip, gravity })
    }

    /// Returns the number of joints.
    pub fn n(&self) -> usize {
        self.bodies.len()
    }

    /// Returns whether a joint slides; what is not there does not.
    pub fn slides(&self, joint: usize) -> bool {
        self.bodies.get(joint).is_some_and(|body| body.slides)
    }

    /// Returns [`Self::slides`] of each joint.
    pub fn sliding(&self) -> Vec<bool> {
        self.bodies.iter().map(|body| body.slides).collect()
    }

    /// Returns how far the tip is from the base at most, m.
    pub fn reach(&self) -> f64 {
        let joints = self.bodies.iter().map(|body| body.parent_from_body.translation.vector.norm());
        joints.sum::<f64>() + self.body_from_tip.translation.vector.norm()
    }

    /// Returns whether a mass (kg) with this moment (mass times position in the tip's frame, kg·m) can be borne
    /// there: it does not weigh several times what the arm does, and its middle is no further off than the arm is long. A
    /// moment without a mass to it is something else.
    pub fn bears(&self, mass: f64, moment: &[f64]) -> bool {
        let own: f64 = self.bodies.iter().map(|body| body.mass).sum();
        // A file without masses says nothing of what the arm could lift.
        let lifts = own <= 0.0 || mass <= LIFTS * own;
        let moment = moment.iter().map(|part| part * part).sum::<f64>().sqrt();
        lifts && moment <= mass.abs() * self.reach()
    }

    /// Adds a mass at a point.
    pub fn add_point(&mut self, point: &PointMass) {
        let body = &mut self.bodies[point.body];
        if point.mass.abs() > 1e-12 {
            let com = point.moment / point.mass;
            let inertia = Matrix3::zeros();
            body.add(&Inertial { mass: point.mass, com, inertia });
        } else {
            body.moment += point.moment;
        }
    }

    /// Writes the torques that give `ddq` at `q`, `dq` (rad, rad/s, rad/s², N·m).
    pub fn inverse(&self, q: &[f64], dq: &[f64], ddq: &[f64], tau: &mut [f64]) {
        self.inverse_under(&self.gravity, q, dq, ddq, tau);
    }

    /// As [`Self::inverse`], with another gravity (m/s², base axes).
    pub fn inverse_under(
        &self,
        gravity: &Vector3<f64>,
        q: &[f64],
        dq: &[f64],
        ddq: &[f64],
        tau: &mut [f64],
    ) {
        self.inverse_placed(&self.placed(q), gravity, dq, ddq, tau);
    }

    /// As [`Self::inverse_under`], with the bodies placed already ([`Self::placed`]).
    pub fn inverse_placed(
        &self,
        placed: &Placed,
        gravity: &Vector3<f64>,
        dq: &[f64],
        ddq: &[f64],
        tau: &mut [f64],
    ) {
        let n = self.n();
        let moved = self.moved(placed, gravity, dq, ddq);
        let Placed { turn, place } = placed;
        let (mut force, mut couple) = (Vector3::zeros(), Vector3::zeros());
        for i in (0..n).rev() {
            let body = &self.bodies[i];
            let own = borne(&moved, i, (body.mass, &body.moment, &body.inertia));
            force += own.0;
            couple += own.1;
            let axis = body.axis.into_inner();
            tau[i] = if body.slides { axis.dot(&force) } else { axis.dot(&couple) };
            force = times(&turn[i], &force);
            couple = times(&turn[i], &couple) + place[i].cross(&force);
        }
    }

    /// Writes the torques that it takes more when body `body` weighs more by `excess`; those of joints behind it are 0.
    pub fn inverse_of(&self, moved: &Moved, body: usize, excess: &Excess, tau: &mut [f64]) {
        tau.fill(0.0);
        let Placed { turn, place } = &moved.placed;
        let of = (excess.mass, &excess.moment, &excess.inertia);
        let (mut force, mut couple) = borne(moved, body, of);
        for i in (0..=body).rev() {
            let axis = self.bodies[i].axis.into_inner();
            tau[i] = if self.bodies[i].slides { axis.dot(&force) } else { axis.dot(&couple) };
            force = times(&turn[i], &force);
            couple = times(&turn[i], &couple) + place[i].cross(&force);
        }
    }

    /// Returns how the bodies move under a gravity (m/s², base axes).
    pub fn moved(&self, placed: &Placed, gravity: &Vector3<f64>, dq: &[f64], ddq: &[f64]) -> Moved {
        let none = [Vector3::zeros(); MOST_JOINTS];
        let mut moved = Moved { placed: placed.clone(), w: none, dw: none, a: none };
        let (mut w, mut dw) = (Vector3::zeros(), Vector3::zeros());
        // The base accelerates upwards in place of gravity pulling every body down.
        let mut a = -gravity;
        for (i, body) in self.bodies.iter().enumerate() {
            let (turn, p) = (&placed.turn[i], &placed.place[i]);
            let carried = a + dw.cross(p) + w.cross(&w.cross(p));
            a = turned_back(turn, &carried);
            let axis = body.axis.into_inner();
            let w_parent = turned_back(turn, &w);
            dw = turned_back(turn, &dw);
            if body.slides {
                w = w_parent;
                a += 2.0 * w.cross(&(axis * dq[i])) + axis * ddq[i];
            } else {
                dw += w_parent.cross(&(axis * dq[i])) + axis * ddq[i];
                w = w_parent + axis * dq[i];
            }
            (moved.w[i], moved.dw[i], moved.a[i]) = (w, dw, a);
        }
        moved
    }

    /// Writes the mass matrix at `q`, row by row, n × n.
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §6.2: bodies joined from the tip inwards.
    pub fn mass_matrix(&self, q: &[f64], m: &mut [f64]) {
        let n = self.n();
        let Placed { turn, place } = self.placed(q);
        // All that joint `j` moves, in the frame of body `j`.
        let (mut mass, mut moment, mut inertia) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for j in (0..n).rev() {
            let body = &self.bodies[j];
            mass += body.mass;
            moment += body.moment;
            inertia += body.inertia;
            let axis = body.axis.into_inner();
            let (mut force, mut couple) = if body.slides {
                (mass * axis, moment.cross(&axis))
            } else {
                (axis.cross(&moment), times(&inertia, &axis))
            };
            for i in (0..=j).rev() {
                let along = &self.bodies[i].axis;
                let share =
                    if self.bodies[i].slides { along.dot(&force) } else { along.dot(&couple) };
                (m[i * n + j], m[j * n + i]) = (share, share);
                force = times(&turn[i], &force);
                couple = times(&turn[i], &couple) + place[i].cross(&force);
            }
            (moment, inertia) = seen_from_parent(&turn[j], &place[j], mass, &moment, &inertia);
        }
    }

    /// Turns or slides joint `i` of placed bodies to `value`, rad or m.
    pub fn place(&self, placed: &mut Placed, i: usize, value: f64) {
        (placed.turn[i], placed.place[i]) = self.bodies[i].pose(value);
    }

    /// Returns where each body is in its parent at `q`.
    pub fn placed(&self, q: &[f64]) -> Placed {
        let mut placed = Placed {
            turn: [Matrix3::zeros(); MOST_JOINTS],
            place: [Vector3::zeros(); MOST_JOINTS],
        };
        for (i, value) in q.iter().enumerate().take(self.n()) {
            self.place(&mut placed, i, *value);
        }
        placed
    }

    /// Returns the poses of the bodies in the base, base first.
    pub fn poses(&self, q: &[f64]) -> [Isometry3<f64>; MOST_JOINTS] {
        let mut poses = [Isometry3::identity(); MOST_JOINTS];
        let mut base_from_body = Isometry3::identity();
        for (i, body) in self.bodies.iter().enumerate() {
            base_from_body *= body.parent_from_body;
            if body.slides {
                base_from_body *= nalgebra::Translation3::from(body.axis.into_inner() * q[i]);
            } else {
                base_from_body *= UnitQuaternion::from_axis_angle(&body.axis, q[i]);
            }
            poses[i] = base_from_body;
        }
        poses
    }

    /// Returns the tip's position in the base, m.
    pub fn tip(&self, q: &[f64]) -> Vector3<f64> {
        let mut point: Point3<f64> = self.body_from_tip.translation.vector.into();
        for (body, &angle) in self.bodies.iter().zip(q).rev() {
            let (turn, place) = body.pose(angle);
            point = (times(&turn, &point.coords) + place).into();
        }
        point.coords
    }
}

impl Body {
    /// Returns whether a file can be off by so much of its mass, kg: nothing weighs less than nothing, or four times what
    /// its maker says.
    pub fn may_gain(&self, mass: f64) -> bool {
        (-0.95 * self.mass..3.0 * self.mass).contains(&mass)
    }

    /// Sets the body elsewhere in its parent.
    pub fn sit(&mut self, parent_from_body: Isometry3<f64>) {
        self.parent_from_body = parent_from_body;
        self.turn = parent_from_body.rotation.to_rotation_matrix().into_inner();
    }

    /// Returns the turn and place of the body in its parent.
    fn pose(&self, value: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let origin = self.parent_from_body.translation.vector;
        let axis = self.axis.into_inner();
        if self.slides {
            return (self.turn, origin + self.turn * axis * value);
        }
        // Rodrigues' formula, column by column: e cos + (axis × e) sin + axis (axis · e) (1 - cos).
        let (sin, cos) = value.sin_cos();
        let (x, y, z) = (axis.x, axis.y, axis.z);
        let part = axis * (1.0 - cos);
        let first = times(&self.turn, &(Vector3::new(cos, z * sin, -y * sin) + part * x));
        let second = times(&self.turn, &(Vector3::new(-z * sin, cos, x * sin) + part * y));
        let third = times(&self.turn, &(Vector3::new(y * sin, -x * sin, cos) + part * z));
        let turn = Matrix3::new(
            first.x, second.x, third.x, first.y, second.y, third.y, first.z, second.z, third.z,
        );
        (turn, origin)
    }

    /// Makes the body heavier by a part of what it is, its mass spread as it was.
    pub fn thicken(&mut self, part: f64) {
        self.mass *= 1.0 + part;
        self.moment *= 1.0 + part;
        self.inertia *= 1.0 + part;
    }

    /// Adds mass given in the body's frame.
    fn add(&mut self, inertial: &Inertial) {
        let c = inertial.com.cross_matrix();
        self.mass += inertial.mass;
        self.moment += inertial.mass * inertial.com;
        self.inertia += inertial.inertia - inertial.mass * c * c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::dynamics::{Bodies, Dynamics, GRAVITY};

    #[test]
    fn the_fast_chain_agrees_with_the_general_algorithms() {
        let robot = Robot::gen3();
        let chain = Chain::new(&robot, None, -GRAVITY * Vector3::z()).unwrap();
        let general = Dynamics::new(&robot, Bodies::All);
        let q = [0.5, -0.7, 1.1, 1.4, -0.9, 0.8, 0.3];
        let dq = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7];
        let ddq = [-1.0, 0.5, 0.2, 0.7, -0.3, 1.2, -0.8];
        let mut tau = [0.0; 7];
        chain.inverse(&q, &dq, &ddq, &mut tau);
        let expected = general.inverse(&q, &dq, &ddq).unwrap();
        for (i, tau) in tau.iter().enumerate() {
            assert!((tau - expected[i]).abs() < 1e-9, "{i}: {tau} {}", expected[i]);
        }
        let mut m = [0.0; 49];
        chain.mass_matrix(&q, &mut m);
        let expected = general.mass_matrix(&q).unwrap();
        for i in 0..7 {
            for j in 0..7 {
                assert!((m[i * 7 + j] - expected[(i, j)]).abs() < 1e-9);
            }
        }
        let tip = robot.forward(&q).unwrap().isometry().translation.vector;
        assert!((chain.tip(&q) - tip).norm() < 1e-12);
        let last = chain.poses(&q)[6] * chain.body_from_tip;
        assert!((last.translation.vector - tip).norm() < 1e-12);
    }

    #[test]
    fn a_mass_further_off_than_the_arm_is_long_or_far_heavier_is_none() {
        let chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        // The Gen3 is 0.9 m long from base to tip and has bodies beside its axis.
        assert!(chain.bears(0.5, &[0.0, 0.05, 0.1]) && chain.bears(-0.5, &[0.0, 0.0, 0.4]));
        assert!(!chain.bears(0.001, &[0.0, 0.0, 0.02]) && !chain.bears(0.0, &[1e-3, 0.0, 0.0]));
        assert!(chain.bears(5.0, &[0.0; 3]) && !chain.bears(190.0, &[0.0; 3]));
    }
}
