//! The words of a script, bound to the action context that its handles lend.
//!
//! What the words do is in [`super::context`], what may be asked of them in [`super::bounds`], and what a line of them
//! does in words in [`super::wording`]. Which there are is listed in [`crate::language::script_words`], for everyone.

use std::sync::{Arc, Mutex};

use rhai::{Array, Dynamic, Engine, NativeCallContext};

use super::bounds::{
    self, ANGLE, CLEARANCE, FLOW, FORCE, HEFT, MASS, PITCH, RATE, Range, SHARE, SPEED, TILT, TURN,
    VOLUME, WAIT, WAY,
};
use super::context::ActionContext;
use super::handle::{Arm, Camera, Fallible, Twin, lock, raise};
use super::path::Path;
use super::plan::{Grasp, Leg, Placement, Pour, Push, Stir, Stroke, Wipe};
use super::refusal::Refusal;
use super::tool_pose::ToolPose;
use super::wording;
use crate::trace::Deed;
use crate::world::Region;
use crate::world::region::TABLE;

/// Binds all of them.
pub(super) fn bind(engine: &mut Engine, context: &Arc<Mutex<ActionContext>>) {
    bind_values(engine);
    bind_work(engine);
    bind_poses(engine);
    bind_camera(engine);
    bind_twin(engine);
    bind_arm(engine);
    bind_memory(engine, context);
}

/// Returns an argument that is in its range, or raises what is wrong with it.
fn within(word: &str, what: &str, value: &Dynamic, range: Range) -> Fallible<f64> {
    let value = number(word, what, value)?;
    range.check(word, what, value).map_err(raise)
}

/// Returns a number, whole or not, or raises that an argument is none.
fn number(word: &str, what: &str, value: &Dynamic) -> Fallible<f64> {
    bounds::number(word, what, value).map_err(raise)
}

fn array(values: impl IntoIterator<Item = f64>) -> Array {
    values.into_iter().map(Dynamic::from).collect()
}

fn list<T: Clone + Send + Sync + 'static>(values: Vec<T>) -> Array {
    values.into_iter().map(Dynamic::from).collect()
}

/// What the planner finds.
fn bind_values(engine: &mut Engine) {
    engine
        .register_type_with_name::<Grasp>("Grasp")
        .register_get("before", |grasp: &mut Grasp| array(grasp.before.iter().copied()))
        .register_get("way_in", |grasp: &mut Grasp| Path::plain(grasp.way_in.clone()))
        .register_get("way_out", |grasp: &mut Grasp| {
            Path::plain(grasp.way_in.iter().rev().cloned().collect())
        })
        .register_get("clearance", |grasp: &mut Grasp| grasp.clearance)
        .register_get("face", |grasp: &mut Grasp| grasp.face().to_owned())
        .register_get("heading", |grasp: &mut Grasp| grasp.heading)
        .register_type_with_name::<Pour>("Pour")
        .register_get("start", |pour: &mut Pour| array(pour.start.iter().copied()))
        .register_get("turn", |pour: &mut Pour| {
            let (source, target) = (pour.source.clone(), pour.target.clone());
            Path::doing(pour.turn.clone(), Deed::Turned { source, target })
        })
        .register_get("back", |pour: &mut Pour| {
            Path::doing(pour.turn.iter().rev().cloned().collect(), Deed::TurnedBack)
        })
        .register_get("clearance", |pour: &mut Pour| pour.clearance)
        .register_fn("share_holding", |pour: &mut Pour, volume: Dynamic| {
            Ok(pour.share_holding(within("share_holding", "the volume", &volume, VOLUME)?))
                as Fallible<f64>
        })
        .register_fn("runs_on", |pour: &mut Pour, share: Dynamic, rate: Dynamic| {
            let share = within("runs_on", "the share", &share, SHARE)?;
            Ok(pour.runs_on(share, within("runs_on", "the rate", &rate, FLOW)?)) as Fallible<f64>
        })
        .register_type_with_name::<Placement>("Placement")
        .register_get("above", |place: &mut Placement| array(place.above.iter().copied()))
        .register_get("way_down", |place: &mut Placement| {
            Path::doing(place.way_down.clone(), Deed::SetDown { object: place.object.clone() })
        })
        .register_get("way_out", |place: &mut Placement| Path::plain(place.way_out.clone()))
        .register_get("at", |place: &mut Placement| array(place.at))
        .register_type_with_name::<Push>("Push")
        .register_get("legs", |push: &mut Push| list(push.legs.clone()))
        .register_type_with_name::<Leg>("Leg")
        .register_get("before", |leg: &mut Leg| array(leg.before.iter().copied()))
        .register_get("way_in", |leg: &mut Leg| Path::plain(leg.way_in.clone()))
        .register_get("way_out", |leg: &mut Leg| Path::plain(leg.way_out.clone()))
        .register_type_with_name::<Path>("Path")
        .register_type_with_name::<Region>("Region");
}

