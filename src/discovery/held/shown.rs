//! What shows an effect on a thing held: how it moved in the hand over time, over the hand's speed or its attitude, how far
//! open the fingers stopped, how high it was seen.

use nalgebra::Vector3;

use super::gap::{HeldGap, Term};
use super::held_finding::AXES;
use super::held_record::Held;
use super::wording;
use crate::discovery::selection::Set;
use crate::discovery::why::{COUNT, Left, Seen, Shows, State};
use crate::discovery::wording::Worded as _;

/// What is read of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// Where it is in the hand, along one of its axes, row by row.
    Place(usize),
    /// How wide it is along an axis of its own, grasp by grasp.
    Width(usize),
    /// How high it is, once.
    Height,
}

const TIME: &str = "time";
/// A stretch of being held, by its number among all.
const GRASP: &str = "grasp";
/// Half the time over which the hand's speed is taken, s: that of a few pictures.
const PACE: f64 = 0.05;

impl HeldGap {
    /// The readings of all recordings, one recording after the other.
    fn readings(&self) -> impl Iterator<Item = (usize, Reading)> {
        let places = (0..AXES.len()).map(Reading::Place);
        let all: Vec<Reading> =
            places.chain([0, 1].map(Reading::Width)).chain([Reading::Height]).collect();
        let is_there = |held: &Held, reading: &Reading| match reading {
            Reading::Place(_) => true,
            Reading::Width(axis) => held.opening.iter().any(|(_, own)| own == axis),
            Reading::Height => held.height.is_some(),
        };
        let of = move |at: usize| -> Vec<(usize, Reading)> {
            let there = all.iter().filter(|reading| is_there(&self.held[at], reading));
            there.map(|reading| (at, *reading)).collect()
        };
        (0..self.held.len()).flat_map(of)
    }

    fn channel(&self, reading: Reading) -> String {
        let object = &self.held[0].object;
        match reading {
            Reading::Place(axis) => AXES[axis].into(),
            Reading::Width(axis) => wording::width(object, axis),
            Reading::Height => wording::height(object),
        }
    }

    /// The states that a place in the hand may depend on, row by row.
    fn moved_by(&self, at: usize) -> Vec<State> {
        let held = &self.held[at];
        let rows: Vec<usize> = held.stretches.iter().flatten().copied().collect();
        let begin = held.time.first().copied().unwrap_or(0.0);
        let of = |name: &str, unit: &str, value: &dyn Fn(usize) -> f64| State {
            name: name.into(),
            unit: unit.into(),
            values: rows.iter().map(|row| value(*row)).collect(),
        };
        // In the hand's own frame, since that is where what is seen late stays behind.
        let speed = |row: usize, axis: usize| {
            let (before, after) = (held.time[row] - PACE, held.time[row] + PACE);
            let way =
                held.hand_at(after).translation.vector - held.hand_at(before).translation.vector;
            held.hand[row].rotation.inverse_transform_vector(&way)[axis] / (2.0 * PACE)
        };
        let leans = |row: usize| {
            held.hand[row].rotation.transform_vector(&Vector3::z()).angle(&-Vector3::z())
        };
        let turned = |row: usize| held.hand[row].rotation.euler_angles().2;
        vec![
            of(TIME, "s", &|row| held.time[row] - begin),
            of("speed_x", "m/s", &|row| speed(row, 0)),
            of("speed_y", "m/s", &|row| speed(row, 1)),
            of("speed_z", "m/s", &|row| speed(row, 2)),
            of("tilt", "rad", &leans),
            of("turn", "rad", &turned),
        ]
    }
}

impl Shows for HeldGap {
    fn left(&self, terms: &[Term], parameters: &[f64]) -> Vec<Left> {
        let size = self.active(terms, parameters).size;
        let of = |(at, reading): (usize, Reading)| {
            let held = &self.held[at];
            let once = |values: Vec<f64>, noise: f64| {
                (noise, vec![!self.has_single(at, Set::Train); values.len()], values)
            };
            let (noise, held_out, values) = match reading {
                Reading::Place(axis) => {
                    let rows = HeldGap::left(self, at, None, terms, parameters).unwrap_or_default();
                    let held_out = |row: usize| !self.is_in(at, row, Set::Train);
                    let held_out = rows.iter().map(|(row, _)| held_out(*row)).collect();
                    (held.noise, held_out, rows.iter().map(|(_, value)| value[axis]).collect())
                }
                Reading::Width(axis) => {
                    let own = held.opening.iter().filter(|(_, own)| *own == axis);
                    once(own.map(|(wider, _)| wider - size[axis]).collect(), Held::PADS)
                }
                Reading::Height => {
                    let off = held.height.iter().map(|(higher, part)| higher - part * size[2]);
                    once(off.collect(), Held::HEIGHT)
                }
            };
            Left { channel: self.channel(reading), unit: "m".into(), noise, held_out, values }
        };
        self.readings().map(of).collect()
    }

    fn states(&self, at: usize) -> Vec<State> {
        let Some((at, reading)) = self.readings().nth(at) else { return Vec::new() };
        // Grasps are counted through all recordings.
        let before: usize = self.held[..at].iter().map(|held| held.opening.len()).sum();
        let counted = |name: &str, values: Vec<f64>| {
            vec![State { name: name.into(), unit: COUNT.into(), values }]
        };
        match reading {
            Reading::Place(_) => self.moved_by(at),
            Reading::Width(axis) => {
                let all = self.held[at].opening.iter().enumerate();
                let own = all.filter(|(_, (_, own))| *own == axis);
                counted(GRASP, own.map(|(k, _)| (before + k + 1) as f64).collect())
            }
            Reading::Height => counted("recording", vec![(at + 1) as f64]),
        }
    }

    fn told(&self, term: &Term) -> Option<(String, String)> {
        Some((self.name(term).to_owned(), self.site(term)))
    }

    fn seen(&self, term: &Term) -> Seen {
        let channel = match term {
            Term::Width(axis) => Some(self.channel(Reading::Width(*axis))),
            Term::Height => Some(self.channel(Reading::Height)),
            _ => None,
        };
        let creeps = matches!(term, Term::Rate | Term::Friction);
        Seen { channel, state: creeps.then(|| TIME.to_owned()) }
    }
}
