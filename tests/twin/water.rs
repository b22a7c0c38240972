//! Water: level at rest, nothing lost, nothing through a wall.

use super::*;
use trueup::twin::FluidSettings;
use trueup::twin::fluid::{Dribble, Filling, Fluid, Rim, Vessel};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
const DT: f64 = 1.0 / 250.0;

fn fluid(fillings: &[(Object, Isometry3<f64>, f64)], settings: &FluidSettings) -> Fluid {
    let fillings: Vec<Filling> = fillings
        .iter()
        .map(|(object, pose, water)| Filling {
            vessel: Vessel::new(object).unwrap(),
            pose: *pose,
            water: *water,
            rim: Rim::default(),
        })
        .collect();
    Fluid::new(settings, &fillings, scene(vec![]).table, GRAVITY, DT, 3).unwrap()
}

/// Watches that no particle goes from the cavity of a vessel to the space beside or below it, or back,
/// without having been above the rim. Knows nothing of the fluid's own bookkeeping.
struct Witness {
    objects: Vec<Object>,
    places: Vec<Vec<Place>>,
    crossings: usize,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Place {
    Cavity,
    Beside,
    Above,
}

impl Witness {
    fn new(objects: &[Object]) -> Self {
        Self { objects: objects.to_vec(), places: vec![Vec::new(); objects.len()], crossings: 0 }
    }

