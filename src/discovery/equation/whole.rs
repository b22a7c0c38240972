//! Whole recordings where stretches of them mislead.
//!
//! A model whose memory does not fade is run in short stretches, each from first values that fit it; over so
//! short a way those make up for a wrong law, down to one by which nothing acts at all. With friction the
//! memory fades, and the recordings can be run through: then everything is asked again.

use super::fitting::{Fitted, fades};
use super::hypothesis::Question;
use super::search::Search;

impl Question<'_> {
    /// Whether what a fitted model's states are at first no longer matters at the end of a recording.
    pub(super) fn fades(&self, fitted: &Fitted) -> bool {
        let point = &fitted.train.point;
        let first: Vec<f64> =
            point.starts.first().into_iter().flatten().map(|v| v.unwrap_or(0.0)).collect();
        fades(&self.bench, &fitted.compiled, &point.params, &first)
    }

    /// The search again on whole recordings, where stretches were run, noise is not all that is left, and what
    /// was found lets the memory fade; `None` otherwise, and when what is found then explains whole recordings
    /// no better than what was found in stretches.
    pub(super) fn on_whole_recordings(
        &self,
        stretches: &Search,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Option<(Self, Search)> {
        let best = &stretches.best;
        let effects = !best.effects.is_empty();
        if self.bench.rows.is_none() || !effects || self.is_noise(best) || !self.fades(&best.fitted)
        {
            return None;
        }
        let mut whole = self.clone();
        whole.bench.rows = None;
        let rewindowed = |fitted: &Fitted| {
            let mut fitted = fitted.clone();
            let (compiled, point) = (&fitted.compiled, &fitted.train.point);
            fitted.train.point = whole.bench.rewindowed(compiled, point, &self.bench);
            fitted
        };
        let plain = rewindowed(&stretches.nominal.fitted);
        let mut before = best.clone();
        before.fitted = rewindowed(&before.fitted);
        let plain = whole.bench.fit(&plain.text, self.name, &plain, 40)?;
        let found = whole.search(plain, progress)?;
        let other = whole.rebuilt(&found.nominal, &before.effects, &before, 40)?;
        (whole.gain(&other, &found.best, 1).evidence() > 0.0).then_some((whole, found))
    }
}
