//! The closed form of the Gen3's inverse kinematics, with joint 3 as the redundancy.
//!
//! The arm is not an SRS arm: neighbouring axes meet at right angles, but no three meet in a point. With
//! joint 3 fixed the wrist centre, where axes 5 and 6 meet, still has a closed form; the wrist's small
//! offset along axis 6 is iterated out.
//!
//! Turned so that odd axes are z and even ones y, the arm is `R = Z1 Y2 Z3 Y4 Z5 Y6 Z7`, and the wrist centre
//! seen from where axes 1 and 2 meet is `Z1 (d2 y + Y2 (l1 z + Z3 (d4 y + Y4 l2 z)))`. Its length gives `q4`,
//! its height `q2`, its bearing `q1`; the rotation that is left gives `q5`, `q6`, `q7`. Two roots each for
//! `q4`, `q2` and `q6` make eight branches, four of which are worked out at once; sines and cosines stand for the
//! angles to the end. Joint 7 says where axis 6 lies, and so the wrist centre. What a wrist centre that is a little elsewhere
//! does to the joints follows by the same triangles (Newton's method), so two passes are enough away from singular poses.
//!
//! Source: derived here from the joint origins; the sub-problems are those of Paden and Kahan (Murray,
//! Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, §3.2).

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use nalgebra::{Isometry3, SMatrix, Vector3};

use super::frames::Frame;
use super::gate::Gate;
use super::kinematics::frame_error;
use super::lanes::{Job, Wide, run};
use super::quad::{Marks, Quad};
use super::robot::{Drive, Motion, Robot};
use super::turn::{Turn, root, unit};

/// How far, m, neighbouring axes may miss each other and still count as meeting: link files print six
/// digits or more, and the polish takes up the rest.
const MEET: f64 = 2e-5;
/// How far, as a cosine, neighbouring axes may be from a right angle.
const SQUARE: f64 = 1e-4;
/// A solution is exact when position (m) and rotation (rad) are off by less.
const EXACT: f64 = 1e-11;
/// A model whose axes meet and are square to this, m and rad, needs no polish: its solutions are its own.
const IDEAL: f64 = 1e-13;
/// Passes at most; away from singular poses two reach the last digits.
const PASSES: usize = 6;
/// Steps of the joints that add up to less, rad, need no further pass: what they leave goes with their square.
const SMALL: f64 = 1e-7;
/// Once a step adds up to more, rad, none is taken: near a singular pose it says nothing.
const WILD: f64 = 0.02;
/// A root that is out of reach by more, of its size and of the forearm's, is none: a polish puts right ten thousand times less.
const HOPELESS: [f64; 2] = [1e-5, 1e-12];
/// The joints that are worked out.
const OTHERS: [usize; 6] = [0, 1, 3, 4, 5, 6];
/// The wrist's bearing is clear when the square of how far it points is above this, against the forearm's.
const CLEAR: f64 = 0.01;

/// The geometry the closed form needs.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    /// Axis 1 along z, axis 2 along y, the origin where they meet; in base coordinates at zero.
    base: Frame,
    /// Where the tip stands in the frame of axis 7.
    tip: Frame,
    /// Angle of each joint when it reads 0, rad.
    zero: [f64; 7],
    d2: f64,
    l1: f64,
    d4: f64,
    l2: f64,
    d6: f64,
    /// Whether the robot is this model to [`IDEAL`].
    is_ideal: bool,
}

/// Joint 3 as one search tries it: all eight branches, `None` where there is no solution.
pub(super) type Branches = [Option<[f64; 7]>; 8];

/// What one value of joint 3 gives.
pub(super) struct Looked {
    pub(super) branches: Branches,
    /// How far each branch that a gate shut is outside the limits, rad, to the gate's blur; infinite for all others.
    pub(super) beyond: [f64; 8],
}

impl Default for Looked {
    fn default() -> Self {
        Self { branches: [None; 8], beyond: [f64::INFINITY; 8] }
    }
}

/// Three numbers for each of four branches.
type Three<S> = [Quad<S>; 3];

/// A pose that is wanted, as the closed form sees it.
pub(super) struct Wanted {
    tip: Frame,
    /// The wanted axes of the last frame, and the wrist's end, in the frame of axes 1 and 2.
    turn: Frame,
    /// What joints that are free take, rad.
    near: [f64; 7],
}

