//! Why a form of the map was chosen, in words.

use super::compared::Compared;

/// Nothing else could be fitted to so few pairs.
pub(super) fn only_form(name: &str, n_pairs: usize) -> String {
    format!("{name} is the only form that {n_pairs} pairs determine")
}

/// A form fits closer, and too few pairs are left over to test it.
pub(super) fn cannot_be_tested(name: &str, closer: &str, n_pairs: usize) -> String {
    format!("{name}: {closer} fits closer but {n_pairs} pairs cannot test it")
}

/// The evidence for it is larger than for the next.
pub(super) fn more_evidence(best: &Compared, next: &Compared) -> String {
    format!(
        "{} has {:.1} more log-evidence than {} ({:.3} px² against {:.3} px²)",
        best.model.name(),
        best.evidence - next.evidence,
        next.model.name(),
        best.mse_px,
        next.mse_px
    )
}
