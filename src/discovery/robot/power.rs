//! The power of the test: how small an effect would still have been seen.

use std::f64::consts::PI;

use super::chain::Chain;
use super::explain::ArmGap;
use super::term::{Law, Term};
use crate::discovery::finding::Visible;
use crate::discovery::selection::{Options, ParameterSpec, Residuals as _, Set, sum_of_squares};
use crate::discovery::vocabulary::of_slide;

/// More than this many of the scales on which an effect is small, yet visible, is more than any joint has: of friction 500 N·m, of
/// a load 200 kg. Chosen: what rounding shows of an effect that does nothing asks for a million times more.
const NEVER: f64 = 1e4;

/// Returns how small an effect of each common kind would have been seen, and those of which these recordings show no size that there
/// is: the power of the test. `own` are the simulation's own parameters.
pub(super) fn smallest_visible(
    gap: &ArmGap,
    own: &[f64],
    options: &Options,
) -> (Vec<Visible>, Vec<String>) {
    let (mut visible, mut blind): (Vec<Visible>, Vec<String>) = (Vec::new(), Vec::new());
    let Some(base) = gap.residuals(Set::Train, &[], own) else { return (visible, blind) };
    let count = gap.count(Set::Train) as f64;
    let chain = &gap.train[0].arm.chain;
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
        let needed = options.least_gain + specs.len() as f64 * count.ln();
        let least = (needed.sqrt() / strength.max(f64::MIN_POSITIVE)).max(spec.least);
        // An effect may be a candidate alone and beside others: it is told once.
        let (name, at) = (law.name(), candidate.term.site(&gap.things));
        if visible.iter().any(|told| told.name == name && told.at == at) {
            continue;
        }
        if least > largest(candidate.term, spec, chain) {
            let told = format!("{name}({at})");
            if !blind.contains(&told) {
                blind.push(told);
            }
            continue;
        }
        let slides = law.is_at_joint() && chain.slides(candidate.term.joint);
        let unit = if slides { of_slide(spec.name, spec.unit) } else { spec.unit };
        visible.push(Visible {
            name: name.into(),
            at,
            parameter: spec.name.into(),
            least,
            unit: unit.into(),
        });
    }
    (visible, blind)
}

/// Returns the largest that the first number of an effect can be: half a turn, twice the length of the arm, the end of its range, or
/// what no joint exceeds.
fn largest(term: Term, spec: &ParameterSpec, chain: &Chain) -> f64 {
    let slides = term.law.is_at_joint() && chain.slides(term.joint);
    let bound = match spec.unit {
        "rad" if !slides => PI,
        "rad" | "m" => 2.0 * chain.reach(),
        _ => NEVER * spec.scale,
    };
    bound.min(spec.range.1)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;

    #[test]
    fn no_effect_is_larger_than_there_are() {
        let mut chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        let of = |law: Law, chain: &Chain| largest(Term { law, joint: 0 }, &law.specs()[0], chain);
        let is = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(is(of(Law::ZeroOffset, &chain), PI));
        assert!(is(of(Law::CommandDelay, &chain), 0.5));
        assert!(is(of(Law::Coulomb, &chain), 500.0));
        let reach = chain.reach();
        assert!(is(of(Law::ToolOffset, &chain), 2.0 * reach));
        chain.bodies[0].slides = true;
        assert!(is(of(Law::ZeroOffset, &chain), 2.0 * reach));
    }
}
