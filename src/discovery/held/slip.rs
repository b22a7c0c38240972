//! How a thing creeps along the pads.
//!
//! Two laws. A soft pad lets go at a constant rate, always the way the load pulls. Dry friction holds until the
//! load along the pads exceeds friction times squeeze, and then only takes that much off it: the thing slips
//! while the hand is fast and stops again. (Coulomb's law with two pads: `m v' = m·pull - 2·friction·squeeze`.)

use nalgebra::Vector3;

use super::held_record::Held;

/// What the pads let a thing do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Creep {
    /// m/s, the way the load pulls.
    Rate(f64),
    /// Coefficient of friction.
    Friction(f64),
}

/// Longest step of the integration, s.
const STEP: f64 = 0.002;
/// Steps between two rows at most: over a gap of more than 20 s the steps are longer.
const MOST_STEPS: f64 = 1e4;

/// Returns how far the thing has crept in the hand's frame since it was taken, m, at every row that is judged,
/// stretch after stretch; `None` for friction under a squeeze that nobody told.
pub(super) fn crept(held: &Held, law: Creep) -> Option<Vec<Vec<Vector3<f64>>>> {
    let most = match law {
        Creep::Rate(_) => 0.0,
        Creep::Friction(friction) => friction * held.squeeze?,
    };
    let along = |rows: &Vec<usize>| {
        let (mut place, mut speed) = (Vector3::zeros(), Vector3::zeros());
        let mut found = Vec::with_capacity(rows.len());
        let mut row = rows[0];
        for &wanted in rows {
            while row < wanted {
                let span = held.time[row + 1] - held.time[row];
                let steps = (span / STEP).ceil().clamp(1.0, MOST_STEPS);
                let h = span / steps;
                for k in 0..steps as usize {
                    let part = (k as f64 + 0.5) / steps;
                    let pull = held.pull[row].lerp(&held.pull[row + 1], part);
                    match law {
                        Creep::Rate(rate) => {
                            place += rate * h * pull.try_normalize(1e-9).unwrap_or_default();
                        }
                        Creep::Friction(_) => {
                            // What friction can take off in this step, and no more than there is.
                            let free = speed + h * pull;
                            let size = free.norm();
                            speed = if size > most * h {
                                free * (1.0 - most * h / size)
                            } else {
                                Vector3::zeros()
                            };
                            place += h * speed;
                        }
                    }
                }
                row += 1;
            }
            found.push(place);
        }
        found
    };
    Some(held.stretches.iter().map(along).collect())
}