    fn look(&mut self, poses: &[Isometry3<f64>], particles: &[Vector3<f32>]) {
        for (k, object) in self.objects.iter().enumerate() {
            let place = |p: &Vector3<f32>| {
                let local = poses[k].inverse() * nalgebra::Point3::from(p.cast::<f64>());
                let within = |outline: Shape| match outline {
                    Shape::Cuboid { size } => {
                        local.x.abs() <= size.x / 2.0 && local.y.abs() <= size.y / 2.0
                    }
                    Shape::Cylinder { radius, .. } => local.x.hypot(local.y) <= radius,
                    Shape::Lathe { profile } => {
                        local.x.hypot(local.y) <= profile.radius_at(local.z)
                    }
                    Shape::Mesh { .. } | Shape::Mug { .. } => panic!("not in these tests"),
                };
                // A particle on the rim is neither in nor beside.
                if local.z > object.shape.height() - 1e-4 {
                    Place::Above
                } else if local.z > 0.0 && within(object.inside().unwrap()) {
                    Place::Cavity
                } else {
                    Place::Beside
                }
            };
            let now: Vec<Place> = particles.iter().map(place).collect();
            for (then, now) in self.places[k].iter().zip(&now) {
                let crossed = matches!(
                    (then, now),
                    (Place::Cavity, Place::Beside) | (Place::Beside, Place::Cavity)
                );
                self.crossings += usize::from(crossed);
            }
            self.places[k] = now;
        }
    }
}

/// The pose of a jar turned by `angle` about its lip, which stays at `lip`.
fn tipped(lip: &Vector3<f64>, angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
    let lip_in_jar = Vector3::new(0.0, -0.0325, 0.14);
    Isometry3::from_parts((lip - turn * lip_in_jar).into(), turn)
}

#[test]
fn water_at_rest_stands_as_high_as_its_volume_says() {
    // Twice the height of the centre of mass is the level.
    for (object, area) in
        [(jar(), 0.059_f64.powi(2)), (cup(), std::f64::consts::PI * 0.077 * 0.077)]
    {
        for water in [1.5e-4, 2.5e-4] {
            let pose = at(0.6, 0.0, 0.0);
            let mut fluid = fluid(&[(object.clone(), pose, water)], &FluidSettings::default());
            for _ in 0..250 {
                fluid.step(&[pose]);
            }
            let ratio = 2.0 * (fluid.centre_in(0).unwrap().z - 0.003) / (water / area);
            assert!((ratio - 1.0).abs() < 1e-3, "{} {water}: {ratio}", object.name);
            assert!((fluid.volume_in(0) - water).abs() < 1e-9);
        }
    }
}

/// Returns what a jar of 150 mL still holds at each of some tilts (deg) while it is turned at a speed, mL.
fn turning(degrees_per_second: f64, at_degrees: &[f64], particles: usize) -> Vec<f64> {
    let lip = Vector3::new(0.5, 0.0, 0.4);
    let settings = FluidSettings { particles, ..FluidSettings::default() };
    let mut fluid = fluid(&[(jar(), tipped(&lip, 0.0), 1.5e-4)], &settings);
    let (mut step, mut held) = (0, Vec::new());
    for degrees in at_degrees {
        while degrees_per_second * f64::from(step) * DT < *degrees {
            step += 1;
            let angle = (degrees_per_second * f64::from(step) * DT).to_radians();
            fluid.step(&[tipped(&lip, angle)]);
        }
        held.push(fluid.volume_in(0) * 1e6);
    }
    held
}

#[test]
fn a_jar_that_is_turned_slowly_holds_what_geometry_and_a_weir_say() {
    // What stands below the lip's level: the wedge between it and the lower wall, `h² w / (2 tan θ)`.
    let wedge = |degrees: f64| 0.137_f64.powi(2) * 0.059 / (2.0 * degrees.to_radians().tan()) * 1e6;
    // Slowly, the head over the lip is that of a weir which passes what the turning sets free, dV/dθ dθ/dt.
    for (particles, speed, tilts) in [
        (300, 1.0, [79.0, 83.0, 87.0]),
        (600, 1.0, [79.0, 83.0, 87.0]),
        (600, 4.0, [84.0, 86.0, 88.0]),
        (2000, 4.0, [84.0, 86.0, 88.0]),
    ] {
        for (degrees, held) in tilts.iter().zip(turning(speed, &tilts, particles)) {
            let flow = (wedge(degrees - 0.5) - wedge(degrees + 0.5)) * speed * 1e-6;
            let head = (flow / (2.0 / 3.0 * 0.611 * 0.059 * 19.62_f64.sqrt())).powf(2.0 / 3.0);
            let above = head * 0.137 / degrees.to_radians().sin() * 0.059 * 1e6;
            let expected = wedge(*degrees) + above;
            let off = held - expected;
            assert!(off.abs() < 3.0, "{degrees} deg at {speed} deg/s: {held}, not {expected} mL");
        }
    }
    // A jar is not emptied by turning it to level: the last of it runs out beyond.
    let last = turning(10.0, &[90.0, 115.0], 600);
    assert!(last[0] > 20.0 && last[1] < 1.5, "{last:?} mL");
}

#[test]
fn the_last_of_a_jar_drains_as_a_film() {
    let lip = Vector3::new(0.5, 0.0, 0.4);
    let settings = FluidSettings { particles: 2000, ..FluidSettings::default() };
    let mut fluid = fluid(&[(jar(), tipped(&lip, 0.0), 1.5e-4)], &settings);
    let go = |fluid: &mut Fluid, from: f64, to: f64, seconds: f64| {
        let steps = (seconds / DT).round() as usize;
        for i in 1..=steps {
            let angle = from + (to - from) * i as f64 / steps as f64;
            fluid.step(&[tipped(&lip, angle.to_radians())]);
        }
    };
    go(&mut fluid, 0.0, 110.0, 9.0);
    go(&mut fluid, 110.0, 110.0, 1.0);
    for t in [2.0_f64, 4.0, 8.0] {
        go(&mut fluid, 110.0, 110.0, t / 2.0);
        // Jeffreys: the film on a plate is √(ν z / (g s t)) thick at a distance z from its upper end.
        let thick = (1e-6 * 0.137 / (9.81 * 20_f64.to_radians().sin() * t)).sqrt();
        let film = 2.0 / 3.0 * thick * 0.137 * 0.059 * 1e6;
        // It began to drain a little before, and the weir takes some of it too.
        let held = fluid.volume_in(0) * 1e6;
        assert!((0.4 * film..1.1 * film).contains(&held), "{held}, not {film} mL after {t} s");
    }
}

#[test]
fn a_shaken_jar_keeps_its_water_and_a_wild_one_throws_it_over_the_rim_only() {
    for (amplitude, wild) in [(0.025, false), (0.12, true)] {
        let pose = |t: f64| {
            let shift = amplitude * (1.0 - (2.0 * std::f64::consts::PI * t / 0.8).cos());
            let wobble = if wild { 0.6 } else { 0.1 } * (9.0 * t).sin();
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), wobble);
            Isometry3::from_parts(Vector3::new(0.5 + shift, 0.0, 0.2).into(), turn)
        };
        let mut fluid = fluid(&[(jar(), pose(0.0), 1.5e-4)], &FluidSettings::default());
        let mut witness = Witness::new(&[jar()]);
        for i in 0..500 {
            let now = [pose(f64::from(i) * DT)];
            fluid.step(&now);
            witness.look(&now, &fluid.positions());
        }
        assert_eq!(witness.crossings, 0, "amplitude {amplitude}");
        assert!((fluid.total() - 1.5e-4).abs() < 1e-9);
        if !wild {
            assert!((fluid.volume_in(0) - 1.5e-4).abs() < 1e-9, "{}", fluid.volume_in(0));
        }
    }
}

