//! Where something that moves by itself was seen lately, how fast it moves, and where it is expected.
//!
//! Its speed is the slope of where it was seen. What is not seen any more goes on for half a second and then rests where it would be:
//! nobody knows that it is gone. Nothing here knows what it is.

use std::collections::VecDeque;

use nalgebra::Vector3;

/// So far back sights tell how fast something moves, s. Chosen: six pictures of a camera at 30 Hz; a millimetre of noise in each
/// is then 6 mm/s, and a thing that starts to move is known to after a third of the way.
const RECENT: f64 = 0.2;
/// What was not seen for so long is taken to rest where it would be now, s. Chosen: longer than a hand that passes
/// before the camera, shorter than most things go on as they did.
pub(super) const REMEMBERED: f64 = 0.5;

/// Where something was seen lately.
#[derive(Debug, Clone, Default)]
pub struct Sights {
    /// When, s, and where, m; the latest last.
    recent: VecDeque<(f64, Vector3<f64>)>,
}

impl Sights {
    /// Takes in where it was at `time` (s); returns whether that is a later sight than any before, and one at all: others change
    /// nothing.
    pub fn add(&mut self, time: f64, at: Vector3<f64>) -> bool {
        let is_later = self.recent.back().is_none_or(|(before, _)| *before < time);
        if !is_later || !time.is_finite() || at.iter().any(|x| !x.is_finite()) {
            return false;
        }
        self.recent.push_back((time, at));
        while self.recent.len() > 2 && self.recent.front().is_some_and(|(t, _)| *t < time - RECENT)
        {
            self.recent.pop_front();
        }
        true
    }

    /// Returns when it was seen last, s.
    pub fn last(&self) -> Option<f64> {
        self.recent.back().map(|(time, _)| *time)
    }

    /// Returns the slope of the line through places over time that is least off in the mean of squares, m/s.
    pub fn velocity(&self) -> Vector3<f64> {
        let share = (self.recent.len() as f64).recip();
        let time = self.recent.iter().map(|(t, _)| t * share).sum::<f64>();
        let (mut up, mut square) = (Vector3::zeros(), 0.0);
        for (t, place) in &self.recent {
            up += (t - time) * place;
            square += (t - time) * (t - time);
        }
        if square > 0.0 { up / square } else { Vector3::zeros() }
    }

    /// Returns where it is expected at `time` (s), m; nothing before it was seen.
    pub fn at(&self, time: f64) -> Option<Vector3<f64>> {
        let (last, place) = self.recent.back()?;
        Some(place + self.velocity() * (time - last).clamp(0.0, REMEMBERED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_to_move_is_expected_to_go_on_for_half_a_second() {
        let mut sights = Sights::default();
        assert_eq!(sights.at(0.0), None);
        for k in 0..20 {
            let time = 0.04 * f64::from(k);
            assert!(sights.add(time, Vector3::new(0.5 * time, 0.0, 0.3)));
        }
        assert!(!sights.add(0.7, Vector3::zeros()), "it is no later");
        assert!(!sights.add(2.0, Vector3::repeat(f64::NAN)), "it is nowhere");
        assert!((sights.velocity() - Vector3::new(0.5, 0.0, 0.0)).norm() < 1e-12);
        assert!((sights.at(0.96).unwrap() - Vector3::new(0.48, 0.0, 0.3)).norm() < 1e-12);
        assert!((sights.at(9.0).unwrap() - Vector3::new(0.63, 0.0, 0.3)).norm() < 1e-12);
    }
}
