//! Joints brought to rest out of any motion, as fast as their limits of acceleration and jerk allow.
//!
//! All of them together: within a short time accelerations are turned against the speeds, each at a constant jerk, and from then on the
//! joints go along one straight line and rest at the same instant. So the direction of the motion is kept as nearly as can be. A joint
//! that would pass the end of its range by that is brought to rest by itself.
//!
//! Speeds may grow a little before they shrink, where joints push: by a twentieth of their limits at most beyond these.
//!
//! Nobody is asked what is in the way. When to brake is decided elsewhere.
//!
//! Source: along the line the second half of a double-S profile, as in `ramp`.

use super::ramp::{Along, Span, State};
use super::robot::Robot;
use super::trajectory::{Limits, Sample};

/// Accelerations are turned within this many shares of the time in which all of them could be taken back, up to twice that; the best is
/// taken. Chosen: twice as many save a thousandth of a second.
const SHARES: u32 = 16;
/// What is slower rests, rad/s.
const RESTS: f64 = 1e-9;
/// Rounding may pass a limit by this share of it.
const ROUNDING: f64 = 1e-9;
/// So often it is looked whether a joint leaves its range. Chosen: it does so at its end, or less than 1e-4 rad beside a look.
const LOOKS: u32 = 64;

/// What a joint may do while it is brought to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brake {
    /// Its range, rad; infinite where it turns without end.
    pub range: (f64, f64),
    /// Its highest acceleration, rad/s².
    pub acceleration: f64,
    /// Its highest jerk, rad/s³.
    pub jerk: f64,
}

impl Brake {
    /// Returns what each joint of a robot may do: its own limits, as its motions are timed by.
    pub fn of(robot: &Robot) -> Vec<Self> {
        let jerks = Limits::of(robot).jerk;
        let joints = robot.joints().iter().zip(jerks);
        joints
            .map(|(joint, jerk)| Self {
                range: (joint.lower, joint.upper),
                acceleration: joint.acceleration,
                jerk,
            })
            .collect()
    }

    /// How far beyond the range a position is, rad.
    fn beyond(&self, q: f64) -> f64 {
        (q - self.range.1).max(self.range.0 - q).max(0.0)
    }
}

/// How joints come to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Braking {
    ways: Vec<Way>,
}

/// How one joint comes to rest.
#[derive(Debug, Clone, PartialEq)]
struct Way {
    begin: State,
    /// Its acceleration is turned; then it brakes harder, as hard as it may, and less.
    spans: [Span; 4],
}

impl Way {
    fn duration(&self) -> f64 {
        self.spans.iter().map(|(t, _)| t).sum()
    }

    /// Where it is after `t` s, and how it moves.
    fn at(&self, t: f64) -> State {
        let (mut at, mut left) = (self.begin, t);
        for &(span, jerk) in &self.spans {
            let now = left.min(span);
            at = at.after(now, jerk);
            left -= now;
        }
        if t >= self.duration() { State { v: 0.0, a: 0.0, ..at } } else { at }
    }

    /// How much farther beyond its range it goes than it is, rad.
    fn leaves(&self, brake: &Brake) -> f64 {
        let step = self.duration() / f64::from(LOOKS);
        let looks = (0..=LOOKS).map(|k| brake.beyond(self.at(step * f64::from(k)).s));
        (looks.fold(0.0, f64::max) - brake.beyond(self.begin.s)).max(0.0)
    }
}

impl Braking {
    /// Returns how joints that move so come to rest; one entry of `brakes` for each.
    pub fn of(moving: &Sample, brakes: &[Brake]) -> Self {
        let states = moving.q.iter().zip(&moving.dq).zip(&moving.ddq);
        let states = states.map(|((&s, &v), &a)| State { s, v, a });
        let joints: Vec<(State, Brake)> = states.zip(brakes.iter().copied()).collect();
        let mut ways = candidates(&joints)
            .min_by(|a, b| lasts(a).total_cmp(&lasts(b)))
            .expect("accelerations can be taken back");
        for (way, joint) in ways.iter_mut().zip(&joints) {
            if way.leaves(&joint.1) <= 0.0 {
                continue;
            }
            let alone = candidates(std::slice::from_ref(joint)).flatten();
            let nearest = alone.min_by(|a, b| {
                let (least, other) = (a.leaves(&joint.1), b.leaves(&joint.1));
                least.total_cmp(&other).then(a.duration().total_cmp(&b.duration()))
            });
            *way = nearest.expect("an acceleration can be taken back");
        }
        Self { ways }
    }

