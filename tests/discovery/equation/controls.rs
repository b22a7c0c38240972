//! Machines that are as modelled and recordings that are not as in a book: errors of measurement are no effects.

use std::fmt::Write as _;

use rand::{RngExt, SeedableRng, rngs::StdRng};

use trueup::discovery::finding::{Finding, Verdict};
use trueup::discovery::recording::{Map, Recording};

use super::planted::CART;
use super::{ask, normal, record, table, wiggle};

type Row = [f64; 3];

/// Two recordings of a cart that is as modelled, after `spoil` has been at their rows.
fn spoilt(spoil: impl Fn(&mut Vec<Row>, &mut StdRng)) -> [Recording; 2] {
    [1_u32, 2].map(|seed| {
        let rates = |_: f64, u: f64, x: &[f64]| vec![x[1], 2.0 * u - 0.5 * x[1]];
        let input = |t: f64| wiggle(t, f64::from(seed));
        let text = table(350, 0.04, seed, 2e-4, &[0.0, 0.0], rates, |_, x| x[0], input);
        let row = |line: &str| -> Row {
            let mut cells = line.split(',').map(|cell| cell.parse().unwrap());
            std::array::from_fn(|_| cells.next().unwrap())
        };
        let mut rows: Vec<Row> = text.lines().skip(1).map(row).collect();
        spoil(&mut rows, &mut StdRng::seed_from_u64(100 + u64::from(seed)));
        let mut text = String::from("t[s],u,y\n");
        for [t, u, y] in rows {
            writeln!(text, "{t:.6},{u:.9},{y:.9}").unwrap();
        }
        Recording::read(&format!("spoilt {seed}"), &text, None, &Map::default()).unwrap()
    })
}

/// Noise that forgets itself over about ten rows, of standard deviation `size`.
fn coloured(size: f64, n: usize, rng: &mut StdRng) -> Vec<f64> {
    let mut last = size * normal(rng);
    let mut next = || {
        last = 0.9 * last + (1.0_f64 - 0.81).sqrt() * size * normal(rng);
        last
    };
    (0..n).map(|_| next()).collect()
}

#[track_caller]
fn lacks_nothing(recordings: &[Recording]) -> Finding {
    let finding = ask(CART, recordings).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    finding
}

#[test]
fn noise_that_follows_itself_is_no_effect() {
    for size in [0.005, 0.05] {
        lacks_nothing(&spoilt(|rows, rng| {
            let noise = coloured(size, rows.len(), rng);
            rows.iter_mut().zip(noise).for_each(|(row, noise)| row[2] += noise);
        }));
    }
}

/// A smooth wander of its own in each recording, which nothing in the model goes with, was called noise of a size that no
/// sensor has whose rows differ by a hundredth of it.
#[test]
fn a_gap_far_above_the_noise_is_not_called_noise() {
    let recordings = spoilt(|rows, rng| {
        let noise = coloured(1.5, rows.len() + 40, rng);
        let smooth: Vec<f64> = noise.windows(20).map(|w| w.iter().sum::<f64>() / 20.0).collect();
        let smoother = smooth.windows(20).map(|w| w.iter().sum::<f64>() / 20.0);
        rows.iter_mut().zip(smoother).for_each(|(row, wander)| row[2] += wander);
    });
    let finding = ask(CART, &recordings).unwrap().finding;
    assert_ne!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
}

#[test]
fn a_coarse_sensor_is_no_effect() {
    for step in [0.01, 0.1] {
        lacks_nothing(&spoilt(|rows, _| {
            for row in rows.iter_mut() {
                row[2] = (row[2] / step).round() * step;
            }
        }));
    }
}

#[test]
fn stamps_that_jitter_are_no_effect() {
    lacks_nothing(&spoilt(|rows, rng| {
        for row in rows.iter_mut() {
            row[0] += 0.003 * normal(rng).clamp(-3.0, 3.0);
        }
    }));
}

