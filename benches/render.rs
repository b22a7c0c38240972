//! Drawing the kitchen: what the twin's pictures and the laboratory's photos cost.

#![expect(clippy::unwrap_used, reason = "a failed unwrap in a bench is a failed bench")]

#[path = "../tests/kitchen.rs"]
mod kitchen;

use criterion::{Criterion, criterion_group, criterion_main};
use trueup::lab::{Lab, LabSettings};
use trueup::motion::Robot;
use trueup::twin::render::{ArmLook, Options, View, radiance, render};

/// The arm reaching out level over the table, rad.
const REACHING: [f64; 7] =
    [-0.35, 0.95, std::f64::consts::PI, -1.75, 0.0, 1.13, std::f64::consts::FRAC_PI_2];

fn pictures(criterion: &mut Criterion) {
    let scene = kitchen::scene();
    let mut camera = scene.camera;
    (camera.intrinsics.k1, camera.intrinsics.k2) = (-0.15, 0.02);
    let robot = Robot::gen3();
    let urdf = urdf_rs::read_from_string(kitchen::URDF).unwrap();
    let state = kitchen::state([0.60, -0.10, 0.3], [0.58, 0.20, 0.0]);
    let links = kitchen::links(&urdf, &REACHING, 0.085);
    let view = View::of(&scene, &state, &ArmLook::new(&robot), &links);
    let mut group = criterion.benchmark_group("render");
    group.sample_size(20);
    group.bench_function("kitchen 1280x720", |bencher| {
        bencher.iter(|| render(&camera, &view, &Options::default()));
    });
    group.bench_function("kitchen 1280x720, 4 samples", |bencher| {
        bencher.iter(|| render(&camera, &view, &Options { edge_samples: 4, ..Options::default() }));
    });
    group.bench_function("kitchen 1280x720, quick", |bencher| {
        bencher.iter(|| radiance(&camera, &view, &Options::quick()));
    });
    let mut small = camera;
    let lens = &mut small.intrinsics;
    (lens.width, lens.height) = (640, 480);
    for number in [&mut lens.fx, &mut lens.fy, &mut lens.cx] {
        *number *= 0.5;
    }
    lens.cy = 239.5;
    group.bench_function("kitchen 640x480", |bencher| {
        bencher.iter(|| render(&small, &view, &Options::default()));
    });
    group.bench_function("kitchen 640x480, quick", |bencher| {
        bencher.iter(|| radiance(&small, &view, &Options::quick()));
    });
    let mut lab = Lab::new(&robot, &scene, LabSettings::default(), 1).unwrap();
    group.bench_function("lab photo", |bencher| bencher.iter(|| lab.photo()));
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