/// What is the same for all branches and passes.
struct Target<'w, S> {
    simd: S,
    turn: &'w Frame,
    q3: (f64, f64),
    near: &'w [f64; 7],
}

/// How four branches end.
#[expect(clippy::large_enum_variant, reason = "it is taken apart where it is made")]
enum Four<S: Wide> {
    /// None of them leads anywhere.
    Nowhere,
    /// The gate shuts all that lead somewhere: by how much each of the four is outside the limits, rad, and a bit for each
    /// that counts.
    Shut([f64; 4], u8),
    Ends(Ends<S>),
}

/// Where four branches end.
struct Ends<S: Wide> {
    pass: Pass<S>,
    /// What the last step adds to [`OTHERS`], rad.
    step: [Quad<S>; 6],
    /// A bit for each that is a solution to rounding, as far as the model goes.
    settled: u8,
    /// A bit for each that the gate shuts.
    shut: u8,
}

/// Where four branches stand after a pass.
#[derive(Clone, Copy)]
struct Pass<S: Wide> {
    turns: [Turn<S>; 7],
    /// The wrist centre it was made for, m.
    wrist: Three<S>,
    /// The same before joint 2 turns it, and then how far ahead it is.
    arm: Three<S>,
    ahead: Quad<S>,
    /// Slopes of the roots for joints 4 and 2.
    sides: [Quad<S>; 2],
    /// Lanes in which there is a solution.
    holds: Marks<S>,
    /// Lanes in which a root was out of reach by less than the slack.
    is_stretched: Marks<S>,
    /// Lanes in which one was by [`HOPELESS`], and the wrist is not stretched: joint 7 says where it is.
    is_hopeless: Marks<S>,
    /// Lanes in which no root and no bearing is anywhere near where it ceases to be one.
    is_clear: Marks<S>,
}

/// One value of joint 3 to be looked at, those branches whose bit is set in `which`.
struct Look<'l> {
    form: &'l ClosedForm,
    robot: &'l Robot,
    wanted: &'l Wanted,
    q3: f64,
    gate: Option<&'l Gate>,
    which: u32,
    looked: &'l mut Looked,
}

impl Job for Look<'_> {
    type Found = ();

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) {
        self.form.look(simd, self);
    }
}

impl ClosedForm {
    /// Returns the closed form if the robot has the right geometry: seven turning joints whose
    /// neighbouring axes meet at right angles.
    pub fn of(robot: &Robot) -> Option<Self> {
        if robot.n_joints() != 7 {
            return None;
        }
        let mut axes = [Vector3::zeros(); 7];
        let mut points = [Vector3::zeros(); 7];
        let mut pose = Isometry3::identity();
        for &link in &robot.path {
            let joint = &robot.links[link].joint;
            pose *= joint.parent_from_link(joint.value(&[0.0; 7], 0.0));
            match joint.drive {
                Drive::None => {}
                Drive::Joint { index, multiplier, offset }
                    if joint.motion == Motion::Turn
                        && (multiplier - 1.0).abs() < f64::EPSILON
                        && offset.abs() < f64::EPSILON =>
                {
                    axes[index] = pose.rotation * joint.axis.into_inner();
                    points[index] = pose.translation.vector;
                }
                _ => return None,
            }
        }
        let mut meet = [Vector3::zeros(); 6];
        for i in 0..6 {
            if axes[i].dot(&axes[i + 1]).abs() > SQUARE {
                return None;
            }
            let normal = axes[i].cross(&axes[i + 1]);
            let between = points[i + 1] - points[i];
            if between.dot(&normal).abs() > MEET {
                return None;
            }
            meet[i] = points[i] + axes[i] * between.dot(&axes[i]);
        }
        // From one meeting point to the next the way leads along the axis they share.
        let along = |i: usize| (meet[i] - meet[i - 1]).dot(&axes[i]);
        let [d2, l1, d4, l2, d6] = [1, 2, 3, 4, 5].map(along);
        // Without an upper arm and a forearm there is no triangle to solve; the wrist offset must be
        // small for its iteration to converge.
        if l2.abs() < 0.01 || l1.abs() < 0.01 || d6.abs() > 0.05 * l2.abs() {
            return None;
        }
        let y = (axes[1] - axes[0] * axes[0].dot(&axes[1])).normalize();
        let base = Frame { x: y.cross(&axes[0]), y, z: axes[0], origin: meet[0] };
        let (last, zero) = unwound(base, &axes);
        let last = Frame { origin: meet[5], ..last };
        let pose = Frame::of(&pose);
        let tip = Frame {
            x: last.local(&pose.x),
            y: last.local(&pose.y),
            z: last.local(&pose.z),
            origin: last.local(&(pose.origin - meet[5])),
        };
        let mut form = Self { base, tip, zero, d2, l1, d4, l2, d6, is_ideal: false };
        form.is_ideal = form.error_of(robot) < IDEAL;
        Some(form)
    }

