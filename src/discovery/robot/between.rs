//! What is another in each recording of one machine: the offset and the friction of its joints.
//!
//! A number that changed from one recording to the next is fitted to all of them at once: it lands between, and looks as sure as
//! any. So these are fitted once more to every recording by itself, beside all else that was found.

use nalgebra::{Matrix3, Vector3};

use super::channels::Quantity;
use super::explain::ArmGap;
use super::links::fit::CREEPS;
use super::links::{DIFFERS, MATTERS};
use super::simulate::Model;
use super::term::{Law, Term, of_each};
use super::wording;
use crate::discovery::selection::{Hypothesis, Residuals as _, related};

/// What may change in a joint from one day to the next.
const LAWS: [Law; 3] = [Law::TorqueOffset, Law::Coulomb, Law::Viscous];

/// Says, joint by joint, which of these numbers differs most between the recordings, where one does so much that it matters;
/// `names` are those of the recordings, the fitted ones first.
pub(super) fn changed(gap: &ArmGap, best: &Hypothesis<Term>, names: &[&str]) -> Vec<String> {
    let n_recordings = gap.train.len() + gap.heldout.len();
    if !gap.is_along() || n_recordings < 2 || names.len() != n_recordings {
        return Vec::new();
    }
    let gap = gap.for_search();
    let joints = gap.train[0].arm.chain.n();
    let found: Vec<Joint> = (0..joints).map(|joint| Joint::of(&gap, best, joint)).collect();
    let models = gap.train.iter().chain(&gap.heldout);
    let own: Option<Vec<Vec<Option<Own>>>> =
        models.map(|model| each_joint(&gap, best, &found, model)).collect();
    let Some(own) = own else { return Vec::new() };
    let of = |(joint, found): (usize, &Joint)| {
        let own: Option<Vec<&Own>> = own.iter().map(|all| all[joint].as_ref()).collect();
        let own = own?;
        let at = most_different(&own)?;
        let values = own.iter().map(|own| found.numbers[at] + own.more[at]);
        let values: Vec<(&str, f64)> = names.iter().copied().zip(values).collect();
        let slides = gap.train[0].arm.chain.slides(joint);
        Some(wording::differs(&called(LAWS[at], joint, slides), &values))
    };
    found.iter().enumerate().filter_map(of).collect()
}

/// What was found of a joint.
struct Joint {
    /// Its offset, dry and viscous friction.
    numbers: [f64; 3],
    /// Below which speed its dry friction gives way, rad/s.
    creep: f64,
}

impl Joint {
    fn of(gap: &ArmGap, best: &Hypothesis<Term>, joint: usize) -> Self {
        let mut found = Self { numbers: [0.0; 3], creep: CREEPS[0] };
        let effects = of_each(&best.terms, &best.parameters[gap.nuisance().len()..]);
        let all = of_each(&gap.known.0, &gap.known.1).chain(effects);
        for (term, p) in all.filter(|(term, _)| term.joint == joint) {
            let [offset, dry, viscous] = &mut found.numbers;
            match term.law {
                Law::TorqueOffset => *offset += p[0],
                Law::Coulomb | Law::SmoothCoulomb | Law::Stribeck => *dry += p[0],
                Law::Asymmetric => {
                    *dry += 0.5 * (p[0] + p[1]);
                    *offset += 0.5 * (p[0] - p[1]);
                }
                Law::Viscous => *viscous += p[0],
                _ => continue,
            }
            let is_dry = !matches!(term.law, Law::TorqueOffset | Law::Viscous);
            found.creep = p.last().copied().filter(|_| is_dry).unwrap_or(found.creep);
        }
        found
    }
}

/// Returns what a recording says of each joint by itself, `None` of one without a torque; nothing at all where the model runs away.
fn each_joint(
    gap: &ArmGap,
    best: &Hypothesis<Term>,
    found: &[Joint],
    model: &Model,
) -> Option<Vec<Option<Own>>> {
    let here = gap.with_known(&best.terms, &best.parameters).residuals(model)?;
    // What acts in a joint shows at that joint alone, so all joints are changed at once.
    let column = |law: Law| {
        let (mut terms, mut parameters) = (best.terms.clone(), best.parameters.clone());
        for (joint, own) in found.iter().enumerate() {
            terms.push(Term { law, joint });
            parameters.push(1.0);
            parameters.extend((law == Law::Coulomb).then_some(own.creep));
        }
        let there = gap.with_known(&terms, &parameters).residuals(model)?;
        Some(here.iter().zip(there).map(|(here, there)| here - there).collect::<Vec<f64>>())
    };
    let columns: Vec<Vec<f64>> = LAWS.into_iter().map(column).collect::<Option<_>>()?;
    let data = &model.course.data;
    let mut own: Vec<Option<Own>> = found.iter().map(|_| None).collect();
    let predicted = data.channels.iter().filter(|channel| model.is_predicted(channel.quantity));
    for (at, channel) in predicted.enumerate().filter(|(_, c)| c.quantity == Quantity::Torque) {
        let rows = at * data.n_rows()..(at + 1) * data.n_rows();
        let row = |row: usize| Vector3::from_fn(|k, _| columns[k][row]);
        // Rows that are not judged are zero.
        let judged = rows.filter(|row| here[*row].abs() > 0.0).map(|at| (row(at), here[at]));
        own[channel.index] = Own::of(&judged.collect::<Vec<_>>());
    }
    Some(own)
}

