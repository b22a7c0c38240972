//! What no name fits: the sparse formula that explains it, or none.
//!
//! Words of `features` are added to one rate or output. All of them are screened at once, by a
//! linear regression of the residual on what each would change in the simulated outputs: the model is
//! integrated, noise is never differentiated. The best few are fitted in full, and the formula grows
//! word by word while the data held out are predicted better.
//!
//! Source: Brunton, Proctor, Kutz, "Discovering Governing Equations from Data by Sparse Identification of
//! Nonlinear Dynamical Systems", 2016, for formulas by sparse regression; Messenger and Bortz, "Weak `SINDy`",
//! 2021, for integrals instead of derivatives.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::candidates::{Candidate, Ground};
use super::edit::{NewParam, Patch, apply, fresh, model_in};
use super::estimate::Estimate;
use super::features::{CONSTANT, Feature, features};
use super::fitting::Fitted;
use super::hypothesis::{Chosen, Hypothesis, LEAST_EVIDENCE, Question, with_values};
use super::linear::Regression;
use super::search::{Search, Tried};
use super::wording;
use crate::units::Dimension;

/// The name of an effect without one.
pub const UNKNOWN: &str = "unknown";
/// Most words of a formula: more would be a description, not a law.
const MOST_WORDS: usize = 3;
/// How many words are fitted in full at each place.
pub(super) const SHORTLIST: usize = 4;
/// Iterations of a fit in full.
pub(super) const FULLY: usize = 40;
/// How many places are tried in full for the first word.
const BREADTH: usize = 6;
/// Words whose derivatives are taken in one go.
const CHUNK: usize = 16;
/// Two words of one form are one when their shapes lie within this part of their range of each other: two brims a
/// thousandth of the way apart are one.
const ALIKE: f64 = 0.01;
/// A formula must explain this part of what could be explained on the data held out.
pub const LEAST_PREDICTED: f64 = 0.5;

/// What came of looking for a formula.
#[derive(Debug, Clone)]
pub enum Formula {
    /// The best formula does not predict data it was not fitted to: the parts that it explains of what
    /// could be explained, on the data fitted and held out.
    Refused {
        /// On the data fitted.
        train: f64,
        /// On the data held out.
        heldout: f64,
    },
    /// A formula that explains what no name does.
    Predicts(Box<Hypothesis>),
}

/// Where a formula may stand.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub(super) name: String,
    is_state: bool,
    dimension: Option<Dimension>,
}

