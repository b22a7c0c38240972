//! Questions from stored runs, the hardest last.
//!
//! They come in three thirds by how far their margin is from zero beside others of the same unit, and in a
//! seeded order within each. What geometry cannot tell comes at the very end, and is not counted.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;

use crate::trace::{FluentRow, StepRecord};

/// One question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Item {
    /// Which of the runs, from 0.
    pub run: usize,
    /// Which of its steps, from 0.
    pub step: usize,
    /// Which of that step's fluents, from 0.
    pub row: usize,
}

/// Returns all questions of some runs that have a picture, easy ones first; `has_picture` says so of a step of
/// the run of that place.
pub fn ordered(
    runs: &[&[StepRecord]],
    has_picture: &dyn Fn(usize, &StepRecord) -> bool,
    seed: u64,
) -> Vec<Item> {
    let mut found: Vec<(Item, &FluentRow)> = Vec::new();
    for (r, steps) in runs.iter().enumerate() {
        for (s, step) in steps.iter().enumerate().filter(|(_, step)| has_picture(r, step)) {
            let asked = step.fluents.iter().enumerate().filter(|(_, row)| row.ask.is_some());
            found.extend(asked.map(|(f, row)| (Item { run: r, step: s, row: f }, row)));
        }
    }
    let rows: Vec<&FluentRow> = found.iter().map(|(_, row)| *row).collect();
    let mut thirds: [Vec<Item>; 4] = Default::default();
    for (item, row) in found {
        thirds[hardness(row, &rows)].push(item);
    }
    let mut chance = StdRng::seed_from_u64(seed);
    for third in &mut thirds {
        third.shuffle(&mut chance);
    }
    thirds.into_iter().flatten().collect()
}

/// Returns how hard a question is, from 0: how many thirds of the margins of its unit are further from zero.
/// What is yes or no without any margin is easy, what nobody can tell is hardest.
fn hardness(row: &FluentRow, rows: &[&FluentRow]) -> usize {
    if row.measured.is_none() {
        return 3;
    }
    let Some(margin) = &row.margin else { return 0 };
    let others = rows.iter().filter_map(|other| other.margin.as_ref());
    let same: Vec<f64> =
        others.filter(|other| other.unit == margin.unit).map(|other| other.value.abs()).collect();
    let further = same.iter().filter(|size| **size > margin.value.abs()).count();
    (3 * further / same.len().max(1)).min(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::Measure;

    fn row(margin: Option<f64>, measured: Option<bool>) -> FluentRow {
        FluentRow {
            name: "above(jar, cup)".into(),
            expected: None,
            twin: measured,
            measured,
            margin: margin.map(|value| Measure { value, unit: "m".into() }),
            twin_margin: None,
            ask: Some("Is it?".into()),
            why: None,
            std: None,
            direction: None,
            terms: Vec::new(),
        }
    }

    #[test]
    fn margins_near_zero_are_hard_and_unknown_is_hardest() {
        let sizes = [0.09, -0.08, 0.07, 0.03, -0.02, 0.001].map(|m| row(Some(m), Some(m > 0.0)));
        let rows: Vec<&FluentRow> = sizes.iter().collect();
        let hard: Vec<usize> = rows.iter().map(|row| hardness(row, &rows)).collect();
        assert_eq!(hard, [0, 0, 1, 1, 2, 2]);
        assert_eq!(hardness(&row(None, Some(true)), &rows), 0);
        assert_eq!(hardness(&row(Some(0.5), None), &rows), 3);
    }
}
