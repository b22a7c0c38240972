//! What is said of a pour: what was assumed, what was refused, how an effect reads.

use super::gap::Term;
use crate::discovery::finding::ParameterEstimate;
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::Diverged;
use crate::language::ast::EffectItem;
use crate::units::significant;
use crate::world::Scene;

pub(super) use crate::discovery::wording::no_such;

/// A thing that nothing can be poured out of.
pub(super) fn no_vessel(name: &str, recording: &str) -> Error {
    Error::new(
        format!("`{name}` is no vessel"),
        recording,
        "give it `wall` and `holds` in the scene",
    )
}

/// No vessel of the scene has water in it.
pub(super) fn none_filled(recording: &Recording, scene: &Scene) -> Error {
    no_such("a vessel with water", recording, scene)
}

/// There is no vessel beside the one poured from.
pub(super) fn no_second(recording: &Recording, scene: &Scene) -> Error {
    no_such("a second vessel", recording, scene)
}

/// A fit that ran away.
pub(super) fn diverged(what: Diverged, recording: &str) -> Error {
    Error::new(
        what.to_string(),
        recording,
        "is the scale's column in kg, and the tilt in rad or deg?",
    )
}

pub(super) fn inside_unknown(recording: &str, target: &str) -> String {
    format!("{recording}: no column `inside[m]`; the lip is taken to stay over `{target}`")
}

pub(super) fn other_vessels(recording: &str, [source, target]: &[String; 2]) -> String {
    format!(
        "{recording}: a pour from `{source}` into `{target}`, other vessels than the last one's; it is left out, give it by \
         itself to have it looked at"
    )
}

pub(super) fn one_pour() -> String {
    "one pour cannot be cut in two: every second second of it is held out; a second run would \
     be a better judge"
        .into()
}

pub(super) fn all_cut() -> String {
    "only the last pour was in one turn: every second second of each is held out, not all of the last".into()
}

pub(super) fn not_of_pouring(effect: &EffectItem) -> String {
    let (name, at) = (&effect.name.text, &effect.at.text);
    format!("effect {name}({at}) does not change a pour and is left aside")
}

/// How an effect reads with its numbers.
pub(super) fn equation(
    [source, target]: &[String; 2],
    term: Term,
    estimates: &[ParameterEstimate],
) -> String {
    let number = |i: usize| {
        let (_, value, _, unit) = &estimates[i];
        format!("{} {unit}", significant(*value, 3)).trim_end().to_owned()
    };
    match term {
        Term::Volume => format!("volume({source}) = {} at first", number(0)),
        Term::Dribble => format!(
            "volume({target}) += {} * (1 - exp(-t_upright/{})) after {source} is upright",
            number(0),
            number(1)
        ),
        Term::Viscosity => format!(
            "what stands above the lip of {source} leaves through a film, w*rho*g*h^3*slope/(3*{})",
            number(0)
        ),
        Term::Overflow => format!("volume({target}) <= {}, the rest runs over", number(0)),
        Term::Mass => format!("{source} weighs {} when it is empty", number(0)),
        Term::Gain => format!("mass *= {}", number(0)),
        Term::Drift => format!("mass += {} * t", number(0)),
        Term::Clip => format!("mass <= {} as read", number(0)),
    }
}

/// When the scale reads otherwise than the model says, from the part of it after the vessel is upright.
pub(super) fn when(after: f64) -> &'static str {
    if after > 0.6 {
        "after the vessel is upright again"
    } else if after < 0.2 {
        "while it pours"
    } else {
        "while it pours and after"
    }
}

/// When a vessel is weighed in the hand.
pub(super) fn before_it_pours() -> &'static str {
    "what it bears before it pours"
}

/// Where a filling is read.
pub(super) fn as_weighed() -> &'static str {
    "what the scales say that it held"
}

pub(super) fn nothing_missing() -> &'static str {
    "the scale read what the model says, within noise, and no effect explains any of the rest"
}

/// What to do when several effects explain the same.
pub(super) fn pour_otherwise() -> &'static str {
    "pour another volume, wait with the vessel upright over the other, and weigh what is beside it"
}
