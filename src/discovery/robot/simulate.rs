//! The closed loop of arm and controller with effects, and what the sensors would have read.
//!
//! [`Model::predict`] gives every channel of a recording for a list of effects. With a known controller
//! the motion is simulated from the commands at the controller's rate; without one the measured motion is
//! taken as it is, and torque and tip are predicted from it.
//!
//! Dry friction holds a joint that it can hold: the torque that would stop the joint within a step,
//! limited to the friction's level, as in a contact solver. Source: Stewart and Trinkle 1996.

#![expect(
    clippy::needless_range_loop,
    reason = "joints index a dozen arrays at once; formulas read better with the index of their source"
)]

use std::collections::BTreeMap;
use std::sync::{Arc as Shared, Mutex};

use nalgebra::{Matrix3, Vector3};

use super::chain::{Chain, MOST_JOINTS, PointMass};
use super::data::Quantity;
use super::plant::{Arm, Scene};
use super::term::{Feature, Law, Term};
use crate::discovery::recording::sidecar::TorqueSensor;

/// A load smaller than this leaves a joint with play somewhere inside its gap, N·m; chosen.
const PLAY_LOAD: f64 = 0.05;

/// How fast a joint caught by friction comes to rest, 1/s: within a hundredth of a second, as gears that
/// give a little and the soft constraints of simulators do.
const STOP: f64 = 105.0;

/// A motor without rotor inertia would be nowhere in its gap; this is less than any, kg·m².
const LEAST_ROTOR: f64 = 1e-3;

/// A measured speed below this may be noise, rad/s; chosen for encoders of arms.
const SPEED_NOISE: f64 = 5e-3;

/// An arm laid out along one recording, ready to be simulated with any effects.
#[derive(Debug)]
pub struct Model {
    /// The arm.
    pub arm: Arm,
    /// The recording.
    pub scene: Scene,
    columns: Mutex<BTreeMap<ColumnKey, Shared<Vec<f64>>>>,
    /// The last few motions, each with the effects that moved it: effects of the sensors alone need no
    /// new simulation.
    motions: Mutex<Vec<Remembered>>,
}

/// A motion and what moved it.
#[derive(Debug, Clone)]
struct Remembered {
    terms: Vec<Term>,
    parameters: Vec<f64>,
    motion: Shared<Motion>,
}

/// Which change to the bodies a torque column is of: kind, joint or body, axis.
type ColumnKey = (u8, usize, u8);

/// How many motions are remembered.
const REMEMBERED: usize = 4;

/// Dry friction: level over speed, per direction.
#[derive(Debug, Clone, Copy)]
struct Dry {
    joint: usize,
    forward: f64,
    backward: f64,
    /// Peak above the level and the speed at which it dies.
    peak: f64,
    velocity: f64,
    /// Below this speed it gives way, rad/s.
    creep: f64,
    /// Whether it gives way evenly and then holds its level (a contact solver's friction) rather than
    /// bending smoothly.
    sharp: bool,
}

impl Dry {
    /// Returns the torque against the motion, its peak judged at `dq`, its creep at `speed`.
    fn torque(&self, dq: f64, speed: f64) -> f64 {
        let level = if speed > 0.0 { self.forward } else { self.backward };
        let peak = self.peak * (-(dq / self.velocity).powi(2)).exp();
        -(level + peak) * (speed / self.creep).tanh()
    }

    /// Returns the torque over a step in which the joint would reach the speed `free` without friction;
    /// `own` is the speed that 1 N·m adds in the step. Implicit, since a creep is stiff.
    fn held(&self, dq: f64, free: f64, own: f64, tick: f64) -> f64 {
        let level = if free > 0.0 { self.forward } else { self.backward };
        let peak = self.peak * (-(dq / self.velocity).powi(2)).exp();
        let level = level + peak;
        if level <= 1e-12 {
            return self.torque(dq, free);
        }
        let slope = own * level / self.creep;
        if self.sharp {
            // A soft stop: the torque that would end the motion within 1/STOP, less what gives way.
            let inverse = own / tick;
            let stop = (free - dq) / tick + STOP * dq;
            return -(stop / (inverse + self.creep * STOP / level)).clamp(-level, level);
        }
        // Newton's method on v = free - own·level·tanh(v/creep), a monotone equation; begun where the
        // tanh is straight or flat.
        let mut v = if free.abs() > own * level + self.creep {
            free - own * level * free.signum()
        } else {
            free / (1.0 + slope)
        };
        for _ in 0..3 {
            let tanh = (v / self.creep).tanh();
            let error = v - free + own * level * tanh;
            v -= error / (1.0 + slope * (1.0 - tanh * tanh));
        }
        -level * (v / self.creep).tanh()
    }
}

