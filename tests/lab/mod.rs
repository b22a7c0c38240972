//! The laboratory: what it hides shows in what it does, and nowhere else.

use nalgebra::Isometry3;
use trueup::lab::{Lab, LabSettings, Spot};
use trueup::motion::Robot;
use trueup::world::{Camera, Pixel, Point, Scene, Window};

use crate::kitchen;

mod secrecy;

/// The arm reaching out level over the table with the marker in view, rad; found by trying.
const REACHING: [f64; 7] =
    [-0.35, 0.95, std::f64::consts::PI, -1.75, 0.0, 1.13, std::f64::consts::FRAC_PI_2];

fn with_places(mut settings: LabSettings) -> LabSettings {
    let mut put = |name: &str, x_m, y_m, yaw_rad| {
        settings.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad });
    };
    put("jar", 0.60, -0.12, 0.4);
    put("cup", 0.62, 0.20, 0.0);
    settings.start.q_rad = REACHING.to_vec();
    settings
}

fn open(settings: LabSettings, seed: u64) -> (Lab, Scene) {
    let scene = kitchen::scene();
    (Lab::new(&Robot::gen3(), &scene, with_places(settings), seed).unwrap(), scene)
}

/// The mean place of the pixels near `near` that `belongs` weighs, px.
fn centroid(
    photo: &image::RgbImage,
    near: Pixel,
    reach: f64,
    belongs: impl Fn([f64; 3]) -> f64,
) -> Option<Pixel> {
    let (mut sum, mut su, mut sv) = (0.0, 0.0, 0.0);
    for v in (near.v - reach) as u32..=(near.v + reach) as u32 {
        for u in (near.u - reach) as u32..=(near.u + reach) as u32 {
            let weight = belongs(photo.get_pixel(u, v).0.map(linear));
            sum += weight;
            su += weight * f64::from(u);
            sv += weight * f64::from(v);
        }
    }
    (sum > 1.0).then(|| Pixel::new(su / sum, sv / sum))
}

