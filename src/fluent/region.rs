//! Where something may stand, as the language says it: `table`, `tray`, `left_of(cup)`, `between(a, b)`.
//!
//! A region is made here with its directions in the world; what is inside is [`crate::world::Region`]'s to say.

use nalgebra::Vector3;

use super::builtin::{self, Standing};
use super::eval::{self, Comparison, Value};
use super::reading::{Error, Reading};
use super::{Evaluator, wording};
use crate::language::ast::Expr;
use crate::units::{Dimension, Quantity};
use crate::world::region::{Bearer, TABLE};
use crate::world::{Region, support};

/// An object rests on what is at most this far below it, m: what `upright` allows (`stdlib/fluents/std.task`).
const STANDS: f64 = 0.005;

/// Who looks when somebody says left.
#[derive(Debug, Clone, Copy)]
enum View {
    Robot,
    Camera,
}

/// Returns the region that an argument names.
pub(super) fn of(on: &Evaluator<'_>, arg: &(&Expr, Value)) -> Result<Region, Error> {
    match &arg.1 {
        Value::Region(region) => Ok(region.clone()),
        Value::Thing(name) => Ok(Region::On(name.clone())),
        Value::Place(place) => Ok(match place.at {
            Some(at) => Region::Point([at.x, at.y]),
            None => Region::Unknown(place.of.clone()),
        }),
        Value::Word(word) => Err(eval::unknown_name(on, word)),
        other => Err(eval::kind(arg.0, other, "a place")),
    }
}

/// Returns the region of a relation: `left_of(cup)`, `point(50 cm, 0 cm)`.
pub(super) fn relation(
    on: &Evaluator<'_>,
    name: &str,
    args: &[(&Expr, Value)],
) -> Result<Value, Error> {
    let thing = |at: usize| -> Result<String, Error> {
        let name = builtin::thing(on, &args[at])?;
        builtin::known_object(on, name).map(|known| known.object.name.clone())
    };
    Ok(Value::Region(match name {
        "point" => Region::Point([length(&args[0])?, length(&args[1])?]),
        "between" => Region::Between(thing(0)?, thing(1)?),
        "next_to" => Region::Beside { of: thing(0)?, way: None },
        "start_of" => start_of(on, &thing(0)?),
        "away_from" => {
            let mut circles = Vec::new();
            for name in [thing(0)?, thing(1)?] {
                let Region::Spot { at: [x, y], .. } = start_of(on, &name) else {
                    return Ok(Value::Region(Region::Unknown(name)));
                };
                let radius = on.scene.object(&name).map_or(0.0, |o| o.shape.outer_radius());
                circles.push([x, y, radius]);
            }
            Region::Away(circles)
        }
        side => {
            let way = way(on, side, view(args.get(1))?);
            Region::Beside { of: thing(0)?, way: Some(way) }
        }
    }))
}

/// Where a thing stood when the run began, and on what.
fn start_of(on: &Evaluator<'_>, name: &str) -> Region {
    let pose = on.start.object(name).and_then(|known| known.world_from_object);
    let (Some(object), Some(pose)) = (on.scene.object(name), pose) else {
        return Region::Unknown(name.to_owned());
    };
    let below = support::below(on.scene, &on.start.objects, object, &pose);
    Region::Spot { at: pose.origin().xy().into(), on: below.name }
}

fn length(arg: &(&Expr, Value)) -> Result<f64, Error> {
    match &arg.1 {
        Value::Measure(measure) if measure.dimension == Dimension::LENGTH => {
            measure.value.ok_or_else(|| eval::kind(arg.0, &arg.1, wording::A_KNOWN_LENGTH))
        }
        other => Err(eval::kind(arg.0, other, wording::A_KNOWN_LENGTH)),
    }
}

fn view(arg: Option<&(&Expr, Value)>) -> Result<View, Error> {
    let Some((expr, value)) = arg else { return Ok(View::Robot) };
    match value {
        Value::Word(word) | Value::Thing(word) if word == "robot" => Ok(View::Robot),
        Value::Word(word) | Value::Thing(word) if word == "camera" => Ok(View::Camera),
        other => Err(eval::kind(expr, other, wording::A_VIEW)),
    }
}

