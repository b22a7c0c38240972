//! A measured motion without its noise, for arms whose controller is not known.
//!
//! Whittaker's smoother: the curve that is near the samples and whose third differences are small. It has
//! no phase, keeps a quadratic exactly, and its strength is chosen so that what it takes away is as
//! large as the noise and no larger. Rows of nearly one time are one reading to it, their mean, and lie on the curve.
//! Where speeds are measured as well, the curve is near those, too, as near as the two agree: a speed says more of an
//! acceleration than a position does. Sizes leave out the largest errors, for a stamp that is wrong now and then makes a few
//! much larger than the others.
//!
//! Source: Eilers, "A Perfect Smoother", Anal. Chem. 75, 2003.

use super::channels::{Data, Quantity};
use super::spline::Spline;
use crate::discovery::recording::usual_step;

/// A joint's motion without its noise.
pub struct Smooth {
    /// Positions at the rows, rad.
    pub q: Vec<f64>,
    /// Standard deviation of the speed that is left to noise, rad/s.
    pub speed_error: f64,
    /// The same once more smoothed, as much as before, rad: what that takes away was taken away the first time, too.
    pub again: Vec<f64>,
}

/// Returns the joint's measured positions without noise, rad.
pub fn smoothed(data: &Data, joint: usize, values: &[f64]) -> Smooth {
    let noise = data
        .channels
        .iter()
        .find(|c| c.quantity == Quantity::Position && c.index == joint)
        .map_or(0.0, |channel| channel.noise);
    let speeds = data.measured(Quantity::Speed, joint).map(|speeds| {
        let found = data.channels.iter();
        let mut found = found.filter(|c| c.quantity == Quantity::Speed && c.index == joint);
        (speeds, found.next().map_or(0.0, |c| c.noise))
    });
    joined(&data.time, values, noise, speeds)
}

/// Readings over time: a row each, or the mean of rows of nearly one time.
struct Knots {
    /// When each was taken, s.
    time: Vec<f64>,
    /// Of how many rows it is the mean.
    rows: Vec<usize>,
}

/// Rows nearer to each other than this part of a step say little about what is between them: a third difference over them is
/// mostly their noise.
const NEAREST: f64 = 0.2;

/// Between rows further apart than so many usual steps the clock paused.
const PAUSE: f64 = 5.0;

impl Knots {
    /// Takes rows of nearly one time together.
    fn of(rows_at: &[f64]) -> Self {
        let nearest = NEAREST * step(rows_at);
        let (mut time, mut rows): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
        for at in rows_at {
            if let (Some(mean), Some(n)) = (time.last_mut(), rows.last_mut())
                && at - *mean < nearest
            {
                *n += 1;
                *mean += (at - *mean) / *n as f64;
            } else {
                time.push(*at);
                rows.push(1);
            }
        }
        Self { time, rows }
    }

    /// Returns the mean over the rows of each.
    fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut rest = values;
        let mean = |n: &usize| {
            let (own, later) = rest.split_at(*n);
            rest = later;
            own.iter().sum::<f64>() / *n as f64
        };
        self.rows.iter().map(mean).collect()
    }

    /// Returns the curve through their values at the rows.
    fn at_rows(&self, rows_at: &[f64], values: Vec<f64>) -> Vec<f64> {
        if values.len() == rows_at.len() {
            return values;
        }
        let curve = Spline::through(&self.time, &values);
        let mut hint = 0;
        rows_at.iter().map(|at| curve.at(*at, &mut hint).0).collect()
    }
}

/// Returns the mean step of a clock, s, pauses left out: one stamp that is far from all others must not count for many steps.
fn step(time: &[f64]) -> f64 {
    let longest = PAUSE * usual_step(time);
    let pauses = || time.windows(2).map(|t| t[1] - t[0]).filter(|step| *step > longest);
    let whole = time[time.len() - 1] - time[0];
    (whole - pauses().sum::<f64>()) / (time.len() - 1 - pauses().count()) as f64
}

/// What measured speeds say of the way from row to row.
struct Speeds {
    /// Mean speed between a row and the next, rad/s.
    between: Vec<f64>,
    /// How long that is, s.
    spans: Vec<f64>,
    /// Standard deviation of their errors, rad/s: their noise, or by how much more they and the positions disagree.
    error: f64,
}

