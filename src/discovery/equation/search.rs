//! Which effects a model lacks: added one by one while it pays, fitted together, pruned, and set against
//! their rivals.
//!
//! An effect must pay twice: by the Bayesian information criterion on the data fitted, with residuals
//! counted by how independent they are and a charge for every candidate tried, and by a smaller gap on
//! data held out.

use rayon::prelude::*;

use super::candidates::{Candidate, Ground, Range, candidates, velocities};
use super::data::std;
use super::edit::{NewParam, Patch, apply, model_in};
use super::estimate::Estimate;
use super::fitting::{Bench, Fitted};
use super::score::{lines, twice_log_ratio, whiteness};
use super::simulate::simulate;

/// An effect with the patch that was fitted.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Name, place, equation.
    pub candidate: Candidate,
    /// The patch, with the values of its start.
    pub patch: Patch,
}

/// A set of effects fitted together.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// The effects, in the order they were added.
    pub effects: Vec<Chosen>,
    /// The model with them, fitted.
    pub fitted: Fitted,
    /// The same on held-out data.
    pub held: Estimate,
}

/// How one hypothesis compares with another that it extends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Fall of the information criterion on the data fitted.
    pub bic: f64,
    /// Twice the log likelihood ratio on the data held out.
    pub held: f64,
    /// Part by which the root mean square on held-out data falls.
    pub held_rms: f64,
    /// The same on the data fitted.
    pub train_rms: f64,
    /// How white the residuals of the richer one are on held-out data.
    pub white: f64,
}

impl Gain {
    /// All that speaks for the richer model: nothing is fitted to the held-out data but first values, so
    /// what it gains there counts in full.
    pub fn evidence(&self) -> f64 {
        self.bic + self.held
    }
}

/// A rival of a chosen effect.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The effect.
    pub candidate: Candidate,
    /// With its fitted values.
    pub hypothesis: Hypothesis,
    /// How much worse its criterion is; negative when better.
    pub delta_bic: f64,
    /// How much larger its held-out root mean square is, as a part.
    pub held_worse: f64,
}

/// The result of a search.
#[derive(Debug, Clone)]
pub struct Search {
    /// The model as given.
    pub nominal: Hypothesis,
    /// With the effects that pay.
    pub best: Hypothesis,
    /// For each effect of `best`: what leaving it out costs, and its rivals, nearest first.
    pub judged: Vec<(Gain, Vec<Rival>)>,
    /// Candidates that came nearest to being accepted at last, with why not.
    pub refused: Vec<(Candidate, Gain)>,
    /// How many candidates were tried.
    pub n_candidates: usize,
}

/// Least fall of the criterion for an effect to be named.
const LEAST_BIC: f64 = 10.0;
/// Least part by which the held-out gap must fall where what is left is not noise.
const LEAST_SHRINK: f64 = 0.04;
/// Most effects in one model.
const MOST_EFFECTS: usize = 5;
/// Two explanations this near each other in criterion are not told apart.
const TIE: f64 = 6.0;

/// What a search needs to know.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// The recordings.
    pub bench: &'a Bench,
    /// The model's name.
    pub name: &'a str,
    /// Mean squares below which nothing is gained, by output.
    pub floors: Vec<f64>,
}

