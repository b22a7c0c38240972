//! Fluents on planted states: every function, every operator, what is not known, and what is wrong.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};
use trueup::fluent::{Error, Evaluator, Fact, Facts, NoFacts, Reading};
use trueup::language::ast::{BinaryOp, Expr, Program};
use trueup::units::Quantity;
use trueup::world::{
    Camera, Cavity, Intrinsics, Material, Object, ObjectState, Pose, Scene, Shape, Table,
    WorldState,
};

use crate::graph::tree::*;

fn vessel(name: &str, shape: Shape) -> Object {
    Object {
        name: name.into(),
        kind: "Container".into(),
        shape,
        cavity: Some(Cavity { wall: 0.003, capacity: 250e-6, filled: 150e-6 }),
        looks: name.into(),
        material: Material::Opaque,
        colour: [0, 0, 0],
        mass: 0.16,
    }
}

/// A jar 65 × 65 × 140 mm, a cup of radius 80 mm and height 95 mm, and a solid block.
fn scene() -> Scene {
    let jar = Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) };
    let cup = Shape::Cylinder { radius: 0.08, height: 0.095 };
    let block = Shape::Cuboid { size: Vector3::new(0.05, 0.08, 0.03) };
    // Looks straight down: image right is world −y, image down is world −x, farther is down.
    let down = nalgebra::Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let rotation = UnitQuaternion::from_matrix(&down);
    Scene {
        name: "test".into(),
        table: Table { size: Vector3::new(1.2, 0.8, 0.02), centre: [0.5, 0.0], colour: [0; 3] },
        marks: Vec::new(),
        objects: vec![
            vessel("jar", jar),
            vessel("cup", cup),
            Object { cavity: None, ..vessel("block", block) },
        ],
        drawers: Vec::new(),
        camera_name: "overhead".into(),
        camera: Camera {
            intrinsics: Intrinsics::centred(900.0, 1280, 720),
            world_from_camera: Pose::from_parts(Vector3::new(0.5, 0.0, 1.0), rotation),
        },
        person: None,
        calibration: None,
        robot: "gen3_2f85".into(),
        world_from_base: Pose::identity(),
    }
}

/// The jar stands at (0.5, 0.2), the cup at (0.5, −0.2), the block lies at (0.3, 0); all exactly known.
fn state() -> WorldState {
    let at = |name: &str, x, y| ObjectState {
        name: name.into(),
        world_from_object: Some(Pose::upright(x, y, 0.0, 0.3)),
        std: 0.0,
        water: Some(if name == "jar" { 150e-6 } else { 0.0 }),
    };
    WorldState {
        time: 0.0,
        q: vec![0.0; 7],
        opening: 0.085,
        world_from_tool: Pose::from_parts(Vector3::new(0.4, 0.0, 0.3), UnitQuaternion::identity()),
        held: None,
        objects: vec![at("jar", 0.5, 0.2), at("cup", 0.5, -0.2), at("block", 0.3, 0.0)],
        spilt: Some(0.0),
        unknown: Vec::new(),
    }
}

fn read_with(program: &Program, state: &WorldState, facts: &dyn Facts, what: &Expr) -> Reading {
    let (scene, start, bindings) = (scene(), self::state(), BTreeMap::new());
    let on = Evaluator {
        scene: &scene,
        state,
        start: &start,
        fluents: program,
        bindings: &bindings,
        facts,
    };
    on.read(what)
}

fn read(state: &WorldState, what: &Expr) -> Reading {
    read_with(&pouring(), state, &NoFacts, what)
}

fn value(state: &WorldState, what: &Expr) -> Option<f64> {
    let (scene, start, bindings) = (scene(), self::state(), BTreeMap::new());
    let program = pouring();
    let on = Evaluator {
        scene: &scene,
        state,
        start: &start,
        fluents: &program,
        bindings: &bindings,
        facts: &NoFacts,
    };
    on.quantity(what).unwrap().map(|q| q.value)
}