impl Speeds {
    /// Sets speeds beside positions, each with its noise.
    fn of(time: &[f64], (q, q_noise): (&[f64], f64), (dq, dq_noise): (&[f64], f64)) -> Self {
        let spans: Vec<f64> = time.windows(2).map(|t| (t[1] - t[0]).max(1e-9)).collect();
        let between: Vec<f64> = dq.windows(2).map(|v| 0.5 * (v[0] + v[1])).collect();
        let apart = |((q, span), v): ((&[f64], &f64), &f64)| (q[1] - q[0]) / span - v;
        let off = typical(q.windows(2).zip(&spans).zip(&between).map(apart));
        // Of that, this much is the noise of two positions.
        let own = off.powi(2) - 2.0 * (q_noise / step(time)).powi(2);
        let error = own.max(0.5 * dq_noise.powi(2)).max(0.01 * off.powi(2)).sqrt();
        Self { between, spans, error }
    }
}

/// The part of errors that may be wild: what is left of a normal error without it has this standard deviation.
const WILD: (f64, f64) = (0.1, 0.789);

/// Returns the standard deviation of which these would be if they were normal, whatever the largest of them are.
fn typical(values: impl Iterator<Item = f64>) -> f64 {
    let mut squares: Vec<f64> = values.map(|value| value * value).collect();
    let kept = squares.len() - (WILD.0 * squares.len() as f64) as usize;
    if kept == 0 {
        return 0.0;
    }
    squares.select_nth_unstable_by(kept - 1, f64::total_cmp);
    let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // Errors that come in steps have no tails, and are no larger than all of them together.
    (rms(&squares[..kept]) / WILD.1).min(rms(&squares))
}

/// Fewest and most decimals to which a column may have been rounded; fewer, and the steps may be meant.
const DECIMALS: std::ops::RangeInclusive<i32> = 4..=9;

/// Returns a commanded motion without the rounding of the file it was written to: a stiff controller turns a
/// rounding of a micrometre-sized angle, a few milliseconds later undone, into torque.
pub fn unrounded(time: &[f64], values: &[f64]) -> Vec<f64> {
    let is_multiple = |value: &f64, decimals| {
        let scaled = value * 10_f64.powi(decimals);
        (scaled - scaled.round()).abs() < 1e-4
    };
    let rounded = DECIMALS.into_iter().find(|k| values.iter().all(|value| is_multiple(value, *k)));
    // Equally likely anywhere within a step.
    rounded.map_or_else(
        || values.to_vec(),
        |decimals| whittaker(time, values, 10_f64.powi(-decimals) / 12_f64.sqrt()).q,
    )
}

/// Smooths `values`, taken at `time`, until their typical change is about `noise`.
pub fn whittaker(time: &[f64], values: &[f64], noise: f64) -> Smooth {
    joined(time, values, noise, None)
}

/// Fewer readings are left as they are.
const LEAST: usize = 8;

