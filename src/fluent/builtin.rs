//! The functions that fluents are made of: heights, distances, volumes, contacts.
//!
//! What each means is said at its arm of [`call`]. Positions carry their standard deviation along; a tilt
//! is taken to be as uncertain as the position over the object's height.

use nalgebra::Vector3;

use super::eval::{self, Comparison, Measure, Value};
use super::reading::{Error, Reading};
use super::{Evaluator, region, rim, wording};
use crate::language::ast::{Call, Expr};
use crate::language::text;
use crate::units::{Dimension, Quantity};
use crate::world::support::{self, Support};
use crate::world::{Object, Pose, frame};

const LENGTH: Dimension = Dimension { length: 1, mass: 0, time: 0, angle: 0, current: 0, pixel: 0 };
const VOLUME: Dimension = Dimension { length: 3, ..LENGTH };
const ANGLE: Dimension = Dimension { length: 0, angle: 1, ..LENGTH };
const SPEED: Dimension = Dimension { time: -1, ..LENGTH };

/// A gripper counts as open from this share of its stroke: wider than the widest thing it can hold.
const OPEN: f64 = 0.8;
/// An object stands on the table when its lowest point is this close to it, m.
const TOUCHES: f64 = 0.003;
/// What is less than this above what bears it was put down, m.
const HANGS: f64 = 0.03;
/// What is so near to what bears it was put there by sight or by the hand that let it go, m: rounding of its pose.
const STOOD: f64 = 1e-6;
/// A level hand takes things this high above the table, m: its box reaches 37.5 mm below the point between the fingers
/// (`gen3_2f85.urdf`), and 17.5 mm are left to the table.
const LEVEL_HAND: f64 = 0.055;
/// A place: a point, or while a vessel stands the whole rim any of which may become the lip.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// m, in the world; `None` when nobody knows.
    pub(super) at: Option<Vector3<f64>>,
    /// Other points that will do as well.
    open: Vec<Vector3<f64>>,
    sigma: f64,
    /// What moves when the place moves.
    pub(super) of: String,
}

/// A thing of the scene as it stands.
pub(super) struct Standing<'a> {
    pub(super) object: &'a Object,
    pub(super) pose: Option<Pose<frame::World, frame::Object>>,
    pub(super) sigma: f64,
}

/// Calls a function of the language.
pub(super) fn call(
    on: &Evaluator<'_>,
    expr: &Expr,
    call: &Call,
    depth: usize,
) -> Result<Value, Error> {
    let name = call.name.text.as_str();
    let wanted = match name {
        "spilt" | "opening" => 0..=0,
        "contact" | "distance" | "offset" | "gap" | "rests_on" | "between" | "point"
        | "away_from" => 2..=2,
        "reachable" | "left_of" | "right_of" | "in_front_of" | "behind" => 1..=2,
        "height" | "drop" | "lip" | "center" | "rim" | "tilt" | "volume" | "filled"
        | "capacity" | "visible" | "tall" | "held" | "width" | "speed" | "next_to" | "start_of"
        | "stirring" | "swept" | "drawn" | "travel" | "handed" => 1..=1,
        _ => return Err(Error::UnknownFunction { name: name.to_owned() }),
    };
    if !wanted.contains(&call.args.len()) {
        let message = wording::wrong_count(name, *wanted.end(), call.args.len());
        return Err(Error::Arguments { message });
    }
    let mut args = Vec::new();
    for arg in &call.args {
        let expr = eval::single(call, arg)?;
        args.push((expr, eval::value(on, expr, depth)?));
    }
    match name {
        // Whether two things touch.
        "contact" => contact(on, expr, thing(on, &args[0])?, thing(on, &args[1])?),
        "height" => height(on, thing(on, &args[0])?).map(Value::Measure),
        // Whether a thing stands in a region: on the table, on another or in it, beside it.
        "rests_on" => {
            let region = region::of(on, &args[1])?;
            Ok(region::rests_on(on, expr, &standing(on, &args[0])?, &region))
        }
        // Between the middles of two things, seen from above.
        "distance" => Ok(Value::Measure(apart(&middle(on, &args[0])?, &middle(on, &args[1])?))),
        // Between two places, seen from above.
        "offset" => Ok(Value::Measure(apart(&place(on, &args[0])?, &place(on, &args[1])?))),
        "gap" => Ok(Value::Measure(gap(&standing(on, &args[0])?, &standing(on, &args[1])?))),
        // Water on the table.
        "spilt" => Ok(Value::Measure(known(on.state.spilt, VOLUME, 0.0, None, wording::spilt))),
        // Between the finger pads.
        "opening" => Ok(Value::Measure(Measure::exact(on.state.opening, LENGTH))),
        "next_to" | "left_of" | "right_of" | "in_front_of" | "behind" | "between" | "point"
        | "start_of" | "away_from" => region::relation(on, name, &args),
        // Let go while somebody pulled, and not seen standing anywhere since.
        "handed" => {
            let a = standing(on, &args[0])?;
            let stands = support(on, &a).is_some_and(|(drop, _)| drop.abs() < HANGS);
            let handed = on.facts.handed(&a.object.name);
            let handed = if stands { Some(false) } else { handed };
            Ok(yes_no(expr, handed, &wording::work(&a.object.name)))
        }
        "lip" | "center" => Ok(Value::Place(on_the_rim(name, &standing(on, &args[0])?))),
        "visible" | "held" | "tall" => Ok(said_of(on, expr, name, &standing(on, &args[0])?)),
        // Whether planning finds a way to it.
        "reachable" => {
            let face = args.get(1).and_then(|(_, value)| match value {
                Value::Word(word) | Value::Thing(word) => Some(word.as_str()),
                _ => None,
            });
            let object = standing(on, &args[0])?.object;
            match on.facts.reachable(&object.name, face) {
                Some(fact) => Ok(Value::Truth(Box::new(from_fact(expr, fact)))),
                None => Ok(yes_no(expr, None, wording::NO_WAY_PLANNED)),
            }
        }
        _ => measured(on, name, &standing(on, &args[0])?).map(Value::Measure),
    }
}

