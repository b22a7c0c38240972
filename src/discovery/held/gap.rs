//! Things held as something to be explained: [`Residuals`] over how they crept, how they were seen, how large they are.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::held_record::Held;
use super::slip::{Creep, crept};
use crate::discovery::selection::{Block, Candidate, ParameterSpec, Residuals, Set};
use crate::discovery::wording::set_of;

/// What can be missing from what is known of a thing in the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    /// `grip_slip(gripper) { rate }`.
    Rate,
    /// `grip_slip(gripper) { friction }`.
    Friction,
    /// `object_size(object) { dx }`, or `dy` (1): its width between the fingers.
    Width(usize),
    /// `object_size(object) { dz }`: its height.
    Height,
    /// `image_delay(camera)`: it was seen late.
    Late,
    /// `camera_shift(camera)`: it was seen from elsewhere, told in the base's axes; in a model file it sits at
    /// [`OBJECT_TRACKER`](crate::discovery::vocabulary::OBJECT_TRACKER).
    Shift,
}

/// Recordings of one thing, some to fit and some to judge; stretches of a second of a single one take turns.
#[derive(Debug)]
pub(super) struct HeldGap {
    pub(super) held: Vec<Held>,
    pub(super) sets: Vec<Option<Set>>,
    /// Effects that the model has already, with their numbers one after the other.
    pub(super) known: (Vec<Term>, Vec<f64>),
}

/// A slip that comes to less than this in all is not told from a hand that bends, m.
const LEAST: f64 = 1e-3;

const fn spec(
    name: &'static str,
    unit: &'static str,
    scale: f64,
    range: (f64, f64),
) -> ParameterSpec {
    ParameterSpec { name, unit, scale, range, neutral: Some(0.0), least: 0.0 }
}

/// The effects of one hypothesis, sorted.
pub(super) struct ActiveEffects {
    creep: Option<Creep>,
    late: f64,
    camera: Isometry3<f64>,
    pub(super) size: [f64; 3],
}

impl HeldGap {
    /// Returns whether a row of a recording belongs to a set.
    pub(super) fn is_in(&self, at: usize, row: usize, set: Set) -> bool {
        let time = &self.held[at].time;
        set_of(self.sets[at], time[row] - time[0], row, time.len()) == set
    }

    /// Returns whether what was read once belongs to a set: to what decides, since it cannot be cut.
    pub(super) fn has_single(&self, at: usize, set: Set) -> bool {
        set != Set::Unseen && self.sets[at].is_none_or(|own| own == set)
    }

    pub(super) fn active(&self, terms: &[Term], parameters: &[f64]) -> ActiveEffects {
        let mut active =
            ActiveEffects { creep: None, late: 0.0, camera: Isometry3::identity(), size: [0.0; 3] };
        for (terms, mut numbers) in [(&self.known.0[..], &self.known.1[..]), (terms, parameters)] {
            for term in terms {
                let (mine, rest) = numbers.split_at(self.specs(term).len());
                numbers = rest;
                match term {
                    Term::Rate => active.creep = Some(Creep::Rate(mine[0])),
                    Term::Friction => active.creep = Some(Creep::Friction(mine[0])),
                    Term::Width(axis) => active.size[*axis] += mine[0],
                    Term::Height => active.size[2] += mine[0],
                    Term::Late => active.late += mine[0],
                    Term::Shift => {
                        let turn = UnitQuaternion::from_euler_angles(mine[3], mine[4], mine[5]);
                        let place = Vector3::new(mine[0], mine[1], mine[2]);
                        active.camera *= Isometry3::from_parts(place.into(), turn);
                    }
                }
            }
        }
        active
    }

