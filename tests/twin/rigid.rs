//! Rigid bodies against closed forms.

use super::*;
use trueup::twin::Effect;

#[test]
fn a_dropped_block_falls_as_galileo_says() {
    let block = solid("block", Shape::Cuboid { size: Vector3::new(0.05, 0.05, 0.05) }, 0.3);
    let mut twin = twin(vec![block], &state(&HOME, &[("block", at(0.3, 0.3, 0.8), 0.0)]));
    let t = 0.3;
    twin.run(t).unwrap();
    let z = twin.state().objects[0].world_from_object.unwrap().origin().z;
    // Symplectic Euler is ahead of the parabola by g t dt / 2 at most.
    let expected = 0.8 - 0.5 * 9.81 * t * t;
    assert!((z - expected).abs() < 9.81 * t * twin.dt(), "{z} for {expected}");
}

/// Runs a block on a table tilted by `angle` (gravity tilted the other way); returns how far it slid.
fn slide(angle: f64, seconds: f64) -> f64 {
    let block = solid("block", Shape::Cuboid { size: Vector3::new(0.06, 0.06, 0.03) }, 0.3);
    let robot = gen3();
    let mut settings = Settings::for_arm(&robot);
    settings.gravity = Vector3::new(9.81 * angle.sin(), 0.0, -9.81 * angle.cos());
    let start = state(&HOME, &[("block", at(0.2, 0.3, 0.0), 0.0)]);
    let mut twin = Twin::new(&robot, &scene(vec![block]), &start, settings).unwrap();
    twin.run(seconds).unwrap();
    twin.state().objects[0].world_from_object.unwrap().origin().x - 0.2
}

#[test]
fn a_block_on_an_incline_holds_below_the_friction_angle_and_slides_above_it() {
    let mu: f64 = 0.4;
    let limit = mu.atan();
    assert!(slide(limit - 0.02, 1.0).abs() < 2e-4, "{}", slide(limit - 0.02, 1.0));
    let (angle, t) = (limit + 0.1, 0.5);
    let expected = 0.5 * 9.81 * (angle.sin() - mu * angle.cos()) * t * t;
    let slid = slide(angle, t);
    assert!((slid - expected).abs() < 0.05 * expected, "{slid} for {expected}");
}

#[test]
fn a_cup_at_rest_on_the_table_stays_where_it_is() {
    let start = at(0.55, 0.2, 0.0);
    let mut twin = twin(vec![cup()], &state(&HOME, &[("cup", start, 0.0)]));
    twin.run(2.0).unwrap();
    let pose = twin.state().objects[0].world_from_object.unwrap();
    assert!((pose.origin() - start.translation.vector).norm() < 3e-4, "{pose:?}");
    assert!(pose.tilt() < 2e-3 && twin.contacts("cup", "table") && !twin.contacts("cup", "jar"));
}

#[test]
fn the_arm_follows_its_command_and_the_jaws_theirs() {
    let mut twin = twin(vec![], &state(&HOME, &[]));
    let goal: Vec<f64> = HOME.iter().map(|q| q + 0.3).collect();
    drive(&mut twin, &goal, 1.5);
    twin.run(0.3).unwrap();
    let worst = twin.q().iter().zip(&goal).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst} rad");
    twin.grip(0.02, 0.1, 40.0).unwrap();
    twin.run(1.0).unwrap();
    assert!((twin.opening() - 0.02).abs() < 2e-4, "{} m", twin.opening());
    let robot = gen3();
    let tool = robot.forward_tool(&twin.q()).unwrap();
    let seen = twin.state().world_from_tool;
    assert!((tool.origin() - seen.origin()).norm() < 1e-9);
}

#[test]
fn bad_commands_are_refused_and_the_last_one_stays() {
    let mut twin = twin(vec![], &state(&HOME, &[]));
    assert!(twin.command(&[0.0; 3], &[0.0; 7]).is_err());
    assert!(twin.command(&[f64::NAN; 7], &[0.0; 7]).is_err());
    twin.run(0.1).unwrap();
    assert!(twin.q().iter().zip(HOME).all(|(a, b)| (a - b).abs() < 1e-3));
}