#[test]
fn rows_that_are_lost_are_no_effect() {
    lacks_nothing(&spoilt(|rows, rng| {
        let mut row = 0_u32;
        rows.retain(|_| {
            row += 1;
            !row.is_multiple_of(12) && rng.random_range(0.0..1.0) < 0.9
        });
    }));
}

/// A ball that falls, its height read off a video whose errors are smooth in time.
#[test]
fn a_ball_in_a_video_falls_freely_and_a_light_one_is_dragged() {
    let model = "model ball {\n    state h = free, v = free\n    h' = v\n    v' = -9.80665\n    output h = h\n}\n";
    let made = |seed: u32, drag: f64| {
        let rates = |_: f64, _: f64, x: &[f64]| vec![x[1], -9.80665 - drag * x[1]];
        let start = [45.0, 0.3 * f64::from(seed)];
        let text = table(45, 0.0667, seed, 0.0, &start, rates, |_, x| x[0], |_| 0.0);
        let mut rng = StdRng::seed_from_u64(u64::from(seed));
        let noise = coloured(0.05, 45, &mut rng);
        let mut out = String::from("t[s],h\n");
        for (line, noise) in text.lines().skip(1).zip(noise) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            writeln!(out, "{},{}", cells[0], cells[2] + noise).unwrap();
        }
        Recording::read(&format!("ball {seed}"), &out, None, &Map::default()).unwrap()
    };
    for (a, b) in [(1, 2), (2, 1), (3, 4), (4, 3)] {
        let free = ask(model, &[made(a, 0.0), made(b, 0.0)]).unwrap().finding;
        assert_eq!(free.verdict, Verdict::NothingMissing, "{free:#?}");
        let light = ask(model, &[made(a, 0.3), made(b, 0.3)]).unwrap().finding;
        assert!(matches!(light.verdict, Verdict::Named | Verdict::Ambiguous), "{light:#?}");
        let drags = ["linear_damping", "quadratic_drag"];
        assert!(light.effects.iter().all(|e| drags.contains(&e.name.as_str())), "{light:#?}");
    }
}

/// A fall that looks slow was called a wrong scale of the sensor, in no doubt, beside a note that a wrong clock says as much.
#[test]
fn a_fall_at_another_rate_may_be_the_clock_s() {
    let model = "model ball {\n    state h = free, v = free\n    h' = v\n    v' = -9.80665\n    output y = h\n}\n";
    let made = |seed: u32| {
        let start = [20.0, 3.0 * f64::from(seed)];
        let rates = |_: f64, _: f64, x: &[f64]| vec![x[1], -7.75];
        record(90, 1.0 / 60.0, seed, 5e-3, &start, rates, |_, x| x[0], |_| 0.0)
    };
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    let [effect] = &finding.effects[..] else { panic!("{finding:#?}") };
    assert!(effect.indistinguishable, "{effect:#?}");
    assert!(finding.reason.contains("or a wrong clock (times 0.88"), "{}", finding.reason);
    assert_eq!(outcome.text, model);
    let next = finding.next_experiment.as_ref().unwrap();
    assert!(next.why.contains("whose duration is known"), "{next:?}");
}

/// Fitted to one machine and judged on another, a model is not right because it fits the first.
#[test]
fn another_machine_is_not_noise() {
    let made = |seed: u32, stiffness: f64, scale: f64| {
        let rates = |_: f64, u: f64, x: &[f64]| vec![x[1], u - stiffness * x[0] - 0.4 * x[1]];
        let input = |t: f64| 4.0 * wiggle(t, f64::from(seed));
        let text = table(300, 0.03, seed, 1e-3, &[0.0; 2], rates, |_, x| scale * x[0], input);
        Recording::read(&format!("machine {seed}"), &text, None, &Map::default()).unwrap()
    };
    let model = "model m {\n    input u\n    param stiffness = free ~ 10, damping = free ~ 0.5\n    state q = free, v = free\n    q' = v\n    v' = u - stiffness*q - damping*v\n    output y = q\n}\n";
    let finding = ask(model, &[made(1, 14.0, 1.0), made(2, 15.7, 0.8)]).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert!(finding.effects.is_empty(), "{finding:#?}");
}
