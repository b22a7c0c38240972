//! What sentences are read with: what is on the table and where, what was taught, what was named before.

use super::super::ast::{Call, ExprKind, SceneThing};
use super::super::library::Library;
use super::template::Template;

/// A thing on the table as sentences name it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Thing {
    /// Its name in programs: `cup2`.
    pub name: String,
    /// Its type: `Container`.
    pub kind: String,
    /// What it looks like: `blue cup`; may be empty.
    pub looks: String,
}

/// What people call things of a type beside its name.
const CALLED: &[(&str, &str)] = &[("container", "vessel")];

impl Thing {
    /// Returns what a scene says of a thing.
    pub(crate) fn of(thing: &SceneThing) -> Self {
        let looks = thing.properties.iter().find(|property| property.name.text == "looks");
        let looks = looks.and_then(|property| match property.value.first().map(|v| &v.kind) {
            Some(ExprKind::Text(text)) => Some(text.clone()),
            _ => None,
        });
        Self {
            name: thing.name.text.clone(),
            kind: thing.ty.text.clone(),
            looks: looks.unwrap_or_default(),
        }
    }

    /// Returns what a person calls it.
    pub(super) fn shown(&self) -> &str {
        if self.looks.is_empty() { &self.name } else { &self.looks }
    }

    /// Returns every word that may be used of it.
    pub(super) fn words(&self) -> Vec<String> {
        let name = self.name.to_lowercase();
        let bare = name.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
        let parts = name.split('_').map(str::to_owned);
        let looks = self.looks.to_lowercase();
        let looks = looks.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let kind = self.kind.to_lowercase();
        let called = CALLED.iter().filter(|(known, _)| *known == kind).map(|(_, word)| *word);
        let called: Vec<String> = called.map(str::to_owned).collect();
        parts.chain([bare, kind]).chain(called).chain(looks).collect()
    }
}

/// Where a thing stands, how big it is and what it holds, as the robot looks from its base.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spot {
    /// Its middle, m to the left of the base.
    pub left: f64,
    /// Its middle, m ahead of the base.
    pub ahead: f64,
    /// Its middle in the world, x and y, m.
    pub at: [f64; 2],
    /// Where ahead is, rad about z of the world.
    pub facing: f64,
    /// The radius of the upright cylinder around it, m.
    pub radius: f64,
    /// Its height, m.
    pub height: f64,
    /// Its volume from outside, m³.
    pub volume: f64,
    /// What it stands on or in; `None` is the table.
    pub on: Option<String>,
    /// Water in it, m³; `None` when nobody knows.
    pub water: Option<f64>,
}

/// A sentence that a person has taught, and the call it stands for: `"empty the {o}" = pour(o, cup)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Phrase {
    /// The sentence.
    pub template: Template,
    /// The call; a slot's name in it stands for what the slot holds.
    pub call: Call,
}

/// What sentences are read with.
#[derive(Clone, Copy)]
pub struct Knowledge<'a> {
    /// Tasks with their templates.
    pub library: &'a Library,
    /// What is on the table.
    pub things: &'a [Thing],
    /// What has been taught.
    pub phrases: &'a [Phrase],
    /// What was handled last, which "it" means.
    pub it: Option<&'a str>,
    /// Says where a thing stands and what it holds, if somebody has seen it.
    pub spot: &'a dyn Fn(&str) -> Option<Spot>,
    /// Says why a call cannot be done now, if somebody knows: which need fails, and by how much.
    pub hindrance: &'a dyn Fn(&Call) -> Option<String>,
}

impl<'a> Knowledge<'a> {
    /// What a file says: tasks and things. Nothing was taught or handled, and nobody has seen where things stand or what can be done now.
    pub fn on_paper(library: &'a Library, things: &'a [Thing]) -> Self {
        let (spot, hindrance) = (&|_: &str| None, &|_: &Call| None);
        Self { library, things, phrases: &[], it: None, spot, hindrance }
    }
}

/// `a`, `a or b`, `a, b or c`.
pub(super) fn either(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}