    /// Appends every solution for the tip at `target` with joint 3 at `q3`, up to eight; joint limits
    /// are not looked at. Where a joint is free (a singular pose) it takes its value from `near`.
    pub fn solve(
        &self,
        robot: &Robot,
        target: &Isometry3<f64>,
        q3: f64,
        near: &[f64],
        found: &mut Vec<[f64; 7]>,
    ) {
        let wanted = self.wanted(&Frame::of(target), near);
        for q in self.branches(robot, &wanted, q3, None).branches.into_iter().flatten() {
            if !found.iter().any(|other| same(other, &q)) {
                found.push(q);
            }
        }
    }

    /// Prepares a pose of the tip; where a joint is free it takes its value from `near`.
    pub(super) fn wanted(&self, tip: &Frame, near: &[f64]) -> Wanted {
        let near = std::array::from_fn(|i| near[i] + self.zero[i]);
        Wanted { tip: *tip, turn: self.seen(tip), near }
    }

    /// Returns the gate that a robot's limits make for [`Self::branches`].
    pub(super) fn gate(&self, robot: &Robot) -> Gate {
        // The first pass is off by the wrist's offset, seen from the links; ten times as much where a root is about to
        // vanish, and ten times that to be sure.
        let blur = 100.0 * (self.d6.abs() + MEET) / self.l1.abs().min(self.l2.abs());
        Gate::of(robot, &self.zero, blur)
    }

    /// Returns the solution of each branch with joint 3 at `q3`. Branches may share one.
    pub(super) fn branches(
        &self,
        robot: &Robot,
        wanted: &Wanted,
        q3: f64,
        gate: Option<&Gate>,
    ) -> Looked {
        let mut looked = Looked::default();
        let which = 0b1111_1111;
        run(Look { form: self, robot, wanted, q3, gate, which, looked: &mut looked });
        looked
    }

    /// As [`Self::branches`], for one of them: its solution, or how far it is outside.
    pub(super) fn branch(
        &self,
        robot: &Robot,
        wanted: &Wanted,
        q3: f64,
        gate: &Gate,
        branch: usize,
    ) -> Result<[f64; 7], f64> {
        let mut found = Looked::default();
        let (gate, which) = (Some(gate), 1 << branch);
        run(Look { form: self, robot, wanted, q3, gate, which, looked: &mut found });
        found.branches[branch].ok_or(found.beyond[branch])
    }