/// The same beside measured speeds, rad/s, and their noise.
fn joined(time: &[f64], values: &[f64], noise: f64, speeds: Option<(&[f64], f64)>) -> Smooth {
    let as_it_is = || Smooth { q: values.to_vec(), speed_error: 0.0, again: values.to_vec() };
    if values.len() < LEAST || noise <= 0.0 {
        return as_it_is();
    }
    let knots = Knots::of(time);
    if knots.time.len() < LEAST {
        return as_it_is();
    }
    let read = knots.means(values);
    let speeds = speeds.map(|(dq, dq_noise)| {
        Speeds::of(&knots.time, (&read, noise), (&knots.means(dq), dq_noise))
    });
    let step = step(&knots.time);
    // What the smoother lets through of white noise, `∫ ω² / (1 + λ (ω h)⁶)² dω`, in closed form.
    let speed_error = |strength: f64| noise / (step * 12_f64.sqrt() * strength.powf(0.25));
    // How far a curve is from the positions and from the speeds.
    let off = |smooth: &[f64]| {
        // A mean of rows is as much nearer to the truth.
        let apart = smooth.iter().zip(&read).zip(&knots.rows);
        let positions = typical(apart.map(|((s, v), rows)| (s - v) * (*rows as f64).sqrt()));
        let speeds = speeds.as_ref().map_or(0.0, |speeds| {
            let steps = smooth.windows(2).zip(&speeds.spans).zip(&speeds.between);
            typical(steps.map(|((q, span), v)| (q[1] - q[0]) / span - v))
        });
        [positions, speeds]
    };
    // How much a speed weighs beside a position.
    let speeds = speeds.as_ref().filter(|speeds| speeds.error > 0.0);
    let pull = speeds.map(|speeds| (speeds, (noise / speeds.error).powi(2)));
    // The change grows with the strength; half-decades are fine enough, since the result hardly moves
    // within one. Beyond 10^6.5 the equations lose more digits than the smoothing wins.
    let third = third_differences(&knots.time);
    let smoothest =
        |of: &[f64], strength: f64, pull| penalised(&third, (of, &knots.rows), strength, pull);
    let mut best = smoothest(&read, WEAKEST, pull);
    let weakest = off(&best);
    let most = [
        noise.max(FURTHER[0] * weakest[0]),
        speeds.map_or(0.0, |speeds| speeds.error).max(FURTHER[1] * weakest[1]),
    ];
    let is_within = weakest[0] <= noise || pull.is_some();
    if !is_within {
        // What is rougher than its noise between neighbours is meant.
        return Smooth { speed_error: speed_error(WEAKEST), ..as_it_is() };
    }
    let mut strongest = WEAKEST;
    for half_decade in 1..16 {
        let strength = WEAKEST * 10_f64.powf(f64::from(half_decade) * 0.5);
        let smooth = smoothest(&read, strength, pull);
        if off(&smooth).iter().zip(&most).any(|(off, most)| off > most) {
            break;
        }
        (best, strongest) = (smooth, strength);
    }
    let again = smoothest(&best, strongest, None);
    // Beside measured speeds it is less than that.
    let speed_error = speed_error(strongest);
    Smooth { q: knots.at_rows(time, best), speed_error, again: knots.at_rows(time, again) }
}

/// The weakest smoothing that is one.
const WEAKEST: f64 = 0.1;

/// A curve may be further from positions and from speeds by these factors than the weakest smoothing's, where that is not
/// within their noise: noise that is coarse, or comes in steps, is not known better.
const FURTHER: [f64; 2] = [1.1, 1.5];

/// Neighbours that a difference reaches.
const BAND: usize = 3;

/// Returns the coefficients of the third divided difference at every four samples, -1, 3, -3, 1 where they
/// are even: of a parabola it is none, however uneven they are.
fn third_differences(time: &[f64]) -> Vec<[f64; BAND + 1]> {
    let step = step(time);
    time.windows(BAND + 1)
        .map(|t| {
            std::array::from_fn(|i| {
                let others = (0..=BAND).filter(|j| *j != i);
                6.0 / others.map(|j| (t[i] - t[j]) / step).product::<f64>()
            })
        })
        .collect()
}

