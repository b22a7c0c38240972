//! The cell as the regressions found it: what is planned and rehearsed with it is what the arm does.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use trueup::execution::calibration::Calibration;
use trueup::execution::cell::Cell;
use trueup::execution::plan::Planner;
use trueup::motion::polyline::mix;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Budget, Robot};
use trueup::trace::{NoWay, Why};
use trueup::twin::{Settings, Twin};
use trueup::world::Pose;
use trueup::world::frame::{Flange, Object, Tool, World};

use crate::kitchen::HOME;
use crate::motion::ik::SCARA;

use super::{cell, scripts, state};

/// An arm that was set up badly: centimetres beside its place, zeros up to 4 deg off, the gripper askew.
fn found(declared: &Cell) -> Calibration {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.004, -0.003, 0.02));
    Calibration {
        reported_from_real: Pose::from_parts(Vector3::new(0.012, -0.008, 0.003), turn),
        zeros: vec![0.02, -0.03, 0.01, 0.05, -0.02, 0.07, 0.01],
        tool_shift: [0.002, -0.003, 0.001],
        ..Calibration::nominal(&declared.scene)
    }
}

/// The regressions' word on where the tool is, by the formula they are fitted with, and the adapted twin's.
#[test]
fn the_adapted_twin_has_its_tool_where_the_regressions_say_the_arms_is() {
    let declared = cell();
    let found = found(&declared);
    let adapted = found.cell(&declared);
    let q: Vec<f64> = HOME.iter().enumerate().map(|(i, q)| q + 0.1 * (i as f64 - 3.0)).collect();
    let turned: Vec<f64> = q.iter().zip(&found.zeros).map(|(q, zero)| q + zero).collect();
    let flange = declared.robot.forward(&turned).unwrap();
    let tool = declared.robot.flange_from_tool();
    let tool: Pose<Flange, Tool> =
        Pose::from_parts(tool.origin() + Vector3::from(found.tool_shift), tool.rotation());
    let expected =
        found.reported_from_real.inverse() * (declared.scene.world_from_base * (flange * tool));
    let twin = Twin::new(
        &adapted.robot,
        &adapted.scene,
        &state(&q, [0.6, 0.1, 0.0]),
        Settings::for_arm(&adapted.robot),
    )
    .unwrap();
    let state = twin.state();
    let off = (state.world_from_tool.origin() - expected.origin()).norm();
    let turn = state.world_from_tool.rotation().angle_to(&expected.rotation());
    assert!(off < 1e-6 && turn < 1e-6, "{off} m, {turn} rad");
    // What it is told and what it reports are the arm's own angles.
    assert!(state.q.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-9));
}

/// Rehearsed with joint 6 well inside its range, refused on the arm a tenth of a degree past it.
#[test]
fn what_is_planned_keeps_inside_the_ranges_that_the_arm_itself_counts() {
    let declared = cell();
    let mut found = found(&declared);
    found.reported_from_real = Pose::identity();
    let limits = Limits::of(&declared.robot);
    let mut narrowest = f64::INFINITY;
    for zero in [0.0, 0.06, -0.06] {
        found.zeros[5] = zero;
        let cell = found.cell(&declared);
        let world = state(&HOME, [0.58, 0.15, 0.3]);
        let planner =
            Planner::new(cell.clone(), world, HOME.to_vec(), 0.0, Arc::new(Budget::new(|| false)));
        let ways = planner.grasps("jar", 0.35).unwrap();
        assert!(!ways.is_empty());
        for way in &ways {
            assert_eq!(cell.robot.outside_limits(way.way_in.last().unwrap(), -0.01), None);
            let motion = Trajectory::through_points(&way.way_in, &limits).unwrap();
            cell.clear(motion, &way.before).unwrap();
            for (joint, q) in cell.robot.joints().iter().zip(way.way_in.last().unwrap()) {
                narrowest = narrowest.min(joint.upper - q).min(q - joint.lower);
            }
        }
        let retract = cell.robot.pose("retract").unwrap().to_vec();
        let way = planner.free(&retract, None, 3).unwrap();
        assert_eq!(way.out, [HOME.to_vec()], "nothing is touched at home");
        for q in &way.on {
            assert_eq!(cell.robot.outside_limits(q, 0.0), None);
        }
    }
    assert!(narrowest.is_finite());
}

