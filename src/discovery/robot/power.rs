//! The power of the test: how small an effect would still have been seen.

use super::explain::ArmGap;
use super::term::Law;
use crate::discovery::finding::Visible;
use crate::discovery::selection::{Options, Residuals as _, Set, sum_of_squares};
use crate::discovery::vocabulary::of_slide;

/// Returns how small an effect of each common kind would have been seen: the power of the test. `own` are the
/// simulation's own parameters.
pub(super) fn smallest_visible(gap: &ArmGap, own: &[f64], options: &Options) -> Vec<Visible> {
    let Some(base) = gap.residuals(Set::Train, &[], own) else { return Vec::new() };
    let count = gap.count(Set::Train) as f64;
    let mut visible: Vec<Visible> = Vec::new();
    for candidate in gap.candidates(&[], &base, None) {
        let law = candidate.term.law;
        let wanted = matches!(
            law,
            Law::Coulomb
                | Law::Viscous
                | Law::Payload
                | Law::ObjectMass
                | Law::TorqueOffset
                | Law::ZeroOffset
                | Law::Compliance
                | Law::CommandDelay
                | Law::ToolOffset
        );
        let specs = law.specs();
        let (Some(spec), Some(start)) = (specs.first(), candidate.starts.first()) else { continue };
        if !wanted {
            continue;
        }
        let mut moved = [own, start].concat();
        moved[own.len()] += spec.scale;
        let Some(with) = gap.residuals(Set::Train, &[candidate.term], &moved) else { continue };
        let difference: Vec<f64> = with.iter().zip(&base).map(|(a, b)| a - b).collect();
        let strength = sum_of_squares(&difference).sqrt() / spec.scale;
        if strength <= 0.0 {
            continue;
        }
        let needed = options.least_gain + specs.len() as f64 * count.ln();
        // An effect may be a candidate alone and beside others: it is told once.
        let (name, at) = (law.name(), candidate.term.site(&gap.things));
        if visible.iter().any(|told| told.name == name && told.at == at) {
            continue;
        }
        let slides = law.is_at_joint() && gap.train[0].arm.chain.slides(candidate.term.joint);
        let unit = if slides { of_slide(spec.name, spec.unit) } else { spec.unit };
        visible.push(Visible {
            name: name.into(),
            at,
            parameter: spec.name.into(),
            least: (needed.sqrt() / strength).max(spec.least),
            unit: unit.into(),
        });
    }
    visible
}
