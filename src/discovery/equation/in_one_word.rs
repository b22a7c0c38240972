//! Whether one word says what a formula of several says.
//!
//! Words are found one by one, the first beside a model that has lost its way without any: the square of a state may then look less
//! like what is missing than its third power, with a root of it to make up for the difference. So at the end every word is fitted
//! alone, begun where the formula came to rest, and kept where the formula says no more.

use rayon::prelude::*;

use super::edit::model_in;
use super::features::features;
use super::fitting::Fitted;
use super::hypothesis::{Chosen, Hypothesis, LEAST_EVIDENCE, Question};
use super::unknown::{FULLY, SHORTLIST, places};

/// Iterations in which a word begun where the formula came to rest shows what it leaves.
const BEGUN: usize = 6;

impl Question<'_> {
    /// The one word in the place of a formula of several, where the formula does not say more than it; else the formula.
    pub(super) fn in_one_word(&self, base: &Hypothesis, formula: Hypothesis) -> Hypothesis {
        if formula.effects.len() < base.effects.len() + 2 || self.bench.is_spent() {
            return formula;
        }
        let single = self.nearest_word(base, &formula);
        let is_enough = |one: &Hypothesis| self.gain(one, &formula, 1).evidence() < LEAST_EVIDENCE;
        single.filter(is_enough).unwrap_or(formula)
    }

    /// The word at the formula's place that alone leaves least.
    fn nearest_word(&self, base: &Hypothesis, formula: &Hypothesis) -> Option<Hypothesis> {
        let model = model_in(&base.fitted.text, self.name)?;
        let ground = self.ground(&base.fitted, &model);
        let at = &formula.effects.last()?.candidate.at;
        let place = places(&ground).into_iter().find(|place| place.name == *at)?;
        let from = self.resting(base, formula);
        let mut begun: Vec<(f64, Chosen, Fitted)> = features(&ground)
            .into_par_iter()
            .filter_map(|word| {
                let (text, chosen) = self.written(base, &place, &word)?;
                let fitted = self.bench.fit(&text, self.name, &from, BEGUN)?;
                Some((self.cost(&fitted), chosen, fitted))
            })
            .filter(|(cost, ..)| cost.is_finite())
            .collect();
        begun.sort_by(|a, b| a.0.total_cmp(&b.0));
        begun.truncate(SHORTLIST);
        let singles: Vec<Hypothesis> = begun
            .into_par_iter()
            .filter_map(|(_, chosen, begun)| {
                let fitted = self.bench.fit(&begun.text, self.name, &begun, FULLY)?;
                self.worded(base, chosen, fitted)
            })
            .collect();
        let cost = |one: &Hypothesis| self.cost(&one.fitted);
        singles.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// The model without the formula, its own numbers and first values as they are beside it.
    fn resting(&self, base: &Hypothesis, formula: &Hypothesis) -> Fitted {
        let mut from = base.fitted.clone();
        let (own, beside) = (&base.fitted.compiled, &formula.fitted);
        let task = self.bench.task(own);
        from.train.point = self.bench.inherit(own, &beside.compiled, &beside.train.point, &task);
        from
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidates::Candidate;
    use super::super::edit::{NewParam, Patch};
    use super::super::estimate::Point;
    use super::super::made::bench;
    use super::super::unknown::UNKNOWN;
    use super::*;

    fn model(more: &str) -> String {
        format!("model m {{\n input u\n state x = 0\n x' = u - x{more}\n output x = x\n}}\n")
    }

    fn word(name: &str, text: &str) -> Chosen {
        let amount = NewParam {
            role: "coefficient",
            name: name.into(),
            dimension: None,
            range: None,
            neutral: Some(0.0),
            value: 0.0,
            std: None,
        };
        let rates = vec![("x".into(), format!("+ {name}*{text}"))];
        let patch = Patch { params: vec![amount], rates, ..Patch::default() };
        let equation = format!("x' += {name}*{text}");
        let (at, patches) = ("x".into(), Vec::new());
        Chosen { candidate: Candidate { kind: UNKNOWN, at, patches, equation, within: &[] }, patch }
    }

    /// What is kept of two words for what `truth` adds: the last words of their equations.
    fn kept(truth: &str, words: [&str; 2]) -> Vec<String> {
        let (bench, text) = (bench(&model(truth)), model(""));
        let compiled = bench.prepare(&text, "m").unwrap();
        let point = Point { params: Vec::new(), starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let plain = Fitted { text: text.clone(), compiled, train };
        let given = model_in(&text, "m").unwrap();
        let (floors, refused, whole) = (vec![1e-8], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let base = question.judged(Vec::new(), plain, None).unwrap();
        let [first, second] = words;
        let words = [word("a", first), word("b", second)];
        let both = question.rebuilt(&base, &words, &base, 40).unwrap();
        let formula = question.in_one_word(&base, both);
        let equations = formula.effects.iter().map(|e| e.candidate.equation.clone());
        equations.filter_map(|text| Some(text.rsplit_once('*')?.1.to_string())).collect()
    }

    /// A logistic term was told as a third power beside a root.
    #[test]
    fn one_word_that_says_as_much_takes_the_place_of_two() {
        assert_eq!(kept(" - 0.4*x^2", ["x^5", "abs(x)"]), ["x^2"]);
    }

    #[test]
    fn two_words_that_one_cannot_say_stay() {
        assert_eq!(kept(" - 0.8*x^3 + 0.5*abs(x)", ["x^3", "abs(x)"]), ["x^3", "abs(x)"]);
    }
}
