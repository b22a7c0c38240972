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
//! Whether an arm is of this kind is found in `axes`; a pass is `triangles`.
//!
//! Source: derived here from the joint origins; the sub-problems are those of Paden and Kahan (Murray,
//! Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, §3.2).

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use nalgebra::{Isometry3, Vector3};

use super::frames::Frame;
use super::gate::Gate;
use super::lanes::{Job, Wide, run};
use super::polish::{EXACT, polish};
use super::quad::Quad;
use super::robot::Robot;
use super::triangles::{Pass, Target, three};
use super::turn::Turn;

/// How far, m, neighbouring axes may miss each other and still count as meeting: link files print six
/// digits or more, and the polish takes up the rest.
pub(super) const MEET: f64 = 2e-5;
/// Passes at most; away from singular poses two reach the last digits.
const PASSES: usize = 6;
/// Steps of the joints that add up to less, rad, need no further pass: what they leave goes with their square.
const SMALL: f64 = 1e-7;
/// Once a step adds up to more, rad, none is taken: near a singular pose it says nothing.
const WILD: f64 = 0.02;
/// The joints that are worked out.
pub(super) const OTHERS: [usize; 6] = [0, 1, 3, 4, 5, 6];

/// The geometry the closed form needs.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    /// Axis 1 along z, axis 2 along y, the origin where they meet; in base coordinates at zero.
    pub(super) base: Frame,
    /// Where the tip stands in the frame of axis 7.
    pub(super) tip: Frame,
    /// Angle of each joint when it reads 0, rad.
    pub(super) zero: [f64; 7],
    pub(super) d2: f64,
    pub(super) l1: f64,
    pub(super) d4: f64,
    pub(super) l2: f64,
    pub(super) d6: f64,
    /// Whether the robot is this model to rounding.
    pub(super) is_ideal: bool,
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

/// A pose that is wanted, as the closed form sees it.
pub(super) struct Wanted {
    tip: Frame,
    /// The wanted axes of the last frame, and the wrist's end, in the frame of axes 1 and 2.
    turn: Frame,
    /// What joints that are free take, rad.
    near: [f64; 7],
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
                } else if polish(robot, &wanted.tip, &mut q, &OTHERS) {
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
}

/// Returns a bit for each lane whose branch is wanted: every other one of eight.
fn lanes_of(which: u32) -> u8 {
    ((which & 1) | ((which >> 1) & 2) | ((which >> 2) & 4) | ((which >> 3) & 8)) as u8
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
