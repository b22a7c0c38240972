//! Every effect that an arm might lack, given what was recorded and what is left unexplained.
//!
//! Laws with a shape (the order of a ripple, the width of a hysteresis) need somewhere to begin: orders
//! and frequencies come from a scan of the residual, the others from a few values spread over what is
//! physically sensible.

use std::f64::consts::TAU;

use super::data::Quantity;
use super::simulate::Model;
use super::term::{Feature, Law, SHIFTS, Term};
use crate::discovery::finding::{SIGNIFICANT, above_noise};
use crate::discovery::selection::{Candidate, Set, sum_of_squares};

/// What an effect without a name must explain more, in the units of the criterion: there are many more
/// formulas than names. Chosen: a factor of 400 in odds.
const UNNAMED: f64 = 12.0;

/// Where the creep of dry friction begins to be fitted, rad/s: slow against any motion on purpose.
const CREEP: f64 = 1e-3;

/// Returns the effects to try on top of `present`, at `joints` and on the whole arm; `left` are the
/// residuals in units of noise.
pub fn candidates(
    model: &Model,
    present: &[Term],
    left: &[f64],
    joints: impl Iterator<Item = usize>,
) -> Vec<Candidate<Term>> {
    let data = &model.scene.data;
    let joints: Vec<usize> = joints.collect();
    let mut found = Vec::new();
    let mut add = |law: Law, joint: usize, starts: Vec<Vec<f64>>, surcharge: f64| {
        let starts = if starts.is_empty() { vec![neutral(law)] } else { starts };
        found.push(Candidate { term: Term { law, joint }, with: Vec::new(), starts, surcharge });
    };
    let torque = data.has(Quantity::Torque);
    let tip = data.has(Quantity::Tip);
    let closed = model.scene.closed_loop;
    // Whether a torque at a joint shows anywhere.
    let effort = closed || torque;
    let n = model.scene.plant.n;
    // A motion that is simulated shows creep as such; along a measured one only the rows about standstill
    // do, and a fit that begins on their wrong side stays there.
    let creeps: &[f64] = if closed { &[CREEP] } else { &[CREEP, 4.0 * CREEP, 16.0 * CREEP] };
    for &j in &joints {
        if effort {
            for law in
                [Law::Viscous, Law::Quadratic, Law::Armature, Law::Stiffness, Law::CubicStiffness]
            {
                add(law, j, Vec::new(), 0.0);
            }
            let creeps = |before: &[f64]| {
                creeps.iter().map(|creep| [before, &[*creep]].concat()).collect::<Vec<_>>()
            };
            add(Law::Coulomb, j, creeps(&[0.0]), 0.0);
            if closed {
                // Along a measured motion the two corners look the same.
                add(Law::SmoothCoulomb, j, creeps(&[0.0]), 0.0);
            }
            add(Law::Asymmetric, j, creeps(&[0.0, 0.0]), 0.0);
            let peaks = [0.02, 0.08, 0.3].map(|speed| vec![0.0, 0.0, speed, CREEP]);
            add(Law::Stribeck, j, peaks.to_vec(), 0.0);
            add(Law::Hysteresis, j, shaped(Law::Hysteresis, &[0.004, 0.02, 0.1]), 0.0);
            let scan = Scan::new(model, j, left);
            let orders = scan.orders();
            if !orders.is_empty() {
                add(Law::Ripple, j, shaped(Law::Ripple, &orders), 0.0);
            }
            add(Law::Periodic, j, shaped(Law::Periodic, &scan.frequencies()), 0.0);
            if shows(model, left, j) {
                for (law, starts) in formulas(&scan.edges(), &orders, closed) {
                    add(law, j, starts, UNNAMED);
                }
            }
            // Along a measured motion it is a gain of the sensor.
            if closed || !data.has(Quantity::Position) {
                add(Law::ActuatorGain, j, Vec::new(), 0.0);
            }
            let most = scan.largest_torque;
            let limits: Vec<Vec<f64>> =
                [0.97, 0.9, 0.8, 0.65, 0.5, 0.35].iter().map(|part| vec![part * most]).collect();
            if most > 0.0 {
                add(Law::Saturation, j, limits, 0.0);
            }
        }
        // What the first link weighs no joint about the vertical feels.
        if torque && !closed && (1..n).contains(&j) {
            add(Law::LinkMass, j, Vec::new(), 0.0);
        }
        if torque {
            for law in [Law::TorqueOffset, Law::TorqueGain, Law::TorqueDrift] {
                add(law, j, Vec::new(), 0.0);
            }
        }
        if tip {
            // From no gap to a wide one: where contact is lost and made again does not change evenly.
            let widths = [0.0, 0.004, 0.012, 0.03].map(|width| vec![width]);
            add(Law::Backlash, j, widths.to_vec(), 0.0);
            for law in [Law::ZeroOffset, Law::Compliance] {
                add(law, j, Vec::new(), 0.0);
            }
            // Where the first joint sits in the base is where the tracker sees the base.
            if j > 0 {
                add(Law::LinkLength, j, Vec::new(), 0.0);
            }
            if !closed && !data.has(Quantity::Position) {
                add(Law::ServoSag, j, Vec::new(), 0.0);
            }
        }
    }
    if !tip && model.feels_zeros() {
        // About the first joint's axis, which gravity is along, a zero weighs nothing.
        for &j in joints.iter().filter(|&&j| j > 0) {
            add(Law::ZeroOffset, j, Vec::new(), 0.0);
        }
    }
    if effort {
        add(Law::Payload, 0, Vec::new(), 0.0);
        add(Law::BaseTilt, 0, Vec::new(), 0.0);
    }
    if closed || (!data.commands.is_empty() && !data.has(Quantity::Position)) {
        add(Law::CommandDelay, 0, Vec::new(), 0.0);
    }
    for quantity in [Quantity::Position, Quantity::Speed, Quantity::Torque, Quantity::Tip] {
        if data.has(quantity) && model.is_predicted(quantity) {
            add(Law::SensorDelay(quantity), 0, Vec::new(), 0.0);
        }
    }
    if tip {
        add(Law::ToolOffset, 0, Vec::new(), 0.0);
        for free in SHIFTS {
            add(Law::CameraShift(free), 0, Vec::new(), 0.0);
        }
    }
    if effort && !closed {
        // The friction of a real joint is dry and fluid at once, and its sensor has an offset. Where the
        // motion is measured nothing else tells the three from one law that bends, or differs with
        // direction, so they are tried together.
        for joint in joints {
            for with in [&[Law::Viscous][..], &[Law::Viscous, Law::TorqueOffset]] {
                found.push(Candidate {
                    term: Term { law: Law::Coulomb, joint },
                    with: with.iter().map(|&law| Term { law, joint }).collect(),
                    starts: creeps.iter().map(|creep| vec![0.0, *creep]).collect(),
                    surcharge: 0.0,
                });
            }
        }
    }
    found.retain(|candidate| !present.contains(&candidate.term));
    found
}

