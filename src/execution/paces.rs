//! How fast the arm was held to move, from when on: what time limits are counted by.
//!
//! A limit is said for an arm at full speed. Of an arm that is held to a share of it, by `--speed` or by the dial
//! ([`super::conduct::Dial`]), each second counts as that share of one, so limits stretch as motions do, also where the share changes on
//! the way.

/// From which arm time on (s), and to which share of full speed, the arm was held, in order of time; to none before the first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Paces(Vec<(f64, f64)>);

impl Paces {
    /// From arm time `now` on, s, the arm is held to `pace` of its full speed.
    pub fn turn(&mut self, now: f64, pace: f64) {
        if self.0.last().is_none_or(|(_, last)| last.total_cmp(&pace).is_ne()) {
            self.0.push((now, pace));
        }
    }

    /// Returns how much what went on between two arm times (s) counts as, s at full speed.
    pub fn unslowed(&self, from: f64, to: f64) -> f64 {
        let (mut at, mut pace, mut counted) = (from, 1.0, 0.0);
        for &(since, next) in &self.0 {
            let end = since.min(to);
            if end > at {
                counted += pace * (end - at);
                at = end;
            }
            pace = next;
        }
        counted + pace * (to - at).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_counts_as_the_share_of_full_speed_that_it_passed_at() {
        let mut paces = Paces::default();
        assert!((paces.unslowed(1.0, 4.0) - 3.0).abs() < 1e-12);
        paces.turn(2.0, 0.1);
        paces.turn(3.0, 0.1);
        assert_eq!(paces.0.len(), 1, "it did not change");
        paces.turn(12.0, 0.5);
        for (from, to, counted) in [
            (0.0, 2.0, 2.0),
            (0.0, 12.0, 3.0),
            (2.0, 7.0, 0.5),
            (7.0, 14.0, 1.5),
            (13.0, 15.0, 1.0),
            (15.0, 13.0, 0.0),
        ] {
            let is = paces.unslowed(from, to);
            assert!((is - counted).abs() < 1e-12, "{from} to {to}: {is}");
        }
    }
}