/// Friction that remembers the path.
#[derive(Debug, Clone, Copy)]
struct Loop {
    joint: usize,
    torque: f64,
    width: f64,
    z: f64,
}

/// A joint with a gap between motor and link, and where its motor stands: the link's angle is the
/// joint's own.
#[derive(Debug, Clone, Copy)]
struct Gapped {
    joint: usize,
    width: f64,
    rotor: f64,
    angle: f64,
    speed: f64,
}

/// A torque at a joint that depends on its state and time alone.
#[derive(Debug, Clone, Copy)]
enum Smooth {
    Viscous(f64),
    Quadratic(f64),
    Ripple { sine: f64, cosine: f64, order: f64 },
    Periodic { sine: f64, cosine: f64, frequency: f64 },
    Stiffness(f64),
    Cubic(f64),
    Feature(Feature, f64),
    Above(f64, f64),
    Below(f64, f64),
}

impl Smooth {
    fn torque(self, q: f64, dq: f64, time: f64) -> f64 {
        match self {
            Self::Viscous(c) => -c * dq,
            Self::Quadratic(c) => -c * dq * dq.abs(),
            Self::Ripple { sine, cosine, order } => {
                let (s, c) = (order * q).sin_cos();
                sine * s + cosine * c
            }
            Self::Periodic { sine, cosine, frequency } => {
                let (s, c) = (std::f64::consts::TAU * frequency * time).sin_cos();
                sine * s + cosine * c
            }
            Self::Above(c, q0) => c * (q - q0).max(0.0),
            Self::Below(c, q0) => c * (q0 - q).max(0.0),
            Self::Stiffness(c) => -c * q,
            Self::Cubic(c) => -c * q * q * q,
            Self::Feature(feature, c) => c * feature.value(q, dq, time),
        }
    }
}

/// The effects sorted by where they act.
struct Acting {
    delay: f64,
    gain: [f64; MOST_JOINTS],
    limit: [f64; MOST_JOINTS],
    dry: Vec<Dry>,
    smooth: Vec<(usize, Smooth)>,
    loops: Vec<Loop>,
    /// Torque the arm needs more than modelled, by grid point.
    needed: Vec<f64>,
    zero: [f64; MOST_JOINTS],
    compliance: [f64; MOST_JOINTS],
    sag: [f64; MOST_JOINTS],
    play: [f64; MOST_JOINTS],
    torque_gain: [f64; MOST_JOINTS],
    torque_offset: [f64; MOST_JOINTS],
    torque_drift: [f64; MOST_JOINTS],
    lengths: [Vector3<f64>; MOST_JOINTS],
    has_lengths: bool,
    tool: Vector3<f64>,
    shift: Vector3<f64>,
    turn: Matrix3<f64>,
    late: BTreeMap<Quantity, f64>,
}

/// What the simulation leaves behind, `rows × n` each.
#[derive(Debug)]
struct Motion {
    q: Vec<f64>,
    dq: Vec<f64>,
    tau: Vec<f64>,
    load: Vec<f64>,
    /// Where the link stands beyond its encoder in a gap, rad.
    gap: Vec<f64>,
}

impl Model {
    /// Returns the model of an arm along a recording.
    pub fn new(arm: Arm, scene: Scene) -> Self {
        Self { arm, scene, columns: Mutex::new(BTreeMap::new()), motions: Mutex::new(Vec::new()) }
    }

    /// Returns which channels are predicted, in the order of [`Self::predict`]: positions and speeds
    /// only where the motion is simulated.
    pub fn is_predicted(&self, quantity: Quantity) -> bool {
        self.scene.closed_loop || matches!(quantity, Quantity::Torque | Quantity::Tip)
    }

    /// Returns what each predicted channel would have read, one list of rows after the other, SI.
    /// `None` if the motion runs away.
    pub fn predict(&self, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let acting = self.acting(terms, parameters);
        let motion = self.motion(&acting, terms, parameters)?;
        Some(self.observe(&acting, &motion))
    }