fn close(found: Option<f64>, expected: f64, tolerance: f64) {
    let found = found.expect("known");
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

fn margin(reading: &Reading) -> f64 {
    reading.margin.expect("a margin").value
}

fn move_to(
    state: &mut WorldState,
    name: &str,
    pose: Pose<trueup::world::frame::World, trueup::world::frame::Object>,
) {
    state.object_mut(name).unwrap().world_from_object = Some(pose);
}

/// Turned by `tilt` about the world's x axis, which carries the top towards −y.
fn tilted(
    x: f64,
    y: f64,
    z: f64,
    tilt: f64,
) -> Pose<trueup::world::frame::World, trueup::world::frame::Object> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
    Pose::from_parts(Vector3::new(x, y, z), turn)
}

#[test]
fn quantities_of_standing_objects_are_those_of_their_drawing() {
    let s = state();
    close(value(&s, &f("height", &["jar"])), 0.0, 1e-12);
    close(value(&s, &f("distance", &["jar", "cup"])), 0.4, 1e-12);
    close(value(&s, &fe("offset", vec![f("center", &["jar"]), f("center", &["cup"])])), 0.4, 1e-12);
    close(value(&s, &fe("offset", vec![n("block"), n("jar")])), 0.2_f64.hypot(0.2), 1e-12);
    close(value(&s, &f("gap", &["jar", "cup"])), 0.14 - 0.095, 1e-12);
    close(value(&s, &f("rim", &["cup"])), 0.077, 1e-12);
    close(value(&s, &f("rim", &["jar"])), 0.0295, 1e-12);
    close(value(&s, &f("tilt", &["jar"])), 0.0, 1e-6);
    close(value(&s, &f("volume", &["jar"])), 150e-6, 1e-15);
    close(value(&s, &f("capacity", &["cup"])), 250e-6, 1e-15);
    close(value(&s, &f("width", &["block"])), 0.05, 1e-12);
    close(value(&s, &f("opening", &[])), 0.085, 1e-12);
    close(value(&s, &f("spilt", &[])), 0.0, 1e-12);
    close(value(&s, &f("height", &["gripper"])), 0.3, 1e-12);
    assert_eq!(read(&s, &f("tall", &["jar"])).truth, Some(true));
    assert_eq!(read(&s, &f("tall", &["cup"])).truth, Some(false));
    close(read(&s, &f("tall", &["cup"])).margin.map(|m| m.value), 0.095 - 0.16, 1e-12);
}

#[test]
fn filled_is_what_was_there_when_the_run_began() {
    let mut s = state();
    s.object_mut("jar").unwrap().water = Some(20e-6);
    close(value(&s, &f("filled", &["jar"])), 150e-6, 1e-15);
    close(value(&s, &f("volume", &["jar"])), 20e-6, 1e-15);
    let most = two(number(0.9), BinaryOp::Mul, f("filled", &["jar"]));
    s.object_mut("cup").unwrap().water = Some(130e-6);
    let poured = read(&s, &two(f("volume", &["cup"]), BinaryOp::Ge, most));
    assert_eq!(poured.truth, Some(false));
    assert!((margin(&poured) + 5e-6).abs() < 1e-12, "130 mL of the 135 mL wanted");
}

/// A jar tilted by 90° about its base centre: its axis lies along −y, its lowest side is down.
/// A photograph is unsure to the side; how high a thing stands follows from what bears it.
#[test]
fn what_stands_hangs_no_higher_however_unsure_its_place_is() {
    let mut s = state();
    s.object_mut("block").unwrap().std = 0.004;
    let stands =
        |s: &WorldState| read(s, &two(f("drop", &["block"]), BinaryOp::Le, m(0.005))).truth;
    assert_eq!(stands(&s), Some(true));
    move_to(&mut s, "block", Pose::upright(0.3, 0.0, 0.001, 0.3));
    assert_eq!(stands(&s), None);
}

