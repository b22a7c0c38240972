//! Regression 1 on pairs of which three in ten are wrong: a thousand of them, a hundred thousand, and the forms side by side.
//!
//! Before the times it prints how far the maps are from the planted one, px: root mean square over a grid of the picture, median
//! over seeds.

#![expect(clippy::unwrap_used, reason = "a failed unwrap in a bench is a failed bench")]
#![expect(clippy::print_stderr, reason = "quality stands beside speed")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Matrix3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::alignment::image_map::{
    Model, NoiseIn, Options, Pair, apply, compare, fit_map, fit_map_ranked,
};
use trueup::world::Pixel;

/// The map that is planted: that of `tests/alignment/image_map.rs`.
fn truth() -> Matrix3<f64> {
    Matrix3::new(0.92, -0.08, 60.0, 0.11, 0.95, -35.0, 1.5e-4, -9e-5, 1.0)
}

/// Pairs in a 1000 × 800 picture with noise of 0.5 px in the real picture, three in ten anywhere.
fn planted(n: usize, seed: u64) -> Vec<Pair> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut at = || Pixel::new(random.random_range(0.0..1000.0), random.random_range(0.0..800.0));
    let places: Vec<(Pixel, Pixel)> = (0..n).map(|_| (at(), at())).collect();
    let mut normal = || {
        let (a, b): (f64, f64) =
            (random.random_range(f64::MIN_POSITIVE..1.0), random.random_range(0.0..1.0));
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    let pair = |(i, (twin, elsewhere)): (usize, (Pixel, Pixel))| {
        let seen = apply(&truth(), twin).unwrap();
        let real = Pixel::new(seen.u + 0.5 * normal(), seen.v + 0.5 * normal());
        Pair { real: if i % 10 < 3 { elsewhere } else { real }, twin }
    };
    places.into_iter().enumerate().map(pair).collect()
}

fn error(m: &Matrix3<f64>) -> f64 {
    let places = (0..81).map(|k| Pixel::new(125.0 * f64::from(k / 9), 100.0 * f64::from(k % 9)));
    let square = places.map(|p| apply(m, p).unwrap().distance(apply(&truth(), p).unwrap()).powi(2));
    (square.sum::<f64>() / 81.0).sqrt()
}

fn median_error(n: usize, seeds: u64, options: &Options) -> f64 {
    let fit = |seed| fit_map(&planted(n, seed), Model::Projective, options).unwrap();
    let mut errors: Vec<f64> = (0..seeds).map(|seed| error(&fit(seed).m)).collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

fn maps(criterion: &mut Criterion) {
    let options = Options { noise: NoiseIn::Real, ..Options::default() };
    for (n, seeds) in [(20, 200), (1000, 100), (100_000, 5)] {
        eprintln!("{n} pairs, 30 % wrong: {:.4} px", median_error(n, seeds, &options));
    }
    let mut group = criterion.benchmark_group("map");
    let sets: Vec<Vec<Pair>> = (0..16).map(|seed| planted(1000, seed)).collect();
    let mut next = 0;
    let mut any = || {
        next = (next + 1) % sets.len();
        &sets[next]
    };
    group.bench_function("projective, 1000 pairs, noise in the real picture", |bencher| {
        bencher.iter(|| fit_map(black_box(any()), Model::Projective, &options).unwrap());
    });
    let both = Options::default();
    group.bench_function("projective, 1000 pairs, noise in both pictures", |bencher| {
        bencher.iter(|| fit_map(black_box(any()), Model::Projective, &both).unwrap());
    });
    let scores: Vec<f64> = (0..1000).map(|i| if i % 10 < 3 { 0.2 } else { 0.8 }).collect();
    group.bench_function("the same with scores", |bencher| {
        bencher.iter(|| {
            fit_map_ranked(black_box(any()), Some(&scores), Model::Projective, &both).unwrap()
        });
    });
    let fit = fit_map(&sets[0], Model::Projective, &both).unwrap();
    group.bench_function("three forms side by side, 700 pairs kept", |bencher| {
        bencher.iter(|| compare(black_box(&sets[0]), &fit, &both));
    });
    let few = planted(20, 1);
    group.bench_function("projective, 20 pairs", |bencher| {
        bencher.iter(|| fit_map(black_box(&few), Model::Projective, &options).unwrap());
    });
    group.sample_size(20);
    let many = planted(100_000, 1);
    group.bench_function("projective, 100000 pairs", |bencher| {
        bencher.iter(|| fit_map(black_box(&many), Model::Projective, &options).unwrap());
    });
    group.finish();
}

criterion_group!(benches, maps);
criterion_main!(benches);
