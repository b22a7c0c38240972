//! Pours simulated drop by drop, and what the quasi-static model makes of them.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use trueup::discovery::finding::{Finding, Value, Verdict};
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Investigation, Options, Subject, investigate};
use trueup::twin::FluidSettings;
use trueup::twin::fluid::{Dribble, Filling, Fluid, Rim, Vessel};

use crate::kitchen;

/// The scene's jar and cup.
fn vessels() -> (trueup::world::Object, trueup::world::Object) {
    let scene = kitchen::scene();
    (scene.object("jar").unwrap().clone(), scene.object("cup").unwrap().clone())
}

/// Turns a jar with `water` m³ about its lip over the cup, back, waits, and carries it away.
fn poured(water: f64, dribble: Option<Dribble>, seed: u64) -> Recording {
    // A second still, up at 12 deg/s, a second and a half, back at 45 deg/s, a second and away.
    turned(water, dribble, seed, &[(1.0, 10.0, 2.0, 0.21), (11.5, 14.2, 0.0, 0.78)])
}

/// Pours some of a jar with 150 mL as a person does: some, weighed upright, some more.
fn poured_in_steps(dribble: Option<Dribble>, seed: u64) -> Recording {
    let course = [
        (1.0, 4.0, 1.25, 0.5),
        (6.0, 7.0, 1.30, 0.1),
        (10.0, 13.0, 0.0, 0.78),
        (15.0, 18.0, 1.27, 0.5),
        (19.0, 20.0, 1.33, 0.1),
        (22.0, 23.0, 1.36, 0.1),
        (26.0, 29.0, 0.0, 0.78),
    ];
    turned(150e-6, dribble, seed, &course)
}

/// Turns a jar with `water` m³ about its lip over the cup, between times (s) to a tilt (rad) at a rate (rad/s), and carries it away;
/// returns the recording of a scale under the cup (0.3 g of noise) as a CSV file.
fn turned(
    water: f64,
    dribble: Option<Dribble>,
    seed: u64,
    course: &[(f64, f64, f64, f64)],
) -> Recording {
    const DT: f64 = 1.0 / 240.0;
    let (jar, cup) = vessels();
    let lip = Point3::new(0.0325, 0.0, 0.14);
    let above = Vector3::new(-0.03, 0.0, 0.095 + 0.06 + 0.14);
    let pose = |tilt: f64, away: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        let place = above - Vector3::new(away, 0.0, 0.0) - turn * lip.coords;
        Isometry3::from_parts(Translation3::from(place), turn)
    };
    let filling = |object: &trueup::world::Object, pose, water, dribble| Filling {
        vessel: Vessel::new(object).unwrap(),
        pose,
        water,
        rim: Rim { dribble, ..Rim::default() },
    };
    let fillings = [
        filling(&jar, pose(0.0, 0.0), water, dribble),
        filling(&cup, Isometry3::identity(), 0.0, None),
    ];
    let settings = FluidSettings::default();
    let table = kitchen::scene().table;
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut fluid = Fluid::new(&settings, &fillings, table, gravity, DT, seed).unwrap();
    let (mut csv, mut tilt, mut away) =
        ("t[s],tilt[deg],mass[g],inside[mm]\n".to_owned(), 0.0, 0.0);
    let mut noise = seed;
    let end = course.last().unwrap().1;
    for step in 0..((end + 2.8) / DT) as usize {
        let t = step as f64 * DT;
        if let Some((_, _, to, rate)) = course.iter().find(|turn| (turn.0..turn.1).contains(&t)) {
            tilt += (to - tilt).clamp(-rate * DT, rate * DT);
        } else if t > end + 0.8 {
            away += 0.25 * DT;
        }
        fluid.step(&[pose(tilt, away), Isometry3::identity()]);
        if step % 5 == 0 {
            // A few bits of a mixed counter, even on ±1; scaled to 0.3 g.
            noise = noise.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            let even = (noise >> 40) as f64 / f64::from(1_u32 << 23) - 1.0;
            let mass = fluid.volume_in(1) * 1e6 + 0.3 * 3.0_f64.sqrt() * even;
            let inside = 77.0 - (30.0 + 1e3 * away);
            writeln!(csv, "{t:.4},{:.3},{mass:.2},{inside:.2}", tilt.to_degrees()).unwrap();
        }
    }
    Recording::read(&format!("pour {seed}"), &csv, None, &Map::default()).unwrap()
}

