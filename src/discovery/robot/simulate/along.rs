//! The torques that a measured motion needed, with effects.

use super::super::chain::MOST_JOINTS;
use super::super::channels::Quantity;
use super::super::plant::Course;
use super::active::ActiveEffects;
use super::friction::Dry;
use super::{GridPoint, Model, Motion};

/// A load smaller than this leaves a joint with play somewhere inside its gap, N·m; chosen.
const PLAY_LOAD: f64 = 0.05;

/// A path row by row, and the torques its bodies need, `rows × n` each.
#[derive(Debug)]
pub(super) struct Bare {
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    load: Vec<f64>,
}

impl Bare {
    /// Takes the path of the plant as the motion, `delay` s late.
    fn of(model: &Model, delay: f64) -> Self {
        let Course { data, plant, .. } = &model.course;
        let n = plant.n;
        let [mut q, mut dq, mut ddq, mut load] =
            std::array::from_fn(|_| vec![0.0; data.n_rows() * n]);
        for (row, &time) in data.time.iter().enumerate() {
            let here = GridPoint::at(plant, time - delay);
            let at = row * n..(row + 1) * n;
            for j in 0..n {
                q[row * n + j] = here.of(&plant.q, j);
                dq[row * n + j] = here.of(&plant.dq, j);
                ddq[row * n + j] = here.of(&plant.ddq, j);
            }
            let chain = &model.arm.chain;
            chain.inverse(&q[at.clone()], &dq[at.clone()], &ddq[at.clone()], &mut load[at]);
        }
        Self { q, dq, ddq, load }
    }
}

/// Takes the path of the plant as the motion and works out the torques it needed.
pub(super) fn measured(model: &Model, active: &ActiveEffects) -> Motion {
    let Course { data, plant, .. } = &model.course;
    let n = plant.n;
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
        q: bare.q.clone(),
        dq: bare.dq.clone(),
        load: bare.load.clone(),
        tau: vec![0.0; rows * n],
        gap: vec![0.0; rows * n],
    };
    let mut loops = active.loops.clone();
    let mut last = data.time[0];
    for (row, &time) in data.time.iter().enumerate() {
        let at = row * n..(row + 1) * n;
        if !active.needed.is_empty() {
            let here = GridPoint::at(plant, time - delay);
            for j in 0..n {
                motion.load[row * n + j] += here.of(&active.needed, j);
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
        for dry in &active.dry {
            let j = dry.joint;
            // Near standstill the measured speed does not tell the sign.
            let unsure = model.course.speed_error.get(j).copied().unwrap_or(0.0);
            let softer = Dry { creep: dry.creep.max(unsure), ..*dry };
            motor[j] -= softer.torque(dq[j], dq[j]);
        }
        for j in 0..n {
            let at = row * n + j;
            motion.gap[at] = -play(active.play[j], load[j]);
            let asked = motor[j] / active.gain[j];
            motion.tau[at] = asked.clamp(-active.limit[j], active.limit[j]);
        }
        if !has_position {
            for j in 0..n {
                motion.q[row * n + j] -= active.sag[j] * motion.load[row * n + j];
            }
        }
        last = time;
    }
    motion
}

/// Returns how far the link hangs behind its encoder in a gap of this width, rad.
fn play(width: f64, load: f64) -> f64 {
    if width > 0.0 { 0.5 * width * (load / PLAY_LOAD).tanh() } else { 0.0 }
}