/// Returns the parameters at which a law does nothing.
fn neutral(law: Law) -> Vec<f64> {
    law.slots().iter().map(|slot| slot.neutral.unwrap_or(0.0)).collect()
}

/// Returns whether more than noise is left of what a joint's own sensors read, or it has none: a torque without a name shows
/// there before it shows anywhere else.
fn shows(model: &Model, left: &[f64], joint: usize) -> bool {
    let rows = model.scene.data.n_rows();
    let channels = model.scene.data.channels.iter().filter(|c| model.is_predicted(c.quantity));
    let own = channels.enumerate().filter(|(_, c)| c.quantity != Quantity::Tip && c.index == joint);
    let mut has_own = false;
    own.fold(false, |shows, (at, channel)| {
        has_own = true;
        let sum = sum_of_squares(&left[at * rows..(at + 1) * rows]);
        shows || above_noise(sum, model.judged(channel, Set::Train)) > SIGNIFICANT
    }) || !has_own
}

/// How fast what warms up fades, to begin with, s.
const FADES: [f64; 1] = [8.0];

/// Returns the words of a formula for a torque without a name, each with where its shape begins.
fn formulas(edges: &[f64], orders: &[f64], closed: bool) -> Vec<(Law, Vec<Vec<f64>>)> {
    use Feature::{
        Cosine, Decay, FrictionTimesCosine, FrictionTimesDistance, FrictionTimesLoad,
        FrictionTimesSine, One, PositionTimesSpeed, RootSpeed, Sine, SpeedCubed, Square, Time,
    };
    let mut words = vec![
        Square,
        Sine(1.0),
        Cosine(1.0),
        Sine(2.0),
        Cosine(2.0),
        PositionTimesSpeed,
        FrictionTimesDistance,
        FrictionTimesSine,
        FrictionTimesCosine,
        SpeedCubed,
        RootSpeed,
        Decay(1.0),
        Decay(5.0),
        FrictionTimesLoad,
    ];
    if closed {
        // Where torque is all that shows, a constant and a trend of it have names.
        words.extend([One, Time]);
    }
    let shapes = [
        (Law::Above, edges),
        (Law::Below, edges),
        (Law::LoadRipple, &orders[..orders.len().min(1)]),
        (Law::FadingDry, &FADES),
        (Law::FadingFluid, &FADES),
    ];
    let shapes = shapes.into_iter().filter(|(_, shapes)| !shapes.is_empty());
    let shapes = shapes.map(|(law, shapes)| (law, shaped(law, shapes)));
    shapes.chain(words.into_iter().map(|word| (Law::Feature(word), Vec::new()))).collect()
}

