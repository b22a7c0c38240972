//! Inverse kinematics in closed form of arms whose axes meet or run parallel: every solution, by subproblems.
//!
//! Six joints are taken apart where
//! - the last three axes meet (a spherical wrist) and axes 2 and 3 are parallel or axes 1 and 2 meet, or
//! - axes 2, 3 and 4 are parallel and axes 5 and 6 meet (the arms of Universal Robots),
//!
//! from the base or, turned about, from the tip. Of seven joints one is held, joint 3 for an arm with a spherical shoulder
//! and a spherical wrist, joint 7 for the Panda; a caller goes through its values. What an arm is, is found from where
//! its axes lie, not by name. Axes need to meet and be parallel only nearly, as those of a calibrated arm do: solutions
//! are then starts, which [`super::polish`] brings to the last digits. The Gen3, of whose axes no three meet, has a
//! [form of its own](super::closed_form).
//!
//! Source: Elias and Wen, IK-Geo (see [`super::subproblem`]); Ostermeier, Külz and Althoff, "Automatic Geometric
//! Decomposition for Analytical Inverse Kinematics", RA-L 2025; for the Panda, He and Liu, "Analytical Inverse
//! Kinematics for Franka Emika Panda", ICMRE 2021.

use nalgebra::{Matrix3, Vector3};

use super::frames::Frame;
use super::robot::Robot;
use super::screws::Screws;
use super::subproblem::{About, onto, to_distance, to_height};

/// How far, m, axes that meet may miss each other: more than calibration finds on a machine.
const MEET: f64 = 3e-3;
/// The sine of the angle up to which axes are parallel.
const PARALLEL: f64 = 0.01;
/// The sine of the angle from which two axes cross: that of one degree.
const CROSS: f64 = 0.017;
/// Which of seven joints is held, in the order tried: joint 3 swings the elbow, joint 7 turns the hand.
const HELD: [usize; 7] = [2, 6, 4, 0, 3, 5, 1];
/// Angles of a held joint, rad, at which the others must come apart: any that are no special ones.
const ANYWHERE: [f64; 2] = [0.4, -1.3];

/// How an arm is taken apart.
#[derive(Debug, Clone)]
pub(super) struct Decomposition {
    screws: Screws,
    /// The joint that is held, of seven.
    held: Option<usize>,
    kind: Kind,
    /// Whether it is seen from the tip.
    is_reversed: bool,
    /// The joints that are worked out.
    pub(super) six: [usize; 6],
}

/// What of six axes meets or is parallel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The last three meet; 2 and 3 are parallel.
    Wrist,
    /// The last three meet; 1 and 2 do.
    WristAndShoulder,
    /// 2, 3 and 4 are parallel; 5 and 6 meet.
    Parallel,
}

/// Six axes, as the chain goes from one end.
#[derive(Debug, Clone, Copy)]
struct Chain {
    axes: [Vector3<f64>; 6],
    points: [Vector3<f64>; 6],
    tip: Frame,
}

/// A pose that is wanted: the turn of the tip since zero, and where the wrist is.
struct Wanted<'w> {
    turn: Matrix3<f64>,
    wrist: Vector3<f64>,
    near: &'w [f64; 6],
}

impl Decomposition {
    /// Returns how a robot is taken apart, if it can be.
    pub(super) fn of(robot: &Robot) -> Option<Self> {
        let screws = Screws::of(robot)?;
        let held: &[Option<usize>] = match screws.axes.len() {
            6 => &[None],
            7 => &HELD.map(Some),
            _ => return None,
        };
        held.iter().find_map(|&held| {
            let joints: Vec<usize> = (0..screws.axes.len()).filter(|&i| Some(i) != held).collect();
            let six: [usize; 6] = joints.try_into().ok()?;
            let (kind, is_reversed) = [false, true].into_iter().find_map(|is_reversed| {
                let kind = |angle| Chain::of(&screws, held, angle, is_reversed).kind();
                let first = kind(ANYWHERE[0])?;
                (kind(ANYWHERE[1]) == Some(first)).then_some((first, is_reversed))
            })?;
            Some(Self { screws: screws.clone(), held, kind, is_reversed, six })
        })
    }

    /// Returns the joint whose angle is to be given, of an arm with one to spare.
    pub(super) fn held(&self) -> Option<usize> {
        self.held
    }

