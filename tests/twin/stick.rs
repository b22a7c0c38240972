//! What the jaws hold sticks to the pads: it stays where it is, slides when friction does not suffice, and is let go.

use super::*;

/// A block between the jaws, 0.2 m over the table.
fn lifted(friction: f64, mass: f64) -> (Twin, Vec<f64>) {
    let robot = gen3();
    let low = reach(&robot, &forward(0.61, 0.0, 0.09), &HOME);
    let high = reach(&robot, &forward(0.61, 0.0, 0.29), &low);
    let block = solid("block", Shape::Cuboid { size: Vector3::new(0.05, 0.05, 0.18) }, mass);
    let mut settings = Settings::for_arm(&robot);
    settings.friction.pad_object = friction;
    let start = state(&low, &[("block", at(0.62, 0.0, 0.0), 0.0)]);
    let mut twin = Twin::new(&robot, &scene(vec![block]), &start, settings).unwrap();
    twin.grip(0.0, 0.1, 40.0).unwrap();
    twin.run(0.8).unwrap();
    drive(&mut twin, &high, 1.5);
    (twin, high)
}

fn in_tool(twin: &Twin) -> Isometry3<f64> {
    let state = twin.state();
    let block = state.object("block").unwrap().world_from_object.unwrap();
    (state.world_from_tool.inverse() * block).isometry().to_owned()
}

/// A pad goes along an arc, what it holds along a chord: the engine let a jar drift by 0.1 mm in two seconds of a motion.
#[test]
fn what_is_carried_around_stays_where_it_sticks() {
    let (mut twin, high) = lifted(0.8, 0.3);
    let start = in_tool(&twin);
    let snapshot = twin.snapshot();
    let around = |twin: &mut Twin| {
        let moved = |joint: usize, by: f64| {
            let mut q = high.clone();
            q[joint] += by;
            q
        };
        for goal in [moved(0, 0.6), moved(6, 1.5), moved(5, -0.5), high.clone()] {
            drive(twin, &goal, 1.5);
        }
        twin.run(0.5).unwrap();
        twin.state()
    };
    let first = around(&mut twin);
    let slip = start.inverse() * in_tool(&twin);
    assert!(slip.translation.vector.norm() < 1e-5, "{:?} m", slip.translation.vector);
    assert!(slip.rotation.angle() < 1e-4, "{} rad", slip.rotation.angle());
    // What sticks is part of a snapshot.
    assert_eq!(around(&mut snapshot.into_twin()), first);
}

/// Returns how a block comes down in the hand that is held with this share of the force that bears it: what it has gone
/// in 0.15 s, m, and its acceleration, m/s².
fn slides(share: f64) -> (f64, f64) {
    let (friction, mass) = (0.2, 0.3);
    let (mut twin, _) = lifted(friction, mass);
    let start = in_tool(&twin);
    twin.grip(0.0, 0.1, share * mass * 9.81 / (2.0 * friction)).unwrap();
    let mut after = |seconds: f64| {
        twin.run(seconds).unwrap();
        (start.inverse() * in_tool(&twin)).translation.vector.norm()
    };
    // While the jaws give way to the new force the block falls.
    let (a, b, c) = (after(0.05), after(0.05), after(0.05));
    (c, (c - 2.0 * b + a) / 0.0025)
}

#[test]
fn what_is_held_with_too_little_slides_as_coulomb_says_and_stays_with_enough() {
    for share in [0.5, 0.8, 0.9] {
        let (_, found) = slides(share);
        let expected = 9.81 * (1.0 - share);
        assert!((found / expected - 1.0).abs() < 0.05, "{share}: {found} for {expected} m/s²");
    }
    let (gone, _) = slides(1.1);
    assert!(gone < 1e-4, "{gone} m");
}

#[test]
fn what_is_let_go_falls_freely() {
    let (mut twin, _) = lifted(0.8, 0.3);
    twin.grip(0.085, 1.0, 40.0).unwrap();
    twin.run(0.1).unwrap();
    let (before, _) = twin.object_velocity("block").unwrap();
    twin.run(0.04).unwrap();
    let (after, _) = twin.object_velocity("block").unwrap();
    let fell = (before.z - after.z) / 0.04;
    assert!((fell / 9.81 - 1.0).abs() < 1e-6, "{fell} m/s²");
    assert_eq!(twin.state().held, None);
}
