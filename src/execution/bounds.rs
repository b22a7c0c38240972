//! What a script may ask for, also one that a stranger wrote: an engine in which nothing reaches further than
//! the arm, the ranges of arguments, and how much is kept of what a script says and remembers.
//!
//! An argument that is out of its range is refused in the line that gives it, with the range.

use nalgebra::{UnitVector3, Vector3};
use rhai::module_resolvers::DummyModuleResolver;
use rhai::{Array, Dynamic, Engine, EvalAltResult, Map};

use super::path::Path;
use super::plan::{Grasp, Leg, Placement, Pour, Push, Stir, Stroke, Wipe};
use super::refusal::{NoMemory, OutOfRange, Refusal};
use super::tool_pose::ToolPose;

/// How many operations of the engine a script may take.
pub(super) const OPERATIONS: u64 = 2_000_000;
/// How deep functions may call each other.
pub(super) const CALLS: usize = 32;
/// How many lines of one script may act: a loop of sips is done in a hundred.
pub(super) const ACTS: usize = 1_000;
/// How many plans one script may ask for.
pub(super) const PLANS: usize = 200;
/// How many notes one script may leave, and of how many characters.
pub(super) const NOTES: (usize, usize) = (100, 400);
/// How many things actions may remember, and with how many characters in a name.
pub(super) const MEMORIES: (usize, usize) = (64, 64);
/// How many parts a thing that is remembered may have, and how deep they may lie in each other.
const PARTS: (usize, usize) = (2_000, 8);

type Fallible<T> = Result<T, Refusal>;

/// Makes an engine for scripts: no files, no clock, no other scripts, and limits on everything that grows.
pub(super) fn engine() -> Engine {
    let mut engine = Engine::new();
    engine.set_max_operations(OPERATIONS);
    engine.set_max_call_levels(CALLS);
    engine.set_max_expr_depths(64, 32);
    engine.set_max_functions(200);
    engine.set_max_variables(200);
    engine.set_max_string_size(16 * 1024);
    engine.set_max_array_size(2_000);
    // A part that is set by `m[k] = v` has its own size looked at and not that of `m`, which waits for the next word that is
    // called on `m` or gives it back. A loop of nothing else ends by its operations.
    engine.set_max_map_size(200);
    engine.set_module_resolver(DummyModuleResolver::new());
    // `curry` would let a function hold itself, twice as large each time. Functions that capture what is around
    // them are left out of the engine for the same reason (its feature `no_closure`).
    for word in ["import", "export", "eval", "curry"] {
        engine.disable_symbol(word);
    }
    engine
        .register_fn("sleep", |_: i64| refused::<()>(&Refusal::Sleep))
        .register_fn("sleep", |_: f64| refused::<()>(&Refusal::Sleep))
        .register_fn("timestamp", || refused::<()>(&Refusal::NoClock));
    engine
}

/// Gives up in the place of a script: a script that catches it gets the words.
fn refused<T>(why: &Refusal) -> Result<T, Box<EvalAltResult>> {
    Err(why.to_string().into())
}

/// The least and the most that an argument may be, SI.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    least: f64,
    most: f64,
    /// The unit it is said in, and what one of it is in SI.
    unit: (&'static str, f64),
}

