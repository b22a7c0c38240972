//! The torques the twin feels, against closed forms.

use super::*;

#[test]
fn gravity_torques_are_the_gradient_of_potential_energy() {
    let robot = gen3();
    let height = |q: &[f64]| -> f64 {
        let poses = robot.link_poses(q, 0.085).unwrap();
        let energy = robot.links().iter().zip(&poses).filter_map(|(link, pose)| {
            let inertial = link.inertial?;
            let com = pose * nalgebra::Point3::from(inertial.com);
            Some(inertial.mass * 9.81 * com.z)
        });
        energy.sum()
    };
    let q = [0.5, -0.7, 1.1, 1.4, -0.9, 0.8, 0.3];
    let twin = twin(vec![], &state(&q, &[]));
    for (i, tau) in twin.torques().into_iter().enumerate() {
        let mut moved = [q, q];
        moved[0][i] += 1e-6;
        moved[1][i] -= 1e-6;
        let slope = (height(&moved[0]) - height(&moved[1])) / 2e-6;
        assert!((tau - slope).abs() < 1e-7, "joint {}: {tau} for {slope}", i + 1);
    }
}

#[test]
fn an_arm_straight_up_needs_no_torque_about_vertical_axes() {
    let tau = twin(vec![], &state(&[0.0; 7], &[])).torques();
    for i in [0, 2, 4, 6] {
        assert!(tau[i].abs() < 1e-9, "joint {}: {}", i + 1, tau[i]);
    }
    // Turned about the vertical first joint the torques of the others stay the same.
    let mut turned = HOME;
    turned[0] = 1.3;
    let a = twin(vec![], &state(&HOME, &[])).torques();
    let b = twin(vec![], &state(&turned, &[])).torques();
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9));
}

#[test]
fn an_uncompensated_arm_sags_as_its_torques_say() {
    let robot = gen3();
    let mut settings = Settings::for_arm(&robot);
    settings.arm.uncompensated = 1.0;
    let kp = settings.arm.kp.clone();
    let mut twin = Twin::new(&robot, &scene(vec![]), &state(&HOME, &[]), settings).unwrap();
    twin.run(1.5).unwrap();
    let tau = twin.torques();
    for (i, q) in twin.q().iter().enumerate() {
        let sag = tau[i] / kp[i];
        assert!((HOME[i] - q - sag).abs() < 1e-4, "joint {}: {} for {sag}", i + 1, HOME[i] - q);
    }
}

/// Commands come every other step, as from an arm's controller; sensors look as often.
#[test]
fn what_torque_sensors_feel_is_of_now_and_not_of_a_moment_ago() {
    use trueup::motion::dynamics::{Bodies, Dynamics};
    let robot = gen3();
    let mut twin = twin(vec![], &state(&HOME, &[]));
    let swing = |t: f64| {
        // Gentle at first, so that the arm is not struck.
        let size = 0.25 * (t / 0.5).min(1.0).powi(3);
        HOME.map(|home| home + size * (5.0 * t).sin())
    };
    let (mut motion, mut felt) = (Vec::new(), Vec::new());
    for step in 0..1000 {
        if step % 2 == 0 {
            let t = twin.time();
            let (q, next) = (swing(t), swing(t + 1e-4));
            let dq: Vec<f64> = q.iter().zip(next).map(|(a, b)| (b - a) / 1e-4).collect();
            twin.command(&q, &dq).unwrap();
        }
        twin.step().unwrap();
        if step % 2 == 1 {
            motion.push((twin.q(), twin.dq()));
            felt.push(twin.torques_sensed());
        }
    }
    // The acceleration of a moment, from the speeds before and after it.
    let arm = Dynamics::new(&robot, Bodies::All).with_opening(twin.opening());
    let span = 4.0 * twin.dt();
    let needed: Vec<Vec<f64>> = (1..motion.len() - 1)
        .map(|k| {
            let pairs = motion[k + 1].1.iter().zip(&motion[k - 1].1);
            let ddq: Vec<f64> = pairs.map(|(after, before)| (after - before) / span).collect();
            arm.inverse(&motion[k].0, &motion[k].1, &ddq).unwrap().as_slice().to_vec()
        })
        .collect();
    let off = |late: usize| -> f64 {
        let squares = (250..450).map(|k| {
            let pairs = felt[k + 1].iter().zip(&needed[k - late]);
            pairs.map(|(felt, needed)| (felt - needed).powi(2)).sum::<f64>()
        });
        (squares.sum::<f64>() / (7.0 * 200.0)).sqrt()
    };
    assert!(off(0) < 0.02, "{} N·m", off(0));
    assert!(off(0) < 0.2 * off(1), "{} N·m now, {} N·m two steps ago", off(0), off(1));
}

/// A hand that is pressed onto the table is pushed back, and what it pushes with follows from the torques that are felt.
#[test]
fn what_pushes_on_the_hand_is_felt_in_the_joints() {
    let robot = gen3();
    let q = {
        let mut q = HOME;
        // Fingers down, tips on the table: found by lowering the second joint until they touch.
        q[5] = 0.6;
        q
    };
    let mut twin = twin(vec![], &state(&q, &[]));
    let lower = |twin: &mut Twin, by: f64| {
        let mut q = q;
        q[1] += by;
        twin.command(&q, &[0.0; 7]).unwrap();
        twin.run(0.02).unwrap();
        ["left_jaw_link", "right_jaw_link", "gripper_base_link"]
            .iter()
            .any(|l| twin.contacts(l, "table"))
    };
    let touched = (0..2000).map(|k| f64::from(k) * 0.0005).find(|by| lower(&mut twin, *by));
    let by = touched.expect("the hand comes down to the table");
    lower(&mut twin, by + 0.004);
    twin.run(1.0).unwrap();
    let (free, felt) = (twin.torques(), twin.torques_felt());
    let (q_now, kp) = (twin.q(), twin.settings().arm.kp.clone());
    let mut q_cmd = q;
    q_cmd[1] += by + 0.004;
    assert!(felt.iter().zip(&free).any(|(a, b)| (a - b).abs() > 1.0), "{felt:?} {free:?}");
    // At rest the servo's own torque carries nothing but what pushes: the links' weight is compensated.
    for joint in 0..robot.n_joints() {
        let servo = kp[joint] * (q_cmd[joint] - q_now[joint]);
        let pushed = felt[joint] - free[joint];
        assert!(
            (servo - pushed).abs() < 0.05 * servo.abs() + 0.3,
            "joint {joint}: {servo} {pushed}"
        );
    }
}
