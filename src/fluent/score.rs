//! How well two fluent vectors agree: the paper's Eq. 8.

use serde::{Deserialize, Serialize};

/// Twin against measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Fluents that differ, both being known.
    pub hamming: usize,
    /// Fluents that both sides know.
    pub known: usize,
    /// Fluents that one side or both do not know: not mismatches, and not agreements.
    pub unknown: usize,
    /// `exp(−hamming)`: a score, not a probability, since it falls with the number of fluents listed.
    pub p: f64,
}

/// Returns `P = exp(−Σ|F^r_i − F^s_i|)` with its counts; what is unknown is no mismatch.
///
/// Fluents are matched by place; where one list is longer, the rest is unknown.
///
/// Source: Zeng, Zhao and Wu, Eq. 8.
pub fn score(twin: &[Option<bool>], measured: &[Option<bool>]) -> Score {
    let mut score = Score { hamming: 0, known: 0, unknown: 0, p: 1.0 };
    for i in 0..twin.len().max(measured.len()) {
        match (twin.get(i).copied().flatten(), measured.get(i).copied().flatten()) {
            (Some(a), Some(b)) => {
                score.known += 1;
                score.hamming += usize::from(a != b);
            }
            _ => score.unknown += 1,
        }
    }
    score.p = (-(score.hamming as f64)).exp();
    score
}

#[cfg(test)]
mod tests {
    use super::score;

    #[test]
    fn unknown_is_neither_agreement_nor_mismatch() {
        let s = score(&[Some(true), Some(false), None], &[Some(true), Some(true), Some(true)]);
        assert_eq!((s.hamming, s.known, s.unknown), (1, 2, 1));
        assert!((s.p - (-1.0_f64).exp()).abs() < 1e-15);
        let perfect = score(&[Some(true)], &[Some(true)]);
        assert!((perfect.p - 1.0).abs() < 1e-15);
        assert_eq!(score(&[Some(true)], &[]).unknown, 1);
    }
}