#[test]
fn compliance_bends_what_the_encoder_does_not_see() {
    let robot = gen3();
    let mut settings = Settings::for_arm(&robot);
    settings.arm.compliance = vec![2e-4; 7];
    let mut twin = Twin::new(&robot, &scene(vec![]), &state(&HOME, &[]), settings).unwrap();
    twin.run(1.0).unwrap();
    let (q, seen, tau) = (twin.q(), twin.encoders(), twin.torques());
    for i in 0..7 {
        assert!((seen[i] - HOME[i]).abs() < 2e-4, "the motor is where it should be");
        assert!((q[i] - (HOME[i] - 2e-4 * tau[i])).abs() < 2e-4, "the link hangs from it");
    }
    assert!((q[1] - HOME[1]).abs() > 1e-3, "{}", q[1] - HOME[1]);
}

#[test]
fn restoring_a_snapshot_and_stepping_equals_stepping() {
    let objects = vec![jar(), cup()];
    let poses = [("jar", at(0.6, 0.1, 0.01), 5e-5), ("cup", at(0.6, -0.15, 0.0), 0.0)];
    let mut twin = twin(objects, &state(&HOME, &poses));
    let goal: Vec<f64> = HOME.iter().map(|q| q + 0.2).collect();
    twin.command(&goal, &[0.0; 7]).unwrap();
    twin.run(0.05).unwrap();
    let snapshot = twin.snapshot();
    let finish = |twin: &mut Twin| {
        twin.run(0.3).unwrap();
        (twin.state(), twin.water(), twin.torques())
    };
    let first = finish(&mut twin);
    twin.restore(&snapshot);
    assert_eq!(finish(&mut twin), first);
    let mut fresh = snapshot.into_twin();
    assert_eq!(finish(&mut fresh), first);
}

#[test]
fn dry_friction_holds_a_joint_against_a_smaller_torque_and_yields_to_a_larger() {
    let robot = gen3();
    // The servo carries nothing: what hangs on the second joint pulls with all its weight.
    let hanging = {
        let start = state(&HOME, &[]);
        let twin = Twin::new(&robot, &scene(vec![]), &start, Settings::for_arm(&robot)).unwrap();
        twin.torques()[1].abs()
    };
    assert!(hanging > 1.0, "{hanging} N·m");
    let moved = |friction: f64| {
        let mut settings = Settings::for_arm(&robot);
        settings.arm.kp[1] = 1e-3;
        settings.arm.kd[1] = 1e-3;
        settings.arm.uncompensated = 1.0;
        Effect::CoulombFriction(1, friction * hanging).change_settings(&mut settings);
        let start = state(&HOME, &[]);
        let mut twin = Twin::new(&robot, &scene(vec![]), &start, settings).unwrap();
        twin.run(0.3).unwrap();
        (twin.q()[1] - HOME[1]).abs()
    };
    // What the servos of the other joints push back is solved for with it: it does not creep.
    assert!(moved(1.3) < 5e-5, "{}", moved(1.3));
    assert!(moved(0.5) > 1e-2, "{}", moved(0.5));
}

/// The finer a step is divided, the less may change: friction, soft gears, and a command every other step.
#[test]
fn an_arm_alone_goes_the_same_way_in_few_parts_as_in_many() {
    let robot = gen3();
    let way = |parts: usize| {
        let mut settings = Settings::for_arm(&robot);
        settings.solver_iterations = parts;
        for joint in 0..7 {
            Effect::CoulombFriction(joint, 0.5).change_settings(&mut settings);
            Effect::ViscousFriction(joint, 0.4).change_settings(&mut settings);
            Effect::JointCompliance(joint, 2e-5).change_settings(&mut settings);
        }
        let mut twin = Twin::new(&robot, &scene(vec![]), &state(&HOME, &[]), settings).unwrap();
        let mut seen = Vec::new();
        for step in 0..400 {
            if step % 2 == 0 {
                let (t, size) = (twin.time(), 0.25);
                let q = HOME.map(|home| home + size * (1.0 - (4.0 * t).cos()));
                twin.command(&q, &[4.0 * size * (4.0 * t).sin(); 7]).unwrap();
            }
            twin.step().unwrap();
            seen.extend(twin.q());
        }
        seen
    };
    let apart =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let many = way(32);
    // A servo that lags by half a step is off by 1 mrad at 1 rad/s.
    let off = apart(&way(1), &many);
    assert!(off < 1e-4, "{off} rad");
    assert!(apart(&way(4), &many) < off);
}

