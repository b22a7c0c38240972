//! What is known of an effect before anything is measured: how common it is, what its numbers can be, and what
//! has to be seen of a motion before it can be told.
//!
//! One line per law. Odds are between names that fit equally well, judged by what commissioning and laboratory
//! benches meet; chosen, not measured: three steps are all they are good for.

/// How common an effect is beside the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Odds {
    /// What moves rubs, what measures has a zero and a scale.
    Common,
    /// One in ten of those.
    Uncommon,
    /// One in a hundred.
    Rare,
}

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
    odds: Odds,
    /// What its amounts can be where it adds to a rate.
    pub(super) sign: Sign,
    /// What has to be seen of the motion.
    pub(super) seen: Seen,
}

const fn law(kind: &'static str, odds: Odds, sign: Sign, seen: Seen) -> Law {
    Law { kind, odds, sign, seen }
}

const LAWS: [Law; 25] = [
    law("linear_damping", Odds::Common, Sign::Given, Seen::Anything),
    law("viscous_friction", Odds::Common, Sign::Given, Seen::Anything),
    law("quadratic_drag", Odds::Common, Sign::Given, Seen::Anything),
    law("quadratic_friction", Odds::Common, Sign::Given, Seen::Anything),
    law("dry_friction", Odds::Common, Sign::Given, Seen::Turning),
    law("coulomb_friction", Odds::Common, Sign::Given, Seen::Anything),
    law("asymmetric_damping", Odds::Uncommon, Sign::Given, Seen::Anything),
    law("asymmetric_friction", Odds::Uncommon, Sign::Given, Seen::Turning),
    law("stribeck_friction", Odds::Uncommon, Sign::Own, Seen::Turning),
    law("linear_stiffness", Odds::Uncommon, Sign::Total, Seen::Anything),
    // Springs soften as well as they harden.
    law("cubic_stiffness", Odds::Uncommon, Sign::Total, Seen::Anything),
    law("hysteresis", Odds::Rare, Sign::Own, Seen::Reversals),
    law("periodic_disturbance", Odds::Rare, Sign::Any, Seen::Anything),
    law("overflow", Odds::Common, Sign::Own, Seen::Anything),
    law("input_offset", Odds::Common, Sign::Any, Seen::Anything),
    law("input_gain", Odds::Common, Sign::Any, Seen::Anything),
    law("input_deadzone", Odds::Uncommon, Sign::Any, Seen::Anything),
    law("input_saturation", Odds::Rare, Sign::Any, Seen::Anything),
    law("input_delay", Odds::Uncommon, Sign::Any, Seen::Anything),
    law("output_offset", Odds::Common, Sign::Any, Seen::Anything),
    law("output_gain", Odds::Common, Sign::Any, Seen::Turning),
    law("output_drift", Odds::Rare, Sign::Any, Seen::Turning),
    law("output_saturation", Odds::Rare, Sign::Any, Seen::Anything),
    law("sensor_delay", Odds::Uncommon, Sign::Any, Seen::Turning),
    law("lag", Odds::Uncommon, Sign::Any, Seen::Turning),
];

/// What is known of a kind; of what has no name that it is common, since the choice among all words is paid for.
pub(super) fn law_of(kind: &str) -> Law {
    let found = LAWS.iter().find(|law| law.kind == kind);
    found.copied().unwrap_or(law("", Odds::Common, Sign::Any, Seen::Anything))
}

/// What naming an effect costs in the criterion: -2 ln of the odds.
pub(in super::super) fn price(kind: &str) -> f64 {
    let odds: f64 = match law_of(kind).odds {
        Odds::Common => 1.0,
        Odds::Uncommon => 0.1,
        Odds::Rare => 0.01,
    };
    -2.0 * odds.ln()
}

#[cfg(test)]
mod tests {
    use super::super::super::super::vocabulary::kind_named;
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