/// What the planner finds for a tool.
fn bind_work(engine: &mut Engine) {
    engine
        .register_type_with_name::<Stir>("Stir")
        .register_get("above", |stir: &mut Stir| array(stir.above.iter().copied()))
        .register_get("way_in", |stir: &mut Stir| Path::plain(stir.way_in.clone()))
        .register_get("way_out", |stir: &mut Stir| {
            Path::plain(stir.way_in.iter().rev().cloned().collect())
        })
        .register_get("round", |stir: &mut Stir| Path::plain(stir.round.clone()))
        .register_type_with_name::<Wipe>("Wipe")
        .register_get("strokes", |wipe: &mut Wipe| list(wipe.strokes.clone()))
        .register_get("hover", |wipe: &mut Wipe| wipe.hover)
        .register_type_with_name::<Stroke>("Stroke")
        .register_get("before", |stroke: &mut Stroke| array(stroke.before.iter().copied()))
        .register_get("along", |stroke: &mut Stroke| Path::plain(stroke.along.clone()))
        .register_get("way_out", |stroke: &mut Stroke| Path::plain(stroke.way_out.clone()))
        .register_fn("stirs", |twin: &mut Twin, tool: &str, vessel: &str| {
            twin.plans()?.stirs(tool, vessel).map(list).map_err(raise)
        })
        .register_fn("wipes", |twin: &mut Twin, o: &str| {
            twin.plans()?.wipes(o).map(list).map_err(raise)
        });
}

/// Poses of the tool.
fn bind_poses(engine: &mut Engine) {
    engine
        .register_type_with_name::<ToolPose>("Pose")
        .register_fn("pose", |at: Array, heading: Dynamic, pitch: Dynamic| {
            let at = bounds::place("pose", &at).map_err(raise)?;
            let heading = within("pose", "the heading", &heading, ANGLE)?;
            let pitch = within("pose", "the pitch", &pitch, PITCH)?;
            Ok(ToolPose::new(at, heading, pitch)) as Fallible<ToolPose>
        })
        .register_get("at", |pose: &mut ToolPose| array(pose.at()))
        .register_get("heading", |pose: &mut ToolPose| pose.heading())
        .register_get("pitch", |pose: &mut ToolPose| pose.pitch())
        .register_fn("moved", |pose: &mut ToolPose, by: Array| {
            let by = bounds::way("moved", &by).map_err(raise)?;
            Ok(pose.moved(by)) as Fallible<ToolPose>
        })
        .register_fn("turned", |pose: &mut ToolPose, axis: Array, angle: Dynamic| {
            let axis = bounds::axis("turned", &axis).map_err(raise)?;
            let angle = within("turned", "the angle", &angle, TURN)?;
            Ok(pose.turned(axis, angle)) as Fallible<ToolPose>
        });
}

/// The words of `camera`.
fn bind_camera(engine: &mut Engine) {
    engine.register_type_with_name::<Camera>("Camera").register_fn(
        "look",
        |at: NativeCallContext<'_>, camera: &mut Camera| {
            camera.acts(&at, wording::looks())?.look().map_err(raise)
        },
    );
}