impl Question<'_> {
    /// The formula for what has no name; `None` when names explain it about as well as a formula would. A formula that
    /// is given may change how the recordings are run, and the nominal model is then fitted on those terms.
    pub(super) fn unnamed(&mut self, search: &mut Search) -> Option<Formula> {
        if self.bench.is_spent() && !search.best.effects.is_empty() {
            return None;
        }
        let before = (self.bench.clone(), search.nominal.clone());
        let Some(formula) = self.formula_settled(&mut search.nominal) else {
            let nothing = Formula::Refused { train: 0.0, heldout: 0.0 };
            return search.best.effects.is_empty().then_some(nothing);
        };
        let beyond = |e: &Estimate| self.beyond(e);
        let explained = |set: fn(&Hypothesis) -> &Estimate| {
            1.0 - beyond(set(&formula)) / beyond(set(&search.nominal)).max(1e-300)
        };
        let (train, heldout) = (explained(|h| &h.fitted.train), explained(|h| &h.held));
        let best = &search.best;
        // Names are worth keeping unless they leave most of what a formula explains.
        let beats = best.effects.is_empty()
            || beyond(&formula.held) < LEAST_PREDICTED * beyond(&best.held)
                && self.gain(best, &formula, 1).evidence() > LEAST_EVIDENCE;
        let falls = self.told(&formula).heldout < self.told(&search.nominal).heldout;
        if beats && falls && heldout >= LEAST_PREDICTED {
            return Some(Formula::Predicts(Box::new(formula)));
        }
        (self.bench, search.nominal) = before;
        search.best.effects.is_empty().then_some(Formula::Refused { train, heldout })
    }

    /// The best formula on top of the nominal model, found again when it shows that inputs are joined
    /// otherwise than it seemed.
    fn formula_settled(&mut self, nominal: &mut Hypothesis) -> Option<Hypothesis> {
        let mut formula = self.formula(nominal)?;
        if self.settle(nominal, &mut formula)? {
            let again = self.formula(nominal);
            let better = again.filter(|again| self.size(&again.held) < self.size(&formula.held));
            formula = better.unwrap_or(formula);
        }
        Some(self.in_one_word(nominal, self.shortened(nominal, formula)))
    }

    /// The best formula on top of a hypothesis, each word an effect called `unknown`; `None` when no word
    /// pays.
    pub(super) fn formula(&self, base: &Hypothesis) -> Option<Hypothesis> {
        let model = model_in(&base.fitted.text, self.name)?;
        let ground = self.ground(&base.fitted, &model);
        let places = places(&ground);
        let mut screened: Vec<(f64, usize, Feature)> = Vec::new();
        for (at, place) in places.iter().enumerate() {
            let found = self.words(base, &ground, place);
            screened.extend(found.into_iter().map(|(left, word)| (left, at, word)));
        }
        screened.sort_by(|a, b| a.0.total_cmp(&b.0));
        screened.truncate(BREADTH);
        let n_tried = places.len() * features(&ground).len();
        let mut firsts = self.fitted_words(base, &screened, &places, n_tried);
        firsts.truncate(2);
        let mut best: Option<Hypothesis> = None;
        for (first, gain) in firsts {
            if !gain.pays() {
                continue;
            }
            let Some(at) = first.effects.last().map(|e| e.candidate.at.clone()) else { continue };
            let Some(place) = places.iter().find(|p| p.name == at) else { continue };
            let grown = self.grown(base, first, place);
            let better = best.as_ref().is_none_or(|b| self.size(&grown.held) < self.size(&b.held));
            if better {
                best = Some(grown);
            }
        }
        best
    }

    /// Whether what a hypothesis leaves on the data fitted follows a word of a formula at any place.
    pub(super) fn follows_something(&self, h: &Hypothesis) -> bool {
        let Some(model) = model_in(&h.fitted.text, self.name) else { return false };
        let ground = self.ground(&h.fitted, &model);
        let places = places(&ground);
        let n_tried = (places.len() * features(&ground).len()).max(1) as f64;
        let before: f64 = h
            .fitted
            .train
            .sums
            .iter()
            .zip(&self.bench.scales)
            .map(|((sum, _), scale)| sum / (scale * scale))
            .sum();
        let sums = h.fitted.train.sums.iter();
        let effective: f64 = h.whites[0].iter().zip(sums).map(|(w, (_, n))| w * *n as f64).sum();
        let least = places
            .iter()
            .filter_map(|place| self.words(h, &ground, place).first().map(|(left, _)| *left))
            .fold(before, f64::min);
        let ratio = effective * (before / least.max(1e-300)).ln();
        ratio - effective.max(2.0).ln() - 2.0 * n_tried.ln() > LEAST_EVIDENCE
    }

    /// Adds words at a place while they pay; what a new word makes needless goes.
    fn grown(&self, base: &Hypothesis, mut formula: Hypothesis, place: &Place) -> Hypothesis {
        for _ in 1..MOST_WORDS {
            let Some(model) = model_in(&formula.fitted.text, self.name) else { break };
            let ground = self.ground(&formula.fitted, &model);
            let words = self.words(&formula, &ground, place);
            let next: Vec<(f64, usize, Feature)> =
                words.into_iter().take(SHORTLIST).map(|(left, word)| (left, 0, word)).collect();
            let n_tried = features(&ground).len();
            let tried = self.fitted_words(&formula, &next, std::slice::from_ref(place), n_tried);
            match tried.into_iter().find(|(longer, gain)| gain.pays() && !repeats(longer)) {
                Some((longer, _)) => formula = self.shortened(base, longer),
                None => break,
            }
        }
        formula
    }

    /// The formula without words that say nothing beside the others, where the others explain as much.
    fn shortened(&self, base: &Hypothesis, formula: Hypothesis) -> Hypothesis {
        let fewer = self.sound(base, formula.clone());
        let is_as_good = !fewer.effects.is_empty() && !self.is_richer(&fewer, &formula);
        if is_as_good { fewer } else { formula }
    }

    /// All words at a place, with the squares that would be left, least first.
    fn words(&self, base: &Hypothesis, ground: &Ground, place: &Place) -> Vec<(f64, Feature)> {
        let all = features(ground);
        let parts: Vec<Option<Vec<(f64, Feature)>>> = all
            .par_chunks(CHUNK)
            .map(|words| {
                let names: Vec<String> =
                    (0..words.len()).map(|i| format!("word_{i}_of_a_formula")).collect();
                let mut term = String::new();
                for (word, name) in words.iter().zip(&names) {
                    let shape = word.shape.map_or(String::new(), |(_, _, at)| format!("{at:e}"));
                    let _ = write!(term, " + {name}*{}", word.text.replace("{}", &shape));
                }
                let params = names.iter().map(|name| amount(name.clone(), None)).collect();
                let patch = Patch { params, ..placed(place, term.trim().to_string()) };
                let text = apply(&base.fitted.text, self.name, &patch)?;
                let mut compiled = self.bench.prepare(&text, self.name)?;
                let parent = &base.fitted;
                let task = self.bench.task(&compiled);
                let point =
                    self.bench.inherit(&compiled, &parent.compiled, &parent.train.point, &task);
                self.bench.set_ramps(&mut compiled, &point);
                let (residuals, columns) = self.bench.task(&compiled).linearised(&point)?;
                let new: Vec<Option<usize>> = (0..columns.len())
                    .map(|k| {
                        let name = &compiled.params.get(k)?.name;
                        names.iter().position(|n| n == name)
                    })
                    .collect();
                let known: Vec<&[f64]> = columns
                    .iter()
                    .zip(&new)
                    .filter(|(_, new)| new.is_none())
                    .map(|(column, _)| column.as_slice())
                    .collect();
                let regression = Regression::new(&known, &residuals)?;
                let found = columns.iter().zip(&new).filter_map(|(column, new)| {
                    let word = words[(*new)?].clone();
                    Some((regression.left_with(column), word))
                });
                Some(found.collect())
            })
            .collect();
        let mut found: Vec<(f64, Feature)> = parts.into_iter().flatten().flatten().collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// Fits words in full on top of a hypothesis, best first.
    fn fitted_words(
        &self,
        base: &Hypothesis,
        words: &[(f64, usize, Feature)],
        places: &[Place],
        n_tried: usize,
    ) -> Vec<Tried> {
        let tried: Vec<Option<Tried>> = words
            .par_iter()
            .map(|(_, at, word)| {
                let (text, chosen) = self.written(base, places.get(*at)?, word)?;
                let fitted = self.bench.fit(&text, self.name, &base.fitted, FULLY)?;
                let rich = self.worded(base, chosen, fitted)?;
                let gain = self.gain(base, &rich, n_tried);
                Some((rich, gain))
            })
            .collect();
        let mut tried: Vec<Tried> = tried.into_iter().flatten().collect();
        tried.sort_by(|a, b| b.1.evidence().total_cmp(&a.1.evidence()));
        tried
    }

    /// The text of a hypothesis with one more word at a place, and the word as an effect.
    pub(super) fn written(
        &self,
        base: &Hypothesis,
        place: &Place,
        word: &Feature,
    ) -> Option<(String, Chosen)> {
        let model = model_in(&base.fitted.text, self.name)?;
        let name = fresh(&model, &format!("{}_unknown", place.name));
        let shape_name = fresh(&model, &format!("{}_unknown_shape", place.name));
        let dimension = place.dimension.zip(word.dimension).map(|(place, word)| place / word);
        let mut params = vec![amount(name.clone(), dimension)];
        if let Some((dimension, range, value)) = word.shape {
            params.push(NewParam {
                role: "shape",
                name: shape_name.clone(),
                dimension,
                range: Some(range),
                neutral: None,
                value,
                std: None,
            });
        }
        let term = match word.text.as_str() {
            CONSTANT => name,
            text => format!("{name}*{}", text.replace("{}", &shape_name)),
        };
        let prime = if place.is_state { "'" } else { "" };
        let equation = format!("{}{prime} += {term}", place.name);
        let title = format!("{UNKNOWN}({})", place.name);
        let patch = Patch { title, params, ..placed(place, format!("+ {term}")) };
        let text = apply(&base.fitted.text, self.name, &patch)?;
        let (at, patches) = (place.name.clone(), Vec::new());
        let candidate = Candidate { kind: UNKNOWN, at, patches, equation, within: &[] };
        Some((text, Chosen { candidate, patch }))
    }

    /// A hypothesis with one more word, as it was fitted; `None` where the word says nothing.
    pub(super) fn worded(
        &self,
        base: &Hypothesis,
        word: Chosen,
        fitted: Fitted,
    ) -> Option<Hypothesis> {
        let mut effects = base.effects.clone();
        effects.push(word);
        let rich = self.judged(effects, fitted, Some(base))?;
        let last = rich.effects.last()?;
        (!rich.is_degenerate(last) && !self.is_idle(&rich, last)).then_some(rich)
    }
}

