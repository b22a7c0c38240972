//! Water: level at rest, nothing lost, nothing through a wall.

use super::*;
use trueup::twin::FluidSettings;
use trueup::twin::fluid::{Filling, Fluid, Vessel};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

fn fluid(fillings: &[(Object, Isometry3<f64>, f64)], settings: &FluidSettings) -> Fluid {
    let fillings: Vec<Filling> = fillings
        .iter()
        .map(|(object, pose, water)| Filling {
            vessel: Vessel::new(object).unwrap(),
            pose: *pose,
            water: *water,
        })
        .collect();
    Fluid::new(settings, &fillings, scene(vec![]).table, GRAVITY, 1.0 / 250.0, 3).unwrap()
}

fn awake() -> FluidSettings {
    FluidSettings { freeze: false, ..FluidSettings::default() }
}

#[test]
fn probe_level() {
    for n in [300, 600, 1000, 2000] {
        let settings = FluidSettings { particles: n, ..awake() };
        for (object, area) in
            [(jar(), 0.059_f64.powi(2)), (cup(), std::f64::consts::PI * 0.077 * 0.077)]
        {
            for water in [1.0e-4, 1.5e-4, 2.5e-4] {
                let pose = at(0.6, 0.0, 0.0);
                let mut fluid = fluid(&[(object.clone(), pose, water)], &settings);
                for _ in 0..500 {
                    fluid.step(&[pose]);
                }
                let com = fluid.centre_in(0).unwrap();
                let level = 2.0 * (com.z - 0.003);
                println!(
                    "{n} {} {:.0} ml: level ratio {:.3} in {:.1}",
                    object.name,
                    water * 1e6,
                    level / (water / area),
                    fluid.volume_in(0) * 1e6
                );
            }
        }
    }
}
