//! Models given by equations: planted effects are found, controls have none, bad input is told.
//!
//! The truth is integrated here by other means than in the program: small Euler-Cromer or midpoint steps
//! in closures that know nothing of model texts.

mod planted;
mod shown;
mod field;
mod textbook;
mod unnamed;
mod numerics;
mod controls;
mod public;

use std::fmt::Write as _;

use rand::{RngExt, SeedableRng, rngs::StdRng};

use trueup::discovery::equation::{Error, Options, Outcome, investigate};
use trueup::discovery::recording::{Map, Recording};

/// Normal noise, by the sum of twelve uniform numbers.
fn normal(rng: &mut StdRng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

/// A smooth input that goes slow and fast, different for every seed.
fn wiggle(t: f64, seed: f64) -> f64 {
    (0.9 * t + seed).sin() + 0.7 * (2.3 * t + 2.0 * seed).sin() + 0.4 * (4.1 * t - seed).cos()
}

/// Records `n` rows `step` s apart: the input, and what `measure` makes of the state after `rates` has
/// carried it on in 50 midpoint steps a row, with noise.
#[expect(clippy::too_many_arguments, reason = "an experiment is described by as many")]
fn record(
    n: usize,
    step: f64,
    seed: u32,
    noise: f64,
    start: &[f64],
    rates: impl Fn(f64, f64, &[f64]) -> Vec<f64>,
    measure: impl Fn(f64, &[f64]) -> f64,
    input: impl Fn(f64) -> f64,
) -> Recording {
    let text = table(n, step, seed, noise, start, rates, measure, input);
    Recording::read(&format!("planted {seed}"), &text, None, &Map::default()).unwrap()
}

/// The same as the text of a recording.
#[expect(clippy::too_many_arguments, reason = "an experiment is described by as many")]
fn table(
    n: usize,
    step: f64,
    seed: u32,
    noise: f64,
    start: &[f64],
    rates: impl Fn(f64, f64, &[f64]) -> Vec<f64>,
    measure: impl Fn(f64, &[f64]) -> f64,
    input: impl Fn(f64) -> f64,
) -> String {
    let mut rng = StdRng::seed_from_u64(u64::from(seed));
    let mut x = start.to_vec();
    let mut text = String::from("t[s],u,y\n");
    for i in 0..n {
        let t = i as f64 * step;
        let seen = measure(t, &x) + noise * normal(&mut rng);
        writeln!(text, "{t:.6},{:.9},{seen:.9}", input(t)).unwrap();
        let h = step / 50.0;
        for k in 0..50_u32 {
            // Between rows a computer holds its command.
            let u = input(t);
            let time = t + f64::from(k) * h;
            let half: Vec<f64> =
                x.iter().zip(rates(time, u, &x)).map(|(x, d)| x + 0.5 * h * d).collect();
            let d = rates(time + 0.5 * h, u, &half);
            x.iter_mut().zip(d).for_each(|(x, d)| *x += h * d);
        }
    }
    text
}

fn ask(model: &str, recordings: &[Recording]) -> Result<Outcome, Error> {
    investigate("model.task", model, "", recordings, &Options::default(), &mut |_, _| {})
}
