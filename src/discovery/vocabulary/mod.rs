//! The names of what a twin can lack: kind, how common it is, where it may sit, its parameters with units.
//!
//! They stand in [`KINDS`]. A model file holds an effect as `name(at) { parameter = value unit }`, `gap`
//! names it, JSON prints it: all three take their words from here. How an effect acts on a motion is
//! the business of whoever simulates it ([`robot`](super::robot) for arms, `equation` for models).
//!
//! Where the field has a name, it is the field's name: Olsson et al., "Friction Models and Friction
//! Compensation", 1998 (friction); Brown 1966 (lenses); Bouc 1967, Wen 1976 (hysteresis).

mod kinds;

use crate::language::ast::{Name, TwinItem};
use crate::language::{Diagnostic, nearest};
use crate::units::Unit;
pub use kinds::KINDS;

/// Where a `camera_shift` of what sees the tip sits in a model file; its numbers are in the base's axes.
pub const TRACKER: &str = "tracker";
/// Where a `camera_shift` of what sees a thing in the hand sits in a model file; its numbers are in the base's axes.
pub const OBJECT_TRACKER: &str = "object_tracker";

/// Returns whether a `camera_shift` of a model file is of what tells places in the base's frame, rather than of the scene's
/// camera, whose numbers are in its own axes.
pub fn is_tracker(at: &str) -> bool {
    [TRACKER, OBJECT_TRACKER].contains(&at)
}

/// Where an effect may sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SiteKind {
    /// `joint_n`.
    Joint,
    /// The name of a link, or `tool` for what is mounted on the last one.
    Link,
    /// `robot`: all of it.
    Robot,
    /// `base`.
    Base,
    /// `tool`.
    Tool,
    /// A measured channel: `q`, `dq`, `tau`, `tcp`.
    Channel,
    /// A camera, or a tracker ([`is_tracker`]).
    Camera,
    /// The table.
    Table,
    /// An object of the scene.
    Object,
    /// The gripper.
    Gripper,
    /// A state of a model.
    State,
    /// An input of a model.
    Input,
    /// An output of a model.
    Output,
    /// Anywhere at all.
    Anywhere,
}

/// One parameter of a kind of effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterKind {
    /// Its name.
    pub name: &'static str,
    /// Its SI unit as the language writes it; empty for a plain number, `?` where it depends on the
    /// state or output it sits at.
    pub unit: &'static str,
    /// The names of its components in a model file when it is a vector; empty for a number.
    pub components: &'static [&'static str],
}

/// How common an effect is beside others that fit equally well, before anything is measured: judged by what commissioning and
/// laboratory benches meet. Chosen, not measured: three steps are all that such odds are good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Odds {
    /// What moves rubs and weighs, what measures has a zero and a scale.
    Common,
    /// One in ten of those.
    Uncommon,
    /// One in a hundred.
    Rare,
}

impl Odds {
    /// Returns what naming such an effect costs in the criterion: -2 ln of the odds.
    pub fn price(self) -> f64 {
        let odds: f64 = match self {
            Self::Common => 1.0,
            Self::Uncommon => 0.1,
            Self::Rare => 0.01,
        };
        -2.0 * odds.ln()
    }
}

/// A kind of effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// Its name, for ever.
    pub name: &'static str,
    /// How common it is beside the others.
    pub odds: Odds,
    /// Where it may sit.
    pub sites: &'static [SiteKind],
    /// Its parameters.
    pub parameters: &'static [ParameterKind],
    /// What it does, in words.
    pub does: &'static str,
    /// How it shows in a residual.
    pub shows: &'static str,
}

/// Returns the unit of a number of a joint that slides, where that of one that turns has `unit`: forces stand for torques, ways for
/// angles. A phase is an angle all the same.
pub fn of_slide(name: &str, unit: &'static str) -> &'static str {
    match (name, unit) {
        ("order", _) => "1/m",
        (_, "rad") if name != "phase" => "m",
        (_, "rad/s") => "m/s",
        (_, "rad/(N*m)") => "m/N",
        (_, "N*m") => "N",
        (_, "N*m/s") => "N/s",
        (_, "N*m/rad") => "N/m",
        (_, "N*m/rad^2") => "N/m^2",
        (_, "N*m/rad^3") => "N/m^3",
        (_, "N*m*s/rad") => "N*s/m",
        (_, "N*m*s/rad^2") => "N*s/m^2",
        (_, "N*m*s^2/rad^2") => "N*s^2/m^2",
        (_, "N*m*s^3/rad^3") => "N*s^3/m^3",
        (_, "kg*m^2") => "kg",
        _ => unit,
    }
}

fn kinds() -> impl Iterator<Item = &'static Kind> {
    KINDS.iter().copied().flatten()
}

/// Returns the kind of that name.
pub fn kind_named(name: &str) -> Option<&'static Kind> {
    kinds().find(|kind| kind.name == name)
}

