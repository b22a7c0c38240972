//! A recording for tests, made by a model that is known.

use super::columns::Data;
use super::estimate::Point;
use super::fitting::Bench;
use super::simulate::{Hold, Scheme};

/// Sixty rows, fitted and held out, of a model called `m` with one input, one state that begins at 0 and nothing free.
pub(super) fn bench(truth: &str) -> Bench {
    let rows: Vec<f64> = (0..60).map(f64::from).collect();
    let data = Data {
        name: String::new(),
        time: rows.iter().map(|row| 0.1 * row).collect(),
        inputs: vec![rows.iter().map(|row| (0.3 * row).sin()).collect()],
        outputs: vec![vec![0.0; rows.len()]],
        noise: vec![1e-3],
        begins: true,
    };
    let mut bench = Bench {
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
    };
    let compiled = bench.prepare(truth, "m").unwrap();
    let point = Point { params: Vec::new(), starts: vec![vec![None]] };
    let values = bench.task(&compiled).run(&point).unwrap();
    let seen: Vec<f64> =
        values.iter().zip(&rows).map(|(value, row)| value + 1e-3 * (37.0 * row).sin()).collect();
    bench.train[0].outputs[0].clone_from(&seen);
    bench.held[0].outputs[0] = seen;
    bench
}
