//! One second of the twin: standing still, and with all the water awake.

#![expect(clippy::unwrap_used, reason = "a failed unwrap in a bench is a failed bench")]

#[path = "../tests/kitchen.rs"]
#[expect(dead_code, reason = "shared with the tests, which use more of it")]
mod kitchen;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use trueup::motion::Robot;
use trueup::twin::fluid::{Filling, Fluid, Rim, Vessel};
use trueup::twin::{FluidSettings, Settings, Twin};

fn twin(criterion: &mut Criterion) {
    let scene = kitchen::scene();
    let robot = Robot::gen3();
    let state = kitchen::state([0.60, -0.10, 0.3], [0.58, 0.20, 0.0]);
    let built = Twin::new(&robot, &scene, &state, Settings::for_arm(&robot)).unwrap();
    let mut group = criterion.benchmark_group("step");
    group.sample_size(10);
    group.bench_function("twin, water asleep, 1 s", |bencher| {
        bencher.iter_batched(
            || built.clone(),
            |mut twin| twin.run(1.0).unwrap(),
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

/// The jar turning about its lip above the cup.
fn tipped(angle: f64) -> Isometry3<f64> {
    let lip = Vector3::new(0.0, 0.0325, 0.14);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -angle);
    Isometry3::from_parts((Vector3::new(0.58, 0.16, 0.16) - turn * lip).into(), turn)
}

fn water(criterion: &mut Criterion) {
    let scene = kitchen::scene();
    let filling = |k: usize, pose, water| Filling {
        vessel: Vessel::new(&scene.objects[k]).unwrap(),
        pose,
        water,
        rim: Rim::default(),
    };
    let cup = Isometry3::translation(0.58, 0.20, 0.0);
    let fillings = [filling(0, tipped(0.0), 150e-6), filling(1, cup, 0.0)];
    let down = Vector3::new(0.0, 0.0, -9.81);
    let mut group = criterion.benchmark_group("step");
    group.sample_size(10);
    for particles in [600, 2000] {
        let settings = FluidSettings { particles, ..FluidSettings::default() };
        let built = Fluid::new(&settings, &fillings, scene.table, down, 0.004, 3).unwrap();
        group.bench_function(format!("pouring {particles} particles, 1 s"), |bencher| {
            bencher.iter_batched(
                || built.clone(),
                |mut fluid| {
                    for k in 0..250 {
                        fluid.step(&[tipped(f64::from(k) * 0.0075), cup]);
                    }
                    fluid
                },
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, twin, water);
criterion_main!(benches);