/// The words of `twin`.
fn bind_twin(engine: &mut Engine) {
    engine
        .register_type_with_name::<Twin>("Twin")
        .register_fn("grasps", |twin: &mut Twin, o: &str, face: &str, pitch: Dynamic| {
            let pitch = within("grasps", "the pitch", &pitch, PITCH)?;
            twin.plans()?.grasps(o, face, pitch).map(list).map_err(raise)
        })
        .register_fn("pours", |twin: &mut Twin, o: &str, at: &str, clearance: Dynamic| {
            let clearance = within("pours", "the clearance", &clearance, CLEARANCE)?;
            twin.plans()?.pours(o, at, clearance).map(list).map_err(raise)
        })
        .register_fn("placements", |twin: &mut Twin, o: &str| {
            let table = Region::On(TABLE.to_owned());
            twin.plans()?.placements(o, &table).map(list).map_err(raise)
        })
        .register_fn("placements", |twin: &mut Twin, o: &str, at: &str| {
            let at = Region::On(at.to_owned());
            twin.plans()?.placements(o, &at).map(list).map_err(raise)
        })
        .register_fn("placements", |twin: &mut Twin, o: &str, at: Region| {
            twin.plans()?.placements(o, &at).map(list).map_err(raise)
        })
        .register_fn("turned_placements", |twin: &mut Twin, o: &str| {
            twin.plans()?.turned_placements(o).map(list).map_err(raise)
        })
        .register_fn("pushes", |twin: &mut Twin, o: &str, at: &str| {
            let at = Region::On(at.to_owned());
            twin.plans()?.pushes(o, &at).map(list).map_err(raise)
        })
        .register_fn("pushes", |twin: &mut Twin, o: &str, at: Region| {
            twin.plans()?.pushes(o, &at).map(list).map_err(raise)
        })
        .register_fn("reach", |twin: &mut Twin, at: ToolPose| {
            let found = twin.plans()?.reach(&at).map_err(raise)?;
            Ok(found.into_iter().map(|q| Dynamic::from(array(q))).collect()) as Fallible<Array>
        })
        .register_fn("turned", |twin: &mut Twin, o: &str| twin.context().turned(o).map_err(raise))
        .register_fn("size", |twin: &mut Twin, o: &str| {
            twin.context().size(o).map(array).map_err(raise)
        })
        .register_fn("pose_named", |twin: &mut Twin, name: &str| {
            twin.context().named_pose(name).map(array).map_err(raise)
        })
        .register_fn("position", |twin: &mut Twin, o: &str| {
            twin.context().position(o).map(array).map_err(raise)
        })
        .register_fn("enough", |twin: &mut Twin, o: &str, volume: Dynamic| {
            let volume = within("enough", "the volume", &volume, VOLUME)?;
            twin.context().enough(o, volume).map_err(raise)
        })
        .register_fn("squeeze", |twin: &mut Twin, o: &str| twin.context().squeeze(o).map_err(raise))
        .register_fn("handings", |twin: &mut Twin, o: &str| {
            let found = twin.plans()?.handings(o).map_err(raise)?;
            Ok(found.into_iter().map(|q| Dynamic::from(array(q))).collect()) as Fallible<Array>
        })
        .register_fn("drawn", |twin: &mut Twin, o: &str| twin.context().drawn(o).map_err(raise))
        .register_fn("travel", |twin: &mut Twin, o: &str| twin.context().travel(o).map_err(raise))
        .register_fn("drips", |twin: &mut Twin, o: &str| twin.context().drips(o).map_err(raise))
        .register_fn("volume", |twin: &mut Twin, o: &str| twin.context().volume(o).map_err(raise));
}

/// The words of `arm`.
fn bind_arm(engine: &mut Engine) {
    engine.register_type_with_name::<Arm>("Arm");
    bind_hand(engine);
    bind_ways(engine);
    bind_lines(engine);
    bind_turns(engine);
    bind_senses(engine);
}

/// The fingers, and holding still.
fn bind_hand(engine: &mut Engine) {
    engine
        .register_fn("open", |at: NativeCallContext<'_>, arm: &mut Arm| {
            arm.acts_on(&at, wording::opens(), Some(Deed::Released))?.open().map_err(raise)
        })
        .register_fn("open_to", |at: NativeCallContext<'_>, arm: &mut Arm, width: Dynamic| {
            let width = number("open_to", "the width", &width)?;
            let does = wording::opens_to(width);
            arm.acts_on(&at, does, Some(Deed::Released))?.open_to(width).map_err(raise)
        })
        .register_fn(
            "close",
            |at: NativeCallContext<'_>, arm: &mut Arm, o: &str, force: Dynamic| {
                let force = number("close", "the force", &force)?;
                let (does, took) = (wording::closes(o, force), Deed::Took { object: o.to_owned() });
                arm.acts_on(&at, does, Some(took))?.close(o, force).map_err(raise)
            },
        )
        .register_fn("weigh", |at: NativeCallContext<'_>, arm: &mut Arm| {
            arm.acts(&at, wording::weighs())?.weigh().map_err(raise)
        })
        .register_fn("heft", |at: NativeCallContext<'_>, arm: &mut Arm, seconds: Dynamic| {
            let seconds = within("heft", "the time", &seconds, HEFT)?;
            arm.acts(&at, wording::hefts(seconds))?.heft(seconds).map_err(raise)
        })
        .register_fn("stands", |at: NativeCallContext<'_>, arm: &mut Arm, o: &str| {
            arm.acts(&at, wording::feels_standing(o))?.stands(o).map_err(raise)
        })
        .register_fn("weighed", |arm: &mut Arm, mass: Dynamic| {
            let mass = within("weighed", "the mass", &mass, MASS)?;
            arm.context().weighed(mass);
            Ok(()) as Fallible<()>
        })
        .register_fn("bears", |arm: &mut Arm, mass: Dynamic| {
            let mass = within("bears", "the mass", &mass, MASS)?;
            arm.context().bears(mass);
            Ok(()) as Fallible<()>
        })
        .register_fn(
            "offer",
            |at: NativeCallContext<'_>,
             arm: &mut Arm,
             o: &str,
             force: Dynamic,
             seconds: Dynamic| {
                let force = within("offer", "the force", &force, FORCE)?;
                let seconds = within("offer", "the time", &seconds, WAIT)?;
                let does = wording::offers(o, force, seconds);
                arm.acts(&at, does)?.offer(o, force, seconds).map_err(raise)
            },
        )
        .register_fn("wait", |at: NativeCallContext<'_>, arm: &mut Arm, seconds: Dynamic| {
            let seconds = within("wait", "the time", &seconds, WAIT)?;
            arm.acts(&at, wording::waits(seconds))?.wait(seconds).map_err(raise)
        });
}