/// Whether the last word of a formula is one of the others again.
fn repeats(formula: &Hypothesis) -> bool {
    let Some((last, before)) = formula.effects.split_last() else { return false };
    let fitted = |word: &Chosen| Chosen {
        patch: with_values(&word.patch, &formula.fitted, false),
        ..word.clone()
    };
    let last = fitted(last);
    before.iter().any(|word| is_same(&fitted(word), &last))
}

/// Whether two words are of one form at one place, with shapes that lie within [`ALIKE`] of their range of each other.
fn is_same(one: &Chosen, other: &Chosen) -> bool {
    let form = |word: &Chosen| {
        let params = word.patch.params.iter();
        params.fold(word.candidate.equation.clone(), |text, param| {
            wording::replace_word(&text, &param.name, param.role)
        })
    };
    let is_near = |(a, b): (&NewParam, &NewParam)| {
        a.range.is_none_or(|[low, high]| {
            // What is never 0, such as how often a wave comes round, may range over many sizes.
            let span = if low > 0.0 { (high - low).min(a.value.abs()) } else { high - low };
            (a.value - b.value).abs() <= ALIKE * span
        })
    };
    form(one) == form(other) && one.patch.shapes().zip(other.patch.shapes()).all(is_near)
}

/// How much of a word there is; none to begin with.
fn amount(name: String, dimension: Option<Dimension>) -> NewParam {
    NewParam {
        role: "coefficient",
        name,
        dimension,
        range: None,
        neutral: Some(0.0),
        value: 0.0,
        std: None,
    }
}

