//! Free parameters that run off when a model is fitted without what it lacks.
//!
//! The mass of a drive whose friction the model leaves out becomes infinite: not to move at all is nearer to what
//! was measured than to move without friction, and from there no effect can be seen. Such a parameter stays
//! where the model's text has it until the effects are there, and is fitted then.

use crate::units::Dimension;

use super::baseline::baseline;
use super::fitting::{Bench, Fitted};
use super::hypothesis::Question;
use super::search::Search;
use super::wording::{self, RanOff};

/// A parameter that is this many times what the text says has run off.
const FAR: f64 = 1e3;
/// Iterations of the fit with everything free again.
const FREED: usize = 80;

/// The free parameters that a fit has taken far from where the model's text has them.
pub(super) fn run_off(fitted: &Fitted) -> Vec<String> {
    let params = fitted.compiled.params.iter().zip(&fitted.train.point.params);
    let is_far = |guess: f64, value: f64| guess != 0.0 && value.abs() > FAR * guess.abs();
    params
        .filter(|(param, value)| param.guess.is_some_and(|guess| is_far(guess, **value)))
        .map(|(param, _)| param.name.clone())
        .collect()
}

/// Where a parameter that has a guess ran off to.
fn ran_off<'n>(fitted: &Fitted, name: &'n str) -> Option<RanOff<'n>> {
    let compiled = &fitted.compiled;
    let i = compiled.params.iter().position(|param| param.name == name)?;
    Some(RanOff {
        name,
        ran: fitted.train.point.params[i],
        given: compiled.params[i].guess?,
        unit: compiled.units.of(name).map(Dimension::si).unwrap_or_default(),
    })
}

impl Question<'_> {
    /// Searches with parameters that ran off in `nominal` where the text has them, then frees them. `None`, and
    /// nothing is changed, when no effect explains more than their running off.
    pub(super) fn anchored(
        &mut self,
        nominal: &Fitted,
        names: &[String],
        seed: u64,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Option<(Search, String)> {
        let bench = Bench { anchored: names.to_vec(), ..self.bench.clone() };
        let mut other = Question { bench, ..self.clone() };
        let near = baseline(&mut other.bench, &nominal.text, self.name, seed).ok()?;
        let mut search = other.search(near, progress)?;
        let off = self.judged(Vec::new(), nominal.clone(), None)?;
        if search.best.effects.is_empty() || other.size(&search.best.held) >= self.size(&off.held) {
            return None;
        }
        let kept = std::mem::take(&mut other.bench.anchored);
        let best = &search.best;
        let freed = other
            .bench
            .fit(&best.fitted.text, self.name, &best.fitted, FREED)
            .filter(|freed| run_off(freed).is_empty())
            .and_then(|freed| other.judged(best.effects.clone(), freed, Some(best)))
            .filter(|freed| other.size(&freed.held) <= other.size(&best.held));
        let are_fitted = freed.is_some();
        match freed {
            Some(freed) => {
                search.best = freed;
                other.replace_stand_ins(&mut search);
            }
            None => other.bench.anchored = kept,
        }
        let off: Vec<RanOff> = names.iter().filter_map(|name| ran_off(nominal, name)).collect();
        let note = wording::anchored(&off, are_fitted);
        *self = other;
        Some((search, note))
    }
}