/// How far the lowest lip point of the first is above the highest rim point of the second.
fn gap(a: &Standing<'_>, b: &Standing<'_>) -> Measure {
    let sigma = a.sigma.hypot(b.sigma);
    let rise = a.pose.zip(b.pose).map(|(pa, pb)| {
        let rim = rim::outline(b.object, &pb);
        let top = rim.iter().fold(f64::NEG_INFINITY, |high, p| high.max(p.z));
        rim::lip(a.object, &pa).height - top
    });
    let grows = Some((a.object.name.clone(), Vector3::z()));
    known(rise, LENGTH, sigma, grows, || unseen(&[a, b]))
}

/// A place on the rim of a vessel.
fn on_the_rim(name: &str, a: &Standing<'_>) -> Place {
    let (sigma, of) = (a.sigma, a.object.name.clone());
    if name == "center" {
        let at = a.pose.map(|pose| rim::rim_centre(a.object, &pose));
        return Place { at, open: Vec::new(), sigma, of };
    }
    // Where water leaves a vessel; while it stands, anywhere on its rim.
    let lip = a.pose.map(|pose| rim::lip(a.object, &pose));
    let at = lip.as_ref().map(|lip| lip.point);
    Place { at, open: lip.map(|lip| lip.open).unwrap_or_default(), sigma, of }
}

/// What is true or false of one object.
fn said_of(on: &Evaluator<'_>, expr: &Expr, name: &str, a: &Standing<'_>) -> Value {
    let object = a.object;
    match name {
        // Seen by the camera; failing that, its place is known. Where nothing has a place, nobody has looked yet.
        "visible" => {
            let has_looked = on.state.objects.iter().any(|each| each.world_from_object.is_some());
            let known = has_looked.then_some(a.pose.is_some());
            let seen = on.facts.visible(&object.name).or(known);
            yes_no(expr, seen, wording::NO_PHOTO)
        }
        "held" => yes_no(expr, Some(on.state.held.as_deref() == Some(&object.name)), ""),
        // At least as high as it is wide, and as a level hand is above the table.
        _ => {
            let round = 2.0 * object.shape.body().outer_radius();
            let wide = object.shape.faces().map_or(round, |[x, y]| x.max(y));
            let high = object.shape.height();
            let least = wide.max(LEVEL_HAND);
            limit(on, expr, high, least, high - least, 0.0)
        }
    }
}

