//! A recording for tests, made by a model that is known.

use super::columns::Data;
use super::estimate::Point;
use super::fitting::Bench;
use super::simulate::{Hold, Scheme};

/// Rows at 10 Hz, fitted and held out, of an input and of an output that nobody has seen yet: it is 0.
pub(super) fn unseen(rows: u32, noise: f64, input: fn(f64) -> f64) -> Bench {
    let rows: Vec<f64> = (0..rows).map(f64::from).collect();
    let data = Data {
        name: String::new(),
        time: rows.iter().map(|row| 0.1 * row).collect(),
        step: 0.1,
        inputs: vec![rows.iter().map(|row| input(*row)).collect()],
        outputs: vec![vec![0.0; rows.len()]],
        noise: vec![noise],
        begins: true,
    };
    Bench {
        train: vec![data.clone()],
        held: vec![data],
        rows: None,
        most_rows: 5000,
        scheme: Scheme { hold: Hold::Line, substeps: 1, shift: 0.0 },
        all_starts_free: false,
        scales: vec![1.0],
        row: 0.1,
        anchored: Vec::new(),
        work: std::sync::Arc::default(),
    }
}

/// Sixty rows, fitted and held out, of a model called `m` with one input, one state that begins at 0 and nothing free.
pub(super) fn bench(truth: &str) -> Bench {
    let mut bench = unseen(60, 1e-3, |row| (0.3 * row).sin());
    let compiled = bench.prepare(truth, "m").unwrap();
    let point = Point { params: Vec::new(), starts: vec![vec![None]] };
    let values = bench.task(&compiled).run(&point).unwrap();
    let noise = (0..60).map(|row| 1e-3 * (37.0 * f64::from(row)).sin());
    let seen: Vec<f64> = values.iter().zip(noise).map(|(value, noise)| value + noise).collect();
    bench.train[0].outputs[0].clone_from(&seen);
    bench.held[0].outputs[0] = seen;
    bench
}
