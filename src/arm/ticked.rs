//! One arm over anything that is stepped through time: the twin and the lab.
//!
//! A [`Plant`] takes joint targets and is advanced tick by tick; [`Ticked`] makes an [`Arm`] of it, so that
//! following, gripping, waiting and stopping are written once.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::limits::{Cleared, ClearedGrip};
use super::{Arm, Cancel, DeviceError, Feedback, Grip, Leader};
pub use crate::motion::braking::Brake;
use crate::motion::braking::Braking;
use crate::motion::trajectory::Sample;

/// Something with an arm that is stepped through time.
pub trait Plant: Send {
    /// Sends joint positions, rad, and speeds, rad/s.
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError>;

    /// Sends the fingers to `opening` m at `speed` m/s with at most `force` N.
    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError>;

    /// Lets `seconds` pass.
    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError>;

    /// Hears how the arm is now, where its time goes on by itself.
    fn refresh(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Has an arm that was brought to rest held where it is, and returns whether that is not where it was sent last: a model of an arm
    /// holds there anyway.
    fn hold(&mut self) -> Result<bool, DeviceError> {
        Ok(false)
    }

    /// Tells whoever stands before the arm that what it holds may be taken, or not any more.
    fn offers(&mut self, _on: bool) {}

    /// Returns whether the connection to it is lost for good.
    fn is_lost(&self) -> bool {
        false
    }

    /// Returns whether the arm was asked to stop and has not answered yet.
    fn owes_stop(&self) -> bool {
        false
    }

    /// Returns whether an arm that errs may still be led to rest: an error of a model of an arm is the end of it.
    fn is_led_to_rest(&self) -> bool {
        false
    }

    /// Returns how long fingers may take to begin to move, s.
    fn fingers_begin_within(&self) -> f64 {
        0.0
    }

    /// Returns how far a joint may stay behind its command, rad, where an arm that is farther behind is stuck or lost.
    fn most_behind(&self) -> Option<f64> {
        None
    }

    /// Returns whether it is wherever it was sent last, however fast that is: no joint of it ever falls behind.
    fn is_ideal(&self) -> bool {
        false
    }

    /// Returns what the arm reported last; `q_cmd` is filled in by [`Ticked`].
    fn report(&mut self) -> Feedback;
}

/// Control period, s.
const PERIOD: f64 = 0.004;
/// After the last command of a motion the arm is given this long to get there, s.
const SETTLE: f64 = 0.2;
/// A servo may be late by this, s: a joint is behind when it is far from all that was commanded in that time. Chosen: a servo without
/// feed-forward and a network are each late by some hundredths.
const LATE: f64 = 0.2;
/// A joint that is too far from its commands for so long does not follow them, s: while they move, and once they rest.
const BEHIND_FOR: (f64, f64) = (0.1, 0.5);
/// A command that is slower rests, rad/s.
const RESTING: f64 = 1e-6;
/// After braking the arm is given at most this long to come to rest, s, below this speed, rad/s.
const REST: (f64, f64) = (0.4, 0.01);
/// A joint that is held where it is, farther than this from its command, is commanded from there on, rad: the most by which a path may begin
/// off the last command ([`super::limits::Limits::jump`]). What is nearer is the servo's own error, and commanding that would let the arm sag.
const HELD: f64 = 0.02;
/// Fingers that move less than this in a tenth of a second are at rest, m: above the encoder's noise.
const STILL: f64 = 3e-4;
/// Fingers that are nearer than this to where they were sent have got there, m.
const THERE: f64 = 3e-3;

/// The arm of a plant.
pub struct Ticked<P> {
    plant: P,
    /// What each joint may do while it is brought to rest.
    brakes: Vec<Brake>,
    q_cmd: Vec<f64>,
    dq_cmd: Vec<f64>,
    ddq_cmd: Vec<f64>,
    /// Where the fingers are to go, and in how many ticks.
    fingers: Option<(ClearedGrip, usize)>,
    /// Where something stopped the fingers when they were sent last, and where they were sent, m.
    stalled: Option<(f64, f64)>,
    /// What was commanded in the last [`LATE`] s, rad, where a joint may be too far behind.
    lately: VecDeque<Vec<f64>>,
    /// Ticks for which a joint has been too far from all of that.
    behind: usize,
    /// Whether the last order may not have come to the arm.
    is_unsure: bool,
}

impl<P: Plant> Ticked<P> {
    /// Takes hold of the arm where it stands; `brakes` has an entry for each joint.
    pub fn new(mut plant: P, brakes: Vec<Brake>) -> Self {
        let q_cmd = plant.report().q;
        let dq_cmd = vec![0.0; q_cmd.len()];
        let ddq_cmd = dq_cmd.clone();
        Self {
            plant,
            brakes,
            q_cmd,
            dq_cmd,
            ddq_cmd,
            fingers: None,
            stalled: None,
            lately: VecDeque::new(),
            behind: 0,
            is_unsure: false,
        }
    }

