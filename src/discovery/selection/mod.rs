//! The search for what is missing: which effects, how large, and whether the data can tell.
//!
//! A [`Residuals`] says what the residuals are for any list of effects; [`search`] adds the effect that explains
//! most, fits all of them together again, tries to exchange and to leave out each one, and stops when
//! nothing more pays. Paying means two things at once: the Bayesian information criterion falls on the
//! data fitted, and the misfit falls on data that were not. A third of those has no say in that either, and what is
//! told of an explanation is what it leaves there. What explains the data as well as the
//! effect chosen is kept as a [`Rival`], so that the caller can say "cannot tell".
//!
//! [`search`] holds the order of things, `weighing` what an effect is worth, `screen` the linear algebra that says which
//! candidates are worth a fit, [`refit`] the fit. Where residuals are linear in all but the shapes of the laws, [`search_linear`]
//! writes them out once (`linear`) and searches there, from several beginnings.
//!
//! Residuals are in units of their noise, so that the sum of their squares is `-2 ln` of the likelihood.
//! The search draws no random numbers; parallel parts are collected in order.
//!
//! Source: Schwarz, "Estimating the Dimension of a Model", 1978; Kass and Raftery, "Bayes Factors", 1995,
//! for the scale of evidence.

mod alone;
mod error;
mod idle;
mod linear;
mod refit;
mod rounds;
mod screen;
mod search;
mod steady;
mod sure;
mod upheld;
mod weighing;
mod wording;

use nalgebra::DMatrix;

use super::finding::{Evidence, MATTERS, TIE, Worth};

pub use error::Diverged;
pub use linear::related;
pub use refit::{refit, rises};
pub use rounds::{floors, search_linear};
pub use screen::{left_after, sum_of_squares};
pub use search::search;
pub use steady::{judge, judged, left, path, reported, split};
pub use upheld::upheld;
pub use weighing::is_sensible;

/// How a parameter enters, and on what scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Its name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// A change that is small, yet visible: for derivatives.
    pub scale: f64,
    /// Least and greatest value.
    pub range: (f64, f64),
    /// The value at which the effect is not there, whatever the others are; `None` for parameters of
    /// its shape.
    pub neutral: Option<f64>,
    /// Nearer to its neutral value than this it means nothing, whatever the data say: the model itself
    /// is not that exact.
    pub least: f64,
}

/// A number nearer to the end of its range than this part of it is at the end.
const END: f64 = 1e-3;

impl ParameterSpec {
    /// Returns whether a value has run to an end of its range at which the effect is there: what fits lies beyond it, and is
    /// something else.
    pub fn has_run_out(&self, value: f64) -> bool {
        let (low, high) = self.range;
        let is_near = |a: f64, b: f64| (a - b).abs() < END * (high - low);
        let is_there = |end: f64| self.neutral.is_none_or(|none| !is_near(none, end));
        [low, high].into_iter().any(|end| is_there(end) && is_near(value, end))
    }
}

/// Which data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// The data fitted.
    Train,
    /// The data held out: no number is fitted to them, but what they do not bear out is not named.
    Heldout,
    /// The part of the data held out that decides nothing: what is told of them is read off it.
    Unseen,
}

impl Set {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Train, Self::Heldout, Self::Unseen];
}

/// A stretch of the residuals that one sensor read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Which sensor.
    pub sensor: usize,
    /// Where its residuals are.
    pub rows: std::ops::Range<usize>,
}

/// An effect that might be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate<T> {
    /// The effect.
    pub term: T,
    /// Effects that join before it, begun where they do nothing: what nature rarely has apart is tried
    /// together, before one law alone takes what belongs to two. What of them does not pay is left out
    /// again.
    pub with: Vec<T>,
    /// Parameters to begin from, each with the shape fixed; parameters with a neutral value are solved
    /// for when it is screened.
    pub starts: Vec<Vec<f64>>,
    /// What it costs beside its parameters, in the units of the criterion: an effect without a name
    /// must explain more than one with.
    pub surcharge: f64,
}

