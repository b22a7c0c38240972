//! What every program may use without defining it: measured functions, objects, faces, members.
//!
//! This is the contract between the checker, which holds a program to it, and `fluent`, which
//! evaluates it. Nothing is evaluated here.

use crate::units::Dimension;

/// The type of a value in a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ty {
    /// A thing on the table, by the name of its type: `Object`, `Graspable`, `Container`, …
    Object(String),
    /// A number with its unit; a plain number has [`Dimension::NONE`].
    Quantity(Dimension),
    /// True, false or unknown.
    Bool,
    /// A place on or above the table. An object serves as one: where it stands.
    Place,
    /// A side to take hold of: `side`, `top`.
    Face,
    /// Who looks, for left and right: `robot`, `camera`.
    View,
    /// A text.
    Text,
    /// Not known, because something else is wrong; fits everything.
    Any,
}

/// A function that measures something.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    /// Its name.
    pub name: &'static str,
    /// Name and type of each parameter, in the spelling of programs.
    pub params: &'static [(&'static str, &'static str)],
    /// How many of them may be left out, from the last.
    pub optional: usize,
    /// The type of its value, in the spelling of programs: `Length`, `Bool`, `Place`, …
    pub result: &'static str,
    /// What it measures, in one line.
    pub doc: &'static str,
}

/// The root of all object types.
pub const OBJECT: &str = "Object";

/// The types that exist without a definition, beside the dimensions.
pub const TYPES: &[(&str, &str)] = &[
    (OBJECT, "Anything that stands on the table, the table and the gripper."),
    ("Place", "A place on or above the table; an object is one, and so is what lies beside it."),
    ("Face", "A side of an object to take hold of: `side` or `top`."),
    ("View", "Who looks, for left and right, in front and behind: `robot` or `camera`."),
    ("Bool", "True, false or unknown."),
    ("Text", "A text in quotes."),
];

/// Names that stand for something everywhere: name, type, one line.
pub const CONSTANTS: &[(&str, &str, &str)] = &[
    ("gripper", OBJECT, "The robot's gripper."),
    ("table", "Surface", "The table; its top is at height 0."),
    ("any", OBJECT, "Some object or other: `not holding(any)`."),
    ("side", "Face", "From the side, fingers level."),
    ("top", "Face", "From above, fingers down."),
    ("robot", "View", "As the robot looks from its base over the table."),
    ("camera", "View", "As the camera's picture shows it."),
];

/// Members of constants: object, member, type, one line.
pub const MEMBERS: &[(&str, &str, &str, &str)] = &[
    ("gripper", "open", "Bool", "The jaws are open."),
    (
        "table",
        "height",
        "Length",
        "Height of the table top, which is where heights are counted from.",
    ),
];

const fn of(
    name: &'static str,
    params: &'static [(&'static str, &'static str)],
    result: &'static str,
    doc: &'static str,
) -> Builtin {
    Builtin { name, params, optional: 0, result, doc }
}

/// A place on one side of a thing, as somebody sees it.
const fn side(name: &'static str, doc: &'static str) -> Builtin {
    Builtin { optional: 1, ..of(name, &[("o", OBJECT), ("view", "View")], "Place", doc) }
}

const ONE: &[(&str, &str)] = &[("o", OBJECT)];
const TWO: &[(&str, &str)] = &[("a", OBJECT), ("b", OBJECT)];

