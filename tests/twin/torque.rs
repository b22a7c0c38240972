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