/// Ways of the arm.
fn bind_ways(engine: &mut Engine) {
    engine
        .register_fn("move_to", |at: NativeCallContext<'_>, arm: &mut Arm, q: Array| {
            let q = arm.joints("move_to", &q)?;
            arm.acts(&at, wording::moves_round())?.move_to(&q, None, 1.0).map_err(raise)
        })
        .register_fn(
            "carry_to",
            |at: NativeCallContext<'_>, arm: &mut Arm, q: Array, tilt: Dynamic, speed: Dynamic| {
                let q = arm.joints("carry_to", &q)?;
                let tilt = within("carry_to", "the tilt", &tilt, TILT)?;
                let speed = within("carry_to", "the speed", &speed, SPEED)?;
                let does = wording::carries(tilt, speed);
                arm.acts(&at, does)?.move_to(&q, Some(tilt), speed).map_err(raise)
            },
        )
        .register_fn(
            "follow",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, speed: Dynamic| {
                let speed = within("follow", "the speed", &speed, SPEED)?;
                let does = wording::follows(speed);
                arm.acts_on(&at, does, path.deed)?.follow(&path.points, speed).map_err(raise)
            },
        )
        .register_fn(
            "draw_back",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, speed: Dynamic| {
                let speed = within("draw_back", "the speed", &speed, SPEED)?;
                let does = wording::draws_back(speed);
                arm.acts_on(&at, does, path.deed)?.draw_back(&path.points, speed).map_err(raise)
            },
        );
}

/// Straight ways of the tool.
fn bind_lines(engine: &mut Engine) {
    engine
        .register_fn(
            "rise",
            |at: NativeCallContext<'_>, arm: &mut Arm, by: Dynamic, speed: Dynamic| {
                let by = within("rise", "the way up", &by, WAY)?;
                let speed = within("rise", "the speed", &speed, SPEED)?;
                let does = wording::moves_straight([0.0, 0.0, by], speed);
                arm.acts(&at, does)?.rise(by, speed).map_err(raise)
            },
        )
        .register_fn(
            "raise",
            |at: NativeCallContext<'_>,
             arm: &mut Arm,
             by: Dynamic,
             least: Dynamic,
             speed: Dynamic| {
                let by = within("raise", "the way up", &by, WAY)?;
                let least = number("raise", "the least", &least)?;
                let speed = within("raise", "the speed", &speed, SPEED)?;
                let does = wording::moves_straight([0.0, 0.0, by], speed);
                arm.acts(&at, does)?.raise(by, least, speed).map_err(raise)
            },
        )
        .register_fn(
            "move_by",
            |at: NativeCallContext<'_>, arm: &mut Arm, by: Array, speed: Dynamic| {
                let by = bounds::way("move_by", &by).map_err(raise)?;
                let speed = within("move_by", "the speed", &speed, SPEED)?;
                let does = wording::moves_straight(by, speed);
                arm.acts(&at, does)?.move_by(by, speed).map_err(raise)
            },
        )
        .register_fn("push", |at: NativeCallContext<'_>, arm: &mut Arm, leg: Leg| {
            let does = wording::pushes(&leg.object, leg.length);
            let pushed = Deed::Pushed { object: leg.object.clone() };
            arm.acts_on(&at, does, Some(pushed))?.push(&leg).map_err(raise)
        })
        .register_fn("move_to", |at: NativeCallContext<'_>, arm: &mut Arm, to: ToolPose| {
            arm.acts(&at, wording::moves_round())?.move_to_pose(&to).map_err(raise)
        })
        .register_fn(
            "line_to",
            |at: NativeCallContext<'_>, arm: &mut Arm, to: ToolPose, speed: Dynamic| {
                let speed = within("line_to", "the speed", &speed, SPEED)?;
                let does = wording::moves_to(to.at(), speed);
                arm.acts(&at, does)?.line_to(&to, speed).map_err(raise)
            },
        )
        .register_fn(
            "pull",
            |at: NativeCallContext<'_>, arm: &mut Arm, by: Array, force: Dynamic| {
                let by = bounds::way("pull", &by).map_err(raise)?;
                let force = within("pull", "the force", &force, FORCE)?;
                arm.acts(&at, wording::pulls(by, force))?.pull(by, force).map_err(raise)
            },
        )
        .register_fn(
            "move_until",
            |at: NativeCallContext<'_>, arm: &mut Arm, by: Array, force: Dynamic| {
                let by = bounds::way("move_until", &by).map_err(raise)?;
                let force = within("move_until", "the force", &force, FORCE)?;
                let does = wording::moves_until(by, force);
                arm.acts(&at, does)?.move_until(by, force).map_err(raise)
            },
        );
}