    /// Hands every solution for the tip at `target` to `found`, up to eight, the held joint at `angle`, rad: exact as far
    /// as axes meet and are parallel. Limits are not looked at. Where a joint is free (a singular pose) it takes its
    /// value from `near`.
    pub(super) fn solve(
        &self,
        target: &Frame,
        angle: f64,
        near: &[f64],
        found: &mut dyn FnMut(Vec<f64>),
    ) {
        let chain = Chain::of(&self.screws, self.held, angle, self.is_reversed);
        let target = if self.is_reversed { target.inverse() } else { *target };
        let order = |k: usize| self.six[if self.is_reversed { 5 - k } else { k }];
        let near_of_six = std::array::from_fn(|k| near[order(k)]);
        let turn = matrix(&target) * matrix(&chain.tip).transpose();
        let at_zero = chain.wrist();
        let wrist = target.origin + turn * (at_zero - chain.tip.origin);
        let wanted = Wanted { turn, wrist, near: &near_of_six };
        let mut take = |six: [f64; 6]| {
            let mut q = near.to_vec();
            if let Some(held) = self.held {
                q[held] = angle;
            }
            for (k, value) in six.into_iter().enumerate() {
                q[order(k)] = value;
            }
            found(q);
        };
        match self.kind {
            Kind::Wrist | Kind::WristAndShoulder => {
                chain.with_wrist(self.kind, &at_zero, &wanted, &mut take);
            }
            Kind::Parallel => chain.with_parallels(&at_zero, &wanted, &mut take),
        }
    }
}

impl Chain {
    /// Returns the axes that are left when one joint is held at an angle, rad; seen from the tip if so wanted.
    fn of(screws: &Screws, held: Option<usize>, angle: f64, is_reversed: bool) -> Self {
        let (mut axes, mut points) = ([Vector3::zeros(); 6], [Vector3::zeros(); 6]);
        let turn =
            held.map(|held| (held, About::new(screws.axes[held], angle), screws.points[held]));
        let mut k = 0;
        for (i, (axis, point)) in screws.axes.iter().zip(&screws.points).enumerate() {
            (axes[k], points[k]) = match &turn {
                Some((held, _, _)) if i == *held => continue,
                Some((held, turn, at)) if i > *held => {
                    (turn.turn(axis), at + turn.turn(&(point - at)))
                }
                _ => (*axis, *point),
            };
            k += 1;
        }
        let mut tip = screws.tip;
        if let Some((_, turn, at)) = &turn {
            tip = Frame {
                x: turn.turn(&tip.x),
                y: turn.turn(&tip.y),
                z: turn.turn(&tip.z),
                origin: at + turn.turn(&(tip.origin - at)),
            };
        }
        let chain = Self { axes, points, tip };
        if is_reversed { chain.reversed() } else { chain }
    }

    /// Returns the chain as the tip sees it: the base is what moves, and the last joint the first.
    fn reversed(&self) -> Self {
        let tip = &self.tip;
        let mut axes = self.axes.map(|axis| -tip.local(&axis));
        let mut points = self.points.map(|point| tip.local(&(point - tip.origin)));
        axes.reverse();
        points.reverse();
        Self { axes, points, tip: tip.inverse() }
    }

    /// Returns what of the axes meets or is parallel, if that is enough to take them apart.
    fn kind(&self) -> Option<Kind> {
        let sine = |i: usize, j: usize| self.axes[i].cross(&self.axes[j]).norm();
        let are_parallel = |i: usize, j: usize| sine(i, j) < PARALLEL;
        let meet = |i: usize, j: usize| sine(i, j) > CROSS && self.missed(i, j) < MEET;
        let wrist = self.wrist();
        let has_wrist = meet(4, 5) && sine(3, 4) > CROSS && self.off(3, &wrist) < MEET;
        if has_wrist && are_parallel(1, 2) && sine(0, 1) > CROSS {
            Some(Kind::Wrist)
        } else if has_wrist && meet(0, 1) {
            Some(Kind::WristAndShoulder)
        } else if meet(4, 5) && are_parallel(1, 2) && are_parallel(2, 3) && sine(0, 1) > CROSS {
            Some(Kind::Parallel)
        } else {
            None
        }
    }

    /// Returns the point of axis `i` that is nearest to axis `j`, m.
    fn meeting(&self, i: usize, j: usize) -> Vector3<f64> {
        let (a, b) = (&self.axes[i], &self.axes[j]);
        let between = self.points[j] - self.points[i];
        let cross = a.cross(b);
        let along = between.cross(b).dot(&cross) / cross.norm_squared();
        self.points[i] + a * along
    }

    /// Returns how far two axes miss each other, m.
    fn missed(&self, i: usize, j: usize) -> f64 {
        self.off(j, &self.meeting(i, j))
    }

    /// Returns how far a point is from an axis, m.
    fn off(&self, i: usize, point: &Vector3<f64>) -> f64 {
        (point - self.points[i]).cross(&self.axes[i]).norm()
    }

    /// Returns where the last two axes meet, halfway where they only nearly do.
    fn wrist(&self) -> Vector3<f64> {
        (self.meeting(4, 5) + self.meeting(5, 4)) * 0.5
    }