#[test]
fn nobody_knows_whether_a_thing_rests_on_what_was_not_seen() {
    let mut s = state();
    let high = Pose::upright(0.5, -0.2, 0.095, 0.0);
    move_to(&mut s, "block", high);
    let on = |s: &WorldState, what: &str| read(s, &f("rests_on", &["block", what])).truth;
    assert_eq!((on(&s, "table"), on(&s, "jar")), (Some(false), Some(false)));
    s.object_mut("cup").unwrap().world_from_object = None;
    assert_eq!((on(&s, "cup"), on(&s, "jar")), (None, Some(false)));
}

/// `rests_on(jar, left_of(cup))` was told twice, once yes and once no, and nothing said which was the height and which the place.
#[test]
fn what_rests_on_something_says_which_of_its_comparisons_is_which() {
    let reading = read(&state(), &f("rests_on", &["jar", "table"]));
    let first = &reading.terms[0].text;
    assert!(first.starts_with("rests_on(jar, table): ") && first.contains("gap"), "{first}");
    assert_eq!(reading.term, "rests_on(jar, table)");
}

#[test]
fn the_lip_of_a_tilted_jar_is_the_lowest_edge_of_its_rim() {
    let mut s = state();
    let tilt = 70.0_f64.to_radians();
    move_to(&mut s, "jar", tilted(0.5, 0.0, 0.30, tilt));
    // The rim centre is 140 mm along the axis (0, −sin, cos); the pouring edge 32.5 mm from it along
    // the rim's own −y, which is (0, −cos, −sin).
    let (sin, cos) = tilt.sin_cos();
    let (y, z) = (-0.14 * sin - 0.0325 * cos, 0.30 + 0.14 * cos - 0.0325 * sin);
    close(value(&s, &f("tilt", &["jar"])), tilt, 1e-9);
    close(value(&s, &f("gap", &["jar", "cup"])), z - 0.095, 1e-9);
    move_to(&mut s, "cup", Pose::upright(0.5, y, 0.0, 0.0));
    let lip_to_cup = fe("offset", vec![f("lip", &["jar"]), f("center", &["cup"])]);
    // Points within 2 mm of the lowest count, so the middle of the lip is a little above the edge.
    close(value(&s, &lip_to_cup), 0.0, 0.002);
    // The base's far edge is what hangs lowest: 32.5 mm below the origin, foreshortened.
    close(value(&s, &f("height", &["jar"])), (0.30 - 0.0325 * sin).min(z), 1e-9);
}

#[test]
fn the_lip_of_a_tilted_cylinder_is_its_lowest_rim_point() {
    let mut s = state();
    let tilt = 50.0_f64.to_radians();
    move_to(&mut s, "cup", tilted(0.5, 0.0, 0.4, tilt));
    let (sin, cos) = tilt.sin_cos();
    let z = 0.4 + 0.095 * cos - 0.08 * sin;
    // Against the jar standing on the table: its rim is at 140 mm.
    close(value(&s, &f("gap", &["cup", "jar"])), z - 0.14, 1e-4);
}

/// While a vessel stands, any point of its rim may become the lip: the nearest one counts.
#[test]
fn a_level_jar_beside_the_cup_axis_is_above_the_cup_by_its_nearest_edge() {
    let mut s = state();
    move_to(&mut s, "jar", Pose::upright(0.5, -0.2 + 0.09, 0.2, 0.0));
    let above = read(&s, &f("above", &["jar", "cup"]));
    assert_eq!(above.truth, Some(true));
    assert_eq!(above.fluent.as_deref(), Some("above"));
    // 77 mm − 5 mm − (90 mm − 32.5 mm) = 14.5 mm is worse than a gap of 245 mm.
    assert!((margin(&above) - 0.0145).abs() < 1e-6, "{}", margin(&above));
    assert_eq!(above.terms.len(), 2);
}

