//! Dry friction of a joint: what the model has of it already, and whether a general law of it is more than its special case.

use super::explain::ArmGap;
use super::term::{Law, Term};

/// A law of friction is right to this part of it and no better: what it has beyond its special case is more than that.
const PART: f64 = 0.03;

impl ArmGap {
    /// Returns the dry friction that the model has at a joint already, both ways together, N·m.
    pub(super) fn dry_known(&self, joint: usize) -> f64 {
        let (terms, values) = &self.known;
        let mut from = 0;
        let of = |term: &Term| {
            let own = &values[from..];
            from += term.law.specs().len();
            match term.law {
                _ if term.joint != joint => 0.0,
                Law::Coulomb | Law::SmoothCoulomb | Law::Stribeck => 2.0 * own[0],
                Law::Asymmetric => own[0] + own[1],
                _ => 0.0,
            }
        };
        terms.iter().map(of).sum()
    }

    /// Returns whether a general law of dry friction is more than its special case, the same at every speed and both ways: as much
    /// as friction is known, however sure the difference is.
    pub(super) fn is_more_than_dry(&self, term: Term, own: &[f64]) -> bool {
        match term.law {
            Law::Asymmetric => {
                let level = 0.5 * (own[0] + own[1] + self.dry_known(term.joint));
                (own[0] - own[1]).abs() > PART * level
            }
            Law::Stribeck => {
                let level = own[0] + 0.5 * self.dry_known(term.joint);
                // Slower than friction gives way, or than a speed is known, a peak is the way in which it does.
                let creep = self.train.iter().fold(own[3], |creep, model| {
                    creep.max(model.course.speed_error.get(term.joint).copied().unwrap_or(0.0))
                });
                // And a peak on no level is the corner of friction that another law has.
                own[1] > PART * level && level > PART * own[1] && own[2] > creep
            }
            _ => true,
        }
    }
}
