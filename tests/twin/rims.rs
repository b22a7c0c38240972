//! What the particles are helped with at a rim: thick liquid leaves as a sheet does, a full vessel runs over; and
//! which effects of a `twin` block change anything.

use super::*;
use trueup::twin::fluid::{Filling, Fluid, Rim, Vessel};
use trueup::twin::{Effect, FluidSettings};

const DT: f64 = 1.0 / 240.0;

/// A jar of 150 mL, held so that its lip is over a bowl, turned to 115 degrees in 8 s and left there; returns what
/// was in jar, bowl and beside them at each second, mL.
fn turned_over(jar_rim: Rim, bowl_rim: Rim, seconds: f64) -> Vec<[f64; 3]> {
    let bowl = vessel("bowl", Shape::Cylinder { radius: 0.15, height: 0.1 }, 0.2);
    let lip = Vector3::new(0.0325, 0.0, 0.14);
    let pose = |tilt: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        Isometry3::from_parts((Vector3::new(0.5, 0.0, 0.2) - turn * lip).into(), turn)
    };
    let filling = |object: &Object, pose: Isometry3<f64>, water: f64, rim: Rim| Filling {
        vessel: Vessel::new(object).unwrap(),
        pose,
        water,
        rim,
    };
    let fillings = [
        filling(&jar(), pose(0.0), 150e-6, jar_rim),
        filling(&bowl, at(0.5, 0.0, 0.0), 0.0, bowl_rim),
    ];
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let settings = FluidSettings::default();
    let mut fluid = Fluid::new(&settings, &fillings, scene(vec![]).table, gravity, DT, 3).unwrap();
    let mut found = Vec::new();
    for step in 0..(seconds / DT) as usize {
        let t = step as f64 * DT;
        fluid.step(&[pose(2.0 * (t / 8.0).min(1.0)), at(0.5, 0.0, 0.0)]);
        if step % 240 == 239 {
            found.push([fluid.volume_in(0), fluid.volume_in(1), fluid.spilt()].map(|v| 1e6 * v));
        }
    }
    found
}

#[test]
fn a_thick_liquid_leaves_the_slower_the_thicker_and_all_of_it_is_accounted_for() {
    let left = |viscosity: f64| {
        let rim = Rim { viscosity: Some(viscosity), ..Rim::default() };
        let seen = turned_over(rim, Rim::default(), 20.0);
        let [jar, bowl, spilt] = seen[seen.len() - 1];
        // What has just left is in the air.
        assert!((jar + bowl + spilt - 150.0).abs() < 1.5, "{jar} {bowl} {spilt} mL");
        assert!(spilt < 1.0, "{spilt} mL");
        jar
    };
    let (thin, thick, thicker) = (left(1e-3), left(0.3), left(1.2));
    assert!(thin < 1.0, "{thin} mL of water stayed");
    // A film of depth √(μ L / (ρ g s t)) at the lip and two thirds of that on the mean drains from a wall (Jeffreys,
    // 1930): about 5 mL on the jar's 81 cm² after 12 s at 0.3 Pa·s. One head over the lip is a coarser law than that.
    assert!((4.0..12.0).contains(&thick), "{thick} mL");
    // It goes with the root of the viscosity.
    assert!((thicker / thick - 2.0).abs() < 0.25, "{thicker} mL for {thick} mL");
}