    fn run(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
        mut command: impl FnMut(f64) -> Option<Sample>,
    ) -> Result<(), DeviceError> {
        let ticks = (seconds / PERIOD).ceil() as usize;
        for tick in 0..ticks {
            if cancel.is_cancelled() {
                return Err(self.cut_short(cancel, watch));
            }
            let order = command(tick as f64 * PERIOD);
            self.tick(order, watch)?;
        }
        Ok(())
    }

    /// Sends an order, if there is one, and lets one period pass; an arm that does not follow is slowed down, and so is one that errs.
    fn tick(
        &mut self,
        order: Option<Sample>,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.send(order, watch).map_err(|error| self.errs(error, watch))?;
        let Some(most) = self.plant.most_behind() else { return Ok(()) };
        let lag = self.lag().into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((joint, _)) = lag.filter(|(_, lag)| *lag > most) else {
            self.behind = 0;
            return Ok(());
        };
        self.behind += 1;
        let rests = self.dq_cmd.iter().all(|dq| dq.abs() <= RESTING);
        let bearable = if rests { BEHIND_FOR.1 } else { BEHIND_FOR.0 };
        if self.behind as f64 * PERIOD < bearable {
            return Ok(());
        }
        self.behind = 0;
        let behind = self.ahead()[joint].abs();
        self.halt(watch)?;
        let (error_deg, limit_deg) = (behind.to_degrees(), most.to_degrees());
        Err(DeviceError::FollowingError { joint: joint + 1, error_deg, limit_deg })
    }

    /// Returns how far each joint's command is ahead of it, rad.
    fn ahead(&mut self) -> Vec<f64> {
        let q = self.plant.report().q;
        self.q_cmd.iter().zip(q).map(|(to, q)| apart(*to, q)).collect()
    }

    /// Returns how far each joint is from the nearest of what was commanded lately, rad.
    fn lag(&mut self) -> Vec<f64> {
        let q = self.plant.report().q;
        let nearest = |(joint, q): (usize, f64)| {
            let off = self.lately.iter().map(|sent| apart(sent[joint], q).abs());
            off.fold(apart(self.q_cmd[joint], q).abs(), f64::min)
        };
        q.into_iter().enumerate().map(nearest).collect()
    }

    /// Waits until the arm has come to where it was sent last; one that does not come is an error of [`Self::tick`].
    fn arrive(
        &mut self,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let Some(most) = self.plant.most_behind() else { return Ok(()) };
        while self.ahead().iter().any(|ahead| ahead.abs() > most) {
            self.run(PERIOD, cancel, watch, |_| None)?;
        }
        Ok(())
    }

    /// Sends an order, if there is one, and lets one period pass.
    fn send(
        &mut self,
        order: Option<Sample>,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let is_order = order.is_some();
        let sent = self.pass(order);
        self.is_unsure = sent.is_err() || (self.is_unsure && !is_order);
        sent?;
        watch(&self.told());
        Ok(())
    }

