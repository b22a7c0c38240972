//! Where in the state, the input or time a residual is largest, in words.

use super::columns::{mean, std};
use super::hypothesis::{Hypothesis, Question};

/// The state, input or time that a residual follows most, in words.
pub(super) fn concentrated(question: &Question, hypothesis: &Hypothesis, output: usize) -> String {
    let fitted = &hypothesis.fitted;
    let bench = &question.bench;
    let task = bench.task(&fitted.compiled);
    let residual = &fitted.train.residuals[output];
    let mut features: Vec<(String, Vec<f64>)> = Vec::new();
    let rows: Vec<(usize, usize)> =
        task.windows.iter().flat_map(|w| w.rows.clone().map(move |r| (w.data, r))).collect();
    let column = |pick: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        rows.iter().map(|(d, r)| pick(*d, *r)).collect()
    };
    features.push(("t".into(), column(&|d, r| bench.train[d].time[r])));
    for (i, (name, _)) in fitted.compiled.inputs.iter().enumerate() {
        features.push((name.clone(), column(&|d, r| bench.train[d].inputs[i][r])));
    }
    for (o, out) in fitted.compiled.outputs.iter().enumerate() {
        features.push((out.name.clone(), column(&|d, r| bench.train[d].outputs[o][r])));
    }
    let total = std(residual).powi(2);
    let mut best = (0.1, String::from("no single signal"));
    for (name, values) in features {
        if values.len() != residual.len() || total <= 0.0 {
            continue;
        }
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        // How much of the residual eight bins of the signal explain, and where it is largest.
        let mut explained = 0.0;
        let mut largest = (0.0, 0.0, 0.0);
        let mean_all = mean(residual);
        for bin in 0..8 {
            let part = &order[order.len() * bin / 8..order.len() * (bin + 1) / 8];
            if part.is_empty() {
                continue;
            }
            let mean = part.iter().map(|i| residual[*i]).sum::<f64>() / part.len() as f64;
            explained += (mean - mean_all).powi(2) * part.len() as f64 / residual.len() as f64;
            if mean.abs() > f64::abs(largest.0) {
                largest = (mean, values[part[0]], values[part[part.len() - 1]]);
            }
        }
        if explained / total > best.0 {
            let n = |v: f64| crate::units::significant(v, 3);
            best = (explained / total, format!("{name} from {} to {}", n(largest.1), n(largest.2)));
        }
    }
    best.1
}
