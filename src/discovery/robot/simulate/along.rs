//! The torques that a measured motion needed, with effects.
//!
//! What acts in a joint shows there alone, so each joint is worked out by itself, and again only when something of its own
//! has changed.

use std::sync::Arc as Shared;

use super::super::channels::Quantity;
use super::super::plant::Course;
use super::active::{ActiveEffects, AtJoint};
use super::friction;
use super::model::{GridPoint, JointMotion, Model, Motion};
use super::recent::{Recent, Same};

/// A load smaller than this leaves a joint with play somewhere inside its gap, N·m; chosen.
const PLAY_LOAD: f64 = 0.05;

/// So many creeps of a joint are remembered: that of the effects, and two that a derivative looks at.
const CREEPS: usize = 3;

/// So many loads of a joint are remembered: that of the effects, and some that a derivative looks at.
const LOADS: usize = 4;

/// So many motions of a joint are remembered: that of the effects, and those that a derivative looks at, a number of the
/// joint after the other.
const MOTIONS: usize = 8;

/// A path and the torques its bodies need, joint by joint.
#[derive(Debug)]
pub(super) struct Bare {
    /// Where each row lies on the grid of the plant.
    points: Vec<GridPoint>,
    joints: Vec<BareJoint>,
}

/// A joint's path and the torque its bodies need, row by row, and what was worked out of them last.
#[derive(Debug)]
struct BareJoint {
    q: Shared<Vec<f64>>,
    dq: Shared<Vec<f64>>,
    ddq: Vec<f64>,
    load: Shared<Vec<f64>>,
    /// How dry friction bends with the speed ([`friction::bent`]), by the bits of its creep (rad/s): most changes of the effects
    /// leave it as it was.
    bends: Recent<u64, Vec<f64>>,
    /// The load by what is needed beside the bare one.
    loads: Recent<Same, Vec<f64>>,
    /// The motion by what acts in the joint and its load.
    motions: Recent<(AtJoint, Same), JointMotion>,
}

impl Bare {
    /// Takes the path of the plant as the motion, `delay` s late.
    fn of(model: &Model, delay: f64) -> Self {
        let Course { data, plant, .. } = &model.course;
        let (n, rows) = (plant.n, data.n_rows());
        let points: Vec<GridPoint> =
            data.time.iter().map(|time| GridPoint::at(plant, time - delay)).collect();
        let mut load = vec![Vec::with_capacity(rows); n];
        for here in &points {
            let [q, dq, ddq] = [&plant.q, &plant.dq, &plant.ddq].map(|values| here.all(values));
            let mut tau = q;
            model.arm.chain.inverse(&q[..n], &dq[..n], &ddq[..n], &mut tau[..n]);
            load.iter_mut().zip(tau).for_each(|(load, tau)| load.push(tau));
        }
        let joint = |(j, load)| {
            let [q, dq, ddq] = [&plant.q, &plant.dq, &plant.ddq]
                .map(|values| points.iter().map(|here| here.of(values, j)).collect());
            BareJoint {
                q: Shared::new(q),
                dq: Shared::new(dq),
                ddq,
                load: Shared::new(load),
                bends: Recent::new(CREEPS),
                loads: Recent::new(LOADS),
                motions: Recent::new(MOTIONS),
            }
        };
        let joints = load.into_iter().enumerate().map(joint).collect();
        Self { points, joints }
    }
}

/// Takes the path of the plant as the motion and works out the torques it needed.
pub(super) fn measured(model: &Model, active: &ActiveEffects) -> Motion {
    // The path is the measured motion, or the command where no motion was measured; only a command
    // can be late.
    let delay = if model.course.data.has(Quantity::Position) { 0.0 } else { active.delay };
    let late;
    let bare = if delay.abs() > 0.0 {
        late = Bare::of(model, delay);
        &late
    } else {
        model.bare.get_or_init(|| Bare::of(model, 0.0))
    };
    let of = |(j, joint): (usize, &BareJoint)| {
        let load = if active.needed.is_empty() {
            Shared::clone(&joint.load)
        } else {
            joint.loads.of(Same(Shared::clone(&active.needed)), |Same(needed)| {
                let more = bare.points.iter().map(|here| here.of(needed, j));
                joint.load.iter().zip(more).map(|(load, more)| load + more).collect()
            })
        };
        let key = (active.at(j), Same(load));
        joint.motions.of(key, |(own, Same(load))| joint.motion(model, j, own, load))
    };
    Motion { joints: bare.joints.iter().enumerate().map(of).collect() }
}

impl BareJoint {
    /// Returns the motion of joint `j` in which it bears a load, N·m row by row.
    fn motion(
        &self,
        model: &Model,
        j: usize,
        own: &AtJoint,
        load: &Shared<Vec<f64>>,
    ) -> JointMotion {
        let data = &model.course.data;
        let (time, rows) = (&data.time, data.n_rows());
        let armature = model.arm.armature[j];
        let mut motor: Vec<f64> =
            load.iter().zip(&self.ddq).map(|(load, ddq)| load + armature * ddq).collect();
        let states =
            || (0..rows).map(|row| (self.q[row], self.dq[row], time[row] - time[0], load[row]));
        for law in &own.smooth {
            for (motor, (q, dq, t, load)) in motor.iter_mut().zip(states()) {
                *motor -= law.torque(q, dq, t, load);
            }
        }
        for each in &own.loops {
            let mut each = *each;
            let mut last = time[0];
            for ((motor, &time), &dq) in motor.iter_mut().zip(time).zip(&*self.dq) {
                *motor += each.torque * each.carried(time - last, dq);
                last = time;
            }
        }
        for dry in &own.dry {
            // Near standstill the measured speed does not tell the sign.
            let unsure = model.course.speed_error.get(j).copied().unwrap_or(0.0);
            let creep = dry.creep.max(unsure);
            let bend = self.bends.of(creep.to_bits(), |_| {
                self.dq.iter().map(|dq| friction::bent(dq / creep)).collect()
            });
            for ((motor, (q, dq, t, load)), bend) in motor.iter_mut().zip(states()).zip(&*bend) {
                *motor += dry.at(q, dq, t, load).level(dq, dq) * bend;
            }
        }
        let tau = motor.iter().map(|asked| (asked / own.gain).clamp(-own.limit, own.limit));
        // Only a command is followed with a sag.
        let q = if own.sag == 0.0 || data.has(Quantity::Position) {
            Shared::clone(&self.q)
        } else {
            let sunk = self.q.iter().zip(&**load).map(|(q, load)| q - own.sag * load);
            Shared::new(sunk.collect())
        };
        JointMotion {
            q,
            dq: Shared::clone(&self.dq),
            tau: tau.collect(),
            load: Shared::clone(load),
            gap: load.iter().map(|load| -play(own.play, *load)).collect(),
        }
    }
}

/// Returns how far the link hangs behind its encoder in a gap of this width, rad.
fn play(width: f64, load: f64) -> f64 {
    if width > 0.0 { 0.5 * width * (load / PLAY_LOAD).tanh() } else { 0.0 }
}
