//! What the joints carry in a rehearsal, beside what the robot's file says that they may.
//!
//! The twin knows the masses, so a plan that no motor could carry out is refused before the arm moves. Judged is a mean: what a
//! servo or a touch adds for a moment is no load, and what pushes on the hand from outside is left out.

use std::collections::VecDeque;
use std::sync::{MutexGuard, PoisonError};

use crate::execution::twin_arm::SharedTwin;
use crate::motion::robot::Robot;
use crate::trace::{Event, Observer, Overload};
use crate::twin::Twin;

/// Over how long torques are averaged, s. Chosen: a plan's accelerations last as long, a servo's and a touch's do not. In 70 runs of
/// eleven arms the mean came to at most 87 % of the limit, single samples to 3 N·m more.
const OVER: f64 = 0.25;
/// Rows that are farther apart than this do not follow each other, s.
const GAP: f64 = 0.05;
/// How much more than the limit is let pass, no unit: masses and centres of mass in a robot's file are known to a few per cent.
const TOLERANCE: f64 = 0.05;

/// Watches what the joints of a twin carry.
pub(super) struct Meter {
    twin: SharedTwin,
    strain: Strain,
}

/// What joints carry over time, and the worst of it.
struct Strain {
    joints: Vec<Allowed>,
    /// The last rows: when, s, and what each joint carries, N·m or N.
    rows: VecDeque<(f64, Vec<f64>)>,
    /// The worst since it was asked last.
    worst: Option<Overload>,
}

/// What one joint may carry.
struct Allowed {
    name: String,
    /// Whether it slides: then it carries N, not N·m.
    slides: bool,
    /// What the robot's file says, N·m or N.
    limit: f64,
    /// From where on it is too much, N·m or N.
    most: f64,
}

impl Meter {
    /// Watches a twin from how it stands now.
    pub(super) fn new(twin: SharedTwin, robot: &Robot) -> Self {
        let strain = Strain::new(robot, &lock(&twin).torques_carried());
        Self { twin, strain }
    }

    /// Returns the joint that carried most beyond what it may since this was asked last, if one did.
    pub(super) fn take(&mut self) -> Option<Overload> {
        self.strain.worst.take()
    }
}

impl Observer for Meter {
    fn event(&mut self, event: &Event) {
        let Event::Tick(feedback) = event else { return };
        let Self { twin, strain } = self;
        let carried = lock(twin).torques_carried();
        strain.add(feedback.time, carried, || lock(twin).state().held);
    }
}

fn lock(twin: &SharedTwin) -> MutexGuard<'_, Twin> {
    twin.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Strain {
    /// Begins with joints that carry so much now, N·m or N, base first. One that carries too much already may go on carrying as
    /// much: what is in the hand has to be put down.
    fn new(robot: &Robot, carried: &[f64]) -> Self {
        let joints = robot.joints().iter().zip(carried).zip(robot.sliding());
        let joints = joints.map(|((joint, now), slides)| {
            let limit = joint.effort;
            let most = (1.0 + TOLERANCE) * limit.max(now.abs());
            Allowed { name: joint.name.clone(), slides, limit, most }
        });
        Self { joints: joints.collect(), rows: VecDeque::new(), worst: None }
    }

    /// Takes a row; `held` says what is in the hand.
    fn add(&mut self, time: f64, carried: Vec<f64>, held: impl FnOnce() -> Option<String>) {
        if self.rows.back().is_some_and(|(last, _)| time - last > GAP) {
            self.rows.clear();
        }
        self.rows.push_back((time, carried));
        while self.rows.get(1).is_some_and(|(next, _)| time - next >= OVER) {
            self.rows.pop_front();
        }
        if self.rows.front().is_none_or(|(first, _)| time - first < OVER) {
            return;
        }
        let mut worst: Option<(&Allowed, f64)> = None;
        for (index, joint) in self.joints.iter().enumerate() {
            let mean = mean(self.rows.iter().filter_map(|(_, row)| row.get(index))).abs();
            let is_worse = worst.is_none_or(|(other, most)| joint.share(mean) > other.share(most));
            if mean > joint.most && is_worse {
                worst = Some((joint, mean));
            }
        }
        let known = self.worst.as_ref().map_or(0.0, |known| known.torque / known.limit);
        if let Some((joint, torque)) = worst.filter(|(joint, mean)| joint.share(*mean) > known) {
            self.worst = Some(Overload {
                joint: joint.name.clone(),
                slides: joint.slides,
                torque,
                limit: joint.limit,
                held: held(),
            });
        }
    }
}

impl Allowed {
    /// Returns a torque in parts of the limit.
    fn share(&self, torque: f64) -> f64 {
        torque / self.limit
    }
}

fn mean<'v>(values: impl Iterator<Item = &'v f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workcell::Stdlib;

    /// A spike of a tenth of a second is no load; the same for half a second is one.
    #[test]
    fn what_lasts_is_a_load_and_a_spike_is_none() {
        let robot = Stdlib::embedded().robot("gen3_2f85").unwrap();
        let efforts: Vec<f64> = robot.joints().iter().map(|joint| joint.effort).collect();
        let at_share = |share: f64| efforts.iter().map(|effort| share * effort).collect::<Vec<_>>();
        let mut strain = Strain::new(&robot, &at_share(0.5));
        let mut tick = 0;
        let mut carry = |ticks: usize, share: f64| {
            for _ in 0..ticks {
                strain.add(f64::from(tick) * 0.004, at_share(share), || Some("jar".into()));
                tick += 1;
            }
            strain.worst.take()
        };
        assert_eq!(carry(100, 0.8), None);
        assert_eq!(carry(25, 1.3), None, "0.1 s");
        assert_eq!(carry(100, 0.8), None);
        let found = carry(125, 1.35).unwrap();
        assert!((found.torque / found.limit - 1.35).abs() < 1e-6, "{found}");
        assert_eq!(found.held.as_deref(), Some("jar"));
        // What begins beyond the limit may stay there, and be put down.
        let mut strain = Strain::new(&robot, &at_share(1.35));
        for tick in 0..125 {
            strain.add(f64::from(tick) * 0.004, at_share(1.4), || None);
        }
        assert_eq!(strain.worst, None);
    }
}