/// Solves `(N + λ D₃ᵀ D₃) z = N y`, a system of seven diagonals, by Cholesky's method, where `N` says of how many rows each of
/// `y` is the mean; with speeds `v` of weight `w` it is `(N + w D₁ᵀ D₁ + λ D₃ᵀ D₃) z = N y + w D₁ᵀ v`.
fn penalised(
    third: &[[f64; BAND + 1]],
    (y, rows): (&[f64], &[usize]),
    strength: f64,
    speeds: Option<(&Speeds, f64)>,
) -> Vec<f64> {
    let n = y.len();
    // Lower band: a[i][k] is entry (i, i - k).
    let mut a = vec![[0.0; BAND + 1]; n];
    for (diagonal, rows) in a.iter_mut().zip(rows) {
        diagonal[0] = *rows as f64;
    }
    for (start, third) in third.iter().enumerate() {
        for i in 0..=BAND {
            for j in 0..=i {
                a[start + i][i - j] += strength * third[i] * third[j];
            }
        }
    }
    if let Some((speeds, weight)) = speeds {
        for (i, span) in speeds.spans.iter().enumerate() {
            let by = weight / span.powi(2);
            a[i][0] += by;
            a[i + 1][0] += by;
            a[i + 1][1] -= by;
        }
    }
    for i in 0..n {
        for k in (0..=BAND.min(i)).rev() {
            let j = i - k;
            let mut sum = a[i][k];
            for m in 1..=BAND {
                if k + m <= BAND && j >= m {
                    sum -= a[i][k + m] * a[j][m];
                }
            }
            a[i][k] = if k == 0 { sum.max(1e-300).sqrt() } else { sum / a[j][0] };
        }
    }
    let mut z: Vec<f64> = y.iter().zip(rows).map(|(y, rows)| y * *rows as f64).collect();
    if let Some((speeds, weight)) = speeds {
        for (i, (v, span)) in speeds.between.iter().zip(&speeds.spans).enumerate() {
            z[i] -= weight * v / span;
            z[i + 1] += weight * v / span;
        }
    }
    for i in 0..n {
        for k in 1..=BAND.min(i) {
            z[i] -= a[i][k] * z[i - k];
        }
        z[i] /= a[i][0];
    }
    for i in (0..n).rev() {
        for k in 1..=BAND {
            if i + k < n {
                z[i] -= a[i + k][k] * z[i + k];
            }
        }
        z[i] /= a[i][0];
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_kept_and_a_zigzag_is_taken_away() {
        let parabola: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.01).powi(2)).collect();
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        let smooth = penalised(&third_differences(&time), (&parabola, &[1; 200]), 1e4, None);
        assert!(smooth.iter().zip(&parabola).all(|(s, p)| (s - p).abs() < 1e-7));
        let rough: Vec<f64> = parabola
            .iter()
            .enumerate()
            .map(|(i, p)| p + if i % 2 == 0 { 1e-3 } else { -1e-3 })
            .collect();
        let smooth = whittaker(&time, &rough, 1.1e-3).q;
        let off = smooth.iter().zip(&parabola).map(|(s, p)| (s - p).abs());
        // An end has neighbours on one side only; such rows are not judged either.
        let worst = off.skip(10).take(180).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst}");
    }

    #[test]
    fn a_rounded_command_gets_its_speed_back() {
        let time: Vec<f64> = (0..500).map(|i| f64::from(i) * 0.004).collect();
        let exact: Vec<f64> = time.iter().map(|t| 0.8 * (1.3 * t).sin()).collect();
        let rounded: Vec<f64> = exact.iter().map(|q| (q * 1e6).round() * 1e-6).collect();
        let off = |q: &[f64]| {
            let errors = (20..480)
                .map(|i| (q[i + 1] - q[i - 1] - exact[i + 1] + exact[i - 1]) / 0.008)
                .map(|error| error * error);
            (errors.sum::<f64>() / 460.0).sqrt()
        };
        assert!(off(&unrounded(&time, &rounded)) < 0.3 * off(&rounded));
        assert_eq!(unrounded(&time, &exact), exact);
    }

    #[test]
    fn measured_speeds_tell_more_of_accelerations() {
        let time: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.01).collect();
        let wobble = |i: usize| ((i as f64 * 12.9898).sin() * 43758.547).rem_euclid(1.0) - 0.5;
        let coarse = |value: f64| (value * 1e4).round() * 1e-4;
        let q: Vec<f64> = time.iter().map(|t| coarse((1.3 * t).sin())).collect();
        let dq: Vec<f64> = time
            .iter()
            .enumerate()
            .map(|(i, t)| 1.3 * (1.3 * t).cos() + 1e-3 * wobble(i))
            .collect();
        let off = |q: &[f64]| {
            let errors = (50..1950).map(|i| {
                let found = (q[i + 1] - 2.0 * q[i] + q[i - 1]) / 1e-4;
                (found + 1.69 * (1.3 * time[i]).sin()).powi(2)
            });
            (errors.sum::<f64>() / 1900.0).sqrt()
        };
        let (alone, both) =
            (whittaker(&time, &q, 3e-5).q, joined(&time, &q, 3e-5, Some((&dq[..], 3e-4))).q);
        assert!(off(&both) < 0.05, "{}", off(&both));
        assert!(off(&both) < off(&alone), "{} {}", off(&both), off(&alone));
    }

    #[test]
    fn a_parabola_at_uneven_times_is_kept() {
        let time: Vec<f64> =
            (0..200).map(|i| f64::from(i) * 0.01 + 0.004 * f64::from(i * i % 5) / 5.0).collect();
        let parabola: Vec<f64> = time.iter().map(|t| t * t).collect();
        let smooth = penalised(&third_differences(&time), (&parabola, &[1; 200]), 1e4, None);
        assert!(smooth.iter().zip(&parabola).all(|(s, p)| (s - p).abs() < 1e-7));
    }

    /// The distance of each pair was held to a fifth of a step by itself: over a row that came 2 ms after another a third
    /// difference then had the position in it, and a whole log was pulled to 0.
    #[test]
    fn of_a_parabola_there_is_no_third_difference_whatever_the_steps() {
        for gaps in [[10.0, 2.0, 8.0], [10.0, 10.0, 2.0], [2.0, 2.0, 2.0], [10.0, 1e-3, 9.0]] {
            let steps = [&[10.5; 30][..], &gaps, &[10.5; 30]].concat();
            let sum = |at: &mut f64, step: &f64| {
                *at += step;
                Some(*at)
            };
            let rows_at: Vec<f64> = steps.iter().scan(0.0, sum).collect();
            let time = Knots::of(&rows_at).time;
            let last = time[time.len() - 1];
            for power in 0..=2 {
                let y: Vec<f64> = time.iter().map(|t| (t / last).powi(power)).collect();
                for (c, y) in third_differences(&time).iter().zip(y.windows(BAND + 1)) {
                    let third: f64 = c.iter().zip(y).map(|(c, y)| c * y).sum();
                    assert!(third.abs() < 1e-12, "{gaps:?}, {power}: {third}");
                }
            }
        }
    }

    /// Rows that nearly repeat a time, and a stamp that is far away, are felt by nobody but themselves.
    #[test]
    fn one_stamp_spoils_nothing() {
        let even: Vec<f64> = (0..600).map(|i| f64::from(i) * 0.0105).collect();
        let with = |more: &[f64]| {
            let mut time = [&even[..], more].concat();
            time.sort_by(f64::total_cmp);
            time
        };
        let moved: Vec<f64> = even
            .iter()
            .map(|t| if (t - even[300]).abs() < 1e-9 { even[299] + 0.002 } else { *t })
            .collect();
        let worst = |time: &[f64]| {
            let read: Vec<f64> = time.iter().map(|t| (2.0 * t).sin()).collect();
            let rounded: Vec<f64> = read.iter().map(|q| (q * 1e4).round() * 1e-4).collect();
            let smooth = whittaker(time, &rounded, 1e-4 / 12_f64.sqrt()).q;
            assert_eq!(smooth.len(), read.len());
            let off = smooth.iter().zip(&read).map(|(s, q)| (s - q).abs());
            off.skip(10).take(580).fold(0.0, f64::max)
        };
        let (near, bursts) = (even[300], [1e-6, 1e-3, 2e-3].map(|late| even[400] + late));
        for time in [
            even.clone(),
            moved,
            with(&[near + 2e-3]),
            with(&[near + 1e-6]),
            with(&bursts),
            with(&[1e6]),
        ] {
            assert!(worst(&time) < 1e-4, "{}", worst(&time));
        }
    }

    #[test]
    fn the_error_of_the_speed_is_what_it_says() {
        let time: Vec<f64> = (0..4000).map(|i| f64::from(i) * 0.01).collect();
        // Twelve numbers that look like chance make a normal one to three digits.
        let chance = |i: usize| ((i as f64 * 12.9898).sin() * 43758.547).rem_euclid(1.0);
        let noise = |i: usize| 2e-5 * ((0..12).map(|k| chance(12 * i + k)).sum::<f64>() - 6.0);
        let read: Vec<f64> =
            time.iter().enumerate().map(|(i, t)| (0.8 * t).sin() + noise(i)).collect();
        let smooth = whittaker(&time, &read, 2e-5);
        let errors: Vec<f64> = (50..3950)
            .map(|i| (smooth.q[i + 1] - smooth.q[i - 1]) / 0.02 - 0.8 * (0.8 * time[i]).cos())
            .collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let ratio = smooth.speed_error / rms;
        assert!((0.5..2.0).contains(&ratio), "{ratio}");
    }
}