/// What the arm measures of itself.
fn bind_senses(engine: &mut Engine) {
    engine
        .register_fn("opening", |arm: &mut Arm| arm.context().opening().map_err(raise))
        .register_fn("joints", |arm: &mut Arm| {
            arm.context().measured().map(|(q, _)| array(q)).map_err(raise)
        })
        .register_fn("torques", |arm: &mut Arm| {
            arm.context().measured().map(|(_, tau)| array(tau)).map_err(raise)
        })
        .register_fn("pose", |arm: &mut Arm| arm.context().tool_pose());
}

/// Turns of the hand.
fn bind_turns(engine: &mut Engine) {
    engine
        .register_fn(
            "turn",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, rate: Dynamic| {
                let rate = within("turn", "the rate", &rate, RATE)?;
                let does = wording::turns(rate);
                arm.acts_on(&at, does, path.deed)?.turn(&path.points, rate).map_err(raise)
            },
        )
        .register_fn(
            "turn_back",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, rate: Dynamic| {
                let rate = within("turn_back", "the rate", &rate, RATE)?;
                let does = wording::turns_back(rate);
                arm.acts_on(&at, does, Some(Deed::TurnedBack))?
                    .turn_back(&path.points, rate)
                    .map_err(raise)
            },
        )
        .register_fn(
            "turn_about",
            |at: NativeCallContext<'_>, arm: &mut Arm, axis: Array, angle: Dynamic| {
                let axis = bounds::axis("turn_about", &axis).map_err(raise)?;
                let angle = within("turn_about", "the angle", &angle, TURN)?;
                arm.acts(&at, wording::turns_about(angle))?.turn_about(axis, angle).map_err(raise)
            },
        )
        .register_fn(
            "turn_to",
            |at: NativeCallContext<'_>,
             arm: &mut Arm,
             path: Path,
             share: Dynamic,
             rate: Dynamic| {
                let share = within("turn_to", "the share", &share, SHARE)?;
                let rate = within("turn_to", "the rate", &rate, RATE)?;
                let does = wording::turns_to(share, rate);
                arm.acts_on(&at, does, path.deed)?.turn_to(&path.points, share, rate).map_err(raise)
            },
        );
}

/// What is remembered, told and chosen.
fn bind_memory(engine: &mut Engine, context: &Arc<Mutex<ActionContext>>) {
    let keeper = context.clone();
    engine.register_fn("remember", move |name: &str, value: Dynamic| {
        lock(&keeper).remember(name, value).map_err(raise)
    });
    let keeper = context.clone();
    engine.register_fn("recall", move |name: &str| lock(&keeper).recall(name).map_err(raise));
    let teller = context.clone();
    engine.register_fn("note", move |text: &str| lock(&teller).note(text));
    let teller = context.clone();
    engine.on_print(move |text| lock(&teller).note(text));
    let teller = context.clone();
    engine.on_debug(move |text, _, _| lock(&teller).note(text));
    let chooser = context.clone();
    engine.register_fn("choose", move |ways: Array| -> Fallible<Dynamic> {
        let chosen = lock(&chooser).choose(ways.len()).map_err(raise)?;
        ways.into_iter().nth(chosen).ok_or_else(|| Refusal::NotAmongWays.to_string().into())
    });
}
