//! Why a form of the map was chosen, and what a person should know before relying on it, in words.

use std::fmt;

use super::compared::Compared;
use super::trust::{Side, Warning};

impl Warning {
    /// Returns its name in documents.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unchecked { .. } => "unchecked",
            Self::OnALine { .. } => "on_a_line",
            Self::HardlyDetermined { .. } => "hardly_determined",
            Self::SmallPatch { .. } => "small_patch",
            Self::Horizon { .. } => "horizon",
            Self::CornerNearZero { .. } => "corner_near_zero",
            Self::ByChance { .. } => "by_chance",
            Self::Mirrored => "mirrored",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unchecked { kept, left_out: 0 } => write!(
                f,
                "{kept} pairs fit exactly whatever they are, so a wrong one cannot be noticed: add pairs (one more shows that \
                 something is wrong, two more show which)"
            ),
            Self::Unchecked { kept, left_out } => write!(
                f,
                "{kept} pairs fit exactly whatever they are; {left_out} more do not agree with them, and which of all are \
                 wrong cannot be told: add pairs"
            ),
            Self::OnALine { side, across_px, noise_px } => {
                let side = match side {
                    Side::Real => "real",
                    Side::Twin => "twin",
                };
                write!(
                    f,
                    "the {side} points lie on one line but for their noise (± {across_px:.2} px across it, noise \
                     {noise_px:.2} px): beside the line the map is made of noise; add points off it"
                )
            }
            Self::HardlyDetermined { std_px, noise_px } => write!(
                f,
                "between its own points the map is known to ± {std_px:.1} px only, with a noise of {noise_px:.2} px: nearly all \
                 of them lie on one line or in one place; add points elsewhere"
            ),
            Self::SmallPatch { share, at, std_px: Some(std) } => write!(
                f,
                "the points cover {:.0} % of the twin's picture: at ({:.0}, {:.0}) the map is known to ± {std:.1} px; spread \
                 the points, or use it near them only",
                100.0 * share,
                at.u,
                at.v
            ),
            Self::SmallPatch { share, at, std_px: None } => write!(
                f,
                "the points cover {:.0} % of the twin's picture, and ({:.0}, {:.0}) lies beyond the map's horizon; use it near \
                 the points only",
                100.0 * share,
                at.u,
                at.v
            ),
            Self::Horizon { share } => write!(
                f,
                "the map's horizon runs through the twin's picture: {:.0} % of it has no image",
                100.0 * share
            ),
            Self::CornerNearZero { ratio } => write!(
                f,
                "the twin's pixel (0, 0) is nearly sent to infinity (h33 is {ratio:.1e} of what it is at the points): entries \
                 of M with a 1 in the corner are huge; move the origin of the twin's pixels, for example to the image centre"
            ),
            Self::ByChance { kept, given, log_expected } => write!(
                f,
                "{kept} of {given} pairs agree, no more than pairs at random would (10^{log_expected:.0} such agreements are \
                 expected of chance): check that the rows are paired rightly"
            ),
            Self::Mirrored => f.write_str(
                "the real picture is the twin's seen in a mirror, as no two cameras over one table see it: are two columns \
                 exchanged, such as u_x and u_y?"
            ),
        }
    }
}

/// Nobody chose.
pub(super) fn asked_for(name: &str) -> String {
    format!("{name} was asked for")
}

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