impl Question<'_> {
    /// Compares `rich` with `poor`.
    pub fn gain(&self, poor: &Hypothesis, rich: &Hypothesis, n_tried: usize) -> Gain {
        let free = |h: &Hypothesis| {
            h.fitted.compiled.params.len()
                + h.fitted.train.point.starts.iter().flatten().flatten().count()
        };
        let whites: Vec<f64> = rich.fitted.train.residuals.iter().map(|r| whiteness(r)).collect();
        let effective: Vec<f64> =
            whites.iter().zip(&rich.fitted.train.sums).map(|(w, (_, n))| w * *n as f64).collect();
        let total: f64 = effective.iter().sum();
        let ratio = twice_log_ratio(
            &poor.fitted.train.sums,
            &rich.fitted.train.sums,
            &effective,
            &self.floors,
        );
        let extra = free(rich) as f64 - free(poor) as f64;
        let bic = ratio - extra * total.max(2.0).ln() - 2.0 * (n_tried.max(1) as f64).ln();
        let held_whites: Vec<f64> = rich.held.residuals.iter().map(|r| whiteness(r)).collect();
        let held_effective: Vec<f64> =
            held_whites.iter().zip(&rich.held.sums).map(|(w, (_, n))| w * *n as f64).collect();
        let held = twice_log_ratio(&poor.held.sums, &rich.held.sums, &held_effective, &self.floors);
        Gain {
            bic,
            held,
            held_rms: 1.0 - self.size(&rich.held) / self.size(&poor.held).max(1e-300),
            train_rms: 1.0
                - self.size(&rich.fitted.train) / self.size(&poor.fitted.train).max(1e-300),
            white: super::data::mean(&held_whites),
        }
    }

    /// Root mean square of an estimate's residuals over outputs, in units of the scales.
    pub fn size(&self, estimate: &Estimate) -> f64 {
        let sum: f64 =
            estimate.rms().iter().zip(&self.bench.scales).map(|(r, s)| (r / s).powi(2)).sum();
        (sum / self.bench.scales.len().max(1) as f64).sqrt()
    }

    fn pays(gain: &Gain) -> bool {
        let needed = LEAST_SHRINK * (1.0 - gain.white).clamp(0.0, 1.0);
        gain.evidence() >= LEAST_BIC
            && gain.held > 1.0
            && gain.held_rms > needed
            && gain.train_rms > needed.min(0.5 * LEAST_SHRINK)
    }

    fn judged(&self, effects: Vec<Chosen>, fitted: Fitted) -> Option<Hypothesis> {
        let held = self.bench.held_out(&fitted)?;
        Some(Hypothesis { effects, fitted, held })
    }

    /// What the candidates are made from, at a fitted model.
    fn ground<'m>(
        &self,
        fitted: &'m Fitted,
        model: &'m crate::language::ast::ModelItem,
    ) -> Ground<'m> {
        let compiled = &fitted.compiled;
        let bench = self.bench;
        let task = bench.task(compiled);
        // States and their rates along the simulation: a model whose outputs are its states.
        let mut probe = compiled.clone();
        let output = |reg| super::compile::Output {
            name: String::new(),
            dimension: None,
            reg,
            delay: None,
            state: None,
        };
        probe.outputs =
            compiled.state_regs.iter().chain(&compiled.rates).map(|r| output(*r)).collect();
        let mut all = compiled.program.outputs.clone();
        all.extend(&compiled.program.rates);
        all.sort_unstable();
        all.dedup();
        probe.program.outputs = all;
        let n = compiled.states.len();
        let mut columns = vec![Vec::new(); 2 * n];
        for (w, start) in task.windows.iter().zip(&fitted.train.point.starts) {
            let mut out = vec![0.0; w.rows.len() * 2 * n];
            let data = &bench.train[w.data];
            let params = &fitted.train.point.params;
            if simulate(&probe, data, w.rows.clone(), bench.scheme, params, start, &mut out).is_ok()
            {
                for (k, column) in columns.iter_mut().enumerate() {
                    column.extend(out.iter().skip(k).step_by(2 * n).copied());
                }
            }
        }
        let of = |column: &Vec<f64>| Range::of(column.iter().copied());
        let over = |pick: &dyn Fn(&super::data::Data) -> &Vec<f64>| {
            Range::of(
                bench
                    .train
                    .iter()
                    .flat_map(|d| pick(d).iter().copied())
                    .collect::<Vec<_>>()
                    .into_iter(),
            )
        };
        let mut spectrum = Vec::new();
        if let (Some(first), Some(r)) = (bench.train.first(), fitted.train.residuals.first()) {
            let m = task
                .windows
                .first()
                .map_or(0, |w| if bench.rows.is_none() { w.rows.len() } else { 0 });
            let m = if m == 0 { first.n_rows().min(r.len()) } else { m };
            let time = &first.time[..m.min(first.n_rows())];
            let of_motion: Vec<f64> = first
                .inputs
                .iter()
                .chain(&first.outputs)
                .flat_map(|column| lines(time, &column[..time.len()], 6))
                .collect();
            let longest = task.windows.iter().map(|w| w.rows.len()).max().unwrap_or(0);
            let run = longest as f64 * first.step();
            let apart = 2.0 / (time[time.len() - 1] - time[0]).max(1e-300);
            spectrum = lines(time, &r[..m.min(r.len())], 4);
            // What the motion itself repeats is no disturbance, and what does not come round a few
            // times in a run cannot be told from a drift.
            spectrum.retain(|f| f * run >= 3.0 && of_motion.iter().all(|g| (f - g).abs() > apart));
            spectrum.truncate(2);
        }
        Ground {
            model,
            compiled,
            states: columns[..n].iter().map(of).collect(),
            rates: columns[n..].iter().map(of).collect(),
            inputs: (0..compiled.inputs.len()).map(|i| over(&|d| &d.inputs[i])).collect(),
            outputs: (0..compiled.outputs.len()).map(|o| over(&|d| &d.outputs[o])).collect(),
            step: bench.train.first().map_or(1.0, super::data::Data::step),
            duration: bench
                .train
                .iter()
                .map(|d| d.time[d.n_rows() - 1] - d.time[0])
                .fold(0.0, f64::max),
            lines: spectrum,
        }
    }

    /// Fits a candidate on top of a hypothesis: every start shortly, the best one in full.
    fn try_candidate(
        &self,
        base: &Hypothesis,
        candidate: &Candidate,
        iterations: usize,
    ) -> Option<(Fitted, Patch)> {
        let mut best: Option<(f64, Fitted, Patch)> = None;
        for patch in &candidate.patches {
            let Some(text) = apply(&base.fitted.text, self.name, patch) else { continue };
            let Some(fitted) = self.bench.fit(&text, self.name, &base.fitted, iterations) else {
                continue;
            };
            let cost = self.size(&fitted.train);
            if cost.is_finite() && best.as_ref().is_none_or(|(b, ..)| cost < *b) {
                best = Some((cost, fitted, patch.clone()));
            }
        }
        best.map(|(_, fitted, patch)| (fitted, patch))
    }

    /// Tries every candidate on top of a hypothesis; best first by the criterion.
    fn round(&self, base: &Hypothesis) -> Vec<(Hypothesis, Gain)> {
        let Some(model) = model_in(&base.fitted.text, self.name) else { return Vec::new() };
        let ground = self.ground(&base.fitted, &model);
        let used = |c: &Candidate| {
            base.effects.iter().any(|e| {
                e.candidate.at == c.at
                    && (e.candidate.kind == c.kind
                        || c.within.contains(&e.candidate.kind)
                        || e.candidate.within.contains(&c.kind))
            })
        };
        let all: Vec<Candidate> = candidates(&ground).into_iter().filter(|c| !used(c)).collect();
        let n_tried = all.len();
        let quick: Vec<Option<(Fitted, Patch, Candidate)>> = all
            .into_par_iter()
            .map(|c| self.try_candidate(base, &c, 10).map(|(f, p)| (f, p, c)))
            .collect();
        let mut quick: Vec<(Fitted, Patch, Candidate)> = quick.into_iter().flatten().collect();
        // Rank by likelihood less the price of the parameters, with few effective residuals.
        let rank = |f: &Fitted| {
            let n: f64 = f.train.sums.iter().map(|(_, n)| *n as f64).sum();
            let k =
                f.compiled.params.len() + f.train.point.starts.iter().flatten().flatten().count();
            n * self.size(&f.train).max(1e-300).ln() + 2.0 * k as f64
        };
        quick.sort_by(|a, b| rank(&a.0).total_cmp(&rank(&b.0)));
        quick.truncate(10);
        let full: Vec<Option<(Hypothesis, Gain)>> = quick
            .into_par_iter()
            .map(|(fitted, patch, candidate)| {
                let text = fitted.text.clone();
                let fitted = self.bench.fit(&text, self.name, &fitted, 40).unwrap_or(fitted);
                let mut effects = base.effects.clone();
                effects.push(Chosen { candidate, patch });
                let rich = self.judged(effects, fitted)?;
                let gain = self.gain(base, &rich, n_tried);
                Some((rich, gain))
            })
            .collect();
        let mut full: Vec<(Hypothesis, Gain)> = full.into_iter().flatten().collect();
        full.sort_by(|a, b| b.1.evidence().total_cmp(&a.1.evidence()));
        full
    }

    /// The text of a model with some effects written in from the nominal text, values as fitted.
    pub fn rebuilt(
        &self,
        nominal: &Hypothesis,
        effects: &[Chosen],
        at: &Fitted,
        iterations: usize,
    ) -> Option<Hypothesis> {
        let mut text = nominal.fitted.text.clone();
        for effect in effects {
            let patch = with_values(&effect.patch, at, false);
            text = apply(&text, self.name, &patch)?;
        }
        let fitted = self.bench.fit(&text, self.name, at, iterations)?;
        self.judged(effects.to_vec(), fitted)
    }

    /// Searches from a fitted nominal model.
    pub fn search(&self, nominal: Fitted) -> Option<Search> {
        let nominal = self.judged(Vec::new(), nominal)?;
        let mut best = nominal.clone();
        let mut refused = Vec::new();
        let mut rounds: Vec<Vec<(Hypothesis, Gain)>> = Vec::new();
        let mut n_candidates = 0;
        while best.effects.len() < MOST_EFFECTS {
            let round = self.round(&best);
            n_candidates = n_candidates.max(round.len());
            let accepted = Self::simplest(&round).cloned().or_else(|| self.pair(&best, &round));
            let Some((mut next, _)) = accepted else {
                refused = round
                    .into_iter()
                    .take(5)
                    .filter_map(|(h, g)| h.effects.last().map(|e| (e.candidate.clone(), g)))
                    .collect();
                break;
            };
            self.prune(&nominal, &mut next);
            rounds.push(round);
            if next.effects.len() <= best.effects.len()
                && self.size(&next.held) >= self.size(&best.held)
            {
                break;
            }
            best = next;
        }
        let judge = |best: &Hypothesis| -> Vec<(Gain, Vec<Rival>)> {
            (0..best.effects.len()).map(|i| self.judge_effect(&nominal, best, i, &rounds)).collect()
        };
        let mut judged = judge(&best);
        // What was added early, alone, may have a better rival now that the others are there.
        let better = judged
            .iter()
            .filter_map(|(_, rivals)| rivals.first())
            .find(|rival| rival.delta_bic < -LEAST_BIC && rival.held_worse < -0.5 * LEAST_SHRINK);
        if let Some(rival) = better {
            best = rival.hypothesis.clone();
            judged = judge(&best);
        }
        Some(Search { nominal, best, judged, refused, n_candidates })
    }

    /// Of the candidates that pay and are nearly as good as the best, the one with the fewest values.
    fn simplest(round: &[(Hypothesis, Gain)]) -> Option<&(Hypothesis, Gain)> {
        let paying: Vec<&(Hypothesis, Gain)> =
            round.iter().filter(|(_, gain)| Self::pays(gain)).collect();
        let most = paying.first()?.1.evidence();
        let enough = most - LEAST_BIC.max(0.03 * most);
        let size = |h: &Hypothesis| {
            let starts =
                h.fitted.train.point.starts.first().map_or(0, |w| w.iter().flatten().count());
            h.fitted.compiled.params.len() + starts
        };
        paying
            .into_iter()
            .filter(|(_, gain)| gain.evidence() >= enough)
            .min_by_key(|(h, _)| size(h))
    }

    /// Two effects that pay only together, each hiding the other: the nearest misses, each with a round
    /// of its own.
    fn pair(&self, base: &Hypothesis, round: &[(Hypothesis, Gain)]) -> Option<(Hypothesis, Gain)> {
        let coloured = base.fitted.train.residuals.iter().any(|r| whiteness(r) < 0.3);
        if !coloured || base.effects.len() + 2 > MOST_EFFECTS {
            return None;
        }
        let mut best: Option<(Hypothesis, Gain)> = None;
        for (first, gain) in round.iter().filter(|(_, g)| g.held > 0.0 && g.held_rms > 0.0).take(3)
        {
            for (second, _) in self.round(first).into_iter().take(4) {
                let together = self.gain(base, &second, round.len() * round.len());
                let better = best.as_ref().is_none_or(|(_, b)| together.evidence() > b.evidence());
                // The second must be worth more than the first alone, or it is the first with company.
                if better
                    && Self::pays(&together)
                    && together.held_rms > gain.held_rms + LEAST_SHRINK
                {
                    best = Some((second, together));
                }
            }
        }
        best
    }

    /// Drops effects that others have made needless.
    fn prune(&self, nominal: &Hypothesis, hypothesis: &mut Hypothesis) {
        let mut i = 0;
        while hypothesis.effects.len() > 1 && i + 1 < hypothesis.effects.len() {
            let mut fewer = hypothesis.effects.clone();
            fewer.remove(i);
            if let Some(poor) = self.rebuilt(nominal, &fewer, &hypothesis.fitted, 30) {
                let gain = self.gain(&poor, hypothesis, 1);
                if gain.evidence() < TIE || gain.held_rms < 0.25 * LEAST_SHRINK * (1.0 - gain.white)
                {
                    *hypothesis = poor;
                    continue;
                }
            }
            i += 1;
        }
    }

    /// What an effect is worth, and who could stand in its place.
    fn judge_effect(
        &self,
        nominal: &Hypothesis,
        best: &Hypothesis,
        i: usize,
        rounds: &[Vec<(Hypothesis, Gain)>],
    ) -> (Gain, Vec<Rival>) {
        let mut fewer = best.effects.clone();
        let own = fewer.remove(i);
        let without = if fewer.is_empty() {
            Some(nominal.clone())
        } else {
            self.rebuilt(nominal, &fewer, &best.fitted, 30)
        };
        let Some(without) = without else {
            let none = Gain { bic: 0.0, held: 0.0, held_rms: 0.0, train_rms: 0.0, white: 1.0 };
            return (none, Vec::new());
        };
        let gain = self.gain(&without, best, 1);
        let mut others: Vec<Chosen> = Vec::new();
        for (h, _) in rounds.iter().flatten() {
            let Some(last) = h.effects.last() else { continue };
            let same = |e: &Chosen| {
                e.candidate.kind == last.candidate.kind && e.candidate.at == last.candidate.at
            };
            let clash = |e: &Chosen| {
                e.candidate.at == last.candidate.at
                    && (e.candidate.within.contains(&last.candidate.kind)
                        || last.candidate.within.contains(&e.candidate.kind))
            };
            if !same(&own) && !fewer.iter().any(|e| same(e) || clash(e)) && !others.iter().any(same)
            {
                let patch = with_values(&last.patch, &h.fitted, false);
                others.push(Chosen { candidate: last.candidate.clone(), patch });
            }
        }
        others.truncate(12);
        let mut rivals: Vec<Rival> = others
            .into_par_iter()
            .filter_map(|other| {
                let mut effects = fewer.clone();
                effects.push(other.clone());
                let hypothesis = self.rebuilt(nominal, &effects, &without.fitted, 40)?;
                let delta_bic = gain.bic - self.gain(&without, &hypothesis, 1).bic;
                let held_worse =
                    self.size(&hypothesis.held) / self.size(&best.held).max(1e-300) - 1.0;
                Some(Rival { candidate: other.candidate, hypothesis, delta_bic, held_worse })
            })
            .collect();
        rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        (gain, rivals)
    }
}