    /// Returns where the thing was seen in the hand less where it should have been, m: stretch by stretch, row by
    /// row, before the mean of the stretch is taken away.
    fn drift(&self, at: usize, active: &ActiveEffects) -> Option<Vec<Vec<Vector3<f64>>>> {
        let held = &self.held[at];
        let base_from_camera = active.camera.inverse();
        let crept = match active.creep {
            Some(law) => Some(crept(held, law)?),
            None => None,
        };
        let mut all = Vec::new();
        for (stretch, rows) in held.stretches.iter().enumerate() {
            let one = |(i, &row): (usize, &usize)| {
                let hand = held.hand_at(held.time[row] - active.late);
                let place = base_from_camera * nalgebra::Point3::from(held.seen[row]);
                let in_hand = hand.inverse() * place;
                let moved = crept.as_ref().map_or_else(Vector3::zeros, |crept| crept[stretch][i]);
                in_hand.coords - moved
            };
            all.push(rows.iter().enumerate().map(one).collect());
        }
        Some(all)
    }

    /// Returns the residuals of the rows of one recording that belong to `set` (all of them for `None`), m in the
    /// hand's frame, with their rows; how the thing was grasped is taken away stretch by stretch.
    pub(super) fn left(
        &self,
        at: usize,
        set: Option<Set>,
        terms: &[Term],
        parameters: &[f64],
    ) -> Option<Vec<(usize, Vector3<f64>)>> {
        let drift = self.drift(at, &self.active(terms, parameters))?;
        let held = &self.held[at];
        let mut found = Vec::new();
        for (rows, values) in held.stretches.iter().zip(drift) {
            let mine: Vec<(usize, Vector3<f64>)> = rows
                .iter()
                .copied()
                .zip(values)
                .filter(|(row, _)| set.is_none_or(|set| self.is_in(at, *row, set)))
                .collect();
            let sum: Vector3<f64> = mine.iter().map(|(_, value)| value).sum();
            let grasp = sum / mine.len().max(1) as f64;
            found.extend(mine.into_iter().map(|(row, value)| (row, value - grasp)));
        }
        Some(found)
    }

    /// Returns the residuals of a set in units of noise, recording by recording: those of its places, of its widths and of its
    /// height.
    fn read(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Option<Vec<[Vec<f64>; 3]>> {
        let size = self.active(terms, parameters).size;
        let of = |(at, held): (usize, &Held)| -> Option<[Vec<f64>; 3]> {
            let rows = self.left(at, Some(set), terms, parameters)?;
            let places = rows.iter().flat_map(|(_, value)| value.iter());
            let places: Vec<f64> = places.map(|value| value / held.noise).collect();
            if !self.has_single(at, set) {
                return Some([places, Vec::new(), Vec::new()]);
            }
            let widths = held.opening.iter();
            let widths = widths.map(|(wider, axis)| (wider - size[*axis]) / Held::PADS).collect();
            let height = held.height.iter();
            let height = height.map(|(higher, part)| (higher - part * size[2]) / Held::HEIGHT);
            Some([places, widths, height.collect()])
        };
        self.held.iter().enumerate().map(of).collect()
    }

    fn longest(&self) -> f64 {
        let span =
            |held: &Held, rows: &Vec<usize>| held.time[rows[rows.len() - 1]] - held.time[rows[0]];
        let spans =
            self.held.iter().flat_map(|held| held.stretches.iter().map(|rows| span(held, rows)));
        spans.fold(0.0, f64::max)
    }
}

impl Residuals for HeldGap {
    type Term = Term;

    fn specs(&self, term: &Term) -> Vec<ParameterSpec> {
        let length = |name| spec(name, "m", 1e-3, (-0.5, 0.5));
        match term {
            Term::Rate => {
                let rate = spec("rate", "m/s", 1e-4, (0.0, 1.0));
                vec![ParameterSpec { least: LEAST / self.longest().max(1e-3), ..rate }]
            }
            Term::Friction => {
                vec![ParameterSpec { neutral: None, ..spec("friction", "", 2e-3, (1e-3, 5.0)) }]
            }
            Term::Width(0) => vec![ParameterSpec { least: Held::PADS, ..length("dx") }],
            Term::Width(_) => vec![ParameterSpec { least: Held::PADS, ..length("dy") }],
            Term::Height => vec![ParameterSpec { least: 2.0 * Held::HEIGHT, ..length("dz") }],
            Term::Late => {
                // No picture is of what comes.
                vec![ParameterSpec { least: 2e-3, ..spec("delay", "s", 5e-3, (0.0, 1.0)) }]
            }
            Term::Shift => {
                let turn = |name| spec(name, "rad", 2e-3, (-1.0, 1.0));
                let (x, y, z) = (length("x"), length("y"), length("z"));
                vec![x, y, z, turn("roll"), turn("pitch"), turn("yaw")]
            }
        }
    }