/// Returns the direction of a side in the plane of the table, of length 1, as the robot looks from its base or as the
/// picture shows it: what is lower in the picture is in front.
fn way(on: &Evaluator<'_>, side: &str, view: View) -> [f64; 2] {
    let (left, nearer) = match view {
        View::Robot => {
            let base = on.scene.world_from_base.rotation();
            (base * Vector3::y(), base * -Vector3::x())
        }
        View::Camera => {
            let camera = on.scene.camera.world_from_camera.rotation();
            (camera * -Vector3::x(), camera * Vector3::y())
        }
    };
    let way = match side {
        "left_of" => left,
        "right_of" => -left,
        "in_front_of" => nearer,
        _ => -nearer,
    };
    // A camera that looks along the table has no depth to speak of; its picture's left still is a direction.
    way.xy().try_normalize(1e-9).unwrap_or_else(|| left.xy()).into()
}

/// Whether a thing stands in a region.
pub(super) fn rests_on(
    on: &Evaluator<'_>,
    expr: &Expr,
    a: &Standing<'_>,
    region: &Region,
) -> Value {
    let Some((drop, below)) = builtin::support(on, a) else {
        return builtin::yes_no(expr, None, &builtin::unseen(&[a]));
    };
    let objects = &on.state.objects;
    let unseen = |name: &str| builtin::yes_no(expr, None, &wording::place(name));
    let stands = match region.bearer(on.scene, objects) {
        Err(lost) => return unseen(&lost.0),
        Ok(Bearer::This(name)) if is_lost(on, &name) => return unseen(&name),
        Ok(Bearer::This(name)) => below.name.as_deref().unwrap_or(TABLE) == name,
        Ok(Bearer::Any) => true,
    };
    if !stands {
        return builtin::yes_no(expr, Some(false), "");
    }
    let sigma = builtin::over_support(a, drop);
    let rests = builtin::limit(on, expr, drop, STANDS, STANDS - drop, sigma);
    let Value::Truth(rests) = rests else { return rests };
    let rests = rests.about(wording::ITS_HEIGHT);
    let sigma_of = |others: &[&str]| {
        let others = others.iter().filter_map(|name| on.state.object(name));
        others.map(|other| other.std).fold(a.sigma, f64::hypot)
    };
    let rests = match &below.name {
        Some(name) => {
            let edge = within(on, expr, below.inset, sigma_of(&[name]));
            rests.joined(edge.about(wording::ITS_EDGE), true)
        }
        None => rests,
    };
    let at = a.pose.map_or([f64::NAN; 2], |pose| pose.origin().xy().into());
    let inside = match region.margin(on.scene, objects, a.object, at) {
        Err(lost) => return unseen(&lost.0),
        Ok(inside) if inside.is_infinite() => return Value::Truth(Box::new(rests)),
        Ok(inside) => inside,
    };
    let sigma = sigma_of(&region.things());
    let place = within(on, expr, inside, sigma).about(wording::ITS_PLACE);
    Value::Truth(Box::new(rests.joined(place, true)))
}

/// Whether nobody knows where a thing of the scene is.
fn is_lost(on: &Evaluator<'_>, name: &str) -> bool {
    on.scene.object(name).is_some()
        && on.state.object(name).is_none_or(|known| known.world_from_object.is_none())
}

/// A reading of how far inside something is, m.
fn within(on: &Evaluator<'_>, expr: &Expr, inside: f64, sigma: f64) -> Reading {
    let found = Comparison {
        value: None::<Quantity>,
        limit: None,
        margin: Some(inside).filter(|inside| inside.is_finite()),
        dimension: Dimension::LENGTH,
        sigma: if sigma.is_finite() { sigma } else { 0.0 },
        tolerance: eval::usual_tolerance(Dimension::LENGTH),
        is_strict: false,
        grows: None,
        unknown: None,
    };
    eval::with_margin(on, expr, &found)
}