impl Range {
    pub(super) const fn new(least: f64, most: f64, unit: (&'static str, f64)) -> Self {
        Self { least, most, unit }
    }

    /// Returns the value if it is in the range: NaN is in none.
    ///
    /// # Errors
    ///
    /// Says what was given to which `word`, and the range.
    pub(super) fn check(&self, word: &str, what: &str, value: f64) -> Fallible<f64> {
        if (self.least..=self.most).contains(&value) {
            return Ok(value);
        }
        let (unit, one) = self.unit;
        Err(Refusal::OutOfRange(OutOfRange {
            word: word.to_owned(),
            what: what.to_owned(),
            value: value / one,
            range: [self.least / one, self.most / one],
            unit,
        }))
    }
}

const DEG: (&str, f64) = ("deg", std::f64::consts::PI / 180.0);

/// A share of full speed: below this an arm hardly moves.
pub(super) const SPEED: Range = Range::new(0.02, 1.0, ("of full speed", 1.0));
/// How fast the hand turns.
pub(super) const RATE: Range = Range::new(0.5 * DEG.1, 180.0 * DEG.1, ("deg/s", DEG.1));
/// How far what is carried may lean.
pub(super) const TILT: Range = Range::new(0.0, 180.0 * DEG.1, DEG);
/// How the tool is pitched for a grasp.
pub(super) const PITCH: Range = Range::new(-90.0 * DEG.1, 90.0 * DEG.1, DEG);
/// A joint position; plans and limits know each joint's own range.
pub(super) const ANGLE: Range = Range::new(-720.0 * DEG.1, 720.0 * DEG.1, DEG);
/// Room between two things.
pub(super) const CLEARANCE: Range = Range::new(-0.1, 1.0, ("m", 1.0));
/// A straight way; no arm that is known reaches further from one side to the other.
pub(super) const WAY: Range = Range::new(0.0, 2.0, ("m", 1.0));
/// A place; twice as far as any arm that is known reaches.
const PLACE: Range = Range::new(-4.0, 4.0, ("m", 1.0));
/// A turn of the hand, either way round.
pub(super) const TURN: Range = Range::new(-360.0 * DEG.1, 360.0 * DEG.1, DEG);
/// What the joints are to feel: less is lost in their noise, and more is pressed with than feeling needs.
pub(super) const FORCE: Range = Range::new(1.0, 40.0, ("N", 1.0));
/// How long the arm holds still.
pub(super) const WAIT: Range = Range::new(0.0, 600.0, ("s", 1.0));
/// How long it weighs: one reading at least.
pub(super) const HEFT: Range = Range::new(0.02, 60.0, ("s", 1.0));
/// A place on a path; a script may ask for a little before its beginning, and gets the beginning.
pub(super) const SHARE: Range = Range::new(-1.0, 2.0, ("", 1.0));
/// A flow: a litre a second either way, more than any arm pours.
pub(super) const FLOW: Range = Range::new(-1e-3, 1e-3, ("mL/s", 1e-6));
/// Water, also less than none where a sum runs below it.
pub(super) const VOLUME: Range = Range::new(-0.1, 0.1, ("mL", 1e-6));
/// A mass as it was weighed, also less than none.
pub(super) const MASS: Range = Range::new(-5.0, 50.0, ("kg", 1.0));

/// Returns a number, whole or not.
///
/// # Errors
///
/// Says what an argument is instead.
pub(super) fn number(word: &str, what: &str, value: &Dynamic) -> Fallible<f64> {
    let (word, what) = (word.to_owned(), what.to_owned());
    as_number(value).map_err(|found| Refusal::NotANumber { word, what, found })
}

fn as_number(value: &Dynamic) -> Result<f64, &'static str> {
    value.as_float().or_else(|_| value.as_int().map(|whole| whole as f64))
}

/// Returns the numbers of an array.
///
/// # Errors
///
/// Says which of them is none.
pub(super) fn numbers(word: &str, array: &Array) -> Fallible<Vec<f64>> {
    let number = |(at, value): (usize, &Dynamic)| {
        as_number(value).map_err(|found| Refusal::NoNumber {
            word: word.to_owned(),
            at: at + 1,
            found,
        })
    };
    array.iter().enumerate().map(number).collect()
}

/// Returns one joint position for each of `n` joints.
///
/// # Errors
///
/// Says how many there should be, or which is none.
pub(super) fn joints(word: &str, array: &Array, n: usize) -> Fallible<Vec<f64>> {
    let q = numbers(word, array)?;
    if q.len() != n {
        return Err(Refusal::Joints { word: word.to_owned(), joints: n, given: q.len() });
    }
    for (joint, q) in q.iter().enumerate() {
        ANGLE.check(word, &format!("joint {}", joint + 1), *q)?;
    }
    Ok(q)
}