    /// Returns the motion, simulated or remembered.
    fn motion(
        &self,
        acting: &Acting,
        terms: &[Term],
        parameters: &[f64],
    ) -> Option<Shared<Motion>> {
        let mut moving = (Vec::new(), Vec::new());
        let mut at = 0;
        for term in terms {
            let count = term.law.slots().len();
            if term.law.moves() {
                moving.0.push(*term);
                moving.1.extend_from_slice(&parameters[at..at + count]);
            }
            at += count;
        }
        let lock = "no thread panics while it holds the lock";
        let same = |known: &&Remembered| known.terms == moving.0 && known.parameters == moving.1;
        if let Some(known) = self.motions.lock().expect(lock).iter().find(same) {
            return Some(Shared::clone(&known.motion));
        }
        let motion = Shared::new(if self.scene.closed_loop {
            self.closed_loop(acting)?
        } else {
            self.measured_motion(acting)
        });
        let mut motions = self.motions.lock().expect(lock);
        if motions.len() == REMEMBERED {
            motions.remove(0);
        }
        let (terms, parameters) = moving;
        motions.push(Remembered { terms, parameters, motion: Shared::clone(&motion) });
        Some(motion)
    }

    /// Returns measured minus predicted in units of noise, in the order of [`Self::predict`]; rows that
    /// are not judged are 0.
    pub fn residuals(&self, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let mut values = self.predict(terms, parameters)?;
        let rows = self.scene.data.n_rows();
        let mut at = 0;
        for channel in &self.scene.data.channels {
            if !self.is_predicted(channel.quantity) {
                continue;
            }
            let part = &mut values[at..at + rows];
            for (row, (value, measured)) in part.iter_mut().zip(&channel.values).enumerate() {
                let judged = (self.scene.first_row..self.scene.last_row).contains(&row);
                *value = if judged { (measured - *value) / channel.noise } else { 0.0 };
            }
            at += rows;
        }
        values.iter().all(|value| value.is_finite()).then_some(values)
    }

    /// Returns how many independent values are judged.
    pub fn count(&self) -> usize {
        let channels = self.scene.data.channels.iter();
        let predicted = channels.filter(|channel| self.is_predicted(channel.quantity)).count();
        predicted * (self.scene.last_row - self.scene.first_row)
    }

    /// Returns the torque column of a change to the bodies, computed once.
    fn column(
        &self,
        key: ColumnKey,
        unit: f64,
        change: impl Fn(&mut Chain) + Sync,
    ) -> Shared<Vec<f64>> {
        if let Some(found) =
            self.columns.lock().expect("no thread panics while it holds the lock").get(&key)
        {
            return Shared::clone(found);
        }
        let column = Shared::new(self.scene.plant.column(&self.arm, change, unit));
        let mut columns = self.columns.lock().expect("no thread panics while it holds the lock");
        Shared::clone(columns.entry(key).or_insert(column))
    }

    /// Sorts effects by where they act.
    fn acting(&self, terms: &[Term], parameters: &[f64]) -> Acting {
        let mut acting = Acting {
            delay: 0.0,
            gain: [1.0; MOST_JOINTS],
            limit: [f64::INFINITY; MOST_JOINTS],
            dry: Vec::new(),
            smooth: Vec::new(),
            loops: Vec::new(),
            needed: Vec::new(),
            zero: [0.0; MOST_JOINTS],
            compliance: [0.0; MOST_JOINTS],
            sag: [0.0; MOST_JOINTS],
            play: [0.0; MOST_JOINTS],
            torque_gain: [1.0; MOST_JOINTS],
            torque_offset: [0.0; MOST_JOINTS],
            torque_drift: [0.0; MOST_JOINTS],
            lengths: [Vector3::zeros(); MOST_JOINTS],
            has_lengths: false,
            tool: Vector3::zeros(),
            shift: Vector3::zeros(),
            turn: Matrix3::identity(),
            late: BTreeMap::new(),
        };
        if let Some(controller) = &self.arm.controller {
            for (limit, known) in acting.limit.iter_mut().zip(&controller.torque_limit_nm) {
                *limit = *known;
            }
        }
        let mut at = 0;
        for term in terms {
            let count = term.law.slots().len();
            self.add(&mut acting, term, &parameters[at..at + count]);
            at += count;
        }
        acting
    }