/// After a pour the hand was left against the cup, and `home()` was refused for where it began.
#[test]
fn a_hand_that_touches_something_is_led_away_before_it_goes_on() {
    let cell = cell();
    let tool = cell.tool_pose(&HOME).origin();
    // The jar's side 4 mm inside a finger.
    let mut world = state(&HOME, [tool.x + 0.03, tool.y + 0.07, 0.0]);
    let jar = &mut world.objects[0];
    jar.world_from_object = Some(Pose::upright(tool.x + 0.02, tool.y + 0.075, tool.z - 0.07, 0.0));
    let planner = Planner::new(
        cell.clone(),
        world.clone(),
        HOME.to_vec(),
        0.0,
        Arc::new(Budget::new(|| false)),
    );
    let retract = cell.robot.pose("retract").unwrap().to_vec();
    let way = planner.free(&retract, None, 1).unwrap();
    assert!(way.out.len() > 1, "it stands where it touches nothing: {:?}", way.out);
    assert_eq!((&way.out[0][..], way.out.last()), (&HOME[..], way.on.first()));
    assert_eq!(way.on.last(), Some(&retract));
    // Where the goal itself touches something there is still no way.
    let error = planner.free(&HOME, None, 1).unwrap_err();
    assert!(
        matches!(&error, NoWay { why: Why::NoPath(why), .. } if why.contains("jar")),
        "{error}"
    );
    // An arm that may be 4 cm beside where it says takes the jar for larger, and tells how near it is.
    let (at, budget) = (HOME.to_vec(), Arc::new(Budget::new(|| false)));
    let error = Planner::new(cell.clone(), world, at, 0.04, budget).free(&HOME, None, 1);
    let Err(NoWay { why: Why::TooNear(near), .. }) = error else { panic!("{error:?}") };
    assert!(near.second == "jar" && near.apart < 0.0, "{near:?}");
    assert!((near.kept - 0.04).abs() < 1e-12, "{near:?}");
}

/// On its way to a can an empty hand was led past it with 0.3 mm of room, brushed it in the twin and knocked it over.
#[test]
fn a_free_motion_keeps_room_from_what_it_passes_and_goes_where_there_is_none() {
    /// What is kept, less what distances are known to, m.
    const KEPT: f64 = 0.0049;
    let cell = cell();
    let turned = |by: f64| {
        let mut q = HOME.to_vec();
        q[0] += by;
        q
    };
    let goal = turned(0.8);
    let planner = |jar: Pose<World, Object>, q: &[f64]| {
        let mut world = state(q, [0.6, 0.1, 0.0]);
        world.objects[0].world_from_object = Some(jar);
        world.objects[1].world_from_object = None;
        let budget = Arc::new(Budget::new(|| false));
        Planner::new(cell.clone(), world, q.to_vec(), 0.0, budget)
    };
    // Farther and farther out before the hand that turns past it, until it does so without touching.
    let tool = cell.tool_pose(&turned(0.4)).origin();
    let out = Vector3::new(tool.x, tool.y, 0.0).normalize();
    let beside = |k: i32| {
        let at = tool + out * (0.001 * f64::from(k));
        Pose::upright(at.x, at.y, tool.z - 0.07, 0.0)
    };
    let grazes = |jar: &Pose<World, Object>| planner(*jar, &HOME).world().certify(&HOME, &goal);
    let jar = (30..300).map(beside).find(grazes).unwrap();
    let there = planner(jar, &HOME);
    let near = |q: &[f64]| there.world().nearby(q, KEPT).contains_key("jar");
    let nearer = |way: &[Vec<f64>]| {
        way.windows(2).find_map(|edge| {
            (0..=200).map(|k| mix(&edge[0], &edge[1], f64::from(k) / 200.0)).find(|q| near(q))
        })
    };
    let beside_it = nearer(&[HOME.to_vec(), goal.clone()]).expect("straight it is a hair");
    let way = there.free(&goal, None, 1).unwrap();
    assert_eq!((way.out.len(), way.on.last()), (1, Some(&goal)));
    assert_eq!(nearer(&way.on), None, "{:?}", way.on);
    // Where it is to end beside it, and where it begins there, it may be nearer.
    let to = there.free(&beside_it, None, 1).unwrap();
    assert_eq!((to.out.len(), to.on.last()), (1, Some(&beside_it)));
    let back = planner(jar, &beside_it).free(&HOME, None, 1).unwrap();
    assert_eq!((back.out.len(), back.on.last()), (1, Some(&HOME.to_vec())));
}

/// The whole run was stopped because one point of the touch-off led the tool too near to the table.
#[test]
fn a_visit_that_the_limits_refuse_leaves_the_arm_where_it_is_or_goes_above() {
    let mut scripts = scripts(
        &trueup::arm::Cancel::default(),
        trueup::execution::decisions::DecisionLog::recording(),
    );
    let mut context = scripts.context();
    let floor = context.cell().limits.floor;
    let at = |z: f64| trueup::execution::plan::side_pose(Vector3::new(0.5, 0.1, z), 0.2, 0.35);
    let height = |context: &mut trueup::execution::context::ActionContext| {
        let q = context.planned_q().unwrap().to_vec();
        context.cell().tool_pose(&q).origin().z
    };
    let before = context.planned_q().unwrap().to_vec();
    // In the table there is no way at all, and nothing moves.
    assert!(context.visit(&at(-0.02)).is_err());
    assert_eq!(context.planned_q().unwrap(), before);
    context.visit(&at(0.2)).unwrap();
    assert!(height(&mut context) > 0.19 && height(&mut context) > floor);
}

