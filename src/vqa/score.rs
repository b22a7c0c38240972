//! How well questions are answered: precision, recall, F1, what was left open, and whether the answer on the
//! twin's picture is the answer on the photograph.
//!
//! The positive class is *yes*. `unsure` and `unparsed` are no positives: on a true yes they lower recall, and
//! they never enter precision. Frames of one run are not independent, and neither are runs of one laboratory,
//! so intervals come from drawing laboratories (seeds), not frames.
//!
//! Source: Zeng, Zhao and Wu, Table 3; Cohen, "A coefficient of agreement for nominal scales", 1960; the
//! cluster bootstrap of Field and Welsh, 2007.

use std::collections::{BTreeMap, BTreeSet};

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;

use super::{On, Said};

/// Who answers by measuring.
pub const GEOMETRY: &str = "geometry";
/// How many draws an interval rests on.
const DRAWS: usize = 2000;

/// One question about one picture, with its true answer and those that were given.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The kind of question: the name of its fluent.
    pub question: String,
    /// Run, step and fluent: the same for the picture of the twin and the photograph of one moment.
    pub moment: String,
    /// The seed of the laboratory.
    pub seed: u64,
    /// Which picture.
    pub on: On,
    /// The true answer; `None` when nobody knows.
    pub truth: Option<bool>,
    /// Whose word that is: `person:expert` or `geometry`.
    pub truth_by: &'static str,
    /// What was answered, by whom.
    pub answers: BTreeMap<String, Said>,
}

/// Counts over pictures with a known truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    /// Yes, and it is so.
    pub true_yes: usize,
    /// Yes, and it is not.
    pub false_yes: usize,
    /// No, and it is not.
    pub true_no: usize,
    /// No, and it is so.
    pub false_no: usize,
    /// Left open on a true yes.
    pub open_yes: usize,
    /// Left open on a true no.
    pub open_no: usize,
    /// Of those left open, the ones that said so.
    pub unsure: usize,
    /// Of those left open, the ones that could not be read.
    pub unparsed: usize,
}

impl Counts {
    fn add(&mut self, truth: bool, said: Said) {
        let place = match (truth, said.truth()) {
            (true, Some(true)) => &mut self.true_yes,
            (true, Some(false)) => &mut self.false_no,
            (true, None) => &mut self.open_yes,
            (false, Some(true)) => &mut self.false_yes,
            (false, Some(false)) => &mut self.true_no,
            (false, None) => &mut self.open_no,
        };
        *place += 1;
        self.unsure += usize::from(said == Said::Unsure);
        self.unparsed += usize::from(said == Said::Unparsed);
    }

    fn plus(self, other: Self) -> Self {
        Self {
            true_yes: self.true_yes + other.true_yes,
            false_yes: self.false_yes + other.false_yes,
            true_no: self.true_no + other.true_no,
            false_no: self.false_no + other.false_no,
            open_yes: self.open_yes + other.open_yes,
            open_no: self.open_no + other.open_no,
            unsure: self.unsure + other.unsure,
            unparsed: self.unparsed + other.unparsed,
        }
    }

    fn yes(self) -> usize {
        self.true_yes + self.false_no + self.open_yes
    }

    /// Returns how many pictures there are.
    pub fn n(self) -> usize {
        self.yes() + self.false_yes + self.true_no + self.open_no
    }

    /// Returns the share of the answers yes that are right; `None` without any.
    pub fn precision(self) -> Option<f64> {
        share(self.true_yes, self.true_yes + self.false_yes)
    }

    /// Returns the share of the true yes that were answered so; `None` without any.
    pub fn recall(self) -> Option<f64> {
        share(self.true_yes, self.yes())
    }

    /// Returns the harmonic mean of precision and recall; `None` where nothing is yes and nobody said so.
    pub fn f1(self) -> Option<f64> {
        share(2 * self.true_yes, self.true_yes + self.false_yes + self.yes())
    }

    /// Returns the share of the pictures of which the answer is yes.
    pub fn base_rate(self) -> Option<f64> {
        share(self.yes(), self.n())
    }
}