/// A measure of one object.
fn measured(on: &Evaluator<'_>, name: &str, a: &Standing<'_>) -> Result<Measure, Error> {
    let object = a.object;
    let cavity = |what| object.cavity.ok_or_else(|| not_a_vessel(object, what));
    Ok(match name {
        // Inner radius of the rim: of the largest circle that fits.
        "rim" => {
            let inside = object.inside().ok_or_else(|| not_a_vessel(object, "rim"))?;
            Measure::exact(inside.rim_radius(), LENGTH)
        }
        // Between the object's axis and the vertical.
        "tilt" => {
            let sigma = a.sigma / object.shape.height().max(1e-3);
            let tilt = a.pose.map(|pose| pose.tilt());
            known(tilt, ANGLE, sigma, None, || unseen(&[a]))
        }
        // The lowest point of an object above what it would fall onto.
        "drop" => {
            let grows = Some((object.name.clone(), Vector3::z()));
            let drop = support(on, a).map(|(drop, _)| drop);
            let sigma = drop.map_or(a.sigma, |drop| over_support(a, drop));
            known(drop, LENGTH, sigma, grows, || unseen(&[a]))
        }
        // Water inside now.
        "volume" => {
            let water = on.state.object(&object.name).and_then(|o| o.water);
            known(water, VOLUME, 0.0, None, || wording::water(&object.name))
        }
        // Water inside when the run began, or as the scene says.
        "filled" => {
            let cavity = cavity("filling")?;
            let water = on.start.object(&object.name).and_then(|o| o.water);
            Measure::exact(water.unwrap_or(cavity.filled), VOLUME)
        }
        // Water it takes to the brim.
        "capacity" => Measure::exact(cavity("capacity")?.capacity, VOLUME),
        // The smallest width that a gripper would close on.
        "width" => Measure::exact(object.shape.width(), LENGTH),
        // How far a drawer is drawn, by the places of tray and case, and how far it can be.
        "drawn" => {
            let drawer =
                on.scene.drawer(&object.name).ok_or_else(|| not_a_drawer(object, "way"))?;
            let case = known_object(on, &drawer.case)?;
            let both = case.pose.zip(a.pose);
            let drawn = both.and_then(|(case, tray)| drawer.drawn(on.scene, &case, &tray));
            known(drawn, LENGTH, a.sigma, None, || unseen(&[&case, a]))
        }
        "travel" => {
            let drawer = on.scene.drawer(&object.name);
            Measure::exact(drawer.ok_or_else(|| not_a_drawer(object, "travel"))?.travel, LENGTH)
        }
        // How far something held went round in its water.
        "stirring" => {
            let turned = on.facts.stirred(&object.name);
            known(turned, ANGLE, 0.0, None, || wording::work(&object.name))
        }
        // The share of its top that a tool was led over.
        "swept" => {
            let share = on.facts.swept(&object.name);
            known(share, Dimension::NONE, 0.0, None, || wording::work(&object.name))
        }
        // How fast its middle moves.
        _ => {
            let speed = on.facts.speed(&object.name);
            known(speed, SPEED, 0.0, None, || wording::speed(&object.name))
        }
    })
}

/// `gripper.open`, `gripper.opening`, `table.height`.
pub(super) fn member(
    on: &Evaluator<'_>,
    expr: &Expr,
    of: &str,
    name: &str,
) -> Result<Value, Error> {
    match (of, name) {
        ("gripper", "open") => {
            let (opening, wide) = (on.state.opening, OPEN * on.facts.stroke());
            Ok(limit(on, expr, opening, wide, opening - wide, 0.0))
        }
        ("gripper", "opening") => Ok(Value::Measure(Measure::exact(on.state.opening, LENGTH))),
        ("table", "height") => Ok(Value::Measure(Measure::exact(0.0, LENGTH))),
        _ => Err(Error::UnknownName { name: format!("{of}.{name}"), suggestion: None }),
    }
}