    #[inline(always)]
    fn look<S: Wide>(&self, simd: S, asked: Look<'_>) {
        let Look { robot, wanted, q3, gate, which, looked, .. } = asked;
        let sin_cos = (q3 + self.zero[2]).sin_cos();
        let target = Target { simd, turn: &wanted.turn, q3: sin_cos, near: &wanted.near };
        for (half, elbow) in [1.0, -1.0].into_iter().enumerate() {
            let which = lanes_of(which >> half);
            if which == 0 {
                continue;
            }
            let ends = match self.four(&target, elbow, gate, which) {
                Four::Nowhere => continue,
                Four::Shut(beyond, shut) => {
                    for (lane, beyond) in beyond.into_iter().enumerate() {
                        if shut & (1 << lane) != 0 {
                            looked.beyond[2 * lane + half] = beyond;
                        }
                    }
                    continue;
                }
                Four::Ends(ends) => ends,
            };
            let exact = if self.is_ideal { ends.settled } else { 0 };
            let holds = ends.pass.holds.bits() & which;
            let mut positions = [[q3; 7]; 4];
            for k in 0..6 {
                let turn = ends.pass.turns[OTHERS[k]];
                let zero = Quad::all(simd, self.zero[OTHERS[k]]);
                let angles = (turn.sin.angle(turn.cos) + ends.step[k] - zero).lanes();
                for (q, angle) in positions.iter_mut().zip(angles) {
                    q[OTHERS[k]] = angle;
                }
            }
            for (lane, mut q) in positions.into_iter().enumerate() {
                let bit = 1 << lane;
                if holds & bit == 0 {
                    continue;
                }
                if exact & bit != 0 {
                    looked.branches[2 * lane + half] = Some(q);
                } else if ends.shut & bit != 0 {
                    let gate = gate.expect("it shuts the branch");
                    looked.beyond[2 * lane + half] = gate.beyond(simd, &ends.pass.turns)[lane];
                } else if polish(robot, &wanted.tip, &mut q) {
                    looked.branches[2 * lane + half] = Some(q);
                }
            }
        }
    }

    /// Moves a target towards the shoulder, or away from it, until the wrist can be there, as far as the two links
    /// alone decide.
    pub(super) fn within_reach(&self, target: &Frame) -> Frame {
        let wrist = self.seen(target).origin;
        let (long, short) = (self.l1.abs() + self.l2.abs(), (self.l1.abs() - self.l2.abs()).abs());
        let far = wrist.norm().max(1e-9);
        let wanted = far.clamp(short + 0.02 * long, 0.995 * long);
        Frame {
            origin: target.origin + self.base.direction(&(wrist * (wanted / far - 1.0))),
            ..*target
        }
    }

    /// Returns the last frame's axes and the wrist's end for a tip, seen from where axes 1 and 2 meet.
    fn seen(&self, target: &Frame) -> Frame {
        // R = B' T H', with the base B and the tip's axes H in the last frame.
        let rows = Frame {
            x: Vector3::new(self.tip.x.x, self.tip.y.x, self.tip.z.x),
            y: Vector3::new(self.tip.x.y, self.tip.y.y, self.tip.z.y),
            z: Vector3::new(self.tip.x.z, self.tip.y.z, self.tip.z.z),
            origin: Vector3::zeros(),
        };
        let [x, y, z] = [rows.x, rows.y, rows.z].map(|v| self.base.local(&target.direction(&v)));
        let hand = x * self.tip.origin.x + y * self.tip.origin.y + z * self.tip.origin.z;
        let origin = self.base.local(&(target.origin - self.base.origin)) - hand;
        Frame { x, y, z, origin }
    }

