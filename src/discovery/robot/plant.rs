//! An arm along the motion of one recording: what the simulation needs at every instant, laid out once.
//!
//! The rigid-body part of the equation of motion is linearised about a path close to the one the arm
//! took, `M(p) q̈ + h(p, ṗ) + K (q - p) + D (q̇ - ṗ) = τ`; with a position controller the arm stays
//! within a few milliradians of its reference, and what is dropped is of second order in that distance.
//! The controller, friction and all other effects are simulated as they are. A simulation of ten
//! seconds then takes about two milliseconds instead of fifty.

use super::chain::{Chain, Excess, MOST_JOINTS, Placed};
use super::channels::{Data, Quantity};
use super::spline::Spline;
use crate::discovery::recording::sidecar::{Controller, TorqueSensor};
use crate::discovery::resample;

/// The arm as it is modelled, the same for all recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Its rigid bodies.
    pub chain: Chain,
    /// Rotor inertia at each joint, kg·m².
    pub armature: Vec<f64>,
    /// Its controller, if known.
    pub controller: Option<Controller>,
    /// Which side of the gear the torque is measured on.
    pub torque_sensor: TorqueSensor,
    /// Names of its joints in the robot's file, for messages.
    pub joint_names: Vec<String>,
}

/// The bodies along a path, at even steps of time.
#[derive(Debug, Clone)]
pub struct Plant {
    /// Number of joints.
    pub n: usize,
    /// Time of the first grid point, s.
    pub start: f64,
    /// Step of the grid, s.
    pub step: f64,
    /// Number of grid points.
    pub len: usize,
    /// The path, `len × n`, rad.
    pub q: Vec<f64>,
    /// Its speed, rad/s.
    pub dq: Vec<f64>,
    /// Its acceleration, rad/s².
    pub ddq: Vec<f64>,
    /// `h`: torque of gravity and velocity on the path, N·m.
    pub bias: Vec<f64>,
    /// Gravity torque at the command, N·m: what the controller feeds forward.
    pub feedforward: Vec<f64>,
    /// Inverse of the mass matrix with rotors, `len × n × n`.
    pub inverse_mass: Vec<f64>,
    /// `K = ∂(M q̈ + h)/∂q`, `len × n × n`.
    pub stiffness: Vec<f64>,
    /// `D = ∂h/∂q̇`, `len × n × n`.
    pub damping: Vec<f64>,
}

/// Step of the grid, s: the arm turns a few milliradians in it.
const GRID_STEP: f64 = 0.005;

/// How long the arm is simulated before the first row, s; it held still, or moved evenly.
pub const RUN_IN: f64 = 1.0;

/// Change of an angle or speed for derivatives of torques; errors of rounding and of curvature are both
/// far below the torque noise.
const DIFFERENCE: f64 = 1e-5;

impl Plant {
    /// Lays the arm out along a path given by one spline per joint, from [`RUN_IN`] before `from` to `to`.
    pub fn along(arm: &Arm, path: &[Spline], from: f64, to: f64, rests: bool) -> Self {
        let n = arm.chain.n();
        let len = ((to - from + RUN_IN) / GRID_STEP).ceil() as usize + 2;
        let start = from - RUN_IN;
        let mut plant = Self {
            n,
            start,
            step: GRID_STEP,
            len,
            q: vec![0.0; len * n],
            dq: vec![0.0; len * n],
            ddq: vec![0.0; len * n],
            bias: vec![0.0; len * n],
            feedforward: vec![0.0; len * n],
            inverse_mass: vec![0.0; len * n * n],
            stiffness: vec![0.0; len * n * n],
            damping: vec![0.0; len * n * n],
        };
        let mut hints = vec![0; n];
        for k in 0..len {
            let time = start + k as f64 * GRID_STEP;
            for j in 0..n {
                let (q, dq, ddq) = if rests && time < from {
                    (path[j].at(from, &mut hints[j]).0, 0.0, 0.0)
                } else {
                    path[j].at(time, &mut hints[j])
                };
                plant.q[k * n + j] = q;
                plant.dq[k * n + j] = dq;
                plant.ddq[k * n + j] = ddq;
            }
        }
        for k in 0..len {
            // A resting arm is the same all through the run-in.
            let still = k > 0 && rests && start + k as f64 * GRID_STEP < from - 0.5 * GRID_STEP;
            if still {
                plant.copy(k - 1, k);
            } else {
                plant.fill(arm, k);
            }
        }
        plant
    }