/// Pours a jar into a cup at 0.5 m: the lip starts 25 cm high, `y` from the cup's axis, and is lowered to
/// `z` while the jar is turned to 125 degrees. Returns the fluid at the end.
fn pour(y: f64, z: f64, degrees_per_second: f64) -> (Fluid, Witness) {
    let cup_pose = at(0.5, 0.0, 0.0);
    let jar_pose = |degrees: f64| {
        let down = ((degrees - 20.0) / 100.0).clamp(0.0, 1.0);
        tipped(&Vector3::new(0.5, y, 0.25 + (z - 0.25) * down), degrees.to_radians())
    };
    let fillings = [(jar(), jar_pose(0.0), 1.5e-4), (cup(), cup_pose, 0.0)];
    let mut fluid = fluid(&fillings, &FluidSettings::default());
    let mut witness = Witness::new(&[jar(), cup()]);
    let steps = ((125.0 / degrees_per_second + 1.5) / DT) as usize;
    for i in 0..steps {
        let degrees = (degrees_per_second * i as f64 * DT).min(125.0);
        let poses = [jar_pose(degrees), cup_pose];
        fluid.step(&poses);
        witness.look(&poses, &fluid.positions());
    }
    (fluid, witness)
}

#[test]
fn a_poured_jar_ends_in_the_cup_and_every_drop_is_accounted_for() {
    let (fluid, witness) = pour(0.02, 0.14, 20.0);
    let (jar, cup, spilt) = (fluid.volume_in(0), fluid.volume_in(1), fluid.spilt());
    assert_eq!(witness.crossings, 0);
    assert!((jar + cup + spilt - 1.5e-4).abs() < 1e-9, "{jar} {cup} {spilt}");
    assert!(cup > 0.97 * 1.5e-4 && spilt < 3e-6, "in the cup {cup}, spilt {spilt}");
}

#[test]
fn a_lip_below_the_rim_of_the_cup_loses_no_water_through_either_wall() {
    let (fluid, witness) = pour(-0.02, 0.075, 40.0);
    assert_eq!(witness.crossings, 0);
    let kept = fluid.volume_in(0) + fluid.volume_in(1) + fluid.spilt();
    assert!((kept - 1.5e-4).abs() < 1e-9, "{kept}");
    assert!(fluid.volume_in(1) > 0.9 * 1.5e-4, "{}", fluid.volume_in(1));
}

#[test]
fn a_jar_poured_beside_the_cup_spills_and_says_so() {
    let (fluid, witness) = pour(0.2, 0.15, 60.0);
    assert_eq!(witness.crossings, 0);
    assert!(fluid.volume_in(1) < 1e-6, "{}", fluid.volume_in(1));
    assert!(fluid.spilt() > 0.95 * 1.5e-4, "{}", fluid.spilt());
}

#[test]
fn a_full_jar_that_is_pushed_too_hard_spills_over_its_rim() {
    // 4 mm below the rim; a push of 6 m/s² wants 18 mm between the two walls, a gentle one of 0.5 m/s² 1.5 mm.
    let water = 0.059 * 0.059 * 0.133;
    for (acceleration, spills) in [(0.5, false), (6.0, true)] {
        let pose = |t: f64| {
            let t = t.min(0.4);
            at(0.5 + 0.5 * acceleration * t * t, 0.0, 0.2)
        };
        let mut fluid = fluid(&[(jar(), pose(0.0), water)], &FluidSettings::default());
        for step in 0..250 {
            fluid.step(&[pose(f64::from(step) * DT)]);
        }
        let lost = 1e6 * (water - fluid.volume_in(0));
        assert!((lost > 5.0) == spills && (lost < 0.5) != spills, "{acceleration} m/s²: {lost} mL");
    }
}