/// Everything that can be measured, in the order of a help page.
pub const FUNCTIONS: &[Builtin] = &[
    of("visible", ONE, "Bool", "The camera has found `o`."),
    Builtin {
        optional: 1,
        ..of(
            "reachable",
            &[("o", OBJECT), ("face", "Face")],
            "Bool",
            "The arm can take hold of `o`, from that face if one is given.",
        )
    },
    of("held", ONE, "Bool", "The fingers hold `o`."),
    of("contact", TWO, "Bool", "`a` and `b` touch."),
    of("tall", ONE, "Bool", "`o` is high enough to be held from the side."),
    of("height", ONE, "Length", "Height of the base of `o` above the table."),
    of(
        "drop",
        ONE,
        "Length",
        "How far `o` would fall if let go, onto the table or what is below it.",
    ),
    of("rests_on", &[("o", OBJECT), ("at", "Place")], "Bool", "`o` stands on `at`, or in it."),
    of("next_to", ONE, "Place", "Beside `o`, on any side of it: at most 12 cm away."),
    side("left_of", "Left of `o`, as the robot sees it, or the camera: at most 12 cm away."),
    side("right_of", "Right of `o`."),
    side("in_front_of", "In front of `o`: nearer to who looks."),
    side("behind", "Behind `o`: farther from who looks."),
    of("between", TWO, "Place", "Between `a` and `b`: the middle half of the way."),
    of(
        "point",
        &[("x", "Length"), ("y", "Length")],
        "Place",
        "A point of the table, in the world: `point(50 cm, -20 cm)`.",
    ),
    of(
        "away_from",
        TWO,
        "Place",
        "On the table, away from where `a` and `b` stood when the run began, so that others may stand there.",
    ),
    of("start_of", ONE, "Place", "Where `o` stood when the run began."),
    of("distance", TWO, "Length", "Horizontal distance between the axes of `a` and `b`."),
    of(
        "offset",
        &[("a", "Place"), ("b", "Place")],
        "Length",
        "Horizontal distance between two places.",
    ),
    of("gap", TWO, "Length", "How far the lowest point of the lip of `a` is above the rim of `b`."),
    of("lip", ONE, "Place", "The lowest point of the rim of `o`: where water leaves it."),
    of("center", ONE, "Place", "The centre of the rim of `o`."),
    of("rim", ONE, "Length", "Inner radius of the rim of `o`."),
    of("width", ONE, "Length", "How far the jaws must open to take hold of `o`."),
    of("opening", &[], "Length", "Opening between the jaws."),
    of("tilt", ONE, "Angle", "Angle between the axis of `o` and the vertical."),
    of("speed", ONE, "Speed", "How fast `o` moves."),
    of("volume", ONE, "Volume", "Water inside `o` now."),
    of("filled", ONE, "Volume", "Water inside `o` when the run began."),
    of("capacity", ONE, "Volume", "Water `o` can hold, to the brim."),
    of(
        "stirring",
        ONE,
        "Angle",
        "How far something held went round in the water of `o` since the run began.",
    ),
    of(
        "swept",
        ONE,
        "Number",
        "The share of the top of `o` over which closed fingers, or what they hold, were led touching it since the run began.",
    ),
    of(
        "handed",
        ONE,
        "Bool",
        "Somebody pulled at `o` when the fingers let it go, and it was not seen standing since.",
    ),
    of("drawn", ONE, "Length", "How far the drawer `o` is drawn out of its case."),
    of("travel", ONE, "Length", "How far the drawer `o` can be drawn."),
    of("spilt", &[], "Volume", "Water on the table."),
];

/// Returns the function of that name.
pub fn function(name: &str) -> Option<&'static Builtin> {
    FUNCTIONS.iter().find(|f| f.name == name)
}

/// Returns the type of the constant of that name, in the spelling of programs.
pub fn constant(name: &str) -> Option<&'static str> {
    CONSTANTS.iter().find(|(constant, ..)| *constant == name).map(|(_, ty, _)| *ty)
}

/// Returns the type of a constant's member, in the spelling of programs.
pub fn member(of: &str, name: &str) -> Option<&'static str> {
    MEMBERS.iter().find(|(object, member, ..)| *object == of && *member == name).map(|m| m.2)
}

impl Builtin {
    /// Returns `height(o: Object) -> Length`.
    pub fn signature(&self) -> String {
        let params: Vec<String> =
            self.params.iter().map(|(name, ty)| format!("{name}: {ty}")).collect();
        format!("{}({}) -> {}", self.name, params.join(", "), self.result)
    }
}

impl Ty {
    /// Reads a type as programs spell it; any other name is an object type, and none is not known.
    pub fn named(name: &str) -> Self {
        match name {
            "" => Self::Any,
            "Bool" => Self::Bool,
            "Place" => Self::Place,
            "Face" => Self::Face,
            "View" => Self::View,
            "Text" => Self::Text,
            name => {
                Dimension::named(name).map_or_else(|| Self::Object(name.into()), Self::Quantity)
            }
        }
    }

    /// Returns it in words for a sentence: `a length`, `a Container`, `true or false`.
    pub fn words(&self) -> String {
        match self {
            Self::Object(name) => {
                let vowel = name.starts_with(['A', 'E', 'I', 'O', 'U']);
                format!("{} {name}", if vowel { "an" } else { "a" })
            }
            Self::Quantity(dimension) => dimension.words(),
            Self::Bool => "true or false".into(),
            Self::Place => "a place".into(),
            Self::Face => "a face".into(),
            Self::View => "a view, `robot` or `camera`".into(),
            Self::Text => "a text".into(),
            Self::Any => "anything".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_name_stands_once_and_every_type_exists() {
        let names: BTreeSet<&str> =
            FUNCTIONS.iter().map(|f| f.name).chain(CONSTANTS.iter().map(|c| c.0)).collect();
        assert_eq!(names.len(), FUNCTIONS.len() + CONSTANTS.len());
        for function in FUNCTIONS {
            assert!(function.optional <= function.params.len());
            let types = function.params.iter().map(|p| p.1).chain([function.result]);
            for ty in types {
                let known = TYPES.iter().any(|(name, _)| *name == ty);
                assert!(known || Dimension::named(ty).is_some(), "{}: {ty}", function.name);
            }
        }
        assert_eq!(function("tilt").unwrap().signature(), "tilt(o: Object) -> Angle");
    }
}