impl<T> Candidate<T> {
    /// Returns everything that joins, in the order of its parameters.
    fn joining(&self) -> impl Iterator<Item = &T> {
        self.with.iter().chain([&self.term])
    }
}

/// What is to be explained: measured minus model, for any list of effects.
pub trait Residuals: Sync {
    /// An effect at its place.
    type Term: Clone + PartialEq + Send + Sync;

    /// Returns the parameters of the model itself that are estimated along with any effects, with
    /// their values to begin from.
    fn nuisance(&self) -> Vec<(ParameterSpec, f64)> {
        Vec::new()
    }

    /// Returns the parameters of an effect.
    fn specs(&self, term: &Self::Term) -> Vec<ParameterSpec>;

    /// Returns the residuals in units of noise for the model's own parameters followed by those of the
    /// effects in order; `None` when the model runs away.
    fn residuals(&self, set: Set, terms: &[Self::Term], parameters: &[f64]) -> Option<Vec<f64>>;

    /// Returns how many independent residuals a set has.
    fn count(&self, set: Set) -> usize;

    /// Returns what could be missing beyond `terms`, given the residuals that are left on the data
    /// fitted. When an effect was left out for others to take its place, only what is related to it is
    /// wanted.
    fn candidates(
        &self,
        terms: &[Self::Term],
        left: &[f64],
        instead_of: Option<&Self::Term>,
    ) -> Vec<Candidate<Self::Term>>;

    /// Returns whether `new` can join where `present` is. An effect of the same kind at the same place cannot.
    fn compatible(&self, present: &Self::Term, new: &Self::Term) -> bool {
        present != new
    }

    /// Returns whether effects without a name wait until no named one pays any more: where many effects
    /// act at once, a formula can look like the sum of two of them.
    fn names_first(&self) -> bool {
        false
    }

    /// Returns whether the two may explain the same data: when one joins, only those that are related to
    /// it are tried against others in their place.
    fn related(&self, a: &Self::Term, b: &Self::Term) -> bool {
        let _ = (a, b);
        true
    }

    /// Returns whether the effect acts on many data with several numbers, so that it can stand for two or three
    /// others and none of them leads out again: then the search is tried once more without it.
    fn is_broad(&self, term: &Self::Term) -> bool {
        let _ = term;
        false
    }

    /// Returns whether the law is exact, so that once its numbers are right it leaves nothing behind: the
    /// mechanics of rigid bodies are, friction is not.
    fn is_exact(&self, term: &Self::Term) -> bool {
        let _ = term;
        false
    }

    /// Returns whether the residuals change unevenly with the effect's parameters, as where contact is
    /// lost and made again: then the fit begins with a loss that a few wild rows cannot steer.
    fn is_rough(&self, term: &Self::Term) -> bool {
        let _ = term;
        false
    }

    /// Returns whether an effect with these parameters is more than an accident of a few rows.
    fn is_sensible(&self, term: &Self::Term, parameters: &[f64]) -> bool {
        let _ = (term, parameters);
        true
    }

    /// Returns whether an effect must be larger than its own uncertainty once all are fitted together with their shapes, where it may trade
    /// against what joined after it.
    fn asks_for_size(&self) -> bool {
        false
    }

    /// Returns how uncertain the parameters of a hypothesis are together, with all that is not known of the model beside it.
    fn covariance(&self, h: &Hypothesis<Self::Term>) -> DMatrix<f64> {
        h.covariance.clone()
    }

    /// Returns on which of an effect's numbers its others stand, by its place among them: an effect without it is none, however sure
    /// the others are.
    fn base(&self, term: &Self::Term) -> Option<usize> {
        let _ = term;
        None
    }

    /// Returns whether names must explain data without what has none: where laws are exact and names alone are written into the
    /// model, what rests on a formula beside it, or leaves most of the gap, stands for something else.
    fn names_stand_alone(&self) -> bool {
        false
    }