    /// Iterates four branches, of which those count whose bit is set in `which`.
    #[inline(always)]
    fn four<S: Wide>(
        &self,
        target: &Target<'_, S>,
        elbow: f64,
        gate: Option<&Gate>,
        which: u8,
    ) -> Four<S> {
        let simd = target.simd;
        let k = |x: f64| Quad::all(simd, x);
        let (x, y, end) = (
            three(simd, &target.turn.x),
            three(simd, &target.turn.y),
            three(simd, &target.turn.origin),
        );
        let elbow = k(elbow);
        // The first pass leaves the wrist offset out, the later ones know joint 7 from the one before.
        let Some(mut pass) = self.pass(&end, target, elbow) else { return Four::Nowhere };
        let mut shut = 0;
        if let Some(gate) = gate {
            shut = (pass.holds & pass.is_clear & gate.shuts(simd, &pass.turns)).bits() & which;
            if pass.holds.bits() & which & !shut == 0 {
                return if shut == 0 {
                    Four::Nowhere
                } else {
                    Four::Shut(gate.beyond(simd, &pass.turns), shut)
                };
            }
        }
        let which = which & !shut;
        let d6 = k(self.d6);
        let mut used: Option<Turn<S>> = None;
        let mut calm = pass.holds;
        let mut passes = 1;
        loop {
            let seven = pass.turns[6];
            // Axis 6 in the base: y turned back by joint 7.
            let mut wrist = end;
            let mut aside = end;
            for i in 0..3 {
                wrist[i] = end[i] - d6 * (x[i] * seven.sin + y[i] * seven.cos);
                aside[i] = wrist[i] - pass.wrist[i];
            }
            let off = aside[0] * aside[0] + aside[1] * aside[1] + aside[2] * aside[2];
            let is_there = off.below(k(0.01 * EXACT * EXACT));
            let mut step = self.step(&pass, target, &aside);
            if let Some(used) = used {
                // Joint 7 moves the wrist centre once more; how far it has gone tells by how much.
                let gone = seven.sin * used.cos - seven.cos * used.sin;
                let more = gone / (gone - step[5]);
                let is_known = k(1e-13).below(gone.abs()) & more.abs().below(k(2.0));
                let more = is_known.pick(more, k(1.0));
                for joint in &mut step {
                    *joint = *joint * more;
                }
            }
            let sum = step[0].abs()
                + step[1].abs()
                + step[2].abs()
                + step[3].abs()
                + step[4].abs()
                + step[5].abs();
            let is_small = sum.below(k(SMALL)) & pass.is_stretched.not();
            let settled = (is_small | is_there).bits();
            if pass.holds.bits() & which & !settled == 0 || passes == PASSES {
                let settled = settled & pass.is_stretched.not().bits();
                if self.is_ideal {
                    // The wrist is where it must be, and cannot be.
                    pass.holds = pass.holds & (is_there & pass.is_hopeless).not();
                }
                for joint in &mut step {
                    *joint = is_small.pick(*joint, k(0.0));
                }
                return Four::Ends(Ends { pass, step, settled, shut });
            }
            calm = calm & sum.below(k(WILD));
            let by = calm.pick(step[5], k(0.0));
            let less = k(0.5) * by * by;
            let next = Turn {
                sin: seven.sin + (seven.cos * by - seven.sin * less),
                cos: seven.cos - (seven.sin * by + seven.cos * less),
            };
            for i in 0..3 {
                wrist[i] = end[i] - d6 * (x[i] * next.sin + y[i] * next.cos);
            }
            used = Some(next);
            passes += 1;
            let Some(next) = self.pass(&wrist, target, elbow) else { return Four::Nowhere };
            pass = next;
        }
    }

    /// Solves for four branches with the wrist centre at `w`; `None` where none of them has a solution.
    #[inline(always)]
    fn pass<S: Wide>(
        &self,
        w: &Three<S>,
        target: &Target<'_, S>,
        elbow: Quad<S>,
    ) -> Option<Pass<S>> {
        let simd = target.simd;
        let k = |x: f64| Quad::all(simd, x);
        let (s3, c3) = (k(target.q3.0), k(target.q3.1));
        let (d2, l1, d4, l2) = (k(self.d2), k(self.l1), k(self.d4), k(self.l2));
        let near = |i: usize| target.near[i];
        // |w|² in q4: A cos q4 + B sin q4 = C.
        let two = k(2.0);
        let fixed = d2 * d2 + l1 * l1 + d4 * d4 + l2 * l2 + two * d2 * d4 * c3;
        let across = w[0] * w[0] + w[1] * w[1];
        let length = across + w[2] * w[2];
        let four = root(two * l1 * l2, two * d2 * l2 * s3, length - fixed, elbow, near(3))?;
        let (holds4, out4, clear4) = (four.holds, four.is_stretched, four.is_clear);
        let hopeless = |lack: Quad<S>, size: Quad<S>| {
            (k(HOPELESS[0]) * size + k(HOPELESS[1]) * l2 * l2).below(lack)
        };
        let hopeless4 = hopeless(four.lack, four.size);
        let (side4, four) = (four.side, four.turn);
        // The wrist before joint 2 turns it.
        let (x, y, z) =
            (c3 * l2 * four.sin - s3 * d4, s3 * l2 * four.sin + c3 * d4 + d2, l1 + l2 * four.cos);
        // Height: z cos q2 - x sin q2.
        let two = root(z, -x, w[2], Quad::of(simd, [1.0, -1.0, 1.0, -1.0]), near(1))?;
        let (holds2, out2, clear2) = (two.holds, two.is_stretched, two.is_clear);
        let hopeless2 = hopeless(two.lack, two.size);
        let (side2, two) = (two.side, two.turn);
        let holds = holds2 & holds4;
        if holds.is_nowhere() {
            return None;
        }
        let ahead = two.cos * x + two.sin * z;
        let one = unit(ahead * w[1] - y * w[0], ahead * w[0] + y * w[1], near(0), 1e-18);
        // What rotation is left for the wrist: Z5 Y6 Z7, by columns.
        let wanted = target.turn;
        let mut left = [three(simd, &wanted.x), three(simd, &wanted.y), three(simd, &wanted.z)];
        for column in &mut left {
            let [x, y, z] = *column;
            let (x, y) = (one.cos * x + one.sin * y, one.cos * y - one.sin * x);
            let (x, z) = (two.cos * x - two.sin * z, two.sin * x + two.cos * z);
            let (x, y) = (c3 * x + s3 * y, c3 * y - s3 * x);
            let (x, z) = (four.cos * x - four.sin * z, four.sin * x + four.cos * z);
            *column = [x, y, z];
        }
        let flip = Quad::of(simd, [1.0, 1.0, -1.0, -1.0]);
        let [to_x, to_y, to_z] = left[2];
        let five = unit(flip * to_y, flip * to_x, near(4), 1e-18);
        let six = Turn { sin: to_x * five.cos + to_y * five.sin, cos: to_z };
        let seven = Turn {
            sin: five.cos * left[0][1] - five.sin * left[0][0],
            cos: five.cos * left[1][1] - five.sin * left[1][0],
        };
        let three = Turn { sin: s3, cos: c3 };
        Some(Pass {
            turns: [one, two, three, four, five, six, seven],
            wrist: *w,
            arm: [x, y, z],
            ahead,
            sides: [side4, side2],
            holds,
            is_stretched: out2 | out4,
            is_hopeless: (hopeless2 | hopeless4) & k(CLEAR).below(six.sin * six.sin),
            is_clear: clear2 & clear4 & across.reaches(k(CLEAR) * l2 * l2),
        })
    }