/// Returns the law doing nothing in each of the given shapes; its last parameter is the shape.
fn shaped(law: Law, shapes: &[f64]) -> Vec<Vec<f64>> {
    shapes
        .iter()
        .map(|shape| {
            let mut start = neutral(law);
            if let Some(last) = start.last_mut() {
                *last = *shape;
            }
            start
        })
        .collect()
}

/// Sine and cosine of `k·x` for every `x`, for one `k` after the other at even steps: each step turns every
/// pointer a little, and no sine is worked out again.
struct Pointers {
    sine: Vec<f64>,
    cosine: Vec<f64>,
    /// Sine and cosine of `step·x`.
    turns: Vec<(f64, f64)>,
}

impl Pointers {
    fn new(x: &[f64], first: f64, step: f64) -> Self {
        Self {
            sine: x.iter().map(|x| (first * x).sin()).collect(),
            cosine: x.iter().map(|x| (first * x).cos()).collect(),
            turns: x.iter().map(|x| (step * x).sin_cos()).collect(),
        }
    }

    fn turn(&mut self) {
        for ((sine, cosine), (s, c)) in self.sine.iter_mut().zip(&mut self.cosine).zip(&self.turns)
        {
            (*sine, *cosine) = (*sine * c + *cosine * s, *cosine * c - *sine * s);
        }
    }
}

/// One joint's residuals and motion, looked at through its own position loop alone.
struct Scan {
    time: Vec<f64>,
    q: Vec<f64>,
    first_row: usize,
    /// Residuals of torque and position in units of noise, and the noise.
    torque: Option<(Vec<f64>, f64)>,
    position: Option<(Vec<f64>, f64)>,
    /// Inertia, kp, kd of the joint's loop; `None` without a controller.
    own: Option<(f64, f64, f64)>,
    largest_torque: f64,
}

