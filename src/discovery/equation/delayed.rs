//! A held input that acts late: smooth in how late it is, with its integral kept.
//!
//! A staircase has no derivative with respect to its delay, and a Runge–Kutta step does not see where within it the staircase jumps.
//! So what acts is the mean of the staircase over one usual step about the time, which lies half a row behind the lines through even
//! rows. The value in the middle of a step is the one with which Simpson's rule, which is what the classical method makes of an input,
//! gives the mean over that step: no jump is lost or counted twice, however uneven the rows are. Before the first row an input is
//! what it is there.

use super::columns::{Data, place};

/// So near to a row, as a part of the usual step, a line has the slopes of either side.
const NEAR: f64 = 1e-3;

impl Data {
    /// The mean of a held input over one usual step about a time, and its slope.
    pub(super) fn held_about(&self, input: usize, t: f64) -> (f64, f64) {
        let half = 0.5 * self.step;
        let part = |s: f64| (s - t) / self.step + 0.5;
        let mean = self.held_mean(input, (t - half, t + half), part);
        let [before, after] = [t - half, t + half].map(|s| self.inputs[input][self.held_row(s)]);
        (mean, (after - before) / self.step)
    }

    /// The value of [`Self::held_about`] `late` s before the middle of a Runge–Kutta step of length `h` from `t`, and its slope.
    pub(super) fn held_amid(&self, input: usize, (t, h): (f64, f64), late: f64) -> (f64, f64) {
        // As the step itself asks for both ends, to the last bit: at a jump the slopes of either side must cancel.
        let (from, to) = (self.held_about(input, t - late), self.held_about(input, t + h - late));
        let (outer, inner) = (0.5 * (self.step + h), 0.5 * (self.step - h));
        let middle = t + 0.5 * h - late;
        let ramp = |s: f64| 0.5 * s.max(0.0).powi(2);
        // Of a mean over the step of means over a usual step: the weight of what comes before.
        let part = |s: f64| {
            let s = s - middle;
            (ramp(s + outer) - ramp(s + inner) - ramp(s - inner) + ramp(s - outer))
                / (self.step * h)
        };
        let mean = self.held_mean(input, (middle - outer, middle + outer), part);
        let slope = (to.0 - from.0) / h;
        (0.25 * (6.0 * mean - from.0 - to.0), 0.25 * (6.0 * slope - from.1 - to.1))
    }

    /// An input on straight lines between rows, and its slope: at a row the mean of those on either side, whichever of them rounding
    /// would take.
    pub(super) fn line_about(&self, input: usize, t: f64) -> (f64, f64) {
        let at = |t: f64| self.input_at(input, t, false).0;
        let near = NEAR * self.step;
        (at(t), (at(t + near) - at(t - near)) / (2.0 * near))
    }

    /// The mean of a held input between two times, weighed so that `part` of the weight lies before a time.
    fn held_mean(&self, input: usize, (from, to): (f64, f64), part: impl Fn(f64) -> f64) -> f64 {
        let values = &self.inputs[input];
        let mut row = self.held_row(from);
        let (mut mean, mut done) = (0.0, 0.0);
        while row + 1 < values.len() && self.time[row + 1] < to {
            let here = part(self.time[row + 1]).min(1.0).max(done);
            mean += values[row] * (here - done);
            done = here;
            row += 1;
        }
        mean + values[row] * (1.0 - done)
    }

    /// The row whose value a held input has at a time.
    fn held_row(&self, t: f64) -> usize {
        let last = self.n_rows() - 1;
        if t <= self.time[0] {
            0
        } else if t >= self.time[last] {
            last
        } else {
            place(&self.time, t)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::made::unseen;
    use super::*;

    /// An input that jumps at every row, at rows that are uneven by so large a part of a row.
    fn jumping(uneven: f64) -> Data {
        let mut data = unseen(40, 1e-3, |row| (2.3 * row).sin()).train.remove(0);
        for (row, t) in (0_u32..).zip(&mut data.time) {
            *t += 0.1 * uneven * (1.7 * f64::from(row)).sin();
        }
        data
    }

    #[test]
    fn between_even_rows_it_is_the_line_half_a_row_later() {
        let data = jumping(0.0);
        for t in [0.5, 1.03, 1.777, 2.96] {
            let (here, line) = (data.held_about(0, t), data.input_at(0, t - 0.05, false));
            assert!((here.0 - line.0).abs() < 1e-9, "{t}: {here:?} {line:?}");
            assert!((here.1 - line.1).abs() < 1e-6, "{t}: {here:?} {line:?}");
        }
    }

    /// Simpson's rule over steps as long as the rows, against sums over pieces of microseconds.
    #[test]
    fn what_a_late_input_brings_is_kept_between_uneven_rows() {
        let data = jumping(0.4);
        for late in [0.0, 0.03, 0.11, 0.25] {
            let steps = data.time[5..35].windows(2).map(|pair| (pair[0] - late, pair[1] - pair[0]));
            let brought: f64 = steps
                .map(|(t, h)| {
                    let ends = data.held_about(0, t).0 + data.held_about(0, t + h).0;
                    h / 6.0 * (ends + 4.0 * data.held_amid(0, (t + late, h), late).0)
                })
                .sum();
            let (from, to) = (data.time[5] - late, data.time[34] - late);
            let pieces = 200_000_u32;
            let fine = (0..pieces).map(|i| {
                let t = from + (to - from) * (f64::from(i) + 0.5) / f64::from(pieces);
                data.held_about(0, t).0 * (to - from) / f64::from(pieces)
            });
            let truth: f64 = fine.sum();
            assert!((brought - truth).abs() < 1e-6, "{late}: {brought} {truth}");
        }
    }

    #[test]
    fn the_slope_in_the_middle_of_a_step_is_one() {
        let data = jumping(0.4);
        let at = |t: f64| data.held_amid(0, (t + 0.2, 0.07), 0.2);
        for t in [0.613, 1.234, 2.071] {
            let slope = (at(t + 1e-6).0 - at(t - 1e-6).0) / 2e-6;
            assert!((slope - at(t).1).abs() < 1e-4 * slope.abs().max(1.0), "{t}: {slope}");
        }
    }

    /// A delay of whole rows, with which every fit begins, puts each jump where the method asks: rounding took the slope of the one
    /// side or the other, and what a delay changes in the speed of a cart was the sum of those.
    #[test]
    fn slopes_at_jumps_add_up() {
        let data = jumping(0.0);
        for late in [0.1, 0.15, 0.2, 0.4] {
            let steps = data.time[8..35].windows(2).map(|pair| (pair[0], pair[1] - pair[0]));
            let changed: f64 = steps
                .map(|(t, h)| {
                    let ends = data.held_about(0, t - late).1 + data.held_about(0, t + h - late).1;
                    h / 6.0 * (ends + 4.0 * data.held_amid(0, (t, h), late).1)
                })
                .sum();
            let [from, to] = [8, 34].map(|row: usize| data.held_about(0, data.time[row] - late).0);
            assert!((changed - (to - from)).abs() < 1e-9, "{late}: {changed} {}", to - from);
            let row = data.time[20];
            let lines = [5e-3, -5e-3].map(|by| data.input_at(0, row + by, false).1);
            let slope = data.line_about(0, row).1;
            assert!((slope - 0.5 * (lines[0] + lines[1])).abs() < 1e-6, "{slope} {lines:?}");
        }
    }
}