    /// Returns how long it takes, s; none for joints at rest.
    pub fn duration(&self) -> f64 {
        lasts(&self.ways)
    }

    /// Returns how the joints move after `t` s; they rest once it is over.
    pub fn sample(&self, t: f64) -> Sample {
        let states: Vec<State> = self.ways.iter().map(|way| way.at(t)).collect();
        Sample {
            q: states.iter().map(|state| state.s).collect(),
            dq: states.iter().map(|state| state.v).collect(),
            ddq: states.iter().map(|state| state.a).collect(),
        }
    }
}

/// How long the longest of them takes, s.
fn lasts(ways: &[Way]) -> f64 {
    ways.iter().map(Way::duration).fold(0.0, f64::max)
}

/// Ways to rest for joints together, by how long their accelerations are turned for. One is to take them all back first.
fn candidates(joints: &[(State, Brake)]) -> impl Iterator<Item = Vec<Way>> {
    let times = joints.iter().map(|(at, brake)| at.a.abs() / brake.jerk);
    let longest = times.fold(0.0, f64::max);
    let shares = if longest > 0.0 { 2 * SHARES } else { 0 };
    (0..=shares).filter_map(move |k| together(joints, longest * f64::from(k) / f64::from(SHARES)))
}

/// The way to rest for joints together whose accelerations are turned for `turn` s, if limits allow it.
///
/// With jerks that are constant for so long, accelerations end at `-u d` and speeds at `(1 - u turn / 2) d`, where
/// `d = v + a turn / 2` does not depend on `u`: from there on it is one line. The largest `u` is the quickest.
fn together(joints: &[(State, Brake)], turn: f64) -> Option<Vec<Way>> {
    let line: Vec<f64> = joints.iter().map(|(at, _)| at.v + 0.5 * turn * at.a).collect();
    let share = |limit: fn(&Brake) -> f64| {
        let each = joints.iter().zip(&line).map(|((_, brake), d)| limit(brake) / d.abs());
        each.fold(f64::INFINITY, f64::min)
    };
    // Limits along the line, of which one is the whole.
    let (a, j) = (share(|brake| brake.acceleration), share(|brake| brake.jerk));
    // No harder than that the acceleration can be taken back before the joints turn round.
    let no_return = 2.0 / (0.5 * turn + (0.25 * turn * turn + 2.0 / j).sqrt());
    let (mut least, mut most) = (0.0_f64, a.min(no_return));
    for ((at, brake), d) in joints.iter().zip(&line) {
        let room = brake.jerk * turn * (1.0 + ROUNDING);
        let ends = [(-room - at.a) / d, (room - at.a) / d];
        least = least.max(ends[0].min(ends[1]));
        most = most.min(ends[0].max(ends[1]));
    }
    if least > most {
        return None;
    }
    let rests = line.iter().all(|d| d.abs() < RESTS);
    let u = if rests { 0.0 } else { most };
    if u < least {
        return None;
    }
    let left = (1.0 - 0.5 * turn * u).max(0.0);
    // Down to rest is up from it, mirrored.
    let mirrored = if rests { [(0.0, 0.0); 3] } else { Along { v: left, a, j }.up(0.0, u, left) };
    let ways = joints.iter().zip(&line).map(|((at, _), d)| {
        let first = if turn > 0.0 { (-u * d - at.a) / turn } else { 0.0 };
        let [more, held, less] = mirrored.map(|(t, jerk)| (t, -jerk * d));
        Way { begin: *at, spans: [(turn, first), more, held, less] }
    });
    Some(ways.collect())
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

    fn brake(acceleration: f64) -> Brake {
        Brake { range: FREE, acceleration, jerk: acceleration / 0.05 }
    }

    fn moving(q: &[f64], dq: &[f64], ddq: &[f64]) -> Sample {
        Sample { q: q.to_vec(), dq: dq.to_vec(), ddq: ddq.to_vec() }
    }

    /// At the limits it takes `v / a + a / j`, and half of that at the speed.
    #[test]
    fn one_joint_at_full_speed_rests_in_the_least_time() {
        let braking = Braking::of(&moving(&[1.0], &[-1.5], &[0.0]), &[brake(5.0)]);
        assert!((braking.duration() - (1.5 / 5.0 + 0.05)).abs() < 1e-9, "{}", braking.duration());
        let end = braking.sample(1.0);
        assert!((end.q[0] - (1.0 - 1.5 * 0.175)).abs() < 1e-9, "{end:?}");
        assert_eq!((end.dq[0], end.ddq[0]), (0.0, 0.0));
    }

    /// A push is taken back first, 0.05 s; a joint that brakes as hard as it may goes on.
    #[test]
    fn it_begins_with_the_acceleration_there_is() {
        let pushed = Braking::of(&moving(&[0.0], &[1.0], &[5.0]), &[brake(5.0)]);
        assert!((pushed.duration() - (0.05 + 1.125 / 5.0 + 0.05)).abs() < 1e-6, "{pushed:?}");
        let braked = Braking::of(&moving(&[0.0], &[1.0], &[-5.0]), &[brake(5.0)]);
        assert!((braked.duration() - (0.875 / 5.0 + 0.05)).abs() < 1e-6, "{braked:?}");
        let ending = Braking::of(&moving(&[0.0], &[0.125], &[-5.0]), &[brake(5.0)]);
        assert!((ending.duration() - 0.05).abs() < 1e-6, "{ending:?}");
    }

    #[test]
    fn joints_at_rest_take_no_time() {
        let braking = Braking::of(&moving(&[0.1, 0.2], &[0.0; 2], &[0.0; 2]), &[brake(5.0); 2]);
        assert!(braking.duration() <= 0.0);
        assert_eq!(braking.sample(0.0).q, [0.1, 0.2]);
    }

    #[test]
    fn limits_are_kept_and_the_line_is_straight_in_the_end() {
        let mut random = StdRng::seed_from_u64(7);
        for _ in 0..500 {
            let brakes: Vec<Brake> = (0..4).map(|_| brake(random.random_range(1.0..9.0))).collect();
            let dq: Vec<f64> = (0..4).map(|_| random.random_range(-2.0..2.0)).collect();
            let pushes = brakes.iter().map(|brake| brake.acceleration);
            let ddq: Vec<f64> = pushes.map(|a| a * random.random_range(-1.0..1.0)).collect();
            let braking = Braking::of(&moving(&[0.0; 4], &dq, &ddq), &brakes);
            let begin = braking.sample(0.0);
            assert_eq!((begin.dq, begin.ddq), (dq, ddq));
            for (way, brake) in braking.ways.iter().zip(&brakes) {
                let within = |(_, jerk): &Span| jerk.abs() < brake.jerk * (1.0 + 1e-6);
                assert!(way.spans.iter().all(within), "{way:?} {brake:?}");
                let hardest =
                    (0..=100).map(|k| way.at(f64::from(k) / 100.0 * way.duration()).a.abs());
                let hardest = hardest.fold(0.0, f64::max);
                assert!(hardest < brake.acceleration * (1.0 + 1e-6), "{way:?} {brake:?}");
                let spans = way.spans.iter();
                let end = spans.fold(way.begin, |at, (t, jerk)| at.after(*t, *jerk));
                assert!(end.v.abs() < 1e-6 && end.a.abs() < 1e-6, "{end:?}");
            }
            // No slower than to take all accelerations back, and then to brake.
            let slowest = braking.ways.iter().zip(&brakes).map(|(way, brake)| {
                (way.begin.v + 0.5 * 0.05 * way.begin.a).abs() / brake.acceleration
            });
            assert!(braking.duration() < 0.05 + 0.1 + slowest.fold(0.0, f64::max) + 1e-6);
        }
    }

    /// Together with a joint that takes long it would run on beyond its range.
    #[test]
    fn a_joint_at_the_end_of_its_range_is_brought_to_rest_by_itself() {
        let mut brakes = [brake(5.0), brake(1.0)];
        let at = moving(&[0.0, 0.0], &[0.2, 2.0], &[0.0; 2]);
        let together = Braking::of(&at, &brakes);
        assert!(together.sample(9.0).q[0] > 0.1);
        brakes[0].range = (-1.0, 0.02);
        let braking = Braking::of(&at, &brakes);
        let end = braking.sample(9.0).q;
        assert!(end[0] <= 0.02, "{end:?}");
        assert!((end[1] - together.sample(9.0).q[1]).abs() < 1e-12);
    }
}
