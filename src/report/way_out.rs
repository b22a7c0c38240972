//! What a person could change when a plan, or a step of it, was stopped.

use crate::language::ast::{ExprKind, Step};
use crate::language::parse_line;
use crate::trace::{Cause, Unmet, Why};
use crate::workcell::InTwin;

/// Returns the call that makes a condition true that is about what is held, if it is one: `place(jar)` for `not held(jar)`.
fn letting_go(condition: &str) -> Option<String> {
    let (Some(Step::Check(condition, _)), _) = parse_line(&format!("check {condition}")) else {
        return None;
    };
    let ExprKind::Not(held) = &condition.kind else { return None };
    let ExprKind::Call(call) = &held.kind else { return None };
    let ExprKind::Name(object) = &call.args.first()?.values.first()?.kind else { return None };
    let is_held = matches!(call.name.text.as_str(), "held" | "holding" | "grasped");
    // Which thing it is, where it is any, the hand knows.
    is_held.then(|| if object == "any" { "place".to_owned() } else { format!("place({object})") })
}

/// Says how a condition is made true.
pub(super) fn made_true(condition: &str) -> String {
    match letting_go(condition) {
        Some(call) => format!("put down what is held first, with `{call}`"),
        None if condition == "gripper.open" => "open the hand first, with `open_gripper()`".into(),
        None => "make it true first".to_owned(),
    }
}

/// Whether a condition fails where things stand too near, too far or out of sight, and not for a number that was asked for.
fn is_about_room(condition: &str) -> bool {
    const OF_ROOM: &[&str] = &[
        "visible",
        "reachable",
        "rests_on",
        "above",
        "contact",
        "distance",
        "offset",
        "near",
        "held",
        "holding",
        "grasped",
    ];
    let bare = condition.strip_prefix("not ").unwrap_or(condition);
    bare.split_once('(').is_none_or(|(name, _)| OF_ROOM.contains(&name))
}

/// Says what a person could change when an amount of water came out otherwise than promised.
fn about_water(water: &InTwin, unmet: &Unmet) -> &'static str {
    /// Less than this share of what is missing is not what went wrong, no unit.
    const PART: f64 = 0.5;
    let missing = unmet.margin.map_or(0.0, |margin| margin.value.abs());
    if water.spilt > PART * missing {
        "what was spilt would need a wider vessel; a smaller `amount:` may spill less"
    } else if unmet.numbers.is_some_and(|(volume, limit)| volume.value > limit.value) {
        "more came than may come; ask for less, with `amount:`"
    } else {
        "nothing of it was spilt: it stayed where it was; ask for less, with `amount:`"
    }
}