    fn residuals(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let all: Vec<f64> =
            self.read(set, terms, parameters)?.into_iter().flatten().flatten().collect();
        all.iter().all(|value| value.is_finite()).then_some(all)
    }

    fn blocks(&self, set: Set) -> Vec<Block> {
        let read = self.read(set, &[], &[]).unwrap_or_default();
        let mut from = 0;
        let of = |(sensor, values): (usize, &Vec<f64>)| {
            let rows = from..from + values.len();
            from = rows.end;
            Block { sensor, rows }
        };
        read.iter().flat_map(|one| one.iter().enumerate()).map(of).collect()
    }

    /// A size is read by itself: how the thing moves in the hand says nothing of it, nor it of that.
    fn related(&self, a: &Term, b: &Term) -> bool {
        let is_size = |term: &Term| matches!(term, Term::Width(_) | Term::Height);
        a == b || !(is_size(a) || is_size(b))
    }

    fn count(&self, set: Set) -> usize {
        let of = |at: usize| {
            let held = &self.held[at];
            let rows =
                |rows: &Vec<usize>| rows.iter().filter(|row| self.is_in(at, **row, set)).count();
            // Three numbers a stretch go into how it was grasped.
            let places: usize =
                held.stretches.iter().map(|stretch| 3 * rows(stretch).saturating_sub(1)).sum();
            let single = held.opening.len() + usize::from(held.height.is_some());
            places + if self.has_single(at, set) { single } else { 0 }
        };
        (0..self.held.len()).map(of).sum()
    }

    fn candidates(
        &self,
        terms: &[Term],
        _left: &[f64],
        instead_of: Option<&Term>,
    ) -> Vec<Candidate<Term>> {
        let mut found = vec![Term::Rate, Term::Late, Term::Shift];
        let every = |of: &dyn Fn(&Held) -> bool| self.held.iter().all(of);
        if every(&|held| held.squeeze.is_some()) {
            found.push(Term::Friction);
        }
        for axis in [0, 1] {
            if self.held.iter().any(|held| held.opening.iter().any(|(_, own)| *own == axis)) {
                found.push(Term::Width(axis));
            }
        }
        if every(&|held| held.height.is_some()) {
            found.push(Term::Height);
        }
        // Friction that holds the largest load by so much does nothing; below, it lets go now and then.
        let most = self.held.iter().filter_map(|held| {
            let pulls = held.stretches.iter().flatten().map(|row| held.pull[*row].norm());
            Some(pulls.fold(0.0, f64::max) / held.squeeze?)
        });
        let most = most.fold(0.0, f64::max);
        found.retain(|term| !terms.contains(term) && !self.known.0.contains(term));
        found.retain(|term| instead_of.is_none_or(|out| self.related(out, term)));
        let candidate = |term: Term| {
            let starts = match term {
                Term::Friction => {
                    [0.99, 0.97, 0.94, 0.9, 0.85, 0.8].map(|part| vec![part * most]).to_vec()
                }
                _ => vec![vec![0.0; self.specs(&term).len()]],
            };
            Candidate { term, with: Vec::new(), starts, surcharge: 0.0 }
        };
        found.into_iter().map(candidate).collect()
    }

    /// A number that ran to the end of its range is that of something else.
    fn is_sensible(&self, term: &Term, parameters: &[f64]) -> bool {
        let specs = self.specs(term);
        !specs.iter().zip(parameters).any(|(spec, value)| spec.has_run_out(*value))
    }

    fn compatible(&self, a: &Term, b: &Term) -> bool {
        let creeps = |term: &Term| matches!(term, Term::Rate | Term::Friction);
        a != b && !(creeps(a) && creeps(b))
    }

    fn is_rough(&self, term: &Term) -> bool {
        *term == Term::Friction
    }
}