fn share(part: usize, of: usize) -> Option<f64> {
    (of > 0).then(|| part as f64 / of as f64)
}

/// One row of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// `real`, `twin` or `both`.
    pub on: &'static str,
    /// How many pictures.
    pub n: usize,
    /// The share of true yes among them.
    pub base_rate: Option<f64>,
    /// Right answers yes over answers yes.
    pub precision: Option<f64>,
    /// Right answers yes over true yes.
    pub recall: Option<f64>,
    /// Their harmonic mean.
    pub f1: Option<f64>,
    /// 95 % interval of F1 over laboratories; `None` with fewer than two of them.
    pub f1_95: Option<[f64; 2]>,
    /// What the row was counted from.
    pub counts: Counts,
}

/// Answers on the twin's picture beside answers on the photograph of the same moment, where the truth is the
/// same in both.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Agreement {
    /// How many moments. A moment with an unparsed answer is none.
    pub pairs: usize,
    /// The share in which both answers are the same: the paper's consistency.
    pub share: Option<f64>,
    /// Cohen's kappa: the same with what chance would give taken out; `None` where one answer is all there
    /// is, and chance explains everything.
    pub kappa: Option<f64>,
}

/// All there is about one kind of question and one who answers; `question` is `None` for all together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// The kind of question.
    pub question: Option<String>,
    /// Who answers.
    pub by: String,
    /// Photographs, pictures of the twin, both; those without any picture are left out.
    pub rows: Vec<Row>,
    /// Twin against photograph.
    pub agreement: Agreement,
}

/// How often a kind of question is to be answered yes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Base {
    /// The kind of question.
    pub question: String,
    /// Which picture.
    pub on: On,
    /// How many pictures whose truth is known.
    pub n: usize,
    /// How many of them are a yes.
    pub yes: usize,
}

/// What is known of everybody's answers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Always `yes`.
    pub positive: &'static str,
    /// How many questions about pictures there are.
    pub questions: usize,
    /// Those of which nobody knows the answer; they are left out.
    pub without_truth: usize,
    /// How many true answers are whose word.
    pub truth_by: BTreeMap<String, usize>,
    /// What there was to answer.
    pub bases: Vec<Base>,
    /// How many laboratories the intervals were drawn from.
    pub laboratories: usize,
    /// By who answers, all questions first.
    pub groups: Vec<Group>,
}

/// Counts cases. `is_asked` says of whom; geometry is not judged where geometry is the truth.
pub fn table(cases: &[Case], is_asked: &dyn Fn(&str) -> bool, seed: u64) -> Table {
    let known: Vec<&Case> = cases.iter().filter(|case| case.truth.is_some()).collect();
    let mut truth_by: BTreeMap<String, usize> = BTreeMap::new();
    for case in &known {
        *truth_by.entry(case.truth_by.to_owned()).or_default() += 1;
    }
    let who: BTreeSet<&str> =
        known.iter().flat_map(|case| case.answers.keys().map(String::as_str)).collect();
    let questions: BTreeSet<&str> = known.iter().map(|case| case.question.as_str()).collect();
    let seeds: BTreeSet<u64> = known.iter().map(|case| case.seed).collect();
    let mut groups = Vec::new();
    for by in who.into_iter().filter(|by| is_asked(by)) {
        let judged: Vec<&Case> = known
            .iter()
            .copied()
            .filter(|case| case.answers.contains_key(by) && case.truth_by != by)
            .collect();
        if judged.is_empty() {
            continue;
        }
        groups.push(group(None, by, &judged, seed));
        for question in &questions {
            let own: Vec<&Case> =
                judged.iter().copied().filter(|case| case.question == *question).collect();
            if !own.is_empty() {
                groups.push(group(Some(question), by, &own, seed));
            }
        }
    }
    Table {
        positive: "yes",
        questions: cases.len(),
        without_truth: cases.len() - known.len(),
        truth_by,
        bases: bases(&known),
        laboratories: seeds.len(),
        groups,
    }
}