/// Returns a straight way.
///
/// # Errors
///
/// Says what it should be.
pub(super) fn way(word: &str, array: &Array) -> Fallible<[f64; 3]> {
    let by = numbers(word, array)?;
    let [x, y, z] = by[..] else {
        return Err(Refusal::Way { word: word.to_owned(), given: by.len() });
    };
    WAY.check(word, "the length", x.hypot(y).hypot(z))?;
    Ok([x, y, z])
}

/// Returns a place.
///
/// # Errors
///
/// Says what it should be.
pub(super) fn place(word: &str, array: &Array) -> Fallible<[f64; 3]> {
    let at = numbers(word, array)?;
    let [x, y, z] = at[..] else {
        return Err(Refusal::Way { word: word.to_owned(), given: at.len() });
    };
    for (along, value) in ["x", "y", "z"].into_iter().zip([x, y, z]) {
        PLACE.check(word, along, value)?;
    }
    Ok([x, y, z])
}

/// Returns a direction.
///
/// # Errors
///
/// Says what it should be.
pub(super) fn axis(word: &str, array: &Array) -> Fallible<UnitVector3<f64>> {
    let at = numbers(word, array)?;
    let [x, y, z] = at[..] else {
        return Err(Refusal::Way { word: word.to_owned(), given: at.len() });
    };
    let axis = Vector3::new(x, y, z);
    let known = UnitVector3::try_new(axis, 1e-9).filter(|axis| axis.iter().all(|x| x.is_finite()));
    known.ok_or_else(|| Refusal::Axis { word: word.to_owned() })
}

/// Returns a note as it is kept: of many characters the first.
pub(super) fn short(text: &str) -> String {
    let (_, most) = NOTES;
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}

/// Returns a value as it may be remembered, by itself: what a later action recalls is not changed by this one
/// any more, and is no handle of an arm, which would then move another than the one that is meant.
///
/// # Errors
///
/// Says what it is instead.
pub(super) fn memory(name: &str, value: Dynamic) -> Fallible<Dynamic> {
    let (_, longest) = MEMORIES;
    if name.is_empty() || name.chars().count() > longest {
        return Err(Refusal::MemoryName { longest });
    }
    let mut left = PARTS.0;
    plain(value, PARTS.1, &mut left).map_err(|why| Refusal::Memory { name: short(name), why })
}

fn plain(value: Dynamic, depth: usize, left: &mut usize) -> Result<Dynamic, NoMemory> {
    *left = left.checked_sub(1).ok_or(NoMemory::Parts { most: PARTS.0 })?;
    let value = value.flatten();
    if value.is_array() || value.is_map() {
        let deeper = depth.checked_sub(1).ok_or(NoMemory::Deep { most: PARTS.1 })?;
        if let Some(map) = value.read_lock::<Map>() {
            let parts =
                map.iter().map(|(key, part)| Ok((key.clone(), plain(part.clone(), deeper, left)?)));
            return Ok(parts.collect::<Result<Map, NoMemory>>()?.into());
        }
        let parts = value.into_array().unwrap_or_default().into_iter();
        let parts = parts.map(|part| plain(part, deeper, left));
        return Ok(parts.collect::<Result<Array, NoMemory>>()?.into());
    }
    let is_value = value.is_unit()
        || value.is_bool()
        || value.is_int()
        || value.is_float()
        || value.is_char()
        || value.is_string()
        || value.is::<Grasp>()
        || value.is::<Pour>()
        || value.is::<Placement>()
        || value.is::<Push>()
        || value.is::<Leg>()
        || value.is::<Stir>()
        || value.is::<Stroke>()
        || value.is::<Wipe>()
        || value.is::<Path>()
        || value.is::<ToolPose>();
    if is_value { Ok(value) } else { Err(NoMemory::Handle) }
}