impl Kind {
    /// Returns every number of the kind in order, with its name in a model file and its unit: a vector
    /// counts once per component.
    pub fn numbers(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.parameters.iter().flat_map(|parameter| {
            let one = parameter.components.is_empty().then_some((parameter.name, parameter.unit));
            one.into_iter().chain(parameter.components.iter().map(|name| (*name, parameter.unit)))
        })
    }
}

/// Returns what is wrong with the effects of a twin: a name nobody knows, a seat such an effect cannot
/// have, a parameter it does not have or of another unit; `turns` says of a joint, from 0, whether it is known to turn and not to
/// slide.
pub fn check(twin: &TwinItem, turns: &dyn Fn(usize) -> bool) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for effect in &twin.effects {
        let Some(kind) = kind_named(&effect.name.text) else {
            let names = kinds().map(|kind| kind.name);
            found.push(unknown("effect", &effect.name, nearest(&effect.name.text, names)));
            continue;
        };
        if kind.sites == [SiteKind::Joint] && joint(&effect.at.text).is_none() {
            let message = format!("`{}` sits at a joint", kind.name);
            found.push(
                Diagnostic::error("task::effect", effect.at.span, message, "not a joint")
                    .help("write `joint_1`, `joint_2`, …, counted from the base"),
            );
        }
        for parameter in &effect.parameters {
            let name = &parameter.name.text;
            let known = kind.numbers().find(|(known, _)| known == name);
            let Some((_, written)) = known else {
                let names = || kind.numbers().map(|(name, _)| name);
                // An effect that is a formula has the parameters of its formula.
                if names().next().is_none() {
                    continue;
                }
                let what = format!("parameter of `{}` called", kind.name);
                let near = nearest(name, names());
                let list = names().collect::<Vec<_>>().join(", ");
                let diagnostic = unknown(&what, &parameter.name, near);
                found.push(match near {
                    Some(_) => diagnostic,
                    None => diagnostic.help(format!("it has: {list}")),
                });
                continue;
            };
            let Ok(unit) = Unit::parse(written) else { continue };
            let given = parameter.value.quantity.dimension;
            let is_given = |unit: &str| Unit::parse(unit).is_ok_and(|u| u.dimension == given);
            let slides = joint(&effect.at.text)
                .is_some_and(|joint| is_given(of_slide(name, written)) && !turns(joint));
            if given != unit.dimension && !slides {
                let message = format!(
                    "`{name}` is {}, and this is {}",
                    unit.dimension.words(),
                    given.words()
                );
                found.push(
                    Diagnostic::error(
                        "task::effect",
                        parameter.value.span,
                        message,
                        "another unit",
                    )
                    .help(format!("write it in {}", unit.dimension.si())),
                );
            }
        }
    }
    found
}

/// Returns which joint a seat is, from 0.
fn joint(at: &str) -> Option<usize> {
    at.strip_prefix("joint_")?.parse::<usize>().ok()?.checked_sub(1)
}

fn unknown(what: &str, name: &Name, near: Option<&str>) -> Diagnostic {
    let message = format!("there is no {what} `{}`", name.text);
    let found = Diagnostic::error("task::effect", name.span, message, "not in the vocabulary");
    match near {
        Some(near) => found.did_you_mean(near),
        None => found.help("`docs/gap.md` lists the effects that have a name"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_units_exist() {
        for (at, kind) in kinds().enumerate() {
            assert!(kinds().take(at).all(|other| other.name != kind.name), "{}", kind.name);
            assert!(!kind.sites.is_empty(), "{}", kind.name);
            for (_, unit) in kind.numbers().filter(|(_, unit)| *unit != "?") {
                assert!(Unit::parse(unit).is_ok(), "{}: {unit}", kind.name);
            }
        }
    }

    /// Friction of a joint that slides was told in N·m.
    #[test]
    fn no_number_of_a_joint_that_slides_is_of_an_angle() {
        for kind in kinds().filter(|kind| kind.sites.contains(&SiteKind::Joint)) {
            for (name, unit) in kind.numbers().filter(|(_, unit)| *unit != "?") {
                let told = of_slide(name, unit);
                assert!(Unit::parse(told).is_ok(), "{}: {told}", kind.name);
                let is_turned = told.contains("rad") || told.contains("N*m");
                assert!(!is_turned || name == "phase", "{}: {told}", kind.name);
            }
        }
        assert_eq!(of_slide("torque", "N*m"), "N");
        assert_eq!(of_slide("coefficient", "N*m*s/rad"), "N*s/m");
        assert_eq!(of_slide("inertia", "kg*m^2"), "kg");
    }

    #[test]
    fn vectors_are_counted_by_component() {
        let names: Vec<_> = kind_named("payload").unwrap().numbers().map(|(n, _)| n).collect();
        assert_eq!(names, ["mass", "com_x", "com_y", "com_z"]);
        assert!(kind_named("gremlins").is_none());
    }
}