/// From above, more of the fingers is beside a vase than the pads of a level hand: it is wider there than they open.
#[test]
fn what_is_too_wide_from_above_alone_is_said_to_be_too_wide() {
    let mut cell = cell();
    let mut scene = trueup::world::Scene::clone(&cell.scene);
    let profile = [[0.030, 0.0], [0.036, 0.060], [0.045, 0.140]];
    let jar = scene.objects.iter_mut().find(|object| object.name == "jar").unwrap();
    jar.shape =
        trueup::world::Shape::Lathe { profile: trueup::world::Profile::new(&profile).unwrap() };
    cell.scene = Arc::new(scene);
    let world = state(&HOME, [0.58, 0.15, 0.3]);
    let planner = Planner::new(cell, world, HOME.to_vec(), 0.0, Arc::new(Budget::new(|| false)));
    let error = planner.grasps("jar", std::f64::consts::FRAC_PI_2).unwrap_err();
    let NoWay { why: Why::TooWide { width, opening }, .. } = &error else { panic!("{error}") };
    assert!(*width > opening - 0.008 && *width < 0.1, "{error}");
}

/// Six rehearsals failed with "its promise `held` does not hold", and it was called a matter of room.
#[test]
fn what_the_fingers_do_not_close_on_is_said_to_be_too_narrow() {
    let file = |name: &str| {
        std::fs::read_to_string(crate::program::project(&format!("stdlib/robots/gen3_2f85/{name}")))
            .unwrap()
    };
    let text = file("gen3_2f85.urdf");
    let range = "lower=\"0\" upper=\"0.0425\"";
    assert_eq!(text.matches(range).count(), 2);
    let text = text.replace(range, "lower=\"0.04\" upper=\"0.0425\"");
    let mut cell = cell();
    let robot = Robot::from_urdf_with(&text, &file("robot.toml"), None).unwrap();
    cell.robot = Arc::new(robot);
    let world = state(&HOME, [0.58, 0.15, 0.3]);
    let planner = Planner::new(cell, world, HOME.to_vec(), 0.0, Arc::new(Budget::new(|| false)));
    let error = planner.grasps("jar", 0.0).unwrap_err();
    let NoWay { why: Why::TooNarrow { width, opening }, .. } = &error else { panic!("{error}") };
    assert!((width - 0.065).abs() < 1e-6 && (opening - 0.08).abs() < 1e-6, "{error}");
}

/// A Panda and a can: "all 48 reachable ways touch something, mostly `panda_hand` with can", when nothing else was near. Here a box
/// that is as deep as no hand reaches round: 60 mm from its middle, of which the palm is 30 mm behind the tool, drawn back by 22 mm
/// at most, and 5 mm are left.
#[test]
fn fingers_that_are_too_short_for_a_thing_are_said_to_be() {
    let mut cell = cell();
    let mut scene = trueup::world::Scene::clone(&cell.scene);
    let jar = scene.objects.iter_mut().find(|object| object.name == "jar").unwrap();
    jar.shape = trueup::world::Shape::Cuboid { size: Vector3::new(0.12, 0.06, 0.14) };
    cell.scene = Arc::new(scene);
    let world = state(&HOME, [0.58, 0.15, 0.3]);
    let planner = Planner::new(cell, world, HOME.to_vec(), 0.0, Arc::new(Budget::new(|| false)));
    let error = planner.grasps("jar", 0.0).unwrap_err();
    let NoWay { why: Why::FingersShort { by }, .. } = &error else { panic!("{error}") };
    assert!((by - 0.013).abs() < 1e-6, "{error}");
    assert!(error.to_string().contains("the fingers are 13 mm too short"), "{error}");
}

/// A hand on a slide over a jar that it takes 84 mm up, with the slide at 416 mm. Of a slide 30 mm were kept at each end, and what
/// was refused for that was "0 mm out of reach".
#[test]
fn a_slide_is_used_to_its_end_and_what_is_beyond_names_it() {
    let reachable = |upper: &str, face: Option<&str>| {
        let text = SCARA.replace(r#"upper="0.45""#, &format!(r#"upper="{upper}""#));
        let mut cell = cell();
        cell.robot = Arc::new(Robot::from_urdf(&text, None).unwrap());
        let (world, q) = (state(&HOME, [0.45, 0.1, 0.0]), vec![0.0, 0.5, 0.9, 0.2, 0.0]);
        Planner::new(cell, world, q, 0.0, Arc::new(Budget::new(|| false))).reachable("jar", face)
    };
    assert_eq!(reachable("0.42", None), Ok(()));
    assert_eq!(reachable("0.417", None).unwrap_err().why, Why::AtEnd { joint: "j3".into() });
    let Why::OutOfReach { nearest } = reachable("0.366", None).unwrap_err().why else {
        panic!("the slide is 50 mm too short")
    };
    assert!((nearest - 0.05).abs() < 1e-3, "{nearest}");
    // It always points down.
    assert_eq!(reachable("0.45", Some("side")).unwrap_err().why, Why::NotTurned);
}
