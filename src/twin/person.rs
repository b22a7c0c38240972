//! Somebody who takes what is held out: after a while a pull, until the fingers give the thing free.
//!
//! Nothing is taken that is not offered ([`super::Twin::offer`]), as a person is told in words. The rehearsal's person pulls
//! at once and as hard as is usual; the laboratory's is drawn anew and may not come at all. This is a force on a thing and no
//! model of a person.

use nalgebra::Vector3;

/// A hand that holds something this near to where it is handed over is before the person, m.
const NEAR: f64 = 0.15;
/// A joint slower than this is at rest, rad/s.
const STILL: f64 = 0.03;
/// A pull grows to its strength within so long, s.
const GROWS: f64 = 0.4;
/// Who has pulled so long without getting it lets go, s.
const GIVES_UP: f64 = 6.0;
/// What the fingers have not held for so long has been taken, s.
const FREE: f64 = 0.1;

/// Somebody who may take something.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Where it is handed over, m in the world.
    at: Vector3<f64>,
    /// Away from the arm: a level unit vector.
    away: Vector3<f64>,
    /// From the offer to the pull, s.
    delay: f64,
    /// How hard, N.
    pull: f64,
    /// Whether anybody comes.
    comes: bool,
    offered: bool,
    since: Option<f64>,
    /// What is pulled at, and when it was last held, s.
    pulling: Option<(usize, f64)>,
    given_up: bool,
}

/// What a person does in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Does {
    /// Nothing.
    Waits,
    /// Pulls at an object with a force, N.
    Pulls(usize, Vector3<f64>),
    /// Goes away with it, to a place in the world, m.
    Takes(usize, Vector3<f64>),
}

impl Person {
    /// Somebody stands at `at` (m, world) before an arm whose base is at `base`, and pulls with `pull` N `delay` s after
    /// something is held out; nobody when `comes` is false.
    pub fn new(at: Vector3<f64>, base: Vector3<f64>, delay: f64, pull: f64, comes: bool) -> Self {
        let away = Vector3::new(at.x - base.x, at.y - base.y, 0.0);
        let away = away.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        Self {
            at,
            away,
            delay,
            pull,
            comes,
            offered: false,
            since: None,
            pulling: None,
            given_up: false,
        }
    }

    pub(super) fn hears(&mut self, offered: bool) {
        self.offered = offered;
        (self.since, self.given_up) = (None, false);
    }

    /// Whether anything is asked of a person at all.
    pub(super) fn is_asked(&self) -> bool {
        self.comes && (self.offered || self.pulling.is_some())
    }

    /// Says what the person does at `time` (s), when the tool is at `tool` (m), its fastest joint moves at `speed` (rad/s)
    /// and the fingers hold `held`.
    pub(super) fn step(
        &mut self,
        time: f64,
        tool: Vector3<f64>,
        speed: f64,
        held: Option<usize>,
    ) -> Does {
        if let Some((object, last_held)) = self.pulling {
            if held == Some(object) {
                self.pulling = Some((object, time));
            } else if time - last_held > FREE {
                self.pulling = None;
                // Out of every picture of the table.
                return Does::Takes(object, self.at + 3.0 * self.away + Vector3::z());
            }
            let since = time - self.since.unwrap_or(time);
            if since > GIVES_UP {
                (self.pulling, self.given_up) = (None, true);
                return Does::Waits;
            }
            return Does::Pulls(object, self.away * self.pull * (since / GROWS).min(1.0));
        }
        let is_before = (tool - self.at).norm() < NEAR && speed < STILL;
        let Some(object) = held.filter(|_| is_before && !self.given_up) else {
            self.since = None;
            return Does::Waits;
        };
        let since = *self.since.get_or_insert(time);
        if time - since >= self.delay {
            (self.since, self.pulling) = (Some(time), Some((object, time)));
        }
        Does::Waits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_pulled_at_before_it_is_offered_and_what_is_let_go_is_taken() {
        let at = Vector3::new(0.6, 0.0, 0.25);
        let mut person = Person::new(at, Vector3::zeros(), 1.0, 10.0, true);
        assert!(!person.is_asked());
        person.hears(true);
        let does = |person: &mut Person, time: f64, held| person.step(time, at, 0.0, held);
        assert_eq!(does(&mut person, 0.0, Some(2)), Does::Waits);
        assert_eq!(does(&mut person, 0.9, Some(2)), Does::Waits);
        does(&mut person, 1.1, Some(2));
        let Does::Pulls(2, force) = does(&mut person, 1.6, Some(2)) else { panic!() };
        assert!((force - Vector3::x() * 10.0).norm() < 1e-9);
        assert!(matches!(does(&mut person, 1.65, None), Does::Pulls(..)), "a touch flickers");
        assert!(matches!(does(&mut person, 1.8, None), Does::Takes(2, _)));
        assert!(!Person::new(at, Vector3::zeros(), 1.0, 10.0, false).is_asked(), "nobody comes");
    }
}