#[test]
fn a_full_vessel_runs_over_and_keeps_what_it_holds() {
    let brim = Rim { brim: Some(90e-6), ..Rim::default() };
    let seen = turned_over(Rim::default(), brim, 13.0);
    let [jar, bowl, spilt] = seen[seen.len() - 1];
    assert!(jar < 1.0 && (bowl - 90.0).abs() < 0.3, "{jar} mL, {bowl} mL");
    assert!((spilt - 60.0).abs() < 1.5, "{spilt} mL");
    // Also where it is full at its rim: particles pile up over one by themselves.
    let dish = vessel("dish", Shape::Cylinder { radius: 0.04, height: 0.016 }, 0.1);
    let filling = |object: &Object, pose, water| Filling {
        vessel: Vessel::new(object).unwrap(),
        pose,
        water,
        rim: Rim::default(),
    };
    let lip = Vector3::new(0.0325, 0.0, 0.14);
    let pose = |tilt: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        Isometry3::from_parts((Vector3::new(0.48, 0.0, 0.1) - turn * lip).into(), turn)
    };
    let fillings =
        [filling(&super::jar(), pose(0.0), 150e-6), filling(&dish, at(0.5, 0.0, 0.0), 0.0)];
    let (table, gravity) = (scene(vec![]).table, Vector3::new(0.0, 0.0, -9.81));
    let mut fluid =
        Fluid::new(&FluidSettings::default(), &fillings, table, gravity, DT, 3).unwrap();
    for step in 0..(11.0 / DT) as usize {
        let tilt = 2.0 * (step as f64 * DT / 9.0).min(1.0);
        fluid.step(&[pose(tilt), at(0.5, 0.0, 0.0)]);
    }
    let to_rim = std::f64::consts::PI * 0.037 * 0.037 * 0.013;
    assert!(fluid.volume_in(1) < to_rim + 0.3e-6, "{} of {to_rim} m³", fluid.volume_in(1));
    assert!(fluid.volume_in(1) > 0.7 * to_rim, "{} of {to_rim} m³", fluid.volume_in(1));
}

#[test]
fn effects_change_the_scene_and_say_when_they_change_nothing() {
    let number = |wanted: &'static [(&str, f64)]| {
        move |name: &str| wanted.iter().find(|(own, _)| *own == name).map(|(_, value)| *value)
    };
    let mut kitchen = scene(vec![jar(), cup()]);
    let known = |name: &str, at: &str, numbers: &'static [(&str, f64)]| {
        Effect::known(name, at, number(numbers))
    };
    let wider = known("object_size", "jar", &[("dx", 4e-3), ("dz", -1e-2)]).unwrap();
    wider.change_scene(&mut kitchen);
    let size = Shape::Cuboid { size: Vector3::new(0.069, 0.065, 0.13) };
    assert_eq!(kitchen.object("jar").unwrap().shape, size);
    known("overflow", "cup", &[("level", 9e-5)]).unwrap().change_scene(&mut kitchen);
    assert!((kitchen.object("cup").unwrap().cavity.unwrap().capacity - 9e-5).abs() < 1e-12);

    let mut settings = Settings::for_arm(&gen3());
    known("liquid_viscosity", "jar", &[("viscosity", 0.4)]).unwrap().change_settings(&mut settings);
    known("overflow", "jar", &[("level", 9e-5)]).unwrap().change_settings(&mut settings);
    let expected = Rim { dribble: None, viscosity: Some(0.4), brim: Some(9e-5) };
    assert_eq!(settings.rims["jar"], expected);
    // A rotor is said whole: what is found is in the place of what a twin has for its servo's sake.
    known("armature", "joint_3", &[("inertia", 0.15)]).unwrap().change_settings(&mut settings);
    assert!((settings.arm.armature[2] - 0.15).abs() < 1e-12);

    // A slip has one law; a place that is not there has none.
    assert!(known("grip_slip", "gripper", &[("rate", 1e-3), ("friction", 0.2)]).is_none());
    assert!(known("grip_slip", "jar", &[("rate", 1e-3)]).is_none());
    assert!(known("backlash", "joint_1", &[("width", 1e-3)]).is_none());
    let why = |name: &str, at: &str, numbers: &'static [(&str, f64)]| {
        known(name, at, numbers).unwrap().hindrance(&scene(vec![jar(), solid_block()]), 7)
    };
    assert_eq!(why("object_mass", "jar", &[("mass", 0.2)]), None);
    assert!(
        why("object_mass", "jug", &[("mass", 0.2)])
            .unwrap()
            .to_string()
            .contains("no object `jug`")
    );
    assert!(
        why("overflow", "block", &[("level", 1e-4)]).unwrap().to_string().contains("no vessel")
    );
    assert!(
        why("coulomb_friction", "joint_8", &[("torque", 1.0)])
            .unwrap()
            .to_string()
            .contains("7 joints")
    );
}

fn solid_block() -> Object {
    solid("block", Shape::Cuboid { size: Vector3::new(0.04, 0.04, 0.04) }, 0.1)
}