/// What a recording says of a joint by itself.
struct Own {
    gram: Matrix3<f64>,
    along: Vector3<f64>,
    square: f64,
    /// How much more than was found it has of each number.
    more: Vector3<f64>,
    variances: Vector3<f64>,
}

impl Own {
    /// Fits the numbers to what is left, row by row, where by so much of each of them it falls.
    fn of(rows: &[(Vector3<f64>, f64)]) -> Option<Self> {
        let gram: Matrix3<f64> = rows.iter().map(|(by, _)| by * by.transpose()).sum();
        let along: Vector3<f64> = rows.iter().map(|(by, left)| by * *left).sum();
        let square = rows.iter().map(|(_, left)| left * left).sum();
        let inverse = inverse(&gram)?;
        let more = inverse * along;
        let left: Vec<f64> = rows.iter().map(|(by, left)| left - by.dot(&more)).collect();
        let free = left.len().checked_sub(LAWS.len()).filter(|free| *free > 0)?;
        let level = left.iter().map(|left| left * left).sum::<f64>() / free as f64;
        let variances = inverse.diagonal() * (level * related(&left));
        Some(Self { gram, along, square, more, variances })
    }

    /// Returns what so much more of each number leaves, a sum of squares.
    fn left(&self, more: &Vector3<f64>) -> f64 {
        self.square - 2.0 * self.along.dot(more) + more.dot(&(self.gram * more))
    }
}

/// Returns the inverse of products of columns, some of which may be nothing or say the same.
fn inverse(gram: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let ridge = Matrix3::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
    Some((gram + ridge).cholesky()?.inverse())
}

/// Returns which number differs most between recordings, if one does by far and the same numbers in all leave clearly more.
fn most_different(own: &[&Own]) -> Option<usize> {
    let gram: Matrix3<f64> = own.iter().map(|own| own.gram).sum();
    let along: Vector3<f64> = own.iter().map(|own| own.along).sum();
    let common = inverse(&gram)? * along;
    let in_common: f64 = own.iter().map(|own| own.left(&common)).sum();
    let apart: f64 = own.iter().map(|own| own.left(&own.more)).sum();
    if in_common <= MATTERS * apart {
        return None;
    }
    let differs = |at: usize| -> f64 {
        let told = || own.iter().map(|own| (own.more[at], own.variances[at].max(1e-300)));
        let weight: f64 = told().map(|(_, variance)| 1.0 / variance).sum();
        let mean = told().map(|(x, variance)| x / variance).sum::<f64>() / weight;
        let squares: f64 = told().map(|(x, variance)| (x - mean).powi(2) / variance).sum();
        squares / (own.len() as f64 - 1.0).max(1.0)
    };
    let each = (0..LAWS.len()).map(|at| (differs(at), at));
    let worst = each.max_by(|a, b| a.0.total_cmp(&b.0));
    worst.filter(|(worst, _)| *worst > DIFFERS * DIFFERS).map(|(_, at)| at)
}

/// Returns what a number of a joint is called, with its unit.
fn called(law: Law, joint: usize, slides: bool) -> (String, &'static str) {
    let effort = Quantity::Torque.unit(slides);
    let (name, unit) = match law {
        Law::TorqueOffset => ("torque offset", effort),
        Law::Viscous if slides => ("viscous friction", "N*s/m"),
        Law::Viscous => ("viscous friction", "N*m*s/rad"),
        _ => ("dry friction", effort),
    };
    (format!("the {name} of joint {}", joint + 1), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording in which a joint has so much more offset, dry and viscous friction, read with noise.
    fn recording(more: [f64; 3], shift: u32) -> Own {
        let row = |row: u32| {
            let speed = (0.05 * f64::from(row + shift)).sin();
            let by = Vector3::new(1.0, speed.signum(), speed);
            let scatter = (f64::from(row + 7 * shift) * 12.9898).sin() * 43758.547;
            (by, by.dot(&Vector3::from(more)) + 0.3 * (scatter - scatter.floor() - 0.5))
        };
        Own::of(&(0..800).map(row).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn what_changed_is_told_and_what_did_not_is_not() {
        let same = recording([0.1, 0.2, -0.3], 0);
        assert!((same.more - Vector3::new(0.1, 0.2, -0.3)).norm() < 0.05, "{}", same.more);
        assert_eq!(most_different(&[&same, &recording([0.1, 0.2, -0.3], 31)]), None);
        for at in 0..LAWS.len() {
            let mut other = [0.1, 0.2, -0.3];
            other[at] += 0.5;
            assert_eq!(most_different(&[&same, &recording(other, 31)]), Some(at));
        }
    }

    #[test]
    fn a_joint_whose_sensor_feels_no_friction_says_nothing_of_it() {
        let rows: Vec<(Vector3<f64>, f64)> = (0..100)
            .map(|row| (Vector3::new(1.0, 0.0, 0.0), if row % 2 == 0 { 1.1 } else { 0.9 }))
            .collect();
        let own = Own::of(&rows).unwrap();
        assert!((own.more - Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-6, "{}", own.more);
        assert_eq!(most_different(&[&own, &own]), None);
    }
}