fn contact(on: &Evaluator<'_>, expr: &Expr, a: &str, b: &str) -> Result<Value, Error> {
    if let Some(known) = on.facts.contact(a, b).or_else(|| on.facts.contact(b, a)) {
        return Ok(yes_no(expr, Some(known), ""));
    }
    // What the state says by itself.
    match (a, b) {
        ("gripper", "table") | ("table", "gripper") => {
            Ok(yes_no(expr, None, wording::TABLE_NOT_FELT))
        }
        ("gripper", object) | (object, "gripper") => {
            Ok(yes_no(expr, Some(on.state.held.as_deref() == Some(object)), ""))
        }
        ("table", object) | (object, "table") => {
            let standing = known_object(on, object)?;
            let Some(pose) = standing.pose else {
                return Ok(yes_no(expr, None, &unseen(&[&standing])));
            };
            let above = rim::lowest_of(standing.object, &pose).abs();
            Ok(limit(on, expr, above, TOUCHES, TOUCHES - above, standing.sigma))
        }
        (a, b) => {
            // Far apart is certain; close is for physics to say.
            let (a, b) = (known_object(on, a)?, known_object(on, b)?);
            let (Some(pa), Some(pb)) = (a.pose, b.pose) else {
                return Ok(yes_no(expr, None, &unseen(&[&a, &b])));
            };
            let ball = |o: &Object| o.shape.outer_radius().hypot(0.5 * o.shape.height());
            let between = (rim::middle(a.object, &pa) - rim::middle(b.object, &pb)).norm();
            let clear = between - ball(a.object) - ball(b.object);
            if clear > 2.0 * a.sigma.hypot(b.sigma) {
                return Ok(yes_no(expr, Some(false), ""));
            }
            Ok(yes_no(expr, None, wording::CLOSE))
        }
    }
}

/// Returns how far a thing would fall, m, and onto what.
pub(super) fn support(on: &Evaluator<'_>, a: &Standing<'_>) -> Option<(f64, Support)> {
    let pose = a.pose?;
    let below = support::below(on.scene, &on.state.objects, a.object, &pose);
    Some((rim::lowest_of(a.object, &pose) - below.height, below))
}

/// How far off the height of an object over what bears it may be, m, one standard deviation. What a photograph shows standing was
/// looked for at the heights of what bears things: it is off to a side, and may miss its bearer, but hangs no higher over it.
pub(super) fn over_support(a: &Standing<'_>, drop: f64) -> f64 {
    if drop.abs() < STOOD { 0.0 } else { a.sigma }
}

/// The lowest point of an object (the tool point of the gripper) above the table.
fn height(on: &Evaluator<'_>, name: &str) -> Result<Measure, Error> {
    let grows = Some((name.to_owned(), Vector3::z()));
    match name {
        "gripper" => {
            let mut m = Measure::exact(on.state.world_from_tool.origin().z, LENGTH);
            m.grows = grows;
            Ok(m)
        }
        "table" => Ok(Measure::exact(0.0, LENGTH)),
        name => {
            let a = known_object(on, name)?;
            let low = a.pose.map(|pose| rim::lowest_of(a.object, &pose));
            Ok(known(low, LENGTH, a.sigma, grows, || unseen(&[&a])))
        }
    }
}

/// The horizontal distance of two places, and the way it grows.
fn apart(a: &Place, b: &Place) -> Measure {
    let flat = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
    let sigma = a.sigma.hypot(b.sigma);
    let (Some(pa), Some(pb)) = (a.at, b.at) else {
        let lost = if a.at.is_none() { &a.of } else { &b.of };
        return Measure::unknown(LENGTH, wording::place(lost));
    };
    let mut between = flat(pa - pb);
    // Where any point of a rim will do, the nearest counts; both being open does not arise.
    let others = a.open.iter().map(|p| flat(p - pb)).chain(b.open.iter().map(|p| flat(pa - p)));
    let nearest = others.min_by(|x, y| x.norm().total_cmp(&y.norm()));
    if let Some(nearest) = nearest {
        between = nearest;
    }
    let grows = between.try_normalize(1e-9).map(|way| (a.of.clone(), way));
    Measure { value: Some(between.norm()), dimension: LENGTH, sigma, grows, unknown: None }
}

fn middle(on: &Evaluator<'_>, arg: &(&Expr, Value)) -> Result<Place, Error> {
    if let Value::Thing(name) = &arg.1 {
        if name == "gripper" {
            return Ok(tool(on));
        }
        let a = known_object(on, name)?;
        let at = a.pose.map(|pose| rim::middle(a.object, &pose));
        return Ok(Place { at, open: Vec::new(), sigma: a.sigma, of: name.clone() });
    }
    place(on, arg)
}