#[test]
fn a_jar_too_far_left_says_how_far_and_which_way() {
    let mut s = state();
    // Image right is −y, so +y of the cup is left of it.
    move_to(&mut s, "jar", Pose::upright(0.5, -0.2 + 0.1355, 0.2, 0.0));
    let above = read(&s, &f("above", &["jar", "cup"]));
    assert_eq!(above.truth, Some(false));
    assert!((margin(&above) + 0.031).abs() < 1e-6, "{}", margin(&above));
    assert_eq!(above.term, "offset(lip(jar), center(cup)) <= rim(cup) - 5 mm");
    let way = above.direction.expect("a direction");
    assert_eq!((way.object.as_str(), way.camera.as_str()), ("jar", "right"));
    assert!((Vector3::from(way.world) - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-3);
}

#[test]
fn a_jar_too_low_has_to_go_up() {
    let mut s = state();
    move_to(&mut s, "jar", Pose::upright(0.5, -0.2, 0.0, 0.0));
    let gap = two(f("gap", &["jar", "cup"]), BinaryOp::Ge, m(0.06));
    let reading = read(&s, &gap);
    assert!((margin(&reading) + 0.015).abs() < 1e-9);
    let way = reading.direction.expect("a direction");
    // The camera looks straight down, so up is nearer.
    assert_eq!((way.world, way.camera.as_str()), ([0.0, 0.0, 1.0], "nearer"));
}

/// Closed forms of the robustness semantics, on numbers.
#[test]
fn margins_follow_signal_temporal_logic() {
    let s = state();
    let five = || m(0.05);
    let cases = [
        (two(m(0.03), BinaryOp::Le, five()), 0.02),
        (two(m(0.03), BinaryOp::Ge, five()), -0.02),
        (within(two(m(0.03), BinaryOp::Eq, five()), m(0.03)), 0.01),
        (within(two(m(0.03), BinaryOp::Eq, five()), m(0.01)), -0.01),
        (within(two(m(0.03), BinaryOp::Ne, five()), m(0.01)), 0.01),
        (not(two(m(0.03), BinaryOp::Le, five())), -0.02),
        (and(two(m(0.03), BinaryOp::Le, five()), two(m(0.04), BinaryOp::Le, five())), 0.01),
        (or(two(m(0.03), BinaryOp::Le, five()), two(m(0.04), BinaryOp::Le, five())), 0.02),
    ];
    for (expr, expected) in cases {
        let reading = read(&s, &expr);
        let text = trueup::language::text::expr(&expr);
        assert!((margin(&reading) - expected).abs() < 1e-12, "{text}: {}", margin(&reading));
        assert_eq!(reading.truth, Some(expected > 0.0), "{text}");
    }
    // de Morgan: not (a and b) is as good as (not a) or (not b).
    let a = || two(m(0.03), BinaryOp::Le, five());
    let b = || two(m(0.09), BinaryOp::Le, five());
    let left = read(&s, &not(and(a(), b())));
    let right = read(&s, &or(not(a()), not(b())));
    assert_eq!((left.truth, margin(&left)), (right.truth, margin(&right)));
}

/// 9 mm short of 10 mm is worse than 1° short of 5°, though 9 mm is the smaller number in SI.
#[test]
fn the_worst_term_is_found_by_tolerance_not_by_unit() {
    let s = state();
    let length = within(two(m(0.029), BinaryOp::Eq, m(0.010)), m(0.010));
    let angle = within(two(deg(6.0), BinaryOp::Eq, deg(0.0)), deg(5.0));
    let reading = read(&s, &and(angle, length));
    assert_eq!(reading.truth, Some(false));
    assert!((margin(&reading) + 0.009).abs() < 1e-9);
    assert_eq!(reading.margin.unwrap().dimension.length, 1);
    assert_eq!(reading.terms.len(), 2);
}

#[test]
fn a_margin_exactly_at_the_limit_holds_for_at_most_and_not_for_less_than() {
    let s = state();
    assert_eq!(read(&s, &two(m(0.05), BinaryOp::Le, m(0.05))).truth, Some(true));
    assert_eq!(read(&s, &two(m(0.05), BinaryOp::Lt, m(0.05))).truth, Some(false));
}

#[test]
fn unknown_spreads_as_in_three_valued_logic() {
    let mut s = state();
    s.object_mut("jar").unwrap().world_from_object = None;
    let lost = || two(f("height", &["jar"]), BinaryOp::Gt, m(0.01));
    let yes = || two(m(0.0), BinaryOp::Lt, m(1.0));
    let no = || two(m(1.0), BinaryOp::Lt, m(0.0));
    assert_eq!(read(&s, &lost()).truth, None);
    assert_eq!(
        read(&s, &lost()).unknown.as_deref(),
        Some("the position of `jar` has not been measured")
    );
    assert_eq!(read(&s, &not(lost())).truth, None);
    assert_eq!(read(&s, &and(lost(), yes())).truth, None);
    assert_eq!(read(&s, &and(lost(), no())).truth, Some(false));
    assert_eq!(read(&s, &or(lost(), yes())).truth, Some(true));
    assert_eq!(read(&s, &or(lost(), no())).truth, None);
    assert_eq!(read(&s, &f("visible", &["jar"])).truth, Some(false));
    s.spilt = None;
    assert_eq!(read(&s, &two(f("spilt", &[]), BinaryOp::Le, ml(5.0))).truth, None);
    // What is divided by and comes out as zero.
    let none = two(m(1.0), BinaryOp::Sub, m(1.0));
    let quotient = two(two(m(1.0), BinaryOp::Div, none), BinaryOp::Gt, number(3.0));
    let why = "1 m - 1 m is zero, and nothing can be divided by it";
    assert_eq!(read(&s, &quotient).unknown.as_deref(), Some(why));
}

#[test]
fn a_margin_within_two_standard_deviations_is_not_an_answer() {
    let mut s = state();
    for (std, expected) in [(0.0, Some(true)), (0.004, Some(true)), (0.006, None)] {
        for name in ["jar", "cup"] {
            s.object_mut(name).unwrap().std = std;
        }
        // The distance is 400 mm; σ of the difference is √2 std.
        let near = two(f("distance", &["jar", "cup"]), BinaryOp::Le, m(0.4150));
        let reading = read(&s, &near);
        assert_eq!(reading.truth, expected, "std {std}");
        assert!((reading.sigma - std * 2.0_f64.sqrt()).abs() < 1e-12);
        assert!((margin(&reading) - 0.015).abs() < 1e-9, "the margin is told all the same");
    }
}

#[test]
fn any_ranges_over_the_objects_of_the_scene() {
    let mut s = state();
    let holding = f("holding", &["any"]);
    assert_eq!(read(&s, &holding).truth, Some(false));
    assert_eq!(read(&s, &not(holding.clone())).truth, Some(true));
    s.held = Some("cup".into());
    move_to(&mut s, "cup", Pose::upright(0.4, 0.0, 0.25, 0.0));
    let reading = read(&s, &holding);
    assert_eq!(reading.truth, Some(true));
    assert!((margin(&reading) - 0.24).abs() < 1e-9, "the height decides: contact has no margin");
}

#[test]
fn what_touches_what_is_asked_outside_first() {
    struct Felt;
    impl Facts for Felt {
        fn contact(&self, a: &str, b: &str) -> Option<bool> {
            (a == "jar" && b == "cup").then_some(true)
        }
        fn reachable(&self, object: &str, _face: Option<&str>) -> Option<Fact> {
            let margin = Some(length(if object == "cup" { -0.12 } else { 0.2 }));
            Some(Fact { truth: Some(object != "cup"), margin })
        }
    }
    let (mut s, program) = (state(), pouring());
    let felt = |s: &WorldState, what: &Expr| read_with(&program, s, &Felt, what);
    assert_eq!(felt(&s, &f("contact", &["cup", "jar"])).truth, Some(true));
    assert_eq!(read(&s, &f("contact", &["cup", "jar"])).truth, Some(false), "40 cm apart");
    let standing = read(&s, &f("contact", &["jar", "table"]));
    assert!(standing.truth == Some(true) && (margin(&standing) - 0.003).abs() < 1e-9);
    move_to(&mut s, "jar", Pose::upright(0.5, -0.2, 0.096, 0.0));
    assert_eq!(read(&s, &f("contact", &["cup", "jar"])).truth, None, "close: nobody knows");
    let out = felt(&s, &f("reachable", &["cup", "side"]));
    assert_eq!((out.truth, margin(&out)), (Some(false), -0.12));
    assert_eq!(read(&s, &f("reachable", &["cup", "side"])).truth, None);
    assert_eq!(read(&s, &n("gripper.open")).truth, Some(true));
    s.opening = 0.065;
    assert_eq!(read(&s, &n("gripper.open")).truth, Some(false));
}

#[test]
fn a_mistake_in_a_program_is_an_error_in_the_reading() {
    let s = state();
    let cases: Vec<(Expr, &str)> = vec![
        (two(f("height", &["jar"]), BinaryOp::Le, deg(3.0)), "do not measure the same thing"),
        (two(f("height", &["jar"]), BinaryOp::Eq, m(0.1)), "within 5 mm"),
        (
            within(two(f("tilt", &["jar"]), BinaryOp::Eq, deg(0.0)), deg(-3.0)),
            "the tolerance is -3 deg; it should be more than 0 deg",
        ),
        (two(f("height", &["jra"]), BinaryOp::Le, m(0.1)), "did you mean `jar`?"),
        (f("heigth", &["jar"]), "no fluent or function `heigth`"),
        (f("holding", &["jar", "cup"]), "takes one argument"),
        (two(f("rim", &["block"]), BinaryOp::Le, m(0.1)), "holds nothing"),
        (f("height", &["jar"]), "something true or false is wanted"),
        (and(n("jar"), n("cup")), "something true or false is wanted"),
        (two(f("offset", &["jar", "side"]), BinaryOp::Le, m(0.1)), "nothing here is called `side`"),
        (n("jar.weight"), "nothing here is called `jar.weight`"),
        (expr(trueup::language::ast::ExprKind::Bad), "could not be read"),
    ];
    for (what, expected) in cases {
        let reading = read(&s, &what);
        assert_eq!(reading.truth, None);
        let error = reading.error.expect("an error").to_string();
        assert!(error.contains(expected), "{error:?} does not say {expected:?}");
    }
    let round = program(vec![
        fluent("a", vec![], f("b", &[]), None),
        fluent("b", vec![], f("a", &[]), None),
    ]);
    let reading = read_with(&round, &s, &NoFacts, &f("a", &[]));
    assert!(matches!(reading.error, Some(Error::Circular { .. })));
}

#[test]
fn a_pose_that_is_no_number_is_a_pose_nobody_knows() {
    let mut s = state();
    move_to(&mut s, "jar", Pose::upright(f64::NAN, 0.0, 0.0, 0.0));
    assert_eq!(read(&s, &two(f("height", &["jar"]), BinaryOp::Ge, m(0.0))).truth, None);
    let by_zero = two(two(m(1.0), BinaryOp::Div, number(0.0)), BinaryOp::Ge, m(0.0));
    assert_eq!(read(&s, &by_zero).truth, None);
}

#[test]
fn a_reading_survives_its_file() {
    let s = state();
    let reading = read(&s, &f("above", &["jar", "cup"]));
    let text = serde_json::to_string(&reading).unwrap();
    let again: Reading = serde_json::from_str(&text).unwrap();
    assert_eq!(again.terms.len(), reading.terms.len());
    assert_eq!((again.truth, again.term), (reading.truth, reading.term));
}

#[test]
fn let_names_have_the_value_they_were_given() {
    let (scene, s, program) = (scene(), state(), pouring());
    let bindings: BTreeMap<String, Quantity> = [("before".to_owned(), length(0.1))].into();
    let on = Evaluator {
        scene: &scene,
        state: &s,
        start: &s,
        fluents: &program,
        bindings: &bindings,
        facts: &NoFacts,
    };
    let reading = on.read(&two(f("height", &["jar"]), BinaryOp::Lt, n("before")));
    assert_eq!((reading.truth, margin(&reading)), (Some(true), 0.1));
}