    fn add(&self, acting: &mut Acting, term: &Term, p: &[f64]) {
        let j = term.joint;
        let sharp = matches!(term.law, Law::Coulomb);
        let dry = |forward, backward, peak, velocity, creep| Dry {
            sharp,
            joint: j,
            forward,
            backward,
            peak,
            velocity,
            creep,
        };
        match term.law {
            Law::Coulomb | Law::SmoothCoulomb => acting.dry.push(dry(p[0], p[0], 0.0, 1.0, p[1])),
            Law::Asymmetric => acting.dry.push(dry(p[0], p[1], 0.0, 1.0, p[2])),
            Law::Stribeck => acting.dry.push(dry(p[0], p[0], p[1], p[2], p[3])),
            Law::Viscous => acting.smooth.push((j, Smooth::Viscous(p[0]))),
            Law::Quadratic => acting.smooth.push((j, Smooth::Quadratic(p[0]))),
            Law::Ripple => {
                let ripple = Smooth::Ripple { sine: p[0], cosine: p[1], order: p[2] };
                acting.smooth.push((j, ripple));
            }
            Law::Periodic => {
                let hum = Smooth::Periodic { sine: p[0], cosine: p[1], frequency: p[2] };
                acting.smooth.push((j, hum));
            }
            Law::Stiffness => acting.smooth.push((j, Smooth::Stiffness(p[0]))),
            Law::CubicStiffness => acting.smooth.push((j, Smooth::Cubic(p[0]))),
            Law::Feature(feature) => acting.smooth.push((j, Smooth::Feature(feature, p[0]))),
            Law::Above => acting.smooth.push((j, Smooth::Above(p[0], p[1]))),
            Law::Below => acting.smooth.push((j, Smooth::Below(p[0], p[1]))),
            Law::Hysteresis => {
                acting.loops.push(Loop { joint: j, torque: p[0], width: p[1], z: 0.0 });
            }
            Law::Payload => self.payload(acting, p),
            Law::Armature => {
                let n = self.scene.plant.n;
                let needed = self.needed(acting);
                for (k, row) in needed.chunks_mut(n).enumerate() {
                    row[j] += p[0] * self.scene.plant.ddq[k * n + j];
                }
            }
            Law::BaseTilt => {
                let g = self.arm.chain.gravity.norm();
                // Linear in the two components of gravity that a tilt brings in, exact in z to first order.
                let tilted = nalgebra::Rotation3::from_euler_angles(p[0], p[1], 0.0)
                    .inverse_transform_vector(&Vector3::new(0.0, 0.0, -g));
                let along = tilted - self.arm.chain.gravity;
                for axis in 0..3 {
                    let column = self.column((0, 0, axis as u8), 1.0, |chain| {
                        chain.gravity[axis] += 1.0;
                    });
                    self.accumulate(acting, &column, along[axis]);
                }
            }
            Law::TorqueOffset => acting.torque_offset[j] += p[0],
            Law::TorqueGain => acting.torque_gain[j] *= p[0],
            Law::TorqueDrift => acting.torque_drift[j] += p[0],
            Law::Compliance => acting.compliance[j] += p[0],
            Law::ServoSag => acting.sag[j] += p[0],
            Law::Backlash => acting.play[j] += p[0],
            Law::CommandDelay => acting.delay += p[0],
            Law::ActuatorGain => acting.gain[j] *= p[0],
            Law::Saturation => acting.limit[j] = acting.limit[j].min(p[0]),
            Law::SensorDelay(quantity) => *acting.late.entry(quantity).or_insert(0.0) += p[0],
            Law::ZeroOffset => acting.zero[j] += p[0],
            Law::LinkLength => {
                acting.lengths[j] += Vector3::new(p[0], p[1], p[2]);
                acting.has_lengths = true;
                for axis in 0..3 {
                    let column = self.column((1, j, axis as u8), 1e-3, |chain| {
                        lengthen(chain, j, axis, 1e-3);
                    });
                    self.accumulate(acting, &column, p[axis]);
                }
            }
            Law::ToolOffset => acting.tool += Vector3::new(p[0], p[1], p[2]),
            Law::CameraShift(free) => {
                let mut all = [0.0; 6];
                let mut values = p.iter();
                for (value, _) in all.iter_mut().zip(free).filter(|(_, free)| *free) {
                    *value = values.next().copied().unwrap_or(0.0);
                }
                acting.shift += Vector3::new(all[0], all[1], all[2]);
                let turn = nalgebra::Rotation3::from_euler_angles(all[3], all[4], all[5]);
                acting.turn *= turn.matrix();
            }
        }
    }