impl Scan {
    fn new(model: &Model, j: usize, left: &[f64]) -> Self {
        let scene = &model.scene;
        let (data, plant) = (&scene.data, &scene.plant);
        let rows = data.n_rows();
        let (mut torque, mut position) = (None, None);
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let part = || (left[at * rows..(at + 1) * rows].to_vec(), channel.noise);
            match channel.quantity {
                Quantity::Torque if channel.index == j => torque = Some(part()),
                Quantity::Position if channel.index == j => position = Some(part()),
                _ => {}
            }
        }
        let n = plant.n;
        let q = data
            .time
            .iter()
            .map(|time| {
                let k = ((time - plant.start) / plant.step).round() as usize;
                plant.q[k.min(plant.len - 1) * n + j]
            })
            .collect();
        let controller = model.arm.controller.as_ref().filter(|_| scene.closed_loop);
        let own = controller.map(|controller| {
            let middle = plant.len / 2;
            let inverse = plant.inverse_mass[(middle * n + j) * n + j];
            (1.0 / inverse, controller.kp_nm_per_rad[j], controller.kd_nm_s_per_rad[j])
        });
        let largest_torque = data
            .measured(Quantity::Torque, j)
            .map_or(0.0, |values| values.iter().fold(0.0_f64, |most, value| most.max(value.abs())));
        Self {
            time: data.time.clone(),
            q,
            first_row: scene.first_row,
            torque,
            position,
            own,
            largest_torque,
        }
    }

    /// Returns how much a disturbance of sine and cosine could explain of this joint's residuals.
    fn explains(&self, basis: [&[f64]; 2]) -> f64 {
        let mut columns: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        let mut target: Vec<f64> = Vec::new();
        for (column, disturbance) in columns.iter_mut().zip(basis) {
            let (tau, q) = self.response(disturbance);
            if let Some((_, noise)) = &self.torque {
                column.extend(tau[self.first_row..].iter().map(|value| value / noise));
            }
            if let Some((_, noise)) = &self.position {
                column.extend(q[self.first_row..].iter().map(|value| value / noise));
            }
        }
        for (residual, _) in [&self.torque, &self.position].into_iter().flatten() {
            target.extend(&residual[self.first_row..]);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let [s, c] = &columns;
        let (ss, sc, cc) = (dot(s, s), dot(s, c), dot(c, c));
        let (st, ct) = (dot(s, &target), dot(c, &target));
        let determinant = ss * cc - sc * sc;
        if determinant < 1e-6 * ss * cc {
            return 0.0;
        }
        (cc * st * st - 2.0 * sc * st * ct + ss * ct * ct) / determinant
    }

    /// Returns what a torque at the joint changes in its torque and position channels.
    fn response(&self, disturbance: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let rows = disturbance.len();
        let Some((inertia, kp, kd)) = self.own else {
            return (disturbance.iter().map(|d| -d).collect(), vec![0.0; rows]);
        };
        let (mut tau, mut angle) = (vec![0.0; rows], vec![0.0; rows]);
        let (mut q, mut dq) = (disturbance[0] / kp.max(1e-9), 0.0);
        for row in 0..rows {
            angle[row] = q;
            tau[row] = -kp * q - kd * dq;
            if row + 1 == rows {
                break;
            }
            let span = self.time[row + 1] - self.time[row];
            let steps = (span / 2e-3).ceil().clamp(1.0, 1e3);
            let h = span / steps;
            for step in 0..steps as usize {
                let part = step as f64 / steps;
                let d = disturbance[row] + part * (disturbance[row + 1] - disturbance[row]);
                // Implicit in the damping, which may be stiff.
                dq = (dq + h * (d - kp * q) / inertia) / (1.0 + h * kd / inertia);
                q += h * dq;
            }
        }
        (tau, angle)
    }

    /// Returns the places of the best peaks of `score` over `grid`, best first.
    fn peaks(grid: &[f64], score: &[f64], count: usize) -> Vec<f64> {
        let mut peaks: Vec<(f64, f64)> = (0..grid.len())
            .filter(|&i| {
                (i == 0 || score[i] >= score[i - 1])
                    && (i + 1 == grid.len() || score[i] > score[i + 1])
            })
            .map(|i| (score[i], grid[i]))
            .collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.into_iter().take(count).map(|(_, at)| at).collect()
    }

    /// Returns the orders of a ripple worth trying; none where the joint hardly turns.
    fn orders(&self) -> Vec<f64> {
        let (low, high) =
            self.q.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
        let range = high - low;
        if range < 0.05 {
            return Vec::new();
        }
        // Two orders closer than this look alike over the range; half a step still finds the peak.
        let step = (1.5 / range).clamp(0.05, 2.0);
        // Half a period must not be jumped over between rows, and a full one must fit in the range.
        let fastest =
            self.q.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max).max(1e-6);
        let (first, last) = ((TAU / range).max(1.0), (1.2 / fastest).min(120.0));
        let count = (((last - first) / step).max(1.0) as usize).min(200);
        let grid: Vec<f64> = (0..count).map(|i| first + step * i as f64).collect();
        let mut pointers = Pointers::new(&self.q, first, step);
        let score: Vec<f64> = grid
            .iter()
            .map(|_| {
                let score = self.explains([&pointers.sine, &pointers.cosine]);
                pointers.turn();
                score
            })
            .collect();
        Self::peaks(&grid, &score, 2)
    }

    /// Returns the frequencies of a hum worth trying, Hz.
    fn frequencies(&self) -> Vec<f64> {
        let Some((residual, _)) = self.torque.as_ref().or(self.position.as_ref()) else {
            return vec![1.0];
        };
        let rows = residual.len();
        let span = self.time[rows - 1] - self.time[0];
        let rate = (rows - 1) as f64 / span;
        // From one period in the recording to half the sampling rate, two points to a line's width.
        let step = 0.5 / span;
        let count = ((0.45 * rate / step) as usize).min(1200);
        let grid: Vec<f64> = (2..count.max(3)).map(|i| step * i as f64).collect();
        let since: Vec<f64> = self.time.iter().map(|time| TAU * (time - self.time[0])).collect();
        let mut pointers = Pointers::new(&since, 2.0 * step, step);
        let dot = |a: &[f64]| a.iter().zip(residual).map(|(a, b)| a * b).sum::<f64>();
        let score: Vec<f64> = grid
            .iter()
            .map(|_| {
                let score = dot(&pointers.sine).powi(2) + dot(&pointers.cosine).powi(2);
                pointers.turn();
                score
            })
            .collect();
        Self::peaks(&grid, &score, 1)
    }

    /// Returns places within the range of motion where a one-sided spring could begin.
    fn edges(&self) -> Vec<f64> {
        let (low, high) =
            self.q.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
        [0.1, 0.3, 0.5, 0.7, 0.9].iter().map(|part| low + part * (high - low)).collect()
    }
}