    /// Returns what each of [`OTHERS`] turns, rad, as the wrist centre moves by `by`, m, and the hand does not turn; to first
    /// order.
    #[inline(always)]
    fn step<S: Wide>(&self, pass: &Pass<S>, target: &Target<'_, S>, by: &Three<S>) -> [Quad<S>; 6] {
        let k = |x: f64| Quad::all(target.simd, x);
        let (s3, c3) = (k(target.q3.0), k(target.q3.1));
        let [_, two, _, four, five, six, _] = &pass.turns;
        let (w, [_, y, _], [side4, side2]) = (&pass.wrist, pass.arm, pass.sides);
        // The three equations of a pass, each by its slope.
        let longer = w[0] * by[0] + w[1] * by[1] + w[2] * by[2];
        let turn4 = k(-2.0) * longer / side4;
        let swung = k(self.l2) * turn4;
        let (dx, dy, dz) = (c3 * four.cos * swung, s3 * four.cos * swung, -(four.sin * swung));
        let turn2 = (two.cos * dz - two.sin * dx - by[2]) / side2;
        let farther = two.cos * dx + two.sin * dz + w[2] * turn2;
        let across = w[0] * w[0] + w[1] * w[1];
        let turn1 = ((w[0] * by[1] - w[1] * by[0]) - (pass.ahead * dy - y * farther)) / across;
        // The forearm's turn in its own axes; the wrist undoes it.
        let (up_x, up_y) = (-(c3 * two.sin), s3 * two.sin);
        let turned = turn1 * up_x + turn2 * s3;
        let lifted = turn1 * two.cos;
        let about_x = four.sin * lifted - four.cos * turned;
        let about_y = -(turn1 * up_y + turn2 * c3 + turn4);
        let about_z = -(four.sin * turned + four.cos * lifted);
        let turn6 = five.cos * about_y - five.sin * about_x;
        let turn7 = (five.cos * about_x + five.sin * about_y) / six.sin;
        let turn5 = about_z - six.cos * turn7;
        [turn1, turn2, turn4, turn5, turn6, turn7]
    }