fn linear(c: u8) -> f64 {
    let c = f64::from(c) / 255.0;
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Where the middle of a mark's picture is: the mean over its points as projected, weighted by the area
/// each takes up in the picture.
fn mark_centre(camera: &Camera, x: f64, y: f64, radius: f64) -> Pixel {
    let (mut su, mut sv, mut sum) = (0.0, 0.0, 0.0);
    for i in 0..24 {
        for j in 0..24 {
            let place = |k: i32| (f64::from(k) + 0.5) / 12.0 - 1.0;
            let (a, b) = (place(i) * radius, place(j) * radius);
            if a * a + b * b > radius * radius {
                continue;
            }
            let at = |da, db| camera.project(Point::new(x + a + da, y + b + db, 0.0)).unwrap();
            let (p, pa, pb) = (at(0.0, 0.0), at(1e-5, 0.0), at(0.0, 1e-5));
            let area = ((pa.u - p.u) * (pb.v - p.v) - (pa.v - p.v) * (pb.u - p.u)).abs();
            (su, sv, sum) = (su + area * p.u, sv + area * p.v, sum + area);
        }
    }
    Pixel::new(su / sum, sv / sum)
}

/// The distance between where marks are seen and where the assumed camera puts them, px, mark by mark.
fn mark_errors(lab: &mut Lab, scene: &Scene, reach: f64) -> Vec<f64> {
    let photo = lab.photo();
    let mut errors = Vec::new();
    // Only marks in the free front of the table: no arm, no object, no shadow of them.
    for mark in scene.marks.iter().filter(|mark| mark.x > 0.75) {
        let expected = mark_centre(&scene.camera, mark.x, mark.y, mark.radius);
        if expected.v + reach > 715.0 || (expected.u - 640.0).abs() > 560.0 {
            continue;
        }
        let dark = |c: [f64; 3]| (0.18 - c[1]).max(0.0);
        let seen = centroid(&photo, expected, reach, dark).unwrap();
        errors.push(seen.distance(expected));
    }
    errors
}

#[test]
fn a_perfect_laboratory_is_what_the_assumed_camera_projects() {
    let (mut lab, scene) = open(LabSettings::perfect(), 1);
    let errors = mark_errors(&mut lab, &scene, 20.0);
    assert!(errors.len() >= 4, "{} marks in view", errors.len());
    assert!(errors.iter().all(|&e| e < 0.15), "{errors:?}");
}

/// What a scene's calibration says of the lens is so in the laboratory; a guess is not.
#[test]
fn a_lens_that_was_calibrated_is_as_calibrated() {
    let mut settings = with_places(LabSettings::perfect());
    settings.switches.lens = true;
    let worst = |calibration: Option<String>| {
        let scene = Scene { calibration, ..kitchen::scene() };
        let mut lab = Lab::new(&Robot::gen3(), &scene, settings.clone(), 1).unwrap();
        mark_errors(&mut lab, &scene, 28.0).into_iter().fold(0.0, f64::max)
    };
    let (known, guessed) = (worst(Some("camera.json".into())), worst(None));
    assert!(known < 0.15 && guessed > 3.0, "{known} {guessed}");
}

#[test]
fn a_hidden_camera_is_seen_to_be_elsewhere() {
    let mut settings = LabSettings::perfect();
    settings.switches.camera_pose = true;
    let (mut lab, scene) = open(settings, 3);
    let errors = mark_errors(&mut lab, &scene, 28.0);
    assert!(errors.iter().any(|&e| e > 3.0), "{errors:?}");
}

/// Same seed, same photo and same motion, to the last bit; another seed, another laboratory.
#[test]
fn a_laboratory_repeats_itself_bit_for_bit() {
    let run = |seed| {
        let (mut lab, _) = open(LabSettings::default(), seed);
        let first = lab.photo();
        let mut readings = Vec::new();
        let mut q = REACHING;
        for k in 0..40 {
            q[0] += 0.002;
            lab.command(&q, &[0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
            if k == 10 {
                lab.grip(0.03, 0.1, 30.0).unwrap();
            }
            lab.advance(0.005).unwrap();
            readings.push(lab.feedback());
        }
        (first, readings, lab.photo())
    };
    let (a, b, other) = (run(5), run(5), run(6));
    assert!(a.0 == b.0 && a.2 == b.2, "photos differ");
    assert_eq!(a.1, b.1);
    assert!(a.0 != other.0 && a.1 != other.1);
}

/// A film shows what photographs show, smaller and without their noise, and leaves no trace in the laboratory.
#[test]
fn a_film_shows_the_table_and_changes_nothing() {
    let (mut lab, _) = open(LabSettings::default(), 5);
    let (mut filmed, _) = open(LabSettings::default(), 5);
    let small = filmed.film(480).develop(None);
    assert_eq!(small.dimensions(), (480, 270));
    assert!(small == filmed.film(480).develop(None), "there is no noise in it");
    for lab in [&mut lab, &mut filmed] {
        lab.advance(0.02).unwrap();
    }
    filmed.film(480).develop(None);
    let photo = lab.photo();
    assert!(photo == filmed.photo(), "the next photograph is another one");
    let thumb = image::imageops::thumbnail(&photo, 480, 270);
    let off = thumb.iter().zip(small.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let off = off.sum::<f64>() / (480.0 * 270.0 * 3.0);
    assert!(off < 3.0, "{off} levels on the mean");
}

/// Who asks for a part of a photograph gets what the whole shows there, noise included.
#[test]
fn a_part_of_a_photo_is_what_the_whole_shows_there() {
    let (mut lab, _) = open(LabSettings::default(), 5);
    let taken = lab.shutter();
    let whole = taken.develop(None);
    for (u, v) in [(0, 0), (617, 203), (1130, 575)] {
        let part = taken.develop(Some(Window { u, v, width: 150, height: 145 }));
        let same = image::imageops::crop_imm(&whole, u, v, 150, 145).to_image();
        assert_eq!(part.dimensions(), same.dimensions());
        // Directions are the same to rounding, which may move a value across the edge of a level.
        let off: Vec<u8> = part.iter().zip(same.iter()).map(|(a, b)| a.abs_diff(*b)).collect();
        assert!(off.iter().all(|off| *off <= 1), "{u} {v}: {:?}", off.iter().max());
        let n = off.iter().filter(|off| **off > 0).count();
        assert!(n < off.len() / 1000, "{u} {v}: {n} of {}", off.len());
    }
}

#[test]
fn a_photo_is_noisy_and_the_next_one_differently() {
    let (mut lab, _) = open(LabSettings::default(), 2);
    let (a, b) = (lab.photo(), lab.photo());
    let differences: Vec<f64> =
        a.pixels().zip(b.pixels()).map(|(a, b)| f64::from(a.0[1]) - f64::from(b.0[1])).collect();
    let n = differences.len() as f64;
    let deviation = (differences.iter().map(|d| d * d).sum::<f64>() / n).sqrt();
    assert!((0.5..6.0).contains(&deviation), "{deviation} levels between two photos");
    let mean = differences.iter().sum::<f64>() / n;
    assert!(mean.abs() < 0.05, "{mean}");
}

/// Of jaws that open 110 mm no pick was allowed: they began at 85 mm, and `gripper.open` asks for four fifths of what they can.
#[test]
fn jaws_begin_as_wide_open_as_they_go() {
    let wide = kitchen::URDF.replace("upper=\"0.0425\"", "upper=\"0.055\"");
    let wide = Robot::from_urdf(&wide, None).unwrap();
    let opening = |robot: &Robot, settings: LabSettings| {
        Lab::new(robot, &kitchen::scene(), with_places(settings), 1).unwrap().feedback().opening
    };
    assert!((opening(&wide, LabSettings::perfect()) - 0.110).abs() < 1e-3);
    assert!((opening(&Robot::gen3(), LabSettings::perfect()) - 0.085).abs() < 1e-3);
    let said = LabSettings::from_toml("[start]\nopening_m = 0.04\n").unwrap();
    assert!((opening(&wide, said) - 0.04).abs() < 1e-3);
}

/// Where the marker ball appears in a photo.
fn marker(lab: &mut Lab, scene: &Scene) -> Pixel {
    let photo = lab.photo();
    let robot = urdf_rs::read_from_string(kitchen::URDF).unwrap();
    let links = kitchen::links(&robot, &REACHING, 0.085);
    let gripper: Isometry3<f64> =
        links.iter().find(|(name, _)| name == "gripper_base_link").unwrap().1;
    let ball = Robot::gen3().marker().copied().unwrap();
    let centre = gripper * nalgebra::Point3::from(ball.centre);
    let near = scene.camera.project(Point::from(centre.coords)).unwrap();
    let magenta = |c: [f64; 3]| ((c[0] - c[1] * 2.0).min(c[2] - c[1] * 2.0) - 0.02).max(0.0);
    centroid(&photo, near, 45.0, magenta).unwrap()
}

/// The zeros are wrong, so the tool is elsewhere than the joints say, and the joints do not say so.
#[test]
fn wrong_zeros_move_the_tool_and_not_the_readings() {
    let (mut perfect, scene) = open(LabSettings::perfect(), 4);
    let mut settings = LabSettings::perfect();
    settings.switches.zero_offsets = true;
    settings.joints.zero_sigma_rad = 0.012;
    let (mut shifted, _) = open(settings, 4);
    let apart = marker(&mut perfect, &scene).distance(marker(&mut shifted, &scene));
    // At 0.6 m from the base and 1 m from the lens a hundredth of a radian is about 5 px.
    assert!(apart > 1.5, "the marker moved by {apart} px");
    for (a, b) in perfect.feedback().q.iter().zip(shifted.feedback().q) {
        assert!((a - b).abs() < 1e-9, "an encoder shows its own zero: {a} against {b}");
    }
}

#[test]
fn a_gripper_mounted_aside_moves_the_marker_and_not_the_readings() {
    let (mut perfect, scene) = open(LabSettings::perfect(), 4);
    let mut settings = LabSettings::perfect();
    settings.switches.tool_offset = true;
    settings.mounting.tool_sigma_m = 0.006;
    let (mut shifted, _) = open(settings, 4);
    let apart = marker(&mut perfect, &scene).distance(marker(&mut shifted, &scene));
    assert!(apart > 1.0, "the marker moved by {apart} px");
    assert_eq!(perfect.feedback().q, shifted.feedback().q);
}

/// A late laboratory does what a prompt one does, later by the latency and by nothing else.
#[test]
fn latency_is_a_shift_in_time() {
    let run = |late: f64| {
        let mut settings = LabSettings::perfect();
        settings.switches.latency = late > 0.0;
        settings.latency.command_s = [late, late];
        let (mut lab, _) = open(settings, 1);
        let mut trace = Vec::new();
        for k in 0..150 {
            let t = f64::from(k) * 0.004;
            let mut q = REACHING;
            // A smooth start, so that both begin at rest.
            let s = (t / 0.4).min(1.0);
            q[0] += 0.1 * s * s * (3.0 - 2.0 * s);
            lab.command(&q, &[0.0; 7]).unwrap();
            lab.advance(0.004).unwrap();
            trace.push(lab.feedback().q[0]);
        }
        trace
    };
    let (prompt, late) = (run(0.0), run(0.032));
    let moved = (prompt[149] - prompt[0]).abs();
    assert!(moved > 0.08, "it moved {moved} rad");
    for k in 0..142 {
        assert!((prompt[k] - late[k + 8]).abs() < 1e-6, "step {k}");
    }
    assert!((prompt[60] - late[60]).abs() > 1e-3);
}

#[test]
fn friction_and_give_show_as_tracking_error_and_sag() {
    let lag = |friction: bool| {
        let mut settings = LabSettings::perfect();
        settings.switches.joint_friction = friction;
        let (mut lab, _) = open(settings, 1);
        let mut q = REACHING;
        for _ in 0..100 {
            q[0] += 0.002;
            lab.command(&q, &[0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
            lab.advance(0.004).unwrap();
        }
        q[0] - lab.feedback().q[0]
    };
    let (without, with) = (lag(false), lag(true));
    // Coulomb 0.4 N·m and 0.5 N·m·s/rad at least, against a servo of 4000 N·m/rad.
    assert!(with > without + 1.5e-4, "{with} rad with friction, {without} without");

    let mut settings = LabSettings::perfect();
    settings.switches.compliance = true;
    settings.joints.compliance_rad_per_nm = [8e-4, 8e-4];
    let (mut soft, scene) = open(settings, 1);
    let (mut stiff, _) = open(LabSettings::perfect(), 1);
    for lab in [&mut soft, &mut stiff] {
        lab.command(&REACHING, &[0.0; 7]).unwrap();
        lab.advance(0.5).unwrap();
    }
    let sag = marker(&mut soft, &scene).v - marker(&mut stiff, &scene).v;
    assert!(sag > 1.0, "the tool hangs {sag} px lower");
}

#[test]
fn fingers_stopped_by_nothing_have_not_grasped() {
    let (mut lab, _) = open(LabSettings::default(), 1);
    lab.grip(0.02, 0.1, 30.0).unwrap();
    lab.advance(0.3).unwrap();
    let moving = lab.feedback();
    assert!(!moving.grasped && moving.gripper_current > 0.5, "{moving:?}");
    lab.advance(1.2).unwrap();
    let there = lab.feedback();
    assert!(!there.grasped && (there.opening - 0.02).abs() < 2e-3, "{there:?}");
}

#[test]
fn a_stopped_arm_stays_where_it_is() {
    let (mut lab, _) = open(LabSettings::perfect(), 1);
    let mut q = REACHING;
    for _ in 0..60 {
        q[0] += 0.003;
        lab.command(&q, &[0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        lab.advance(0.005).unwrap();
    }
    let at = lab.feedback().q[0];
    lab.stop().unwrap();
    lab.advance(1.0).unwrap();
    let end = lab.feedback();
    // It brakes from 0.6 rad/s; what it runs on is a few hundredths of a radian.
    assert!((end.q[0] - at).abs() < 0.05 && end.dq.iter().all(|dq| dq.abs() < 1e-3), "{end:?}");
}

#[test]
fn scales_say_what_was_filled_in_and_nothing_is_spilt() {
    let (mut lab, _) = open(LabSettings::perfect(), 1);
    lab.advance(0.2).unwrap();
    let said = lab.scales();
    assert!((said.water_in("jar").unwrap() - 150e-6).abs() < 1e-6, "{said:?}");
    assert!(said.water_in("cup").unwrap() < 1e-9 && said.spilt < 1e-9);
    assert_eq!(said.water_in("kettle"), None);
}

/// Drawn places must be reachable, apart, and off the marks: seen here by the only way to see, a photo.
#[test]
fn objects_are_placed_or_the_reason_is_said() {
    let scene = kitchen::scene();
    for seed in 1..=4 {
        let mut lab = Lab::new(&Robot::gen3(), &scene, LabSettings::perfect(), seed).unwrap();
        let photo = lab.photo();
        let blue = |c: [f64; 3]| (c[2] - 2.0 * c[0] - 0.05).max(0.0);
        let middle = Pixel::new(640.0, 360.0);
        let cup = centroid(&photo, middle, 355.0, blue).unwrap();
        let seen = scene.camera.on_plane(cup, 0.05).unwrap().coords();
        let radius = seen.x.hypot(seen.y);
        assert!((0.50..0.75).contains(&radius), "seed {seed}: the cup is at {seen:?}");
        assert!(seen.y.atan2(seen.x).abs() < 55.0_f64.to_radians());
    }
    let mut crowded = LabSettings::default();
    crowded.placement.apart_m = [3.0, 3.0];
    let error = Lab::new(&Robot::gen3(), &scene, crowded, 1).unwrap_err();
    assert!(error.to_string().contains("placement.apart_m"), "{error}");
    let mut unknown = LabSettings::default();
    unknown.placement.fixed.insert("kettle".into(), Spot { x_m: 0.5, y_m: 0.0, yaw_rad: 0.0 });
    let error = Lab::new(&Robot::gen3(), &scene, unknown, 1).unwrap_err();
    assert!(error.to_string().contains("kettle"), "{error}");
}

#[test]
fn bad_orders_are_refused_and_change_nothing() {
    let (mut lab, _) = open(LabSettings::perfect(), 1);
    assert!(lab.command(&[0.0; 6], &[0.0; 7]).is_err());
    assert!(lab.command(&[f64::NAN; 7], &[0.0; 7]).is_err());
    assert!(lab.grip(f64::INFINITY, 0.1, 10.0).is_err());
    assert!(lab.advance(f64::NAN).is_err());
    let before = lab.feedback().q;
    lab.advance(0.1).unwrap();
    for (a, b) in before.iter().zip(lab.feedback().q) {
        assert!((a - b).abs() < 1e-4);
    }
}

/// The lamp, the lens and the noise of a laboratory, to look at: `TRUEUP_PICTURES=folder`.
#[test]
fn photos_to_look_at() {
    let Some(folder) = std::env::var_os("TRUEUP_PICTURES") else { return };
    for seed in 1..=3 {
        let scene = kitchen::scene();
        let mut settings = LabSettings::default();
        settings.start.q_rad = REACHING.to_vec();
        let mut lab = Lab::new(&Robot::gen3(), &scene, settings, seed).unwrap();
        let file = std::path::Path::new(&folder).join(format!("lab{seed}.png"));
        lab.photo().save(file).unwrap();
    }
}

/// The fingers close on the jar between them: they stop at its width, say so, and carry it up.
#[test]
fn fingers_stopped_by_the_jar_have_grasped_it() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let robot = urdf_rs::read_from_string(kitchen::URDF).unwrap();
    let tool = |q: &[f64; 7]| {
        kitchen::links(&robot, q, 0.085)
            .into_iter()
            .find(|(name, _)| name == "tool_frame")
            .unwrap()
            .1
    };
    // A level gripper, by trying: the wrist makes up for the two bends before it.
    let level = |q2: f64, q4: f64| [0.0, q2, PI, q4, 0.0, q2 - q4 - FRAC_PI_2, FRAC_PI_2];
    let mut best = (f64::INFINITY, HOME_BENDS);
    for i in 0..80 {
        for k in 0..80 {
            let bends = (0.6 + 0.015 * f64::from(i), -2.3 + 0.015 * f64::from(k));
            let p = tool(&level(bends.0, bends.1)).translation.vector;
            let off = (p.x - 0.62).hypot(p.z - 0.085);
            if off < best.0 {
                best = (off, bends);
            }
        }
    }
    let q = level(best.1.0, best.1.1);
    let at = tool(&q).translation.vector;
    assert!(best.0 < 0.02, "no level posture was found: {at:?}");
    let mut settings = LabSettings::default();
    settings.switches.readings = false;
    settings.start.q_rad = q.to_vec();
    settings.placement.fixed.insert("jar".into(), Spot { x_m: at.x, y_m: at.y, yaw_rad: 0.0 });
    settings.placement.fixed.insert("cup".into(), Spot { x_m: 0.62, y_m: 0.32, yaw_rad: 0.0 });
    let mut lab = Lab::new(&Robot::gen3(), &kitchen::scene(), settings, 1).unwrap();
    lab.grip(0.0, 0.08, 25.0).unwrap();
    lab.advance(1.0).unwrap();
    let held = lab.feedback();
    assert!(held.grasped && (held.opening - 0.065).abs() < 2e-3, "{held:?}");
    assert!((held.gripper_current - 0.05).abs() < 1e-9);
    // Up by a few centimetres.
    let mut raised = q;
    for _ in 0..100 {
        raised[1] -= 0.001;
        raised[5] -= 0.001;
        lab.command(&raised, &[0.0; 7]).unwrap();
        lab.advance(0.008).unwrap();
    }
    lab.advance(0.3).unwrap();
    let up = lab.feedback();
    assert!(up.grasped, "{up:?}");
    assert!((up.opening - 0.065).abs() < 2e-3);
    let said = lab.scales();
    assert!(said.spilt < 1e-6, "carried level, nothing is spilt: {said:?}");
}

/// Where the search for a level posture begins, rad.
const HOME_BENDS: (f64, f64) = (0.95, -1.75);

/// Things that would stand in each other, or beside the table, are refused with the keys that put them there.
#[test]
fn places_where_nothing_can_stand_are_named() {
    let scene = kitchen::scene();
    let wrong = |cup: [f64; 2], jar: [f64; 2]| {
        let mut settings = LabSettings::default();
        for (name, [x_m, y_m]) in [("cup", cup), ("jar", jar)] {
            settings.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.0 });
        }
        settings.check_places(&scene).map_err(|error| error.to_string())
    };
    assert_eq!(wrong([0.6, 0.2], [0.6, -0.1]), Ok(()));
    let off = wrong([6.0, 0.2], [0.6, -0.1]).unwrap_err();
    assert!(off.contains("`placement.fixed.cup`") && off.contains("off the table"), "{off}");
    for jar in [[0.6, 0.1], [0.6, 0.0]] {
        let inside = wrong([0.6, 0.1], jar).unwrap_err();
        for name in ["cup", "jar"] {
            assert!(inside.contains(&format!("`placement.fixed.{name}`")), "{inside}");
        }
    }
    // Side by side they touch: a cup of 8 cm radius, and half of a jar of 6.5 cm.
    assert_eq!(wrong([0.6, 0.1], [0.6, 0.1 - 0.08 - 0.0325]), Ok(()));
}