    /// A point mass is linear in mass and mass times place.
    fn payload(&self, acting: &mut Acting, p: &[f64]) {
        let body = self.arm.chain.n() - 1;
        let tip = self.arm.chain.body_from_tip;
        // First moment about the body's origin, in its axes.
        let mass = p[0];
        let moment = tip.rotation * Vector3::new(p[1], p[2], p[3]) + mass * tip.translation.vector;
        // A mass of nothing has no place; its inertia is nothing too.
        let place = if mass.abs() > 1e-3 { moment / mass } else { Vector3::zeros() };
        let column = self.column((2, body, 0), 1.0, |chain| {
            chain.add_point(&PointMass { body, mass: 1.0, moment: Vector3::zeros() });
        });
        self.accumulate(acting, &column, mass);
        for axis in 0..3 {
            let column = self.column((2, body, axis as u8 + 1), 1.0, |chain| {
                let mut moment = Vector3::zeros();
                moment[axis] = 1.0;
                chain.add_point(&PointMass { body, mass: 0.0, moment });
            });
            self.accumulate(acting, &column, moment[axis]);
        }
        for (at, (i, k)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate()
        {
            let column = self.column((3, body, at as u8), 1.0, |chain| {
                let inertia = &mut chain.bodies[body].inertia;
                // -[c]×[c]× = |c|² 1 - c cᵀ, entry by entry of c cᵀ.
                if i == k {
                    for d in (0..3).filter(|d| *d != i) {
                        inertia[(d, d)] += 1.0;
                    }
                } else {
                    inertia[(i, k)] -= 1.0;
                    inertia[(k, i)] -= 1.0;
                }
            });
            self.accumulate(acting, &column, mass * place[i] * place[k]);
        }
    }

    fn needed<'a>(&self, acting: &'a mut Acting) -> &'a mut Vec<f64> {
        if acting.needed.is_empty() {
            acting.needed = vec![0.0; self.scene.plant.len * self.scene.plant.n];
        }
        &mut acting.needed
    }

    fn accumulate(&self, acting: &mut Acting, column: &[f64], factor: f64) {
        if factor.abs() > 0.0 {
            for (to, value) in self.needed(acting).iter_mut().zip(column) {
                *to += factor * value;
            }
        }
    }

    /// Simulates arm and controller from the commands.
    fn closed_loop(&self, acting: &Acting) -> Option<Motion> {
        let Scene { data, plant, .. } = &self.scene;
        let n = plant.n;
        let controller = self.arm.controller.as_ref()?;
        let with_gravity = controller.kind != "pd";
        let (kp, kd) = (&controller.kp_nm_per_rad, &controller.kd_nm_s_per_rad);
        let tick = self.scene.tick;
        let rows = data.n_rows();
        let mut motion = Motion {
            q: vec![0.0; rows * n],
            dq: vec![0.0; rows * n],
            tau: vec![0.0; rows * n],
            load: vec![0.0; rows * n],
            gap: vec![0.0; rows * n],
        };
        let mut loops = acting.loops.clone();
        let mut q = [0.0; MOST_JOINTS];
        let mut dq = [0.0; MOST_JOINTS];
        q[..n].copy_from_slice(&self.scene.reference[..n]);
        dq[..n].copy_from_slice(&self.scene.reference_speed[..n]);
        let mut gapped: Vec<Gapped> = (0..n)
            .filter(|&j| acting.play[j] > 0.0)
            .map(|j| Gapped {
                joint: j,
                width: acting.play[j],
                rotor: self.arm.armature[j].max(LEAST_ROTOR),
                angle: q[j],
                speed: dq[j],
            })
            .collect();
        // What the encoders see: the motor's side of a gap.
        let (mut seen, mut seen_speed) = (q, dq);
        let mut last = (q, dq, [0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        let mut gaps = [0.0; MOST_JOINTS];
        let mut last_gaps = gaps;
        let mut tau = [0.0; MOST_JOINTS];
        let mut load = [0.0; MOST_JOINTS];
        let mut flex = acting.zero;
        let mut row = 0;
        // Where contact is lost and made again a step of a millisecond is coarse.
        let fine = if gapped.is_empty() { 1 } else { 2 };
        let coarse = tick;
        let tick = coarse / fine as f64;
        for k in 0..self.scene.ticks * fine {
            let time = plant.start + k as f64 * tick;
            // Where the reference and the bodies along it stand at this instant.
            let late = (time - acting.delay - plant.start).max(0.0);
            let grid = (late / plant.step).min((plant.len - 2) as f64);
            let g = grid as usize;
            let part = grid - g as f64;
            let (g0, g1) = (g * n, (g + 1) * n);
            let on_grid = |values: &[f64], j: usize| {
                values[g0 + j] + part * (values[g1 + j] - values[g0 + j])
            };
            if k % (self.scene.hold * fine) == 0 {
                let at = (late / coarse).min((self.scene.ticks - 2) as f64);
                let i = at as usize;
                let f = at - i as f64;
                for j in 0..n {
                    let between = |values: &[f64]| {
                        values[i * n + j] + f * (values[(i + 1) * n + j] - values[i * n + j])
                    };
                    let mut asked = kp[j] * (between(&self.scene.reference) - seen[j])
                        + kd[j] * (between(&self.scene.reference_speed) - seen_speed[j]);
                    if with_gravity {
                        asked += on_grid(&plant.feedforward, j);
                    }
                    tau[j] = asked.clamp(-acting.limit[j], acting.limit[j]);
                }
            }
            while row < rows && data.time[row] <= time + 1e-9 {
                // Rows between two ticks are interpolated; most fall on one.
                let back = ((time - data.time[row]) / tick).clamp(0.0, 1.0);
                for j in 0..n {
                    let to = row * n + j;
                    motion.q[to] = seen[j] - back * (seen[j] - last.0[j]);
                    motion.dq[to] = seen_speed[j] - back * (seen_speed[j] - last.1[j]);
                    motion.gap[to] = gaps[j] - back * (gaps[j] - last_gaps[j]);
                    motion.tau[to] = tau[j] - back * (tau[j] - last.2[j]);
                    motion.load[to] = load[j] - back * (load[j] - last.3[j]);
                }
                row += 1;
            }
            if row == rows {
                break;
            }
            last = (seen, seen_speed, tau, load);
            last_gaps = gaps;
            // Torque beyond what the path needs: M q̈ = push.
            let mut push = [0.0; MOST_JOINTS];
            for j in 0..n {
                push[j] = acting.gain[j] * tau[j] - on_grid(&plant.bias, j);
                if !acting.needed.is_empty() {
                    push[j] -= on_grid(&acting.needed, j);
                }
            }
            let mut friction = [0.0; MOST_JOINTS];
            for &(j, law) in &acting.smooth {
                if !matches!(law, Smooth::Viscous(_)) {
                    friction[j] += law.torque(seen[j], seen_speed[j], time - data.time[0]);
                }
            }
            for each in &mut loops {
                let j = each.joint;
                friction[j] -= each.torque * each.z;
                let rate =
                    (seen_speed[j] - seen_speed[j].abs() * each.z * each.z.abs()) / each.width;
                each.z = (each.z + tick * rate).clamp(-1.0, 1.0);
            }
            for j in 0..n {
                push[j] += friction[j];
            }
            let (mut off, mut off_speed) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
            for j in 0..n {
                off[j] = q[j] + flex[j] - on_grid(&plant.q, j);
                off_speed[j] = dq[j] - on_grid(&plant.dq, j);
            }
            let square = g0 * n..(g0 + n) * n;
            let stiffness = &plant.stiffness[square.clone()];
            let damping = &plant.damping[square.clone()];
            let inverse = &plant.inverse_mass[square];
            for i in 0..n {
                let row = i * n..(i + 1) * n;
                let (s, d) = (&stiffness[row.clone()], &damping[row]);
                let mut sum = 0.0;
                for j in 0..n {
                    sum += s[j] * off[j] + d[j] * off_speed[j];
                }
                push[i] -= sum;
            }
            let mut ddq = [0.0; MOST_JOINTS];
            for i in 0..n {
                let m = &inverse[i * n..(i + 1) * n];
                let mut sum = 0.0;
                for j in 0..n {
                    sum += m[j] * push[j];
                }
                ddq[i] = sum;
            }
            for &(j, law) in &acting.smooth {
                // Implicit: a thick fluid on a light joint is stiff.
                if let Smooth::Viscous(c) = law {
                    let ahead = 0.75 * tick;
                    let own = inverse[j * n + j] * ahead;
                    let torque = -c * (seen_speed[j] + ahead * ddq[j]) / (1.0 + c * own);
                    friction[j] += torque;
                    for (i, acceleration) in ddq[..n].iter_mut().enumerate() {
                        *acceleration += inverse[i * n + j] * torque;
                    }
                }
            }
            for dry in &acting.dry {
                let j = dry.joint;
                let own = inverse[j * n + j] * tick;
                let free = dq[j] + tick * ddq[j];
                let torque = dry.held(dq[j], free, own, tick);
                friction[j] += torque;
                for (i, acceleration) in ddq[..n].iter_mut().enumerate() {
                    *acceleration += inverse[i * n + j] * torque;
                }
            }
            for gap in &mut gapped {
                // The link swings free of its rotor, unless that would leave the gap: then the impulse
                // between the two keeps it inside (Stewart and Trinkle's time stepping).
                let j = gap.joint;
                let own = inverse[j * n + j];
                let motor = acting.gain[j] * tau[j] + friction[j];
                let share = (1.0 - gap.rotor * own).max(1e-3);
                // Without rotor and motor torque: the inverse of the mass matrix less the rotor.
                let pull = (ddq[j] * gap.rotor - motor) / share;
                for (i, acceleration) in ddq[..n].iter_mut().enumerate() {
                    *acceleration += inverse[i * n + j] * pull;
                }
                let free = dq[j] + tick * ddq[j] - (gap.speed + tick * motor / gap.rotor);
                let offset = q[j] - gap.angle;
                let half = 0.5 * gap.width;
                let kept = free.clamp((-half - offset) / tick, (half - offset) / tick);
                let link_own = own / share;
                let through = (kept - free) / (tick * (link_own + 1.0 / gap.rotor));
                for (i, acceleration) in ddq[..n].iter_mut().enumerate() {
                    *acceleration += inverse[i * n + j] / share * through;
                }
                gap.speed += tick * (motor - through) / gap.rotor;
                gap.angle += tick * gap.speed;
                load[j] = through;
            }
            for j in 0..n {
                // What goes through the gear: the motor's torque and what acts beside it, less what
                // turns the rotor.
                if acting.play[j] <= 0.0 {
                    load[j] = acting.gain[j] * tau[j] + friction[j] - self.arm.armature[j] * ddq[j];
                }
                // A coarse step is two half steps of a semi-implicit integrator in one.
                let part = if fine == 1 { 0.75 } else { 1.0 };
                q[j] += tick * (dq[j] + part * tick * ddq[j]);
                dq[j] += tick * ddq[j];
                flex[j] = acting.zero[j] - acting.compliance[j] * load[j];
            }
            (seen, seen_speed) = (q, dq);
            for gap in &gapped {
                seen[gap.joint] = gap.angle;
                seen_speed[gap.joint] = gap.speed;
                gaps[gap.joint] = q[gap.joint] - gap.angle;
            }
            if !q[..n].iter().all(|angle| angle.abs() < 1e4) {
                return None;
            }
        }
        Some(motion)
    }

    /// Takes the path of the plant as the motion and works out the torques it needed.
    fn measured_motion(&self, acting: &Acting) -> Motion {
        let Scene { data, plant, .. } = &self.scene;
        let n = plant.n;
        let rows = data.n_rows();
        let has_position = data.has(Quantity::Position);
        let mut motion = Motion {
            q: vec![0.0; rows * n],
            dq: vec![0.0; rows * n],
            tau: vec![0.0; rows * n],
            load: vec![0.0; rows * n],
            gap: vec![0.0; rows * n],
        };
        let mut loops = acting.loops.clone();
        // The path is the measured motion, or the command where no motion was measured; only a command
        // can be late, or be followed with a sag.
        let delay = if has_position { 0.0 } else { acting.delay };
        let mut last = data.time[0];
        for (row, &time) in data.time.iter().enumerate() {
            let grid =
                ((time - delay - plant.start) / plant.step).clamp(0.0, (plant.len - 2) as f64);
            let g = grid as usize;
            let part = grid - g as f64;
            let on_grid = |values: &[f64], j: usize| {
                let (a, b) = (values[g * n + j], values[(g + 1) * n + j]);
                a + part * (b - a)
            };
            let mut ddq = [0.0; MOST_JOINTS];
            for j in 0..n {
                motion.q[row * n + j] = on_grid(&plant.q, j);
                motion.dq[row * n + j] = on_grid(&plant.dq, j);
                ddq[j] = on_grid(&plant.ddq, j);
            }
            let (q, dq) = (&motion.q[row * n..(row + 1) * n], &motion.dq[row * n..(row + 1) * n]);
            let mut load = [0.0; MOST_JOINTS];
            self.arm.chain.inverse(q, dq, &ddq[..n], &mut load[..n]);
            let mut motor = [0.0; MOST_JOINTS];
            for j in 0..n {
                if !acting.needed.is_empty() {
                    load[j] += on_grid(&acting.needed, j);
                }
                motor[j] = load[j] + self.arm.armature[j] * ddq[j];
            }
            for &(j, law) in &acting.smooth {
                motor[j] -= law.torque(q[j], dq[j], time - data.time[0]);
            }
            for each in &mut loops {
                let j = each.joint;
                // Small steps: the state turns within its width.
                let span = (time - last).max(0.0);
                let steps = ((span * dq[j].abs() / (0.2 * each.width)).ceil()).clamp(1.0, 1e4);
                let h = span / steps;
                for _ in 0..steps as usize {
                    let rate = (dq[j] - dq[j].abs() * each.z * each.z.abs()) / each.width;
                    each.z = (each.z + h * rate).clamp(-1.0, 1.0);
                }
                motor[j] += each.torque * each.z;
            }
            for dry in &acting.dry {
                let j = dry.joint;
                // Near standstill the measured speed does not tell the sign.
                let softer = Dry { creep: dry.creep.max(SPEED_NOISE), ..*dry };
                motor[j] -= softer.torque(dq[j], dq[j]);
            }
            for j in 0..n {
                let at = row * n + j;
                motion.load[at] = load[j];
                motion.gap[at] = -play(acting.play[j], load[j]);
                let asked = motor[j] / acting.gain[j];
                motion.tau[at] = asked.clamp(-acting.limit[j], acting.limit[j]);
            }
            if !has_position {
                for j in 0..n {
                    motion.q[row * n + j] -= acting.sag[j] * load[j];
                }
            }
            last = time;
        }
        motion
    }

    /// Turns a motion into what the sensors read.
    fn observe(&self, acting: &Acting, motion: &Motion) -> Vec<f64> {
        let Scene { data, plant, .. } = &self.scene;
        let n = plant.n;
        let rows = data.n_rows();
        let mut out = Vec::with_capacity(data.channels.len() * rows);
        let mut tips: Vec<Vector3<f64>> = Vec::new();
        for channel in &data.channels {
            if !self.is_predicted(channel.quantity) {
                continue;
            }
            let from = out.len();
            let j = channel.index;
            match channel.quantity {
                Quantity::Position => out.extend((0..rows).map(|row| motion.q[row * n + j])),
                Quantity::Speed => out.extend((0..rows).map(|row| motion.dq[row * n + j])),
                Quantity::Torque => {
                    let read = match self.arm.torque_sensor {
                        TorqueSensor::Motor => &motion.tau,
                        TorqueSensor::Link => &motion.load,
                    };
                    out.extend((0..rows).map(|row| {
                        acting.torque_gain[j] * read[row * n + j]
                            + acting.torque_offset[j]
                            + acting.torque_drift[j] * (data.time[row] - data.time[0])
                    }));
                }
                Quantity::Tip => {
                    if tips.is_empty() {
                        tips = self.tips(acting, motion);
                    }
                    out.extend(tips.iter().map(|tip| tip[j]));
                }
            }
            if let Some(delay) = acting.late.get(&channel.quantity) {
                let shifted = delayed(&data.time, &out[from..], *delay);
                out[from..].copy_from_slice(&shifted);
            }
        }
        out
    }

    /// Returns where the tracker sees the tip at every row.
    fn tips(&self, acting: &Acting, motion: &Motion) -> Vec<Vector3<f64>> {
        let n = self.scene.plant.n;
        let mut chain = None;
        if acting.has_lengths {
            let mut longer = self.arm.chain.clone();
            for (j, length) in acting.lengths.iter().take(n).enumerate() {
                for axis in 0..3 {
                    lengthen(&mut longer, j, axis, length[axis]);
                }
            }
            chain = Some(longer);
        }
        let chain = chain.as_ref().unwrap_or(&self.arm.chain);
        let moved = acting.tool.norm() > 0.0;
        let mut chain_with_tool;
        let chain = if moved {
            chain_with_tool = chain.clone();
            chain_with_tool.body_from_tip *= nalgebra::Translation3::from(acting.tool);
            &chain_with_tool
        } else {
            chain
        };
        let mut q = [0.0; MOST_JOINTS];
        (0..self.scene.data.n_rows())
            .map(|row| {
                for j in 0..n {
                    let load = motion.load[row * n + j];
                    q[j] = motion.q[row * n + j] + motion.gap[row * n + j] + acting.zero[j]
                        - acting.compliance[j] * load;
                }
                acting.turn * chain.tip(&q[..n]) + acting.shift
            })
            .collect()
    }
}

/// Returns how far the link hangs behind its encoder in a gap of this width, rad.
fn play(width: f64, load: f64) -> f64 {
    if width > 0.0 { 0.5 * width * (load / PLAY_LOAD).tanh() } else { 0.0 }
}

/// Moves joint `j` along one axis of the link before it, m.
fn lengthen(chain: &mut Chain, j: usize, axis: usize, by: f64) {
    let mut shift = Vector3::zeros();
    shift[axis] = by;
    chain.bodies[j].parent_from_body.translation.vector += shift;
}

/// Returns what a channel reads that is `delay` s late (early, if negative): cubic between rows.
fn delayed(time: &[f64], values: &[f64], delay: f64) -> Vec<f64> {
    let spline = super::spline::Spline::through(time, values);
    let mut hint = 0;
    let (first, last) = (time[0], time[time.len() - 1]);
    time.iter().map(|t| spline.at((t - delay).clamp(first, last), &mut hint).0).collect()
}
