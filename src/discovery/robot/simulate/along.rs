//! The torques that a measured motion needed, with effects.

use std::sync::{Arc as Shared, Mutex, PoisonError};

use super::super::chain::MOST_JOINTS;
use super::super::channels::Quantity;
use super::super::plant::Course;
use super::active::ActiveEffects;
use super::friction::{self, Dry};
use super::{GridPoint, Model, Motion};

/// A load smaller than this leaves a joint with play somewhere inside its gap, N·m; chosen.
const PLAY_LOAD: f64 = 0.05;

/// So many creeps of a joint are remembered: that of the effects, and two that a derivative looks at.
const KEPT: usize = 3;

/// How dry friction of a joint bends with its speed.
#[derive(Debug)]
struct Bend {
    joint: usize,
    /// rad/s.
    creep: f64,
    by_row: Shared<Vec<f64>>,
}

/// A path row by row, and the torques its bodies need, `rows × n` each.
#[derive(Debug)]
pub(super) struct Bare {
    /// Where each row lies on the grid of the plant.
    points: Vec<GridPoint>,
    q: Shared<Vec<f64>>,
    dq: Shared<Vec<f64>>,
    ddq: Vec<f64>,
    load: Vec<f64>,
    /// Oldest first.
    bends: Mutex<Vec<Bend>>,
}

impl Bare {
    /// Takes the path of the plant as the motion, `delay` s late.
    fn of(model: &Model, delay: f64) -> Self {
        let Course { data, plant, .. } = &model.course;
        let n = plant.n;
        let [mut q, mut dq, mut ddq, mut load] =
            std::array::from_fn(|_| vec![0.0; data.n_rows() * n]);
        let points: Vec<GridPoint> =
            data.time.iter().map(|time| GridPoint::at(plant, time - delay)).collect();
        for (row, here) in points.iter().enumerate() {
            let at = row * n..(row + 1) * n;
            for j in 0..n {
                q[row * n + j] = here.of(&plant.q, j);
                dq[row * n + j] = here.of(&plant.dq, j);
                ddq[row * n + j] = here.of(&plant.ddq, j);
            }
            let chain = &model.arm.chain;
            chain.inverse(&q[at.clone()], &dq[at.clone()], &ddq[at.clone()], &mut load[at]);
        }
        let (q, dq) = (Shared::new(q), Shared::new(dq));
        Self { points, q, dq, ddq, load, bends: Mutex::default() }
    }

    /// Returns [`friction::bent`] of a joint's speed over a creep (rad/s), row by row: most changes of the effects leave
    /// it as it was.
    fn bend(&self, joint: usize, n: usize, creep: f64) -> Shared<Vec<f64>> {
        let lock = || self.bends.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |bend: &&Bend| bend.joint == joint && bend.creep.to_bits() == creep.to_bits();
        if let Some(bend) = lock().iter().find(is_same) {
            return Shared::clone(&bend.by_row);
        }
        let speeds = self.dq.iter().skip(joint).step_by(n);
        let by_row: Shared<Vec<f64>> =
            Shared::new(speeds.map(|dq| friction::bent(dq / creep)).collect());
        let mut bends = lock();
        let of_joint = bends.iter().filter(|bend| bend.joint == joint).count();
        let oldest = bends.iter().position(|bend| bend.joint == joint);
        if let Some(oldest) = oldest.filter(|_| of_joint >= KEPT) {
            bends.remove(oldest);
        }
        bends.push(Bend { joint, creep, by_row: Shared::clone(&by_row) });
        by_row
    }
}

/// Takes the path of the plant as the motion and works out the torques it needed.
pub(super) fn measured(model: &Model, active: &ActiveEffects) -> Motion {
    let data = &model.course.data;
    let n = model.course.plant.n;
    let rows = data.n_rows();
    let has_position = data.has(Quantity::Position);
    // The path is the measured motion, or the command where no motion was measured; only a command
    // can be late, or be followed with a sag.
    let delay = if has_position { 0.0 } else { active.delay };
    let late;
    let bare = if delay.abs() > 0.0 {
        late = Bare::of(model, delay);
        &late
    } else {
        model.bare.get_or_init(|| Bare::of(model, 0.0))
    };
    let mut motion = Motion {
        q: Shared::clone(&bare.q),
        dq: Shared::clone(&bare.dq),
        load: bare.load.clone(),
        tau: vec![0.0; rows * n],
        gap: vec![0.0; rows * n],
    };
    let mut loops = active.loops.clone();
    let dry: Vec<(&Dry, Shared<Vec<f64>>)> = active
        .dry
        .iter()
        .map(|dry| {
            // Near standstill the measured speed does not tell the sign.
            let unsure = model.course.speed_error.get(dry.joint).copied().unwrap_or(0.0);
            (dry, bare.bend(dry.joint, n, dry.creep.max(unsure)))
        })
        .collect();
    let mut last = data.time[0];
    for (row, &time) in data.time.iter().enumerate() {
        let at = row * n..(row + 1) * n;
        if !active.needed.is_empty() {
            let more = bare.points[row].all(&active.needed);
            for (load, more) in motion.load[at.clone()].iter_mut().zip(more) {
                *load += more;
            }
        }
        let (q, dq, load) = (&bare.q[at.clone()], &bare.dq[at.clone()], &motion.load[at.clone()]);
        let mut motor = [0.0; MOST_JOINTS];
        for j in 0..n {
            motor[j] = load[j] + model.arm.armature[j] * bare.ddq[row * n + j];
        }
        for &(j, law) in &active.smooth {
            motor[j] -= law.torque(q[j], dq[j], time - data.time[0], load[j]);
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
        for (dry, bend) in &dry {
            let j = dry.joint;
            let here = dry.at(q[j], dq[j], time - data.time[0], load[j]);
            motor[j] += here.level(dq[j], dq[j]) * bend[row];
        }
        for j in 0..n {
            let at = row * n + j;
            motion.gap[at] = -play(active.play[j], load[j]);
            let asked = motor[j] / active.gain[j];
            motion.tau[at] = asked.clamp(-active.limit[j], active.limit[j]);
        }
        last = time;
    }
    if !has_position {
        for (at, q) in Shared::make_mut(&mut motion.q).iter_mut().enumerate() {
            *q -= active.sag[at % n] * motion.load[at];
        }
    }
    motion
}

/// Returns how far the link hangs behind its encoder in a gap of this width, rad.
fn play(width: f64, load: f64) -> f64 {
    if width > 0.0 { 0.5 * width * (load / PLAY_LOAD).tanh() } else { 0.0 }
}