/// The servo is told to be a radian further at once: it turns the arm as fast as its torque does, and no faster.
#[test]
fn a_servo_gives_no_more_torque_than_it_has() {
    use trueup::motion::dynamics::{Bodies, Dynamics};
    let robot = gen3();
    let mut twin = twin(vec![], &state(&HOME, &[]));
    let mut goal = HOME;
    goal[0] += 1.0;
    twin.command(&goal, &[0.0; 7]).unwrap();
    let seconds = 0.02;
    twin.run(seconds).unwrap();
    let arm = Dynamics::new(&robot, Bodies::All).with_opening(twin.opening());
    let mut turn = [0.0; 7];
    let still = arm.inverse(&HOME, &[0.0; 7], &turn).unwrap()[0];
    turn[0] = 1.0;
    let inertia = arm.inverse(&HOME, &[0.0; 7], &turn).unwrap()[0] - still;
    let rotor = twin.settings().arm.armature[0];
    let expected = robot.joints()[0].effort * seconds / (inertia + rotor);
    // The other joints give way a little.
    assert!((twin.dq()[0] / expected - 1.0).abs() < 0.1, "{} for {expected} rad/s", twin.dq()[0]);
}

#[test]
fn arms_the_physics_cannot_move_are_refused() {
    use crate::motion::robots::TWO_LINKS;
    let build = |text: &str| {
        let robot = Robot::from_urdf(text, None).unwrap();
        let start = state(&vec![0.0; robot.n_joints()], &[]);
        Twin::new(&robot, &scene(vec![]), &start, Settings::for_arm(&robot))
    };
    assert!(build(TWO_LINKS).is_ok());
    let no_jaws = TWO_LINKS.replace("type=\"prismatic\"", "type=\"fixed\"");
    let error = build(&no_jaws).unwrap_err().to_string();
    assert!(error.contains("not a pair of coupled sliding jaws"), "{error}");
    let coupled = TWO_LINKS.replace(
        "effort=\"10\"/></joint>\n  <joint name=\"h\"",
        "effort=\"10\"/><mimic joint=\"a\"/></joint>\n  <joint name=\"h\"",
    );
    assert_ne!(coupled, TWO_LINKS);
    let error = build(&coupled).unwrap_err().to_string();
    assert!(error.contains("follow each other"), "{error}");
}

/// An arm that swings, alone or with a block in its jaws, and how the block moved in its hand; beside it something falls that
/// nothing stops, if so wanted: while a thing moves, the engine moves the arm as well.
fn swung(holds: bool, beside: bool) -> (Twin, Isometry3<f64>) {
    let robot = gen3();
    let tool = *robot.forward_tool(&HOME).unwrap().isometry();
    let block = solid("block", Shape::Cuboid { size: Vector3::new(0.04, 0.04, 0.06) }, 0.3);
    let ball = solid("ball", Shape::Cuboid { size: Vector3::repeat(0.05) }, 0.3);
    let within = tool * at(0.0, 0.0, -0.03);
    let (mut objects, mut poses) = (Vec::new(), Vec::new());
    if holds {
        objects.push(block);
        poses.push(("block", within, 0.0));
    }
    if beside {
        objects.push(ball);
        poses.push(("ball", at(0.5, 3.0, 1.0), 0.0));
    }
    let mut start = state(&HOME, &poses);
    if holds {
        (start.opening, start.held) = (0.04, Some("block".into()));
    }
    let mut settings = Settings::for_arm(&robot);
    settings.arm.coulomb = vec![0.5; 7];
    settings.arm.viscous = vec![0.25; 7];
    let mut twin = Twin::new(&robot, &scene(objects), &start, settings).unwrap();
    let in_hand = |twin: &Twin| {
        let state = twin.state();
        let block = state.object("block").and_then(|block| block.world_from_object);
        block.map_or_else(Isometry3::identity, |block| {
            *(state.world_from_tool.inverse() * block).isometry()
        })
    };
    twin.run(0.3).unwrap();
    let before = in_hand(&twin);
    let there: Vec<f64> = HOME.iter().map(|home| home + 0.3).collect();
    drive(&mut twin, &there, 0.7);
    drive(&mut twin, &HOME, 0.7);
    let after = in_hand(&twin);
    (twin, before.inverse() * after)
}

#[test]
fn an_arm_alone_and_what_it_holds_go_as_the_engine_moves_them() {
    for holds in [false, true] {
        let ((own, slip), (engines, slipped)) = (swung(holds, false), swung(holds, true));
        let off = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
        };
        // The engine takes what speed asks for at the end of a step, the arm alone at its beginning.
        assert!(off(&own.q(), &engines.q()) < 2e-6, "{:?} {:?}", own.q(), engines.q());
        assert!(off(&own.torques(), &engines.torques()) < 0.02);
        let apart = (slip.inverse() * slipped).translation.vector.norm();
        assert!(apart < 1e-6, "{apart} m in the hand");
        assert!(slip.translation.vector.norm() < 1e-5, "{slip}");
    }
}
