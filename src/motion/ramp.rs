//! Straight stretches in the least time: from a speed and an acceleration to others, at limits of speed, acceleration and jerk.
//!
//! Up to a highest speed and down from it: pushes and brakes that grow and shrink at the jerk limit. Going on, time is a list
//! of spans of constant jerk.
//!
//! Source: the double-S profile; Biagiotti and Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, 2008, §3.4.

/// Where one is along a curve at some time: how far, how fast, with what acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub(super) s: f64,
    pub(super) v: f64,
    pub(super) a: f64,
}

/// A product takes a fraction of the time of a quotient.
const SIXTH: f64 = 1.0 / 6.0;

impl State {
    /// After `t` s at a constant jerk.
    pub(super) fn after(&self, t: f64, jerk: f64) -> Self {
        Self {
            s: self.s + t * (self.v + t * (self.a / 2.0 + t * jerk * SIXTH)),
            v: self.v + t * (self.a + t * jerk / 2.0),
            a: self.a + t * jerk,
        }
    }
}

/// A span of time, s, and its jerk.
pub(super) type Span = (f64, f64);

/// Limits along a straight stretch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    pub(super) v: f64,
    pub(super) a: f64,
    pub(super) j: f64,
}

impl Along {
    /// Returns the spans from a speed, pushed already, up to a highest one.
    pub(super) fn up(&self, v: f64, a: f64, highest: f64) -> [Span; 3] {
        let gain = highest - v;
        let peak = (self.j * gain + 0.5 * a * a).max(0.0).sqrt().clamp(a, self.a.max(a));
        let held = (gain - (2.0 * peak * peak - a * a) / (2.0 * self.j)) / peak.max(1e-12);
        [((peak - a) / self.j, self.j), (held.max(0.0), 0.0), (peak / self.j, -self.j)]
    }

    /// How far these lead, from a speed and an acceleration.
    fn way(v: f64, a: f64, spans: &[Span; 3]) -> f64 {
        let begin = State { s: 0.0, v, a };
        spans.iter().fold(begin, |at, (t, jerk)| at.after(*t, *jerk)).s
    }

    /// Returns the spans from the speed `from.0` and the acceleration `from.1`, which is a push or none, to `to.0` and `to.1`, which
    /// is a brake or none, over `length`; none where it is too short for that.
    pub(super) fn between(
        &self,
        from: (f64, f64),
        to: (f64, f64),
        length: f64,
    ) -> Option<[Span; 7]> {
        let (pushed, braked) = (from.1, -to.1);
        let least = |(v, a): (f64, f64)| v + a * a / (2.0 * self.j);
        let lowest = least(from).max(least((to.0, braked)));
        if lowest > self.v * (1.0 + 1e-9) || pushed < 0.0 || braked < 0.0 {
            return None;
        }
        let parts = |highest: f64| {
            let (up, down) = (self.up(from.0, pushed, highest), self.up(to.0, braked, highest));
            let way = Self::way(from.0, pushed, &up) + Self::way(to.0, braked, &down);
            (up, down, length - way)
        };
        let (mut low, mut high) = (lowest.min(self.v), self.v);
        let mut found = parts(high);
        if found.2 < 0.0 {
            if parts(low).2 < 0.0 {
                return None;
            }
            // The way grows with the highest speed.
            while high - low > 1e-9 * self.v {
                let middle = 0.5 * (low + high);
                if parts(middle).2 >= 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found = parts(low);
        } else {
            low = high;
        }
        let (up, down, left) = found;
        // Backwards in time jerks keep their sign.
        let [a, b, c] = down;
        Some([up[0], up[1], up[2], (left.max(0.0) / low.max(1e-12), 0.0), c, b, a])
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    const LIMITS: Along = Along { v: 1.5, a: 5.0, j: 100.0 };

    /// Runs through spans and returns the end and the largest shares of the limits.
    fn run(v: f64, a: f64, spans: &[Span]) -> (State, [f64; 3]) {
        let mut at = State { s: 0.0, v, a };
        let mut most = [0.0_f64; 3];
        for &(t, jerk) in spans {
            for k in 0..=50 {
                let now = at.after(t * f64::from(k) / 50.0, jerk);
                let shares = [now.v / LIMITS.v, now.a.abs() / LIMITS.a, jerk.abs() / LIMITS.j];
                assert!(now.v > -1e-9, "it never turns back");
                most = std::array::from_fn(|i| most[i].max(shares[i]));
            }
            at = at.after(t, jerk);
        }
        (at, most)
    }

    /// At the limits a way takes `d / v + v / a + a / j`.
    #[test]
    fn from_rest_to_rest_it_takes_the_least_time() {
        let spans = LIMITS.between((0.0, 0.0), (0.0, 0.0), 3.0).unwrap();
        let time: f64 = spans.iter().map(|(t, _)| t).sum();
        assert!((time - (3.0 / 1.5 + 1.5 / 5.0 + 5.0 / 100.0)).abs() < 1e-9, "{time}");
        // Too short for the acceleration to get there: four spans with the jerk at its limit, d = 2 j t³.
        let spans = LIMITS.between((0.0, 0.0), (0.0, 0.0), 0.002).unwrap();
        let time: f64 = spans.iter().map(|(t, _)| t).sum();
        assert!((time - 4.0 * (0.001_f64 / 100.0).cbrt()).abs() < 1e-5, "{time}");
    }

    #[test]
    fn ends_are_met_and_limits_kept() {
        let mut random = StdRng::seed_from_u64(2);
        let mut met = 0;
        for _ in 0..2000 {
            let mut end = || (random.random_range(0.0..1.3), random.random_range(0.0..5.0));
            let (from, to) = (end(), end());
            let length = 10.0_f64.powf(random.random_range(-3.0..0.5));
            let Some(spans) = LIMITS.between(from, (to.0, -to.1), length) else { continue };
            let (at, most) = run(from.0, from.1, &spans);
            assert!((at.s - length).abs() < 1e-6, "{from:?} {to:?} {length}: {at:?}");
            assert!((at.v - to.0).abs() < 1e-6 && (at.a + to.1).abs() < 1e-6, "{at:?}");
            assert!(most.iter().all(|share| *share < 1.0 + 1e-6), "{most:?}");
            met += 1;
        }
        assert!(met > 500, "{met}");
    }
}
