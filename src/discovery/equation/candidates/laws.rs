//! What is known of an effect as a term of an equation: what its numbers can be, and what has to be seen of a motion before it
//! can be told. How common it is stands in the vocabulary.
//!
//! One line per law.

use crate::discovery::vocabulary::kind_named;

/// What the amounts of an effect can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    /// Either.
    Any,
    /// Not negative together with what the model has of it, other effects that were found included: the effect itself is not
    /// negative where the model has nothing of its kind.
    Total,
    /// The same with what the model had before anything was looked for: what resists is not the difference of two laws.
    Given,
    /// The same with what jumps or bends in the model as friction does: a straight damping takes nothing of it away, and what
    /// drives one way and brakes the other is a constant.
    Rubbing,
    /// Not negative.
    Own,
}

/// What has to be seen of the motion for a law to be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    /// Nothing in particular.
    Anything,
    /// That it goes back and forth: a path that is never gone back has no loop.
    Reversals,
    /// Where nothing drives it, that it turns round or comes to rest: else friction of a constant size and a scale of
    /// the sensor are one constant, as gravity and a slope are, and what is late began elsewhere.
    Turning,
}

/// What is known of an effect before anything is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Law {
    kind: &'static str,
    /// What its amounts can be where it adds to a rate.
    pub(super) sign: Sign,
    /// What has to be seen of the motion.
    pub(super) seen: Seen,
}

const fn law(kind: &'static str, sign: Sign, seen: Seen) -> Law {
    Law { kind, sign, seen }
}

const LAWS: [Law; 25] = [
    law("linear_damping", Sign::Given, Seen::Anything),
    law("viscous_friction", Sign::Given, Seen::Anything),
    law("quadratic_drag", Sign::Given, Seen::Anything),
    law("quadratic_friction", Sign::Given, Seen::Anything),
    law("dry_friction", Sign::Rubbing, Seen::Turning),
    law("coulomb_friction", Sign::Given, Seen::Anything),
    law("asymmetric_damping", Sign::Given, Seen::Anything),
    law("asymmetric_friction", Sign::Rubbing, Seen::Turning),
    law("stribeck_friction", Sign::Own, Seen::Turning),
    law("linear_stiffness", Sign::Total, Seen::Anything),
    // Springs soften as well as they harden.
    law("cubic_stiffness", Sign::Total, Seen::Anything),
    law("hysteresis", Sign::Own, Seen::Reversals),
    law("periodic_disturbance", Sign::Any, Seen::Anything),
    law("overflow", Sign::Own, Seen::Anything),
    law("input_offset", Sign::Any, Seen::Anything),
    law("input_gain", Sign::Any, Seen::Anything),
    law("input_deadzone", Sign::Any, Seen::Anything),
    law("input_saturation", Sign::Any, Seen::Anything),
    law("input_delay", Sign::Any, Seen::Anything),
    law("output_offset", Sign::Any, Seen::Anything),
    law("output_gain", Sign::Any, Seen::Turning),
    law("output_drift", Sign::Any, Seen::Turning),
    law("output_saturation", Sign::Any, Seen::Anything),
    law("sensor_delay", Sign::Any, Seen::Turning),
    law("lag", Sign::Any, Seen::Turning),
];

/// What is known of a kind.
pub(super) fn law_of(kind: &str) -> Law {
    let found = LAWS.iter().find(|law| law.kind == kind);
    found.copied().unwrap_or(law("", Sign::Any, Seen::Anything))
}

/// What naming an effect costs in the criterion: what has no name nothing, since the choice among all words is paid for.
pub(in super::super) fn price(kind: &str) -> f64 {
    let is_law = LAWS.iter().any(|law| law.kind == kind);
    kind_named(kind).filter(|_| is_law).map_or(0.0, |kind| kind.odds.price())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_has_a_name_of_the_vocabulary_and_one_line() {
        for (i, law) in LAWS.iter().enumerate() {
            assert!(kind_named(law.kind).is_some(), "{}", law.kind);
            assert!(LAWS[..i].iter().all(|other| other.kind != law.kind), "{}", law.kind);
        }
    }

    #[test]
    fn a_loop_costs_more_than_what_rubs() {
        assert!(price("linear_damping").abs() < 1e-12);
        assert!((price("hysteresis") - 2.0 * 100.0_f64.ln()).abs() < 1e-9);
    }
}