fn bases(known: &[&Case]) -> Vec<Base> {
    let mut found: BTreeMap<(&str, On), (usize, usize)> = BTreeMap::new();
    for case in known {
        let (n, yes) = found.entry((&case.question, case.on)).or_default();
        *n += 1;
        *yes += usize::from(case.truth == Some(true));
    }
    let bases = found.into_iter();
    bases
        .map(|((question, on), (n, yes))| Base { question: question.to_owned(), on, n, yes })
        .collect()
}

fn group(question: Option<&str>, by: &str, cases: &[&Case], seed: u64) -> Group {
    let wheres = [("real", Some(On::Real)), ("twin", Some(On::Twin)), ("both", None)];
    let rows = wheres.into_iter().filter_map(|(name, on)| {
        let is_there = |case: &&Case| on.is_none_or(|on| case.on == on);
        let there: Vec<&Case> = cases.iter().copied().filter(is_there).collect();
        (!there.is_empty()).then(|| row(name, by, &there, seed))
    });
    Group {
        question: question.map(ToOwned::to_owned),
        by: by.to_owned(),
        rows: rows.collect(),
        agreement: agreement(by, cases),
    }
}

fn row(on: &'static str, by: &str, cases: &[&Case], seed: u64) -> Row {
    let mut by_seed: BTreeMap<u64, Counts> = BTreeMap::new();
    for case in cases {
        if let (Some(truth), Some(said)) = (case.truth, case.answers.get(by)) {
            by_seed.entry(case.seed).or_default().add(truth, *said);
        }
    }
    let parts: Vec<Counts> = by_seed.into_values().collect();
    let counts = parts.iter().copied().fold(Counts::default(), Counts::plus);
    Row {
        on,
        n: counts.n(),
        base_rate: counts.base_rate(),
        precision: counts.precision(),
        recall: counts.recall(),
        f1: counts.f1(),
        f1_95: interval(&parts, seed),
        counts,
    }
}

/// Draws laboratories with replacement; returns the middle 95 % of F1.
fn interval(parts: &[Counts], seed: u64) -> Option<[f64; 2]> {
    if parts.len() < 2 {
        return None;
    }
    let mut rng = StdRng::seed_from_u64(seed);
    let mut drawn: Vec<f64> = (0..DRAWS)
        .filter_map(|_| {
            let draw = (0..parts.len()).map(|_| parts[rng.random_range(0..parts.len())]);
            draw.fold(Counts::default(), Counts::plus).f1()
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    let at = |share: f64| drawn.get((share * (drawn.len() as f64 - 1.0)).round() as usize).copied();
    Some([at(0.025)?, at(0.975)?])
}

/// Compares answers on both pictures of the same moments.
fn agreement(by: &str, cases: &[&Case]) -> Agreement {
    let mut moments: BTreeMap<&str, [Option<(bool, Said)>; 2]> = BTreeMap::new();
    for case in cases {
        if let (Some(truth), Some(said)) = (case.truth, case.answers.get(by)) {
            moments.entry(&case.moment).or_default()[case.on as usize] = Some((truth, *said));
        }
    }
    let pairs: Vec<(Said, Said)> = moments
        .into_values()
        .filter_map(|both| match both {
            [Some((a, real)), Some((b, twin))] if a == b => Some((real, twin)),
            _ => None,
        })
        .filter(|(real, twin)| *real != Said::Unparsed && *twin != Said::Unparsed)
        .collect();
    let same = pairs.iter().filter(|(real, twin)| real == twin).count();
    let n = pairs.len();
    let Some(observed) = share(same, n) else { return Agreement::default() };
    let by_chance: f64 = [Said::Yes, Said::No, Said::Unsure]
        .into_iter()
        .map(|said| {
            let real = pairs.iter().filter(|(real, _)| *real == said).count() as f64;
            let twin = pairs.iter().filter(|(_, twin)| *twin == said).count() as f64;
            real * twin / (n * n) as f64
        })
        .sum();
    let kappa = (1.0 - by_chance > 1e-12).then(|| (observed - by_chance) / (1.0 - by_chance));
    Agreement { pairs: n, share: Some(observed), kappa }
}