#[test]
fn the_weight_of_carried_water_is_where_it_stands() {
    let mut fluid = fluid(&[(jar(), at(0.5, 0.0, 0.0), 1.5e-4)], &FluidSettings::default());
    for i in 0..400 {
        let shift = 0.1 * f64::from(i) * DT;
        fluid.step(&[at(0.5 + shift, 0.0, shift)]);
    }
    let com = fluid.centre_in(0).unwrap();
    assert!(com.xy().norm() < 2e-3, "{com:?}");
    for _ in 0..5000 {
        fluid.step(&[tipped(&Vector3::new(0.6, -0.0325, 0.24), 0.3)]);
    }
    // By b² tan θ / (12 h), towards the lower wall.
    let depth = 1.5e-4 / 0.059_f64.powi(2);
    let aside = 0.059_f64.powi(2) * 0.3_f64.tan() / (12.0 * depth);
    let com = fluid.centre_in(0).unwrap();
    assert!((com.y + aside).abs() < 3e-4 && com.x.abs() < 1e-4, "{com:?}, {aside}");
}

#[test]
fn an_overfull_jar_is_refused() {
    let filling = Filling {
        vessel: Vessel::new(&jar()).unwrap(),
        pose: at(0.5, 0.0, 0.0),
        water: 1e-3,
        rim: Rim::default(),
    };
    let table = scene(vec![]).table;
    let made = Fluid::new(&FluidSettings::default(), &[filling], table, GRAVITY, DT, 0);
    assert_eq!(made.err(), Some(0));
}

/// A jar is turned over a bowl and back; what clings to its lip comes later, as a film drains.
#[test]
fn water_clings_to_a_lip_and_drains_exponentially_once_the_vessel_is_upright() {
    let dribble = Dribble { volume: 15e-6, delay: 0.8 };
    let bowl = vessel("bowl", Shape::Cylinder { radius: 0.2, height: 0.1 }, 0.2);
    let fillings = [
        Filling {
            vessel: Vessel::new(&jar()).unwrap(),
            pose: at(0.5, 0.0, 0.3),
            water: 120e-6,
            rim: Rim { dribble: Some(dribble), ..Rim::default() },
        },
        Filling {
            vessel: Vessel::new(&bowl).unwrap(),
            pose: at(0.5, 0.0, 0.0),
            water: 0.0,
            rim: Rim::default(),
        },
    ];
    let mut fluid =
        Fluid::new(&FluidSettings::default(), &fillings, scene(vec![]).table, GRAVITY, DT, 3)
            .unwrap();
    let turned = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        Isometry3::from_parts(at(0.5, 0.0, 0.3).translation, turn)
    };
    let go = |fluid: &mut Fluid, from: f64, to: f64, seconds: f64| {
        let steps = (seconds / DT).round() as usize;
        for i in 1..=steps {
            let angle = from + (to - from) * i as f64 / steps as f64;
            fluid.step(&[turned(angle), at(0.5, 0.0, 0.0)]);
        }
    };
    go(&mut fluid, 0.0, 2.4, 1.5);
    go(&mut fluid, 2.4, 2.4, 1.5);
    assert!((fluid.clinging(0) - dribble.volume).abs() < 0.4e-6, "{} m³", fluid.clinging(0));
    let film = fluid.volume_in(0) - fluid.clinging(0);
    assert!(film < 1e-6, "{film} m³");
    assert!((fluid.volume_in(1) + film - 105e-6).abs() < 1e-6, "{} m³", fluid.volume_in(1));
    go(&mut fluid, 2.4, 0.49, 1.0);
    go(&mut fluid, 0.49, 0.0, 0.2);
    // 0.2 s upright already; at 0.8 s one time constant has passed.
    go(&mut fluid, 0.0, 0.0, 0.6);
    let expected = dribble.volume * (-1.0_f64).exp();
    assert!((fluid.clinging(0) - expected).abs() < 0.5e-6, "{} m³", fluid.clinging(0));
    go(&mut fluid, 0.0, 0.0, 5.0);
    assert!(fluid.clinging(0) == 0.0);
    // What was not poured by then stands in the jar again.
    let both = fluid.volume_in(0) + fluid.volume_in(1);
    assert!((both - 120e-6).abs() < 1e-9, "{both} m³");
    assert!((fluid.volume_in(0) - film).abs() < 1e-9, "{} m³", fluid.volume_in(0));
}