    fn pass(&mut self, order: Option<Sample>) -> Result<(), DeviceError> {
        if self.plant.most_behind().is_some() {
            self.lately.push_back(self.q_cmd.clone());
            if self.lately.len() as f64 * PERIOD > LATE {
                self.lately.pop_front();
            }
        }
        if let Some(Sample { q, dq, ddq }) = order {
            self.plant.command(&q, &dq)?;
            (self.q_cmd, self.dq_cmd, self.ddq_cmd) = (q, dq, ddq);
        }
        match &mut self.fingers {
            Some((grip, 0)) => {
                self.plant.aim(grip.opening(), grip.speed(), grip.force())?;
                self.fingers = None;
            }
            Some((_, ticks)) => *ticks -= 1,
            None => {}
        }
        self.plant.advance(PERIOD)
    }

    fn told(&mut self) -> Feedback {
        Feedback { q_cmd: self.q_cmd.clone(), ..self.plant.report() }
    }

    /// Brings the arm to rest, also where it errs meanwhile.
    fn brake(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<(), DeviceError> {
        self.slow_down(watch).map_err(|error| self.errs(error, watch))
    }

    /// Brings an arm that errs to rest, as far as it can be led there, and has it held; returns the error. Where it errs again it is
    /// held at once.
    fn errs(&mut self, error: DeviceError, watch: &mut dyn FnMut(&Feedback)) -> DeviceError {
        // A wish to stop while the arm was silent has had it held.
        if error == DeviceError::Stopped || !self.plant.is_led_to_rest() {
            return error;
        }
        if self.slow_down(watch) != Err(DeviceError::Stopped) {
            // What goes wrong meanwhile is the lesser trouble.
            let _ = self.hold();
        }
        error
    }

    /// Slows all joints down together from how they were last sent, as fast as their limits allow, and waits until they rest.
    ///
    /// The command never jumps: a joint sent back to where its encoder was read would swing past and
    /// return, and what it carries would spill. Only a joint that has not followed is sent back, so that it does not leap when
    /// what holds it is gone.
    fn slow_down(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<(), DeviceError> {
        // What has not begun is not begun any more.
        self.fingers = None;
        let is_stuck = self.gives_up_stuck();
        let sent =
            Sample { q: self.q_cmd.clone(), dq: self.dq_cmd.clone(), ddq: self.ddq_cmd.clone() };
        let braking = Braking::of(&sent, &self.brakes);
        let least = if is_stuck { PERIOD } else { 0.0 };
        let ticks = (braking.duration().max(least) / PERIOD).ceil() as usize;
        for tick in 1..=ticks {
            self.send(Some(braking.sample(tick as f64 * PERIOD)), watch)?;
        }
        let (longest, slow) = REST;
        for _ in 0..(longest / PERIOD) as usize {
            if self.told().dq.iter().all(|dq| dq.abs() < slow) {
                break;
            }
            self.send(None, watch)?;
        }
        Ok(())
    }

    /// Brings the command of each joint that does not follow to where the joint is, at rest; returns whether there was one.
    fn gives_up_stuck(&mut self) -> bool {
        let Some(most) = self.plant.most_behind() else { return false };
        let (lag, ahead) = (self.lag(), self.ahead());
        let mut is_any = false;
        for (joint, _) in lag.iter().enumerate().filter(|(_, lag)| **lag > most) {
            self.q_cmd[joint] -= ahead[joint];
            self.dq_cmd[joint] = 0.0;
            self.ddq_cmd[joint] = 0.0;
            is_any = true;
        }
        is_any
    }

    /// Commands the arm from where it is held; each joint that is there within the error of its servo stays commanded as it was.
    fn begins_here(&mut self) {
        let ahead = self.ahead();
        for (q, ahead) in self.q_cmd.iter_mut().zip(ahead).filter(|(_, ahead)| ahead.abs() > HELD) {
            *q -= ahead;
        }
        self.dq_cmd.fill(0.0);
        self.ddq_cmd.fill(0.0);
        self.lately.clear();
        self.behind = 0;
    }

    /// Brings the arm to rest and has it held there: nobody goes on from here without asking where it is.
    fn halt(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<(), DeviceError> {
        self.brake(watch)?;
        self.hold()
    }

    /// Has the arm held where it is, and commands it from there.
    fn hold(&mut self) -> Result<(), DeviceError> {
        let held = self.plant.hold();
        self.is_unsure |= held.is_err();
        if held? {
            self.begins_here();
        }
        Ok(())
    }

    /// Brings the arm to rest, since somebody wished so: held where a person did, ready to go on where only this motion was to end.
    fn cut_short(&mut self, cancel: &Cancel, watch: &mut dyn FnMut(&Feedback)) -> DeviceError {
        let rests = if cancel.is_for_all() { self.halt(watch) } else { self.brake(watch) };
        rests.err().unwrap_or(DeviceError::Stopped)
    }
}

/// Returns how much farther `to` is than `from`, rad; whole turns are no distance.
fn apart(to: f64, from: f64) -> f64 {
    let off = to - from;
    off - TAU * (off / TAU).round()
}

impl<P: Plant> Arm for Ticked<P> {
    fn offers(&mut self, on: bool) {
        self.plant.offers(on);
    }

    fn is_lost(&self) -> bool {
        self.plant.is_lost()
    }

    fn owes_stop(&self) -> bool {
        self.plant.owes_stop()
    }

    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        self.plant.refresh()?;
        if self.is_unsure {
            self.begins_here();
            // Until it rests it goes on from here.
            self.is_unsure = self.plant.report().dq.iter().any(|dq| dq.abs() >= REST.1);
        }
        Ok(self.told())
    }

    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let trajectory = trajectory.trajectory();
        let duration = trajectory.duration();
        self.run(duration + SETTLE, cancel, watch, |t| {
            let mut at = trajectory.sample(t.min(duration));
            if t >= duration {
                // Its end may be one at which a spline still bends; the arm stays there.
                at.ddq.fill(0.0);
            }
            Some(at)
        })?;
        self.arrive(cancel, watch)
    }

    fn led_every(&self) -> Option<f64> {
        Some(PERIOD)
    }

    fn lead(
        &mut self,
        leader: &mut Leader<'_>,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        while !cancel.is_cancelled() {
            let Some(order) = leader(&self.told()) else {
                self.brake(watch)?;
                return self.arrive(cancel, watch);
            };
            // Braked at once, with a step of its acceleration: to take that back first would lead nearer to what it is stopped for.
            let none = vec![0.0; self.q_cmd.len()];
            self.tick(Some(Sample { ddq: none, ..order.into_order() }), watch)?;
        }
        Err(self.cut_short(cancel, watch))
    }

    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        let opening = grip.opening();
        self.plant.aim(opening, grip.speed(), grip.force())?;
        let mut last = self.plant.report().opening;
        // What holds them up already does so at once.
        let is_held_up = self
            .stalled
            .take()
            .is_some_and(|(at, to)| (last - at).abs() < THERE && (to < at) == (opening < last));
        let begins_within = if is_held_up { 0.0 } else { self.plant.fingers_begin_within() };
        let (mut still, mut has_begun) = (0, false);
        // At most five seconds: the slowest fingers need two.
        for tenth in 1..=50 {
            self.run(0.1, cancel, watch, |_| None)?;
            let now = self.plant.report().opening;
            still = if (now - last).abs() < STILL { still + 1 } else { 0 };
            // Fingers that give a little the other way, as a linkage does when its motor starts, have not begun.
            has_begun |= (now - last) * (opening - last).signum() >= STILL;
            last = now;
            let is_due = has_begun
                || (last - opening).abs() <= THERE
                || f64::from(tenth) * 0.1 >= begins_within;
            if still >= 3 && is_due {
                break;
            }
        }
        let stalled = (last - opening).abs() > THERE;
        self.stalled = stalled.then_some((last, opening));
        Ok(Grip { opening: last, stalled })
    }

    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError> {
        self.fingers = Some((*grip, (after / PERIOD).round() as usize));
        Ok(())
    }

    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.run(seconds, cancel, watch, |_| None)
    }

    fn stop(&mut self) {
        // A plant that refuses to be slowed down is broken; there is nothing left to stop it with.
        let _ = self.halt(&mut |_| {});
    }
}