impl Rival {
    /// Whether the data cannot tell it from the one chosen, `of`.
    pub fn ties(&self, of: &Candidate) -> bool {
        // A general form that comes out as its special case is no other explanation.
        let nested = of.at == self.candidate.at
            && (of.within.contains(&self.candidate.kind)
                || self.candidate.within.contains(&of.kind));
        !nested && self.delta_bic < TIE && self.held_worse < 0.03
    }
}

/// A patch with the values that were fitted; with deviations when it is to be kept.
pub fn with_values(patch: &Patch, at: &Fitted, keep: bool) -> Patch {
    let params = patch
        .params
        .iter()
        .map(|p| {
            let found = at.compiled.params.iter().position(|q| q.name == p.name);
            let value = found.map_or(p.value, |i| at.train.point.params[i]);
            let std = found.filter(|_| keep).map(|i| at.train.std[i]);
            NewParam { value, std, ..p.clone() }
        })
        .collect();
    Patch { params, ..patch.clone() }
}

/// The state, input or time that a residual follows most, in words.
pub fn concentrated(question: &Question, hypothesis: &Hypothesis, output: usize) -> String {
    let fitted = &hypothesis.fitted;
    let bench = question.bench;
    let task = bench.task(&fitted.compiled);
    let residual = &fitted.train.residuals[output];
    let mut features: Vec<(String, Vec<f64>)> = Vec::new();
    let rows: Vec<(usize, usize)> =
        task.windows.iter().flat_map(|w| w.rows.clone().map(move |r| (w.data, r))).collect();
    let column = |pick: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        rows.iter().map(|(d, r)| pick(*d, *r)).collect()
    };
    features.push(("t".into(), column(&|d, r| bench.train[d].time[r])));
    for (i, (name, _)) in fitted.compiled.inputs.iter().enumerate() {
        features.push((name.clone(), column(&|d, r| bench.train[d].inputs[i][r])));
    }
    for (o, out) in fitted.compiled.outputs.iter().enumerate() {
        features.push((out.name.clone(), column(&|d, r| bench.train[d].outputs[o][r])));
    }
    let total = std(residual).powi(2);
    let mut best = (0.1, String::from("no single signal"));
    for (name, values) in features {
        if values.len() != residual.len() || total <= 0.0 {
            continue;
        }
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        // How much of the residual eight bins of the signal explain, and where it is largest.
        let mut explained = 0.0;
        let mut largest = (0.0, 0.0, 0.0);
        let mean_all = super::data::mean(residual);
        for bin in 0..8 {
            let part = &order[order.len() * bin / 8..order.len() * (bin + 1) / 8];
            if part.is_empty() {
                continue;
            }
            let mean = part.iter().map(|i| residual[*i]).sum::<f64>() / part.len() as f64;
            explained += (mean - mean_all).powi(2) * part.len() as f64 / residual.len() as f64;
            if mean.abs() > f64::abs(largest.0) {
                largest = (mean, values[part[0]], values[part[part.len() - 1]]);
            }
        }
        if explained / total > best.0 {
            let n = |v: f64| crate::units::significant(v, 3);
            best = (explained / total, format!("{name} from {} to {}", n(largest.1), n(largest.2)));
        }
    }
    best.1
}

/// Whether a model moves masses: it has velocities.
pub fn is_mechanical(question: &Question, fitted: &Fitted) -> bool {
    model_in(&fitted.text, question.name)
        .is_some_and(|model| !velocities(&question.ground(fitted, &model)).is_empty())
}
