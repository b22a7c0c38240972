//! How recordings are cut: windows that are run through from first values of their own.

use std::ops::Range;

use super::columns::Data;

/// Rows of one recording that are run through from first values of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Which recording.
    pub data: usize,
    /// Which of its rows.
    pub rows: Range<usize>,
}

/// Most windows; those of a longer list lie evenly over it.
const MOST_WINDOWS: usize = 500;

/// Cuts recordings into windows of about `rows` rows; `None` for one window a stretch. Of more than `most`
/// rows only a part is run: of many windows those that lie evenly over a stretch, of a long one its
/// beginning.
pub fn windows(data: &[Data], rows: Option<usize>, most: usize) -> Vec<Window> {
    let total: usize = data.iter().flat_map(Data::stretches).map(|stretch| stretch.len()).sum();
    let part = (most as f64 / total.max(1) as f64).min(1.0);
    let mut out = Vec::new();
    for (d, one) in data.iter().enumerate() {
        for stretch in one.stretches() {
            let n = rows
                .map_or(1, |r| (stretch.len() as f64 / r.max(3) as f64).round().max(1.0) as usize);
            let kept = ((n as f64 * part).round() as usize).clamp(1, n);
            let longest = ((stretch.len() as f64 * part).ceil() as usize).max(3);
            for k in 0..kept {
                // Of as many parts as are kept the one in the middle.
                let i = (2 * k + 1) * n / (2 * kept);
                let at = |i: usize| stretch.start + stretch.len() * i / n;
                // Windows share their edge, so that no step is lost between two of them.
                let end = if i + 1 == n { at(n) } else { at(i + 1) + 1 };
                out.push(Window { data: d, rows: at(i)..end.min(at(i) + longest + 1) });
            }
        }
    }
    // A recording that is full of gaps has first values by the thousand, each of them estimated.
    let every = out.len().div_ceil(MOST_WINDOWS).max(1);
    out.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(rows: usize) -> Data {
        Data {
            name: String::new(),
            time: (0..rows).map(|i| i as f64 * 0.01).collect(),
            step: 0.01,
            inputs: Vec::new(),
            outputs: vec![vec![0.0; rows]],
            noise: vec![1.0],
            begins: true,
        }
    }

    #[test]
    fn of_too_many_rows_parts_all_over_each_recording_are_run() {
        let all = [data(1000), data(1000)];
        let every = windows(&all, Some(50), 5000);
        assert_eq!(every.len(), 40);
        assert_eq!((every[0].rows.clone(), every[19].rows.clone()), (0..51, 950..1000));
        let some = windows(&all, Some(50), 500);
        let begins: Vec<(usize, usize)> = some.iter().map(|w| (w.data, w.rows.start)).collect();
        let each = [100, 300, 500, 700, 900];
        let expected: Vec<(usize, usize)> =
            (0..2).flat_map(|d| each.map(|start| (d, start))).collect();
        assert_eq!(begins, expected);
        assert!(some.iter().all(|w| w.rows.len() <= 51));
        // One run through each has to begin at the beginning.
        let whole = windows(&all, None, 500);
        let rows: Vec<Range<usize>> = whole.iter().map(|w| w.rows.clone()).collect();
        assert_eq!(rows, [0..251, 0..251]);
    }
}