/// Says what a person could change when this stopped the best plan in the twin, with the water in it.
pub(super) fn way_out(cause: &Cause, water: Option<&InTwin>) -> String {
    let no_way = match cause {
        Cause::NoWay(no_way) => no_way,
        Cause::Needs(unmet) => return made_true(&unmet.term),
        Cause::TooHeavy(_) => return "the hand cannot hold it; take something lighter".to_owned(),
        Cause::Overloaded(overload) => {
            return match &overload.held {
                Some(held) => format!("take something lighter than `{held}`, or put less in it"),
                None => {
                    "do it nearer to the arm, or check the efforts in the robot's URDF".to_owned()
                }
            };
        }
        // Their own words say what would have to be otherwise.
        Cause::Refused(_)
        | Cause::Script(_)
        | Cause::NotRemembered { .. }
        | Cause::Conflict { .. } => {
            return "the reason says what would have to be otherwise".to_owned();
        }
        Cause::Overdue(_) | Cause::Endless { .. } | Cause::Mistimed(_) => {
            return "give it more time".to_owned();
        }
        _ => {
            return match (cause.unmet(), water) {
                (Some(unmet), Some(water)) => about_water(water, unmet).to_owned(),
                (Some(unmet), None) if letting_go(&unmet.term).is_some() => {
                    made_true(&unmet.term)
                }
                (Some(unmet), _) if !is_about_room(&unmet.term) => {
                    "ask for less, or change what the task promises: it is not so in the simulation"
                        .to_owned()
                }
                _ => {
                    "if it is a matter of room, move the objects nearer to the arm or closer together"
                        .to_owned()
                }
            };
        }
    };
    let help = match &no_way.why {
        Why::NotSeen(_) => "clear the camera's view of it and try again",
        Why::TooWide { .. } | Why::NoSides => {
            "the hand does not get around it: take something narrower, or `push` it along the table"
        }
        Why::TooNarrow { .. } => {
            "the hand does not close on it: take something wider, or `push` it along the table"
        }
        Why::FingersShort { .. } => {
            "take it by a side where it is less deep, or `push` it along the table"
        }
        Why::OverOutOfReach(over) => {
            return format!("move `{}` nearer to the arm", over.target);
        }
        Why::OutOfReach { .. } => "move it nearer to the arm",
        Why::AtEnd { joint } => return format!("move it to where `{joint}` need not go so far"),
        Why::NotTurned => "move it, or let the hand come from another side",
        Why::Blocked { .. } | Why::NoPath(_) | Why::NotWithin(_) => {
            "move what is in the way, or make room around it"
        }
        Why::Walls { vessel, .. } => {
            return format!(
                "the hand does not fit between the walls of `{vessel}`: take a wider one, or put a thing in it that stands \
                 higher than they do"
            );
        }
        Why::Tilted(tilted) => {
            let held = &tilted.held;
            return if tilted.is_vessel {
                format!("bring it upright first, with `untilt({held})`")
            } else {
                format!("bring `{held}` upright first")
            };
        }
        Why::IntoHeld { held, .. } => {
            return format!("put down what is in the hand first, with `place({held})`");
        }
        Why::TooNear(near) if near.which == "goal" => {
            return format!(
                "{} has to be farther from {} there: let the arm begin elsewhere, as with another `home` in its robot's `robot.toml`, \
                 or move what is near",
                near.first, near.second
            );
        }
        Why::TooNear(_) => "make room around the arm, or bring it elsewhere first",
        Why::OffTable(_) => "name a place on the table, away from its edge",
        Why::NoFreePlace => "make room on the table: `put` something on something else",
        Why::Shallow { .. } => "fill it, or take a narrower vessel",
        Why::EmptyHand => "`pick` something first",
        Why::OverOpening => "take it by its side: `approach` takes the face, `side`",
        Why::Topples { .. } => "`pick` it instead, or push something wider",
        Why::Lifted { .. } => "`put` it there instead",
        Why::Stopped => "call it again",
    };
    help.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{NoWay, Tilted, TooNear};
    use crate::units::{Dimension, Quantity};

    fn unmet(condition: &str, margin: Option<f64>) -> Unmet {
        let margin = margin.map(|value| Quantity { value, dimension: Dimension::VOLUME });
        Unmet { condition: condition.into(), term: condition.into(), margin, numbers: None }
    }

    #[test]
    fn the_help_fits_what_stopped_the_plan() {
        assert!(
            way_out(&Cause::Needs(unmet("not held(jar)", None)), None).contains("`place(jar)`")
        );
        assert!(way_out(&Cause::Promise(unmet("not held(any)", None)), None).contains("`place`"));
        assert_eq!(way_out(&Cause::Needs(unmet("upright(jar)", None)), None), "make it true first");
        // What was held fell, and the fingers stayed as they were.
        let fingers = way_out(&Cause::Needs(unmet("gripper.open", None)), None);
        assert!(fingers.ends_with("`open_gripper()`"), "{fingers}");
        // A height that was asked for is no matter of room.
        let high = way_out(&Cause::Promise(unmet("height(jar) >= 30 cm", None)), None);
        assert!(high.starts_with("ask for less"), "{high}");
        let beside = way_out(&Cause::Promise(unmet("rests_on(jar, tray)", None)), None);
        assert!(beside.contains("matter of room"), "{beside}");
        let heavy = way_out(&Cause::TooHeavy("too heavy".into()), None);
        assert!(heavy.contains("lighter"), "{heavy}");
        let no_way = |why| Cause::NoWay(NoWay { what: "to get there".into(), why });
        let (held, angle, most) = ("jar".to_owned(), 0.9, 0.14);
        let tilted = Tilted { held: held.clone(), is_vessel: true, angle, most };
        assert!(way_out(&no_way(Why::Tilted(tilted)), None).ends_with("`untilt(jar)`"));
        let says = "the goal is in collision: shoulder_link and jar overlap by 16.3 mm".into();
        let home = no_way(Why::IntoHeld { held, says });
        assert!(way_out(&home, None).ends_with("`place(jar)`"));
        let (by, vessel) = ("hand with bin".into(), "bin".into());
        let walls = way_out(&no_way(Why::Walls { tried: 60, by, vessel }), None);
        assert!(walls.contains("between the walls of `bin`"), "{walls}");
        let near = |which: &str| {
            let (first, second) = ("hand".into(), "table".into());
            no_way(Why::TooNear(Box::new(TooNear {
                which: which.into(),
                first,
                second,
                apart: 0.002,
                kept: 0.04,
            })))
        };
        assert!(way_out(&near("goal"), None).starts_with("hand has to be farther from table"));
        assert!(way_out(&near("start"), None).starts_with("make room around the arm"));
        let poured = Cause::Promise(unmet("volume(cup) >= 81 mL", Some(-27e-6)));
        let water = |spilt| InTwin { vessels: vec![("cup".into(), 54e-6)], spilt };
        assert!(way_out(&poured, Some(&water(25e-6))).contains("wider vessel"));
        assert!(way_out(&poured, Some(&water(0.0))).contains("stayed where it was"));
        assert!(water(25e-6).to_string().ends_with("cup 54.0 mL, spilt 25.0 mL"));
    }
}