    /// Returns how much of what the sensors of an effect leave on a set, in squares of their noise, no explanation takes away:
    /// what is smaller than a part of that ([`Options::matter`]) is not named, however sure it is.
    fn unexplained(&self, set: Set, term: &Self::Term) -> f64 {
        let _ = (set, term);
        0.0
    }

    /// Returns whether an effect is one that machines of this kind commonly have.
    fn is_common(&self, term: &Self::Term) -> bool {
        let _ = term;
        true
    }

    /// Returns what every machine of this kind may have at once: where many effects act, one after the other stands for
    /// others before it is its turn, so these are tried together as well.
    fn common(&self) -> Vec<Self::Term> {
        Vec::new()
    }

    /// Returns effects that do the same as those of a hypothesis and are more usual beside each other, if there are any; further
    /// ones come last.
    fn simplified(
        &self,
        terms: &[Self::Term],
        parameters: &[f64],
    ) -> Option<(Vec<Self::Term>, Vec<f64>)> {
        let _ = (terms, parameters);
        None
    }

    /// Returns which effect of a hypothesis is a general law whose further numbers do nothing, with the special case that is left
    /// of it and the parameters of that one; `None` where every law is more than its special cases.
    fn collapsed(&self, h: &Hypothesis<Self::Term>) -> Option<(usize, Self::Term, Vec<f64>)> {
        let _ = h;
        None
    }

    /// Returns whether parameters of a shape stay where they begin.
    fn shapes_stay(&self) -> bool {
        false
    }

    /// Returns which sensor read which residuals, all of them; needed where they are to be pressed, and where some are read so
    /// seldom that no stretch is to be drawn without them.
    fn blocks(&self, set: Set) -> Vec<Block> {
        let _ = set;
        Vec::new()
    }

    /// Returns whether machines have `other` more often than `chosen`, so that the price of its further numbers says nothing for
    /// `chosen` where both explain the data alike: then a doubt is told.
    fn is_likelier(&self, other: &Self::Term, chosen: &Self::Term) -> bool {
        let _ = (other, chosen);
        false
    }

    /// Returns whether `general` can do all that `special` can: then the simpler one is named when both
    /// explain the data, and no doubt is raised.
    fn contains(&self, general: &Self::Term, special: &Self::Term) -> bool {
        let _ = (general, special);
        false
    }
}

/// Some effects with their parameters fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis<T> {
    /// The effects.
    pub terms: Vec<T>,
    /// Parameters of the model, then of the effects, as fitted.
    pub parameters: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Sum of squares on the data fitted.
    pub train: f64,
    /// Sum of squares on the data held out, same parameters; infinite if the model runs away on them.
    pub heldout: f64,
    /// Sum of squares on the data that decide nothing ([`reported`]); not a number until all is decided.
    pub unseen: f64,
    /// Surcharges of the effects, one each.
    pub surcharges: Vec<f64>,
    /// By how much the criterion fell when each effect joined, the others of that moment fitted again.
    pub gains: Vec<f64>,
    /// Number of residuals in the data fitted.
    pub count: usize,
}

impl<T> Hypothesis<T> {
    /// Returns that nothing is missing, which is to be judged yet.
    pub fn nothing() -> Self {
        Self {
            terms: Vec::new(),
            parameters: Vec::new(),
            covariance: DMatrix::zeros(0, 0),
            train: f64::NAN,
            heldout: f64::NAN,
            unseen: f64::NAN,
            surcharges: Vec::new(),
            gains: Vec::new(),
            count: 0,
        }
    }

    /// Returns the criterion on the data fitted; smaller is better.
    pub fn criterion(&self) -> f64 {
        self.train + self.cost()
    }

    /// Returns the criterion over all data, fitted and held out.
    pub fn evidence(&self) -> f64 {
        self.train + self.heldout + self.cost()
    }

    fn cost(&self) -> f64 {
        let surcharge: f64 = self.surcharges.iter().sum();
        self.parameters.len() as f64 * self.price() + surcharge
    }

    /// What one number costs.
    fn price(&self) -> f64 {
        (self.count as f64).ln()
    }
}