    /// Takes the gravity that the controller feeds forward from the commands, where the path is another.
    fn feed(&mut self, arm: &Arm, commands: &[Spline]) {
        let n = self.n;
        let zero = [0.0; MOST_JOINTS];
        let mut hints = vec![0; n];
        for k in 0..self.len {
            let time = (self.start + k as f64 * self.step).max(self.start + RUN_IN);
            let mut q = [0.0; MOST_JOINTS];
            for j in 0..n {
                q[j] = commands[j].at(time, &mut hints[j]).0;
            }
            let row = k * n..(k + 1) * n;
            arm.chain.inverse(&q[..n], &zero[..n], &zero[..n], &mut self.feedforward[row]);
        }
    }

    fn copy(&mut self, from: usize, to: usize) {
        let n = self.n;
        for values in [&mut self.bias, &mut self.feedforward] {
            values.copy_within(from * n..(from + 1) * n, to * n);
        }
        for values in [&mut self.inverse_mass, &mut self.stiffness, &mut self.damping] {
            values.copy_within(from * n * n..(from + 1) * n * n, to * n * n);
        }
    }

    fn fill(&mut self, arm: &Arm, k: usize) {
        let n = self.n;
        let chain = &arm.chain;
        let row = k * n..(k + 1) * n;
        let mut q = [0.0; MOST_JOINTS];
        let mut dq = [0.0; MOST_JOINTS];
        let mut ddq = [0.0; MOST_JOINTS];
        q[..n].copy_from_slice(&self.q[row.clone()]);
        dq[..n].copy_from_slice(&self.dq[row.clone()]);
        ddq[..n].copy_from_slice(&self.ddq[row.clone()]);
        let zero = [0.0; MOST_JOINTS];
        let mut placed = chain.placed(&q[..n]);
        let inverse = |placed: &Placed, dq: &[f64], ddq: &[f64], tau: &mut [f64]| {
            chain.inverse_placed(placed, &chain.gravity, dq, ddq, tau);
        };
        inverse(&placed, &dq, &zero, &mut self.bias[row.clone()]);
        inverse(&placed, &zero, &zero, &mut self.feedforward[row]);
        let (mut up, mut down) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        for j in 0..n {
            chain.place(&mut placed, j, q[j] + DIFFERENCE);
            inverse(&placed, &dq, &ddq, &mut up);
            chain.place(&mut placed, j, q[j] - DIFFERENCE);
            inverse(&placed, &dq, &ddq, &mut down);
            chain.place(&mut placed, j, q[j]);
            for i in 0..n {
                self.stiffness[(k * n + i) * n + j] = (up[i] - down[i]) / (2.0 * DIFFERENCE);
            }
            let kept = dq[j];
            dq[j] = kept + DIFFERENCE;
            inverse(&placed, &dq, &zero, &mut up);
            dq[j] = kept - DIFFERENCE;
            inverse(&placed, &dq, &zero, &mut down);
            dq[j] = kept;
            for i in 0..n {
                self.damping[(k * n + i) * n + j] = (up[i] - down[i]) / (2.0 * DIFFERENCE);
            }
        }
        let mut mass = vec![0.0; n * n];
        chain.mass_matrix(&q[..n], &mut mass);
        for j in 0..n {
            mass[j * n + j] += arm.armature[j];
        }
        let mass = nalgebra::DMatrix::from_row_slice(n, n, &mass);
        // A massless last link has no inertia at all; a gram at a centimetre keeps the inverse finite.
        let inverse = mass.clone().try_inverse().unwrap_or_else(|| {
            (mass + nalgebra::DMatrix::identity(n, n) * 1e-7)
                .try_inverse()
                .unwrap_or_else(|| nalgebra::DMatrix::identity(n, n))
        });
        for i in 0..n {
            for j in 0..n {
                self.inverse_mass[(k * n + i) * n + j] = inverse[(i, j)];
            }
        }
    }

