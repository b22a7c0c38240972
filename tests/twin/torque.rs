//! The twin's own inverse dynamics against closed forms and published values.

use super::*;

#[test]
fn a_hanging_links_torque_is_its_weight_times_its_lever() {
    // One link on a horizontal axis: tau = m g l cos(q), plus the inertia m l² + I when accelerated.
    let text = r#"<robot name="pendulum">
      <link name="base"/>
      <link name="rod"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
        <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
      <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/>
        <axis xyz="0 -1 0"/><limit effort="50" velocity="5"/></joint>
      <link name="left"/><link name="right"/>
      <joint name="l" type="prismatic"><parent link="rod"/><child link="left"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
      <joint name="r" type="prismatic"><parent link="rod"/><child link="right"/><axis xyz="-1 0 0"/>
        <limit lower="0" upper="0.04" effort="1" velocity="1"/><mimic joint="l"/></joint>
    </robot>"#;
    let model = ArmModel::from_urdf_text(text, "rod").unwrap();
    let tree = trueup::twin::physics::Tree::new(&model);
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    for (q, ddq) in [(0.0, 0.0), (0.7, 0.0), (1.2, 3.0), (-2.0, -1.5)] {
        let full = |value: f64| vec![0.0, value, 0.0, 0.0];
        let tau = tree.inverse_dynamics(&full(q), &full(0.4), &full(ddq), gravity, None);
        let expected = 2.0 * 9.81 * 0.3 * f64::cos(q) + (2.0 * 0.09 + 0.02) * ddq;
        assert!((tau[1] - expected).abs() < 1e-12, "{} for {expected}", tau[1]);
    }
}

#[test]
fn gravity_torques_are_the_gradient_of_potential_energy() {
    let model = gen3();
    let height = |q: &[f64]| -> f64 {
        let poses = model.base_from_links(q, 0.085);
        let energy = model.links.iter().zip(&poses).map(|(link, pose)| {
            let com = pose * nalgebra::Point3::from(link.inertia.com);
            link.inertia.mass * 9.81 * com.z
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
    let model = gen3();
    let mut settings = Settings::for_arm(&model);
    settings.arm.uncompensated = 1.0;
    let kp = settings.arm.kp.clone();
    let mut twin = Twin::new(&model, &scene(vec![]), &state(&HOME, &[]), settings).unwrap();
    twin.run(1.5).unwrap();
    let tau = twin.torques();
    for (i, q) in twin.q().iter().enumerate() {
        let sag = tau[i] / kp[i];
        assert!((HOME[i] - q - sag).abs() < 1e-4, "joint {}: {} for {sag}", i + 1, HOME[i] - q);
    }
}