/// A patch that adds a term at a place.
fn placed(place: &Place, term: String) -> Patch {
    let at = vec![(place.name.clone(), term)];
    if place.is_state {
        Patch { rates: at, ..Patch::default() }
    } else {
        Patch { outputs: at, ..Patch::default() }
    }
}

/// Rates that are more than the name of another state, and outputs.
pub(super) fn places(ground: &Ground) -> Vec<Place> {
    let model = ground.compiled;
    let rates = model.states.iter().zip(&model.rates).filter_map(|(state, rate)| {
        let defined = model.state_regs.contains(rate);
        (!defined).then(|| Place {
            name: state.name.clone(),
            is_state: true,
            dimension: model.units.of(&state.name).map(|d| d / Dimension::TIME),
        })
    });
    let outputs = model.outputs.iter().map(|output| Place {
        name: output.name.clone(),
        is_state: false,
        dimension: output.dimension,
    });
    rates.chain(outputs).collect()
}

#[cfg(test)]
mod tests {
    use super::super::estimate::Point;
    use super::super::made::bench;
    use super::*;

    fn model(more: &str) -> String {
        format!("model m {{\n input u\n state x = 0\n x' = u - x{more}\n output x = x\n}}\n")
    }

    fn word(name: &str, text: &str) -> Chosen {
        let place = Place { name: "x".into(), is_state: true, dimension: None };
        let term = format!("+ {name}*{text}");
        let equation = format!("x' += {name}*{text}");
        let patch = Patch { params: vec![amount(name.into(), None)], ..placed(&place, term) };
        let (at, patches) = ("x".into(), Vec::new());
        Chosen { candidate: Candidate { kind: UNKNOWN, at, patches, equation, within: &[] }, patch }
    }

    #[test]
    fn a_word_that_says_nothing_beside_the_others_is_left_out() {
        let (bench, text) = (bench(&model(" - 0.5*x*x")), model(""));
        let compiled = bench.prepare(&text, "m").unwrap();
        let point = Point { params: Vec::new(), starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let plain = Fitted { text: text.clone(), compiled, train };
        let given = model_in(&text, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let base = question.judged(Vec::new(), plain, None).unwrap();
        // The input never exceeds 1.
        let words = [word("a", "max(u - 2, 0)"), word("b", "x*x")];
        let both = question.rebuilt(&base, &words, &base, 40).unwrap();
        let formula = question.shortened(&base, both);
        assert_eq!(formula.effects.len(), 1);
        let kept = with_values(&formula.effects[0].patch, &formula.fitted, false);
        assert_eq!(kept.params[0].name, "b");
        assert!((kept.params[0].value + 0.5).abs() < 0.05, "{:?}", kept.params);
    }

    /// A brim at 0.9 was told as two, at 0.90007 and 0.89986.
    #[test]
    fn a_word_that_begins_where_another_does_is_that_one() {
        let brim = |name: &str, at: f64| {
            let shape = format!("{name}_shape");
            let mut word = word(name, &format!("max(x - {shape}, 0)"));
            let (range, value) = (Some([0.2, 1.0]), at);
            let level = amount(shape, None);
            let level = NewParam { role: "shape", range, neutral: None, value, ..level };
            word.patch.params.push(level);
            word
        };
        let first = brim("a", 0.90007);
        assert!(is_same(&first, &brim("b", 0.89986)));
        assert!(!is_same(&first, &brim("b", 0.7)));
        assert!(
            !is_same(&first, &word("b", "x*x")) && !is_same(&word("a", "x"), &word("b", "x*x"))
        );
    }
}