    /// Returns how far the model is from the robot itself, m and rad, at a few positions of the joints.
    fn error_of(&self, robot: &Robot) -> f64 {
        // Any positions will do that are no special ones.
        const TRIED: [[f64; 7]; 3] = [
            [0.3, -0.7, 1.1, 0.9, -0.4, 1.2, 2.1],
            [-1.9, 0.6, -2.3, -1.4, 0.8, -0.5, 0.2],
            [2.6, 1.3, 0.4, 1.8, -1.7, 0.9, -2.8],
        ];
        TRIED
            .iter()
            .map(|q| frame_error(&self.forward(q), &robot.tip_frame(q)).amax())
            .fold(0.0, f64::max)
    }

    /// Returns where the model puts the tip.
    fn forward(&self, q: &[f64; 7]) -> Frame {
        let mut frame = self.base;
        let steps = [0.0, 0.0, self.d2, self.l1, self.d4, self.l2, self.d6];
        for (i, (q, zero)) in q.iter().zip(self.zero).enumerate() {
            let (sin, cos) = (q + zero).sin_cos();
            // The way from one meeting point to the next lies along the axis before.
            if i > 1 {
                frame.origin += if i % 2 == 0 { frame.y } else { frame.z } * steps[i];
            }
            if i % 2 == 0 {
                frame.about_z((sin, cos));
            } else {
                frame.about_y((sin, cos));
            }
        }
        frame.then(&self.tip)
    }
}

/// Follows the axes from the base outwards; returns the frame of the last, and each joint's angle at zero.
fn unwound(mut frame: Frame, axes: &[Vector3<f64>; 7]) -> (Frame, [f64; 7]) {
    let mut zero = [0.0; 7];
    // Each joint turns the frame until its y or its z is the next axis.
    for i in 0..6 {
        let next = frame.local(&axes[i + 1]);
        if i % 2 == 0 {
            zero[i] = (-next.x).atan2(next.y);
            frame.about_z(zero[i].sin_cos());
        } else {
            zero[i] = next.x.atan2(next.z);
            frame.about_y(zero[i].sin_cos());
        }
    }
    (frame, zero)
}

#[inline(always)]
fn three<S: Wide>(simd: S, v: &Vector3<f64>) -> Three<S> {
    [Quad::all(simd, v.x), Quad::all(simd, v.y), Quad::all(simd, v.z)]
}

/// Returns a bit for each lane whose branch is wanted: every other one of eight.
fn lanes_of(which: u32) -> u8 {
    ((which & 1) | ((which >> 1) & 2) | ((which >> 2) & 4) | ((which >> 3) & 8)) as u8
}

/// Newton's method with joint 3 held; returns whether the result is exact.
#[inline(never)]
fn polish(robot: &Robot, target: &Frame, q: &mut [f64; 7]) -> bool {
    let mut jacobian = [0.0; 42];
    // Where two roots meet a step leaves half of what is off.
    for _ in 0..14 {
        let tip = robot.jacobian_into(q, &mut jacobian);
        let error = frame_error(&tip, target);
        if error.amax() < EXACT {
            return true;
        }
        let square = SMatrix::<f64, 6, 6>::from_fn(|i, j| jacobian[6 * OTHERS[j] + i]);
        // Beside a singular pose the plain step may be wild; the damping is far below any other effect.
        let damping = 1e-3 * error.norm_squared() + 1e-18;
        let step = square.lu().solve(&error).filter(|step| step.amax() < 0.2).or_else(|| {
            let normal = square.transpose() * square;
            let damped = normal + SMatrix::<f64, 6, 6>::identity() * damping;
            damped.cholesky().map(|factor| factor.solve(&(square.transpose() * error)))
        });
        let Some(step) = step else { return false };
        for (k, &i) in OTHERS.iter().enumerate() {
            q[i] += step[k];
        }
    }
    frame_error(&robot.tip_frame(q), target).amax() < 1e-9
}

/// Whether two solutions are the same up to whole turns.
fn same(a: &[f64; 7], b: &[f64; 7]) -> bool {
    // Rad: solutions are exact to 1e-9 (above).
    const NEAR: f64 = 1e-7;
    let turn = std::f64::consts::TAU;
    for i in 0..7 {
        let gap = (a[i] - b[i]).abs();
        if gap >= NEAR && (gap <= 1.0 || (gap - (gap / turn).round() * turn).abs() >= NEAR) {
            return false;
        }
    }
    true
}
