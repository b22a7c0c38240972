//! What inputs did between rows, where the recordings do not tell: a held input lags half a row behind the straight lines through its
//! rows, and a delay beside it makes up for that without a trace.

use super::estimate::Task;
use super::hypothesis::{Hypothesis, Question};
use super::score::twice_log_ratio;
use super::simulate::{Hold, Scheme};
use crate::discovery::finding::TIE;

/// Iterations in which the numbers follow: they are near where they stood.
const FOLLOWED: usize = 12;

impl Question<'_> {
    /// Adds to each deviation of a hypothesis by how much its number is another where inputs follow straight lines between rows, if
    /// they are held, or are held, if they follow lines, and the recordings do not tell the two apart. Returns whether they do not,
    /// and where there is no effect, whether a number of the model is another by more than its deviation.
    pub(super) fn doubt_between(&self, at: &mut Hypothesis) -> bool {
        let (compiled, train) = (&at.fitted.compiled, &at.fitted.train);
        let taken = self.bench.scheme;
        let Some(hold) = other_than(taken.hold, self.bench.is_averaged()) else { return false };
        if compiled.inputs.is_empty() || compiled.states.is_empty() {
            return false;
        }
        let scheme = Scheme { hold, ..taken };
        let other = Task { scheme, ..self.bench.task(compiled) }.fit(&train.point, FOLLOWED);
        let is_whole = |left: &[Vec<f64>]| left.iter().all(|rows| !rows.is_empty());
        let Some(other) = other.ok().filter(|other| is_whole(&other.residuals)) else {
            return false;
        };
        let counts = train.sums.iter().map(|(_, n)| *n as f64);
        let effective: Vec<f64> = at.whites[0].iter().zip(counts).map(|(w, n)| w * n).collect();
        if twice_log_ratio(&other.sums, &train.sums, &effective, &self.floors) > TIE {
            return false;
        }
        let pairs = train.point.params.iter().zip(&other.point.params);
        let moved: Vec<f64> = pairs.map(|(here, there)| (here - there).abs()).collect();
        if at.effects.is_empty() && moved.iter().zip(&train.std).all(|(by, std)| by <= std) {
            return false;
        }
        at.fitted.train.std.iter_mut().zip(moved).for_each(|(std, by)| *std += by);
        true
    }
}

/// What inputs may as well have done between rows; rows that are averages have no steps left to hold.
fn other_than(hold: Hold, is_averaged: bool) -> Option<Hold> {
    match hold {
        Hold::Zero => Some(Hold::Line),
        Hold::Line if !is_averaged => Some(Hold::Zero),
        Hold::Line | Hold::Curve => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::edit::model_in;
    use super::super::estimate::Point;
    use super::super::fitting::Fitted;
    use super::super::made::unseen;
    use super::*;

    const DELAYED: &str = "model m {\n input u\n param d: s = free ~ 0.12\n state x = free\n x' = (delay(u, d) - x) * 5\n output x = x\n}\n";
    const PLAIN: &str = "model m {\n input u\n param k = free ~ 0.5\n state x = free\n x' = k*(u - x)\n output x = x\n}\n";

    /// Fits a model as if the input went between rows as `taken` says to what it did when it went as `hold` says, with `truth` as its
    /// one number: whether the two cannot be told apart, the number and its deviation.
    fn told(text: &str, taken: Hold, hold: Hold, truth: f64) -> (bool, f64, f64) {
        let mut bench = unseen(60, 1e-3, |row| (0.3 * row).sin());
        let compiled = bench.prepare(text, "m").unwrap();
        let point = |value| Point { params: vec![value], starts: vec![vec![Some(0.0)]] };
        bench.scheme.hold = hold;
        let values = bench.task(&compiled).run(&point(truth)).unwrap();
        let noise = (0..60).map(|row| 1e-3 * (37.0 * f64::from(row)).sin());
        let seen: Vec<f64> = values.iter().zip(noise).map(|(value, noise)| value + noise).collect();
        bench.train[0].outputs[0].clone_from(&seen);
        bench.held[0].outputs[0] = seen;
        bench.scheme.hold = taken;
        let train = bench.task(&compiled).fit(&point(0.8 * truth), 60).unwrap();
        let fitted = Fitted { text: text.into(), compiled, train };
        let given = model_in(text, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let mut at = question.judged(Vec::new(), fitted, None).unwrap();
        let is_open = question.doubt_between(&mut at);
        (is_open, at.fitted.train.point.params[0], at.fitted.train.std[0])
    }

    /// Rows are 0.1 s apart.
    #[test]
    fn a_delay_of_a_held_input_is_half_a_row_in_doubt() {
        let (is_open, delay, std) = told(DELAYED, Hold::Zero, Hold::Line, 0.2);
        assert!(is_open);
        assert!((delay - 0.15).abs() < 0.01, "{delay} s");
        assert!((0.049..0.06).contains(&std), "{delay} +- {std} s");
    }

    #[test]
    fn a_delay_of_an_input_on_lines_is_as_much_in_doubt() {
        let (is_open, delay, std) = told(DELAYED, Hold::Line, Hold::Zero, 0.2);
        assert!(is_open);
        assert!((delay - 0.25).abs() < 0.01, "{delay} s");
        assert!((0.049..0.06).contains(&std), "{delay} +- {std} s");
    }

    #[test]
    fn without_a_delay_a_motion_tells_what_inputs_did() {
        let (is_open, rate, std) = told(PLAIN, Hold::Zero, Hold::Zero, 0.8);
        assert!(!is_open && (rate - 0.8).abs() < 0.02 && std < 0.01, "{rate} +- {std} 1/s");
    }
}