    /// Returns the column `∂τ/∂θ` of a change to the bodies or to gravity, at every grid point: the
    /// torque per unit of the parameter that the arm needs more than modelled, `len × n`.
    pub fn column(&self, arm: &Arm, change: impl Fn(&mut Chain) + Sync, unit: f64) -> Vec<f64> {
        let n = self.n;
        let mut changed = arm.chain.clone();
        change(&mut changed);
        let mut column = vec![0.0; self.len * n];
        let (mut with, mut without) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        for k in 0..self.len {
            let row = k * n..(k + 1) * n;
            let (q, dq, ddq) =
                (&self.q[row.clone()], &self.dq[row.clone()], &self.ddq[row.clone()]);
            changed.inverse(q, dq, ddq, &mut with[..n]);
            arm.chain.inverse(q, dq, ddq, &mut without[..n]);
            for (to, (with, without)) in column[row].iter_mut().zip(with.iter().zip(&without)) {
                *to = (with - without) / unit;
            }
        }
        column
    }

    /// Returns the columns of bodies that weigh more, as [`Self::column`] does for one unit of each, all of them at once: of each which body and
    /// what more.
    pub fn columns(&self, arm: &Arm, heavier: &[(usize, Excess)]) -> Vec<Vec<f64>> {
        let (n, chain) = (self.n, &arm.chain);
        let mut columns = vec![vec![0.0; self.len * n]; heavier.len()];
        for k in 0..self.len {
            let row = k * n..(k + 1) * n;
            let placed = chain.placed(&self.q[row.clone()]);
            let (dq, ddq) = (&self.dq[row.clone()], &self.ddq[row.clone()]);
            let moved = chain.moved(&placed, &chain.gravity, dq, ddq);
            for (column, (body, excess)) in columns.iter_mut().zip(heavier) {
                chain.inverse_of(&moved, *body, excess, &mut column[row.clone()]);
            }
        }
        columns
    }
}

/// A recording with the arm laid out along it.
#[derive(Debug, Clone)]
pub struct Course {
    /// What was measured.
    pub data: Data,
    /// The arm along the path.
    pub plant: Plant,
    /// Whether the path of the plant is that of the commands, which come late together with it.
    pub follows_command: bool,
    /// Whether the arm rests at the first row.
    pub rests: bool,
    /// Whether the motion is simulated with the controller; otherwise the measured motion is taken as it
    /// is and only torque and tip are predicted.
    pub closed_loop: bool,
    /// Step of the simulation, s.
    pub tick: f64,
    /// How many steps the controller holds its torque.
    pub hold: usize,
    /// Reference position at each tick from the start of the run-in, `ticks × n`, rad.
    pub reference: Vec<f64>,
    /// Its speed, rad/s.
    pub reference_speed: Vec<f64>,
    /// Number of ticks.
    pub ticks: usize,
    /// Rows before this one are not judged: the state before a recording that begins in motion is
    /// not known.
    pub first_row: usize,
    /// Nor are rows from this one on: at the end of a measured motion its acceleration is a guess.
    pub last_row: usize,
    /// Along a measured motion, how well each joint's speed is known, rad/s; empty otherwise.
    pub speed_error: Vec<f64>,
    /// Along a measured motion, what its smoothing looks like in each joint's torque: a gain (beyond 1) and a rotor's
    /// inertia (kg·m²) that are none. Empty otherwise.
    pub smoothing: Vec<[f64; 2]>,
    /// Along a measured motion, whether the sign of a joint's speed is in doubt, `rows × n`: what dry
    /// friction does there nobody can say. Empty otherwise.
    pub in_doubt: Vec<bool>,
    /// Along a measured motion, whether a row has no motion that was measured; empty where all have.
    pub blind: Vec<bool>,
    /// Whether a row decides nothing where the recording is held out.
    pub unseen: Vec<bool>,
}

/// A speed below this many standard deviations may have the other sign.
const DOUBT: f64 = 3.0;

