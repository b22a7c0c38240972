//! The whole twin at work: the arm grasps a jar of water, lifts it, and pours it into a cup.

use super::*;

const ML: f64 = 1e-6;

/// Tool poses of a pour: the tool turns about its own axis, which rolls the jar sideways over its edge
/// at +y, while it moves so that the lip is at `y`, `z` m.
fn rolled(y: f64, z: f64, angle: f64) -> Isometry3<f64> {
    // The lip in the jar: half a width to the side and 5 cm above the pads.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -angle);
    let lip = turn * Vector3::new(0.0, 0.0325, 0.05);
    let upright = forward(0.61, 0.0, 0.0);
    let rotation = turn * upright.rotation;
    Isometry3::from_parts(Vector3::new(0.61, y - lip.y, z - lip.z).into(), rotation)
}

#[test]
fn the_arm_pours_a_jar_into_a_cup_and_every_drop_is_accounted_for() {
    let robot = gen3();
    // The stream leaves the lip at half a metre per second: it lands 4 cm further on.
    let (cup_y, lip_y) = (0.22, 0.19);
    let low = reach(&robot, &forward(0.61, 0.0, 0.09), &HOME);
    let poses = [("jar", at(0.62, 0.0, 0.0), 150.0 * ML), ("cup", at(0.62, cup_y, 0.0), 0.0)];
    let mut twin = twin(vec![jar(), cup()], &state(&low, &poses));
    twin.grip(0.0, 0.1, 40.0).unwrap();
    twin.run(0.8).unwrap();
    let above = reach(&robot, &forward(0.61, 0.0, 0.23), &low);
    drive(&mut twin, &above, 1.5);
    let mut q = reach(&robot, &rolled(lip_y, 0.26, 0.0), &above);
    drive(&mut twin, &q, 1.5);
    let state = twin.state();
    assert!((state.object("jar").unwrap().water.unwrap() - 150.0 * ML).abs() < 0.3 * ML);

    // 120 degrees in 8 s while the lip comes down from where the jar stands clear of the cup.
    for i in 1..=40 {
        let share = f64::from(i) / 40.0;
        let angle = share * 120.0_f64.to_radians();
        let next = reach(&robot, &rolled(lip_y, 0.26 - 0.13 * share, angle), &q);
        let speed: Vec<f64> = next.iter().zip(&q).map(|(a, b)| (a - b) / 0.2).collect();
        for k in 1..=100 {
            let t = f64::from(k) / 100.0;
            let at: Vec<f64> = q.iter().zip(&next).map(|(a, b)| a + (b - a) * t).collect();
            twin.command(&at, &speed).unwrap();
            twin.step().unwrap();
        }
        q = next;
    }
    twin.command(&q, &[0.0; 7]).unwrap();
    twin.run(1.5).unwrap();

    let state = twin.state();
    let water = |name: &str| state.object(name).unwrap().water.unwrap();
    let spilt = state.spilt.unwrap();
    assert_eq!(state.held.as_deref(), Some("jar"));
    assert!(water("cup") > 0.97 * 150.0 * ML, "in the cup {} mL", water("cup") / ML);
    assert!(spilt < 3.0 * ML, "spilt {} mL", spilt / ML);
    let sum = water("jar") + water("cup") + spilt;
    assert!((sum - 150.0 * ML).abs() < 1.0 * ML, "accounted for {} mL", sum / ML);
    // The cup feels what came in: it has not moved, and stands on the table.
    let cup = state.object("cup").unwrap().world_from_object.unwrap();
    assert!((cup.origin() - Vector3::new(0.62, cup_y, 0.0)).norm() < 2e-3, "{cup:?}");
}