    /// Solves a chain whose last three axes meet: the first three joints bring the wrist to its place, the last three
    /// turn it.
    fn with_wrist(
        &self,
        kind: Kind,
        at_zero: &Vector3<f64>,
        wanted: &Wanted<'_>,
        take: &mut dyn FnMut([f64; 6]),
    ) {
        let [h1, h2, h3, ..] = self.axes;
        let near = wanted.near;
        let second = if kind == Kind::Wrist { self.points[1] } else { self.meeting(0, 1) };
        let first = if kind == Kind::Wrist { self.points[0] } else { second };
        let (upper, fore) = (self.points[2] - second, at_zero - self.points[2]);
        let p = wanted.wrist - first;
        if kind == Kind::Wrist {
            // What is along axes 2 and 3 they leave as it is.
            let aside = h2.dot(&(at_zero - first));
            for one in to_height(h1, &h2, &p, aside, near[0]) {
                let rest = one.back(&p) - (second - first);
                for three in to_distance(h3, &fore, &upper, rest.norm_squared(), near[2]) {
                    let arm = upper + three.turn(&fore);
                    let two = onto(h2, &arm, &rest, near[1]);
                    self.turn_wrist([one, two, three], wanted, take);
                }
            }
            return;
        }
        for three in to_distance(h3, &fore, &upper, p.norm_squared(), near[2]) {
            let arm = upper + three.turn(&fore);
            // Axis 1 does not see what it turns, axis 2 neither.
            for two in to_height(h2, &arm, &h1, h1.dot(&p), near[1]) {
                let one = onto(h1, &two.turn(&arm), &p, near[0]);
                self.turn_wrist([one, two, three], wanted, take);
            }
        }
    }

    /// Finds the last three joints, whose axes meet, once the first three are known.
    fn turn_wrist(
        &self,
        [one, two, three]: [About; 3],
        wanted: &Wanted<'_>,
        take: &mut dyn FnMut([f64; 6]),
    ) {
        let [.., h4, h5, h6] = self.axes;
        let near = wanted.near;
        let back = |v: Vector3<f64>| three.back(&two.back(&one.back(&(wanted.turn * v))));
        let last = back(h6);
        let across = across(&h6);
        let across_is = back(across);
        for five in to_height(h5, &h6, &h4, h4.dot(&last), near[4]) {
            let four = onto(h4, &five.turn(&h6), &last, near[3]);
            let six = onto(h6, &across, &five.back(&four.back(&across_is)), near[5]);
            take([one, two, three, four, five, six].map(|turn| turn.angle));
        }
    }

    /// Solves a chain whose axes 2, 3 and 4 are parallel and whose last two meet.
    fn with_parallels(
        &self,
        at_zero: &Vector3<f64>,
        wanted: &Wanted<'_>,
        take: &mut dyn FnMut([f64; 6]),
    ) {
        let [h1, h2, h3, h4, h5, h6] = self.axes;
        let points = &self.points;
        let near = wanted.near;
        let p = wanted.wrist - points[0];
        // Joints 2 to 4 turn about one direction; those of them that are turned round count the other way.
        let (third, fourth) = (h3.dot(&h2).signum(), h4.dot(&h2).signum());
        let across = across(&h2);
        let (upper, fore) = (points[2] - points[1], points[3] - points[2]);
        for one in to_height(h1, &h2, &p, h2.dot(&(at_zero - points[0])), near[0]) {
            let last = one.back(&(wanted.turn * h6));
            for five in to_height(h5, &h6, &h2, h2.dot(&last), near[4]) {
                // Axis 2 as the tip sees it.
                let seen = wanted.turn.tr_mul(&one.turn(&h2));
                let six = onto(h6, &seen, &five.back(&h2), near[5]);
                let turned = one.back(&(wanted.turn * six.back(&five.back(&across))));
                let all = onto(h2, &across, &turned, near[1]);
                let hand = all.turn(&(at_zero - points[3]));
                let rest = one.back(&p) - (points[1] - points[0]) - hand;
                for three in to_distance(h3, &fore, &upper, rest.norm_squared(), near[2]) {
                    let two = onto(h2, &(upper + three.turn(&fore)), &rest, near[1]);
                    let four = fourth * (all.angle - two.angle - third * three.angle);
                    take([one.angle, two.angle, three.angle, four, five.angle, six.angle]);
                }
            }
        }
    }
}

/// Returns the rotation of a frame.
fn matrix(frame: &Frame) -> Matrix3<f64> {
    Matrix3::from_columns(&[frame.x, frame.y, frame.z])
}

/// Returns some unit direction at right angles to another.
fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let other = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    axis.cross(&other).normalize()
}
