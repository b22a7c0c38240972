//! The torques that a measured motion needed, with effects.

#![expect(
    clippy::needless_range_loop,
    reason = "joints index a dozen arrays at once; formulas read better with the index of their source"
)]

use super::super::chain::MOST_JOINTS;
use super::super::data::Quantity;
use super::super::plant::Scene;
use super::acting::Acting;
use super::friction::Dry;
use super::{GridPoint, Model, Motion};

/// A load smaller than this leaves a joint with play somewhere inside its gap, N·m; chosen.
const PLAY_LOAD: f64 = 0.05;

/// A measured speed below this may be noise, rad/s; chosen for encoders of arms.
const SPEED_NOISE: f64 = 5e-3;

/// Takes the path of the plant as the motion and works out the torques it needed.
pub(super) fn measured(model: &Model, acting: &Acting) -> Motion {
    let Scene { data, plant, .. } = &model.scene;
    let n = plant.n;
    let rows = data.n_rows();
    let has_position = data.has(Quantity::Position);
    let mut motion = Motion::still(rows * n);
    let mut loops = acting.loops.clone();
    // The path is the measured motion, or the command where no motion was measured; only a command
    // can be late, or be followed with a sag.
    let delay = if has_position { 0.0 } else { acting.delay };
    let mut last = data.time[0];
    for (row, &time) in data.time.iter().enumerate() {
        let here = GridPoint::at(plant, time - delay);
        let mut ddq = [0.0; MOST_JOINTS];
        for j in 0..n {
            motion.q[row * n + j] = here.of(&plant.q, j);
            motion.dq[row * n + j] = here.of(&plant.dq, j);
            ddq[j] = here.of(&plant.ddq, j);
        }
        let (q, dq) = (&motion.q[row * n..(row + 1) * n], &motion.dq[row * n..(row + 1) * n]);
        let mut load = [0.0; MOST_JOINTS];
        model.arm.chain.inverse(q, dq, &ddq[..n], &mut load[..n]);
        let mut motor = [0.0; MOST_JOINTS];
        for j in 0..n {
            if !acting.needed.is_empty() {
                load[j] += here.of(&acting.needed, j);
            }
            motor[j] = load[j] + model.arm.armature[j] * ddq[j];
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

/// Returns how far the link hangs behind its encoder in a gap of this width, rad.
fn play(width: f64, load: f64) -> f64 {
    if width > 0.0 { 0.5 * width * (load / PLAY_LOAD).tanh() } else { 0.0 }
}