/// Pours 150 mL into a cup that is full at `level` m³: what stands above its rim runs over as over a weir, and is
/// weighed too.
pub(super) fn poured_over(level: f64, seed: u64) -> Recording {
    let mut recording = poured(150e-6, None, seed);
    let time = recording.time.clone();
    let mass = recording.columns.iter_mut().find(|column| column.name == "mass").unwrap();
    // Rim 0.23 m around, surface 43 cm²; 1.7 m^½/s is a broad crest's coefficient.
    let (mut inside, mut beside, mut before) = (0.0, 0.0, mass.values[0]);
    for row in 1..time.len() {
        inside += 1e-3 * (mass.values[row] - before);
        before = mass.values[row];
        for _ in 0..10 {
            let above = f64::max(inside - level, 0.0);
            let over = 1.7 * 0.23 * (above / 43e-4).powf(1.5) * (time[row] - time[row - 1]) / 10.0;
            let over = over.min(above);
            (inside, beside) = (inside - over, beside + over);
        }
        mass.values[row] = 1e3 * inside;
    }
    recording.sidecar.pour = Some(trueup::discovery::recording::sidecar::Vessels {
        source: "jar".into(),
        target: "cup".into(),
        held_m3: Some(150e-6),
        first_m3: None,
        there_m3: None,
        spilt_m3: Some(beside),
        borne_kg: None,
    });
    recording
}

fn found(recordings: &[Recording]) -> Finding {
    investigated(recordings).finding
}

fn investigated(recordings: &[Recording]) -> Investigation {
    let scene = kitchen::scene();
    let subject = Subject::Pours(&scene, &[]);
    investigate(recordings, subject, &Options::default(), &mut |_, _| {}).unwrap()
}

fn number(finding: &Finding, effect: usize, name: &str) -> f64 {
    let parameter = &finding.effects[effect].parameters[name];
    match &parameter.value {
        Value::Number(value) => *value,
        Value::Vector(values) => panic!("{values:?}"),
    }
}

#[test]
fn nothing_is_missing_from_a_pour_that_is_as_declared() {
    let finding = found(&[poured(150e-6, None, 1), poured(150e-6, None, 2)]);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    // The power of the test: a film of a few millilitres would have been seen.
    let film = finding.smallest_visible.iter().find(|v| v.name == "lip_dribble").unwrap();
    assert!((0.5e-6..8e-6).contains(&film.least), "{}", film.least);
}

#[test]
fn water_that_runs_on_from_the_lip_is_named_with_its_volume_and_delay() {
    let dribble = Dribble { volume: 18e-6, delay: 1.2 };
    let pours = [poured(150e-6, Some(dribble), 3), poured(150e-6, Some(dribble), 4)];
    for recordings in [&pours[..], &pours[..1]] {
        let finding = found(recordings);
        assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
        let effect = &finding.effects[0];
        assert_eq!((effect.name.as_str(), effect.at.as_str()), ("lip_dribble", "jar"));
        let (volume, delay) = (1e6 * number(&finding, 0, "volume"), number(&finding, 0, "delay"));
        assert!((volume - 18.0).abs() < 1.8, "{volume} mL");
        assert!((delay - 1.2).abs() < 0.25, "{delay} s");
        assert!(finding.gap.shrink_heldout > 0.9, "{:?}", finding.gap);
        assert!(finding.model.added[0].starts_with("effect lip_dribble(jar) { "));
    }
}

#[test]
fn a_jar_that_held_more_than_declared_is_named() {
    let finding = found(&[poured(200e-6, None, 5), poured(200e-6, None, 6)]);
    assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
    assert_eq!(finding.effects[0].name, "liquid_volume");
    let volume = 1e6 * number(&finding, 0, "volume");
    assert!((volume - 200.0).abs() < 4.0, "{volume} mL");
}

/// What a recording is of, as the folder of a run says it: what was in jar and cup at first, and what scales said at the end.
fn between(
    first: f64,
    there: f64,
    held: Option<f64>,
) -> trueup::discovery::recording::sidecar::Vessels {
    trueup::discovery::recording::sidecar::Vessels {
        source: "jar".into(),
        target: "cup".into(),
        held_m3: held,
        first_m3: Some(first),
        there_m3: Some(there),
        spilt_m3: held.map(|_| 0.0),
        borne_kg: None,
    }
}

#[test]
fn the_rest_of_a_jar_poured_on_top_of_what_is_in_the_cup_lacks_nothing() {
    for held in [None, Some(90e-6)] {
        let mut recording = poured(90e-6, None, 9);
        let mass = recording.columns.iter_mut().find(|column| column.name == "mass").unwrap();
        mass.values.iter_mut().for_each(|value| *value += 60.0);
        recording.sidecar.pour = Some(between(90e-6, 60e-6, held));
        let finding = found(&[recording]);
        assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    }
}