/// A place as such, or the origin of a thing.
fn place(on: &Evaluator<'_>, arg: &(&Expr, Value)) -> Result<Place, Error> {
    match &arg.1 {
        Value::Place(place) => Ok(place.clone()),
        Value::Thing(name) if name == "gripper" => Ok(tool(on)),
        Value::Thing(name) if name != "table" => {
            let a = known_object(on, name)?;
            let at = a.pose.map(|pose| pose.origin());
            Ok(Place { at, open: Vec::new(), sigma: a.sigma, of: name.clone() })
        }
        Value::Word(word) => Err(eval::unknown_name(on, word)),
        other => Err(eval::kind(arg.0, other, "a place")),
    }
}

fn tool(on: &Evaluator<'_>) -> Place {
    let at = Some(on.state.world_from_tool.origin());
    Place { at, open: Vec::new(), sigma: 0.0, of: "gripper".into() }
}

pub(super) fn thing<'v>(on: &Evaluator<'_>, arg: &'v (&Expr, Value)) -> Result<&'v str, Error> {
    match &arg.1 {
        Value::Thing(name) => Ok(name),
        Value::Word(word) => Err(eval::unknown_name(on, word)),
        other => Err(eval::kind(arg.0, other, "a thing")),
    }
}

fn standing<'a>(on: &Evaluator<'a>, arg: &(&Expr, Value)) -> Result<Standing<'a>, Error> {
    known_object(on, thing(on, arg)?)
}

pub(super) fn known_object<'a>(on: &Evaluator<'a>, name: &str) -> Result<Standing<'a>, Error> {
    let object = on.scene.object(name).ok_or_else(|| eval::unknown_name(on, name))?;
    let state = on.state.object(name);
    let finite = |p: &Pose<frame::World, frame::Object>| p.origin().iter().all(|v| v.is_finite());
    let pose = state.and_then(|s| s.world_from_object).filter(finite);
    let sigma = state.map_or(0.0, |s| s.std);
    Ok(Standing { object, pose, sigma: if sigma.is_finite() { sigma } else { 0.0 } })
}

fn known(
    value: Option<f64>,
    dimension: Dimension,
    sigma: f64,
    grows: Option<(String, Vector3<f64>)>,
    why: impl Fn() -> String,
) -> Measure {
    match value.filter(|v| v.is_finite()) {
        Some(value) => Measure { value: Some(value), dimension, sigma, grows, unknown: None },
        None => Measure::unknown(dimension, why()),
    }
}

pub(super) fn unseen(things: &[&Standing<'_>]) -> String {
    let lost = things.iter().find(|thing| thing.pose.is_none()).or(things.first());
    let name = lost.map_or("it", |thing| thing.object.name.as_str());
    wording::place(name)
}

fn not_a_drawer(object: &Object, what: &str) -> Error {
    Error::NotADrawer { object: object.name.clone(), what: what.to_owned() }
}

fn not_a_vessel(object: &Object, what: &str) -> Error {
    Error::NotAVessel { object: object.name.clone(), what: what.to_owned() }
}

pub(super) fn yes_no(expr: &Expr, truth: Option<bool>, why: &str) -> Value {
    Value::Truth(Box::new(Reading::plain(expr, truth, Some(why.to_owned()))))
}

/// A length against a limit, with the margin given.
pub(super) fn limit(
    on: &Evaluator<'_>,
    expr: &Expr,
    value: f64,
    limit: f64,
    margin: f64,
    sigma: f64,
) -> Value {
    let length = |value| Some(Quantity { value, dimension: LENGTH });
    let found = Comparison {
        value: length(value),
        limit: length(limit),
        margin: Some(margin).filter(|m| m.is_finite()),
        dimension: LENGTH,
        sigma,
        tolerance: eval::usual_tolerance(LENGTH),
        is_strict: false,
        grows: None,
        unknown: Some(wording::no_value_of(&text::expr(expr))),
    };
    Value::Truth(Box::new(eval::with_margin(on, expr, &found)))
}

fn from_fact(expr: &Expr, fact: super::Fact) -> Reading {
    let why = Some("not known".to_owned());
    let mut reading = Reading::plain(expr, fact.truth, why);
    if let Some(margin) = fact.margin.filter(|m| m.value.is_finite()) {
        reading.margin = Some(margin);
        reading.rank = margin.value / eval::usual_tolerance(margin.dimension);
        reading.terms[0].margin = Some(margin);
    }
    reading
}