/// Another effect in the place of the one chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival<T> {
    /// Which of the effects chosen it would replace.
    pub instead_of: usize,
    /// The hypothesis with it.
    pub hypothesis: Hypothesis<T>,
    /// How much worse its evidence is.
    pub behind: f64,
    /// The share of draws in which it explains most in that place; 0 where it is far behind.
    pub stability: f64,
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Most effects at once.
    pub most: usize,
    /// How many of the screened candidates are fitted.
    pub shortlist: usize,
    /// How much the criterion must fall, beyond the cost of the parameters, for an effect to count.
    pub least_gain: f64,
    /// How much the misfit on the data held out must fall.
    pub least_heldout: f64,
    /// With a gain on the data fitted above this, held-out data that do not exercise the effect (no
    /// change there) do not speak against it.
    pub overwhelming: f64,
    /// An effect must explain more than this part of what those related to it explain already, up to
    /// `forgiven`: how they act is known that well and no better.
    pub imperfection: f64,
    /// The most that `imperfection` asks for.
    pub forgiven: f64,
    /// Which part of that is asked of an effect that acts on many data at once: a law that is off somewhere does not look like
    /// a mass that is felt everywhere.
    pub broad: f64,
    /// An effect without a name takes the place of one with a name only if it explains more by this part.
    pub unnamed: f64,
    /// A law must explain more, by this part of what it explains, than a special case of it.
    pub generality: f64,
    /// An effect must take away more than this part of what its sensors leave in any case.
    pub matter: f64,
    /// Rivals whose evidence is behind by less than this cannot be told apart.
    pub tie: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            most: 5,
            shortlist: 6,
            // About 2 ln(number of candidates): the best of hundreds of useless ones gains that much.
            least_gain: 8.0,
            least_heldout: 4.0,
            overwhelming: 60.0,
            // A law that is right to three parts in a hundred leaves the square of it.
            imperfection: 1e-3,
            forgiven: 100.0,
            broad: 1.0,
            unnamed: 0.0,
            generality: 0.0,
            matter: MATTERS,
            tie: TIE,
        }
    }
}

/// What the search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<T> {
    /// Without any effect.
    pub nothing: Hypothesis<T>,
    /// With the effects that pay.
    pub best: Hypothesis<T>,
    /// The hypothesis without each effect, the others fitted again.
    pub without: Vec<Hypothesis<T>>,
    /// Other explanations, best first.
    pub rivals: Vec<Rival<T>>,
    /// The share of draws of the data in which each effect is named ([`super::resample`]).
    pub stability: Vec<f64>,
}

impl<T> Outcome<T> {
    /// Returns how strongly the data speak for the effect chosen at `at`.
    pub fn worth(&self, at: usize) -> Worth {
        (self.evidence(at, &self.best), self.stability[at])
    }

    /// Returns how strongly the data speak for a rival in the place of the one chosen.
    pub fn worth_of(&self, rival: &Rival<T>) -> Worth {
        (self.evidence(rival.instead_of, &rival.hypothesis), rival.stability)
    }

    fn evidence(&self, at: usize, h: &Hypothesis<T>) -> Evidence {
        let explained = (self.nothing.unseen - self.best.unseen).max(1e-9);
        let without = &self.without[at];
        Evidence {
            delta_bic: without.criterion() - h.criterion(),
            heldout_gain: ((without.unseen - h.unseen) / explained).clamp(-1.0, 1.0),
        }
    }
}

impl<T: PartialEq> Outcome<T> {
    /// Forgets what is said of effects that are not among those kept, which are in the same order.
    fn keep(&mut self, kept: &[T]) {
        for at in
            (0..self.best.terms.len()).rev().filter(|at| !kept.contains(&self.best.terms[*at]))
        {
            self.without.remove(at);
            self.stability.remove(at);
            self.rivals.retain(|rival| rival.instead_of != at);
            for rival in self.rivals.iter_mut().filter(|rival| rival.instead_of > at) {
                rival.instead_of -= 1;
            }
        }
    }
}
