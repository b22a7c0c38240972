//! What remembers is begun over short stretches.
//!
//! A loop of hysteresis, begun from none along a whole recording, moves the resonance before it has its size, and
//! the fit ends in a false bottom. Over short stretches, each from first values of its own, the way there is
//! nearly straight; from there whole recordings are fitted.
//!
//! Source: Bock, "Recent Advances in Parameter Identification Techniques for ODE", 1983 (multiple shooting).

use super::columns::Data;
use super::edit::Patch;
use super::fitting::{Bench, Fitted};
use super::hypothesis::Question;

/// Steps of the fit over stretches.
const STEPS: usize = 10;
/// Stretches in a recording, and the fewest rows of one.
const STRETCHES: usize = 30;
const LEAST_ROWS: usize = 20;

impl Question<'_> {
    /// Where to begin fitting a text with an effect along whole recordings: as fitted over short stretches when
    /// the effect remembers, else `None`.
    pub(super) fn begun(&self, text: &str, patch: &Patch, base: &Fitted) -> Option<Fitted> {
        let has_amount = patch.params.iter().any(|p| p.neutral.is_some());
        if self.bench.rows.is_some() || patch.states.is_empty() || !has_amount {
            return None;
        }
        let longest = self.bench.train.iter().map(Data::n_rows).max()?;
        let share = self.bench.most_rows / self.bench.train.len().max(1);
        let rows = Some((longest.min(share) / STRETCHES).max(LEAST_ROWS));
        let short = Bench { rows, ..self.bench.clone() };
        let mut fitted = short.fit(text, self.name, base, STEPS)?;
        fitted.train.point = self.bench.rewindowed(&fitted.compiled, &fitted.train.point, &short);
        Some(fitted)
    }
}