/// An arm slower than this at its first row rests, rad/s.
const REST: f64 = 5e-3;

/// The largest step of the simulation, s; below the time constants of stiff joints.
const LARGEST_TICK: f64 = 1e-3;

/// What is left of an unknown state after this time is below the noise with any sensible gains, s.
const SETTLE: f64 = 0.4;

/// A smoothed motion is not judged this near to its ends, s.
const EDGE: f64 = 0.1;

impl Course {
    /// Returns a joint's values of the plant, `points × n`, at every row.
    pub fn at_rows(&self, values: &[f64], joint: usize) -> Vec<f64> {
        let plant = &self.plant;
        let at = |time: &f64| {
            let k = ((time - plant.start) / plant.step).round() as usize;
            values[k.min(plant.len - 1) * plant.n + joint]
        };
        self.data.time.iter().map(at).collect()
    }

    /// Returns how far a joint typically turns from one row to the next while it turns, rad.
    pub fn typical_step(&self, joint: usize) -> f64 {
        let measured = self.data.measured(Quantity::Position, joint).unwrap_or(&[]);
        let mut steps: Vec<f64> = measured.windows(2).map(|q| (q[1] - q[0]).abs()).collect();
        steps.retain(|step| *step > 0.0);
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Returns how far a joint turns in all, from its lowest angle to its highest, rad.
    pub fn travel(&self, joint: usize) -> f64 {
        let angles = self.plant.q.iter().skip(joint).step_by(self.plant.n.max(1));
        let (low, high) = angles.fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
        (high - low).max(0.0)
    }

    /// Lays the arm out along a recording.
    pub fn new(arm: &Arm, data: Data) -> Self {
        Self::about(arm, data, None)
    }

    /// Lays the arm out about another motion than its commands, one list of rows per joint, rad: what a
    /// simulation said it did.
    pub fn about(arm: &Arm, data: Data, motion: Option<&[Vec<f64>]>) -> Self {
        let n = data.n;
        let controller = arm.controller.as_ref().filter(|_| !data.commands.is_empty());
        let closed_loop = controller.is_some();
        let (from, to) = (data.time[0], data.time[data.n_rows() - 1]);
        let (mut speed_error, mut again) = (Vec::new(), Vec::new());
        let path: Vec<Spline> = if closed_loop || !data.has(Quantity::Position) {
            let exact = |values: &Vec<f64>| super::smooth::unrounded(&data.time, values);
            data.commands.iter().map(|v| Spline::through(&data.time, &exact(v))).collect()
        } else {
            (0..n)
                .map(|j| {
                    let values = data.measured(Quantity::Position, j).unwrap_or(&[]);
                    let smooth = super::smooth::smoothed(&data, j, values);
                    speed_error.push(smooth.speed_error);
                    again.push(Spline::through(&data.time, &smooth.again));
                    Spline::through(&data.time, &smooth.q)
                })
                .collect()
        };
        let mut hint = 0;
        let rests = path.iter().all(|spline| spline.at(from, &mut hint).1.abs() < REST);
        let follows_command = motion.is_none();
        let plant = match motion {
            None => Plant::along(arm, &path, from, to, rests),
            Some(motion) => {
                let about: Vec<Spline> =
                    motion.iter().map(|values| Spline::through(&data.time, values)).collect();
                let mut plant = Plant::along(arm, &about, from, to, rests);
                plant.feed(arm, &path);
                plant
            }
        };
        let (tick, hold) = match controller {
            Some(controller) => {
                let period = 1.0 / controller.rate_hz;
                let hold = (period / LARGEST_TICK - 1e-9).ceil().max(1.0) as usize;
                (period / hold as f64, hold)
            }
            None => (LARGEST_TICK, 1),
        };
        let mut ticks = 0;
        let (mut reference, mut reference_speed) = (Vec::new(), Vec::new());
        if closed_loop {
            ticks = ((to - plant.start) / tick).ceil() as usize + 2;
            reference = vec![0.0; ticks * n];
            reference_speed = vec![0.0; ticks * n];
            for (j, spline) in path.iter().enumerate() {
                let mut hint = 0;
                for k in 0..ticks {
                    let time = plant.start + k as f64 * tick;
                    let (q, dq, _) = if rests && time < from {
                        (spline.at(from, &mut hint).0, 0.0, 0.0)
                    } else {
                        spline.at(time, &mut hint)
                    };
                    reference[k * n + j] = q;
                    reference_speed[k * n + j] = dq;
                }
            }
        }
        let mut first_row = 0;
        let mut last_row = data.n_rows();
        let after = |span: f64| data.time.iter().position(|t| t - from >= span);
        if !closed_loop && data.has(Quantity::Position) {
            first_row = after(EDGE).unwrap_or(0);
            last_row = data.time.iter().position(|t| to - t < EDGE).unwrap_or(last_row);
        } else if !rests {
            first_row = after(SETTLE).unwrap_or(0);
        }
        if last_row <= first_row {
            // Too short to spare any.
            (first_row, last_row) = (0, data.n_rows());
        }
        let in_doubt = in_doubt(&data, &path, &speed_error);
        let blind = if closed_loop { Vec::new() } else { data.blind() };
        let rows = data.n_rows();
        let unseen = (0..rows).map(|row| resample::is_unseen(row, rows)).collect();
        let smoothing = smoothing(arm, &data.time[first_row..last_row], &path, &again);
        Self {
            data,
            plant,
            follows_command,
            rests,
            closed_loop,
            tick,
            hold,
            reference,
            reference_speed,
            ticks,
            first_row,
            last_row,
            speed_error,
            smoothing,
            in_doubt,
            blind,
            unseen,
        }
    }
}

/// Smoothing takes the sharpest of the accelerations away, and with it torque. How much is seen by smoothing once more: returns
/// the gain beyond 1 and the inertia that turn the torques of the second path into those of the first, joint by joint; nothing for
/// a path that was not smoothed.
fn smoothing(arm: &Arm, time: &[f64], once: &[Spline], again: &[Spline]) -> Vec<[f64; 2]> {
    let n = again.len();
    if n == 0 {
        return Vec::new();
    }
    let (mut hints, mut sums) = (vec![[0, 0]; n], vec![[0.0; 4]; n]);
    let [mut first, mut second] = [0, 1].map(|_| [[0.0; MOST_JOINTS]; 4]);
    for &at in time {
        for j in 0..n {
            (first[0][j], first[1][j], first[2][j]) = once[j].at(at, &mut hints[j][0]);
            (second[0][j], second[1][j], second[2][j]) = again[j].at(at, &mut hints[j][1]);
        }
        for [q, dq, ddq, tau] in [&mut first, &mut second] {
            arm.chain.inverse(&q[..n], &dq[..n], &ddq[..n], &mut tau[..n]);
        }
        for (j, sum) in sums.iter_mut().enumerate() {
            let (tau, lost, ddq) = (second[3][j], first[3][j] - second[3][j], second[2][j]);
            let products = [lost * tau, tau * tau, lost * ddq, ddq * ddq];
            sum.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
        }
    }
    let part = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    sums.iter().map(|sum| [part(sum[0], sum[1]), part(sum[2], sum[3])]).collect()
}

/// Finds the rows at which the sign of a joint's speed is in doubt. A joint that hardly ever moves is judged
/// all the same: what it carries shows at rest.
fn in_doubt(data: &Data, path: &[Spline], speed_error: &[f64]) -> Vec<bool> {
    let (rows, n) = (data.n_rows(), speed_error.len());
    let mut doubt = vec![false; rows * n];
    for (j, (spline, error)) in path.iter().zip(speed_error).enumerate() {
        let mut hint = 0;
        let slow = |time: &f64| spline.at(*time, &mut hint).1.abs() < DOUBT * error;
        let slow: Vec<bool> = data.time.iter().map(slow).collect();
        if slow.iter().filter(|is_slow| **is_slow).count() * 2 < rows {
            for (row, is_slow) in slow.into_iter().enumerate() {
                doubt[row * n + j] = is_slow;
            }
        }
    }
    doubt
}
