//! How sure what was chosen is: whether other stretches of the recordings choose it as well, and what each name takes away.

use super::candidates::Candidate;
use super::estimate::rows_that;
use super::hypothesis::{Hypothesis, Question};
use super::rivals::Rival;
use super::search::Search;
use crate::discovery::finding::Step;
use crate::discovery::resample::{self, Draw};

/// A hypothesis as if only some stretches had been measured.
struct Drawn {
    hypothesis: Hypothesis,
    /// Sums of squares of each output's residuals by stretch, on the data fitted and held out.
    sums: [Vec<Draw>; 2],
}

impl Drawn {
    fn of(hypothesis: &Hypothesis) -> Self {
        let fitted = hypothesis.fitted.train.residuals.iter().map(|r| resample::sums(r));
        let held = hypothesis.held.residuals.iter();
        let held = held.map(|r| resample::sums(&rows_that(r, false)));
        let sums = [fitted.collect(), held.collect()];
        Self { hypothesis: hypothesis.clone(), sums }
    }

    fn draw(&mut self, draw: &[Draw; 2]) -> &Hypothesis {
        let estimates = [&mut self.hypothesis.fitted.train, &mut self.hypothesis.held];
        for ((estimate, sums), draw) in estimates.into_iter().zip(&self.sums).zip(draw) {
            for ((sum, _), stretches) in estimate.sums.iter_mut().zip(sums) {
                *sum = resample::drawn(stretches, draw);
            }
        }
        &self.hypothesis
    }
}

impl Question<'_> {
    /// Returns the share of draws in which `best` pays beside the hypothesis without one of its effects, `own`, and explains
    /// more than every rival of that effect; the rivals are told the shares in which they do. A more general form of the
    /// effect, and what needs more parameters to say no more, explains a hair more in any draw and is no rival here.
    pub(super) fn steadied(
        &self,
        without: &Hypothesis,
        (best, own): (&Hypothesis, &Candidate),
        rivals: &mut [Rival],
    ) -> f64 {
        let mut poor = Drawn::of(without);
        let others: Vec<usize> =
            (0..rivals.len()).filter(|at| !rivals[*at].only_adds(own)).collect();
        let all = std::iter::once(best).chain(others.iter().map(|at| &rivals[*at].hypothesis));
        let mut all: Vec<Drawn> = all.map(Drawn::of).collect();
        let mut wins = vec![0_usize; all.len()];
        for draw in resample::draws() {
            let poor = poor.draw(&draw);
            let gains =
                all.iter_mut().map(|rich| self.gain_among(poor, rich.draw(&draw), 1, &best.whites));
            let most =
                gains.enumerate().max_by(|(_, a), (_, b)| a.evidence().total_cmp(&b.evidence()));
            if let Some((winner, _)) = most.filter(|(_, gain)| gain.pays()) {
                wins[winner] += 1;
            }
        }
        let share = |wins: usize| wins as f64 / resample::DRAWS as f64;
        for (at, wins) in others.iter().zip(&wins[1..]) {
            rivals[*at].stability = share(*wins);
        }
        share(wins[0])
    }

    /// Returns what is left after each effect of what was found, in the order in which they were found.
    pub(super) fn gap_after_each(&self, search: &Search) -> Vec<Step> {
        let best = &search.best;
        let after = |count: usize| {
            if count == best.effects.len() {
                return Some(best.clone());
            }
            self.rebuilt(&search.nominal, &best.effects[..count], best, 30)
        };
        let step = |count: usize| {
            let (here, last) = (after(count)?, &best.effects[count - 1].candidate);
            Some(Step { name: last.kind.into(), at: last.at.clone(), gap: self.told(&here) })
        };
        (1..=best.effects.len()).filter_map(step).collect()
    }
}