#[test]
fn a_pour_in_steps_lacks_nothing_and_what_runs_on_from_the_lip_is_still_named() {
    let told = |dribble, seed| {
        let mut recording = poured_in_steps(dribble, seed);
        recording.sidecar.pour = Some(between(150e-6, 0.0, Some(150e-6)));
        recording
    };
    let finding = found(&[told(None, 10), told(None, 11)]);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    let dribble = Dribble { volume: 12e-6, delay: 1.2 };
    let finding = found(&[told(Some(dribble), 12), told(Some(dribble), 13)]);
    let names: Vec<&str> = finding.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!(names, ["lip_dribble"], "{:#?}", finding.effects);
}

#[test]
fn of_pours_between_several_vessels_those_of_the_lasts_are_looked_at() {
    let mut others = poured_quickly();
    let mut vessels = between(0.0, 0.0, None);
    (vessels.source, vessels.target) = (vessels.target, vessels.source);
    others.sidecar.pour = Some(vessels);
    let finding = found(&[others, poured(150e-6, None, 1)]);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    let is_told = |note: &String| note.contains("a pour from `cup` into `jar`");
    assert!(finding.notes.iter().any(is_told), "{:?}", finding.notes);
}

/// The hand weighs what it holds before it pours; the jar is declared with 160 g and 150 mL.
#[test]
fn a_jar_that_is_heavier_in_the_hand_than_declared_is_named_and_one_within_the_hands_error_is_not()
{
    let weighed = |recording: &Recording, borne: f64| {
        let mut recording = recording.clone();
        recording.sidecar.pour = Some(trueup::discovery::recording::sidecar::Vessels {
            source: "jar".into(),
            target: "cup".into(),
            held_m3: Some(150e-6),
            first_m3: None,
            there_m3: None,
            spilt_m3: Some(0.0),
            borne_kg: Some(borne),
        });
        recording
    };
    let pours = [poured(150e-6, None, 7), poured(150e-6, None, 8)];
    // An arm is a few per cent off, not the same way in every place.
    let heavy = [weighed(&pours[0], 0.312 + 0.14), weighed(&pours[1], 0.299 + 0.14)];
    let Investigation { finding, whys, .. } = investigated(&heavy);
    // What shows it is what the hand bore of each pour, beside what was declared.
    assert_eq!(whys.len(), 1, "{whys:#?}");
    assert_eq!((whys[0].channel.as_str(), whys[0].state.as_str()), ("hand", "pour"));
    let rows: Vec<(f64, bool)> = whys[0].rows.iter().map(|r| (r.state, r.held_out)).collect();
    assert_eq!(rows, [(1.0, false), (2.0, true)]);
    assert!(whys[0].rows.iter().all(|r| (r.left - 0.14).abs() < 0.02), "{:?}", whys[0].rows);
    assert!(whys[0].rows.iter().all(|r| (r.law - 0.14).abs() < 0.02), "{:?}", whys[0].rows);
    assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
    assert_eq!(
        (finding.effects[0].name.as_str(), finding.effects[0].at.as_str()),
        ("object_mass", "jar")
    );
    assert!((number(&finding, 0, "mass") - 0.30).abs() < 0.015, "{}", number(&finding, 0, "mass"));
    let usual = [weighed(&pours[0], 0.325), weighed(&pours[1], 0.290)];
    let finding = found(&usual);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    let least = finding.smallest_visible.iter().find(|v| v.name == "object_mass").unwrap().least;
    assert!((0.01..0.1).contains(&least), "{least} kg");
}

#[test]
fn a_pour_between_unknown_vessels_is_told() {
    let mut recording = poured_quickly();
    recording.sidecar.pour = Some(trueup::discovery::recording::sidecar::Vessels {
        source: "jug".into(),
        target: "cup".into(),
        held_m3: None,
        first_m3: None,
        there_m3: None,
        spilt_m3: None,
        borne_kg: None,
    });
    let scene = kitchen::scene();
    let subject = Subject::Pours(&scene, &[]);
    let options = Options::default();
    let error = investigate(&[recording], subject, &options, &mut |_, _| {}).unwrap_err();
    assert!(error.what.contains("`jug`") && error.help.contains("jar"), "{error:?}");
}

/// A recording that is a pour by its columns alone.
fn poured_quickly() -> Recording {
    let mut csv = "t[s],tilt[deg],mass[g]\n".to_owned();
    for i in 0..50 {
        writeln!(csv, "{},{i},0", f64::from(i) * 0.1).unwrap();
    }
    Recording::read("pour", &csv, None, &Map::default()).unwrap()
}
