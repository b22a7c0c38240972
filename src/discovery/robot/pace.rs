//! Whether measured speeds are the slope of measured angles: along stamps that were written at another rate they are not, and
//! every acceleration is wrong with them.
//!
//! Over spans of several rows the integral of a joint's speed is compared with the change of its angle, as
//! `∫ dq dt = r Δq - T Δdq`: exact for speeds that are `r` times what they should be, behind a filter of first order with the time
//! constant `T`, and as exact as `(ω T)² / 2` for speeds that come `T` late. What a sum over rows leaves out of the integral is
//! put right by the accelerations at both ends (Euler and Maclaurin), so that rows far apart are not taken for another rate.

use super::channels::{Data, Quantity};
use super::error::Misfit;
use super::note::Note;
use super::plausible::{ENOUGH, MOVES};
use crate::discovery::recording::{Error, usual_step};

/// How long a span is, s. Chosen: the noise of angles is small beside their change, and few joints turn back within it.
const SPAN: f64 = 0.25;

/// Fewer rows are no span.
const ROWS: usize = 4;

/// Fewer spans say nothing.
const SPANS: usize = 12;

/// Rows that take this many times as long as they usually do have a pause between them.
const PAUSE: f64 = 1.5;

/// A joint whose ratio is less certain than this has no say.
const SURE: f64 = 0.01;

/// Joints whose ratios differ from their mean by less than this part show the same.
const SAME: f64 = 0.01;

/// All joints together may be off by this part: speeds that are filtered or cut off are, and real arms were by 0.4 % at most.
const CLEAR: f64 = 0.03;

/// A joint by itself may be off by this part.
const ALONE: f64 = 0.05;

/// What a span of rows shows of a joint.
struct Span {
    /// The integral of its speed, rad.
    way: f64,
    /// The change of its angle, rad.
    change: f64,
    /// The change of its speed, rad/s.
    faster: f64,
}

/// What all spans show of a joint.
struct Pace {
    /// From 0.
    joint: usize,
    /// Its speed over the slope of its angle.
    ratio: f64,
    /// How far that may be off by noise and by what is late.
    error: f64,
}

/// Compares measured speeds with measured angles, joint by joint; a note tells of joints that are off by themselves.
///
/// # Errors
///
/// An [`Error`] if all joints that move enough to tell are off by the same ratio.
pub(super) fn check(data: &Data, name: &str) -> Result<Option<Note>, Error> {
    let sure = |pace: &Pace| pace.error < SURE;
    let paces: Vec<Pace> = (0..data.n).filter_map(|joint| pace(data, joint)).filter(sure).collect();
    let ratio = paces.iter().map(|pace| pace.ratio).sum::<f64>() / paces.len().max(1) as f64;
    let is_same = paces.iter().all(|pace| (pace.ratio / ratio - 1.0).abs() < SAME);
    let is_enough = paces.len() >= ENOUGH.min(data.n.max(2));
    if is_enough && is_same && (ratio - 1.0).abs() > CLEAR {
        let misfit = Misfit::Paced { ratio, joints: paces.len() };
        return Err(misfit.at(format!("{name}, columns `t` and `dq_n`")));
    }
    let off = paces.iter().filter(|pace| (pace.ratio - 1.0).abs() > ALONE);
    let joints: Vec<(usize, f64)> = off.map(|pace| (pace.joint, pace.ratio)).collect();
    Ok((!joints.is_empty()).then(|| Note::Paced { recording: name.to_owned(), joints }))
}

/// Returns what a joint shows, if its angle and its speed were measured and it moved.
fn pace(data: &Data, joint: usize) -> Option<Pace> {
    let q = data.measured(Quantity::Position, joint)?;
    let dq = data.measured(Quantity::Speed, joint)?;
    let (low, high) = q.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
    let spans = spans(&data.time, q, dq);
    if high - low < MOVES || spans.len() < SPANS {
        return None;
    }
    let sum = |of: fn(&Span) -> f64| spans.iter().map(of).sum::<f64>();
    let (qq, vv) = (sum(|s| s.change * s.change), sum(|s| s.faster * s.faster));
    let (qv, qw) = (sum(|s| s.change * s.faster), sum(|s| s.change * s.way));
    let vw = sum(|s| s.faster * s.way);
    let det = qq * vv - qv * qv;
    if det <= 1e-9 * qq * vv {
        return None;
    }
    let ratio = (qw * vv - vw * qv) / det;
    let late = (ratio * qv - vw) / vv;
    let left = |s: &Span| (s.way - ratio * s.change + late * s.faster).powi(2);
    // The part that is not explained: noise of the angles makes the ratio smaller by as much at most.
    let unexplained = spans.iter().map(left).sum::<f64>() * vv / det;
    let std = (unexplained / (spans.len() - 2) as f64).sqrt();
    let error = std.max(unexplained).max(0.5 * late * late * vv / qq);
    Some(Pace { joint, ratio, error })
}

/// Cuts a recording of a joint into spans that follow each other, without those in which the clock pauses.
fn spans(time: &[f64], q: &[f64], dq: &[f64]) -> Vec<Span> {
    let step = usual_step(time).max(1e-9);
    let rows = ((SPAN / step).round() as usize).max(ROWS);
    let bend = |row: usize| (dq[row + 1] - dq[row - 1]) / (time[row + 1] - time[row - 1]).max(1e-9);
    let way = |row: usize| {
        let h = time[row + 1] - time[row];
        0.5 * h * (dq[row] + dq[row + 1]) + h * h / 12.0 * (bend(row) - bend(row + 1))
    };
    let mut spans = Vec::new();
    // Of the first row and the last no acceleration is known.
    let mut from = 1;
    while from + rows + 1 < time.len() {
        let to = from + rows;
        if time[to] - time[from] <= PAUSE * rows as f64 * step {
            let way = (from..to).map(way).sum();
            spans.push(Span { way, change: q[to] - q[from], faster: dq[to] - dq[from] });
        }
        from = to;
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::robot::channels::Channel;

    /// Three joints over 10 s, their speeds `late` by a filter of first order, s, stamps and speeds off by a factor each.
    fn read(late: f64, stamps: f64, speeds: [f64; 3]) -> Data {
        let rows = || (0..1000).map(|row| 0.01 * f64::from(row));
        let mut channels = Vec::new();
        for (index, factor) in speeds.into_iter().enumerate() {
            let rate: f64 = [1.3, 2.1, 0.9][index];
            // What a filter of first order makes of a swing once it has forgotten how it began.
            let (less, behind) = ((rate * late).hypot(1.0).recip(), (rate * late).atan());
            let angle = |t: f64| 0.4 * (rate * t).sin();
            let speed = |t: f64| factor * less * 0.4 * rate * (rate * t - behind).cos();
            let mut add = |quantity: Quantity, values: Vec<f64>| {
                let name = format!("{}_{}", quantity.stem(), index + 1);
                channels.push(Channel {
                    quantity,
                    index,
                    name,
                    values,
                    noise: 0.0,
                    unread: vec![],
                });
            };
            add(Quantity::Position, rows().map(angle).collect());
            // In steps of 1 mrad/s.
            let read = |t: f64| (1e3 * speed(t)).round() * 1e-3;
            add(Quantity::Speed, rows().map(read).collect());
        }
        let time = rows().map(|t| stamps * t).collect();
        let (commands, notes) = (Vec::new(), Vec::new());
        Data { n: 3, time, commands, channels, notes, are_currents: false, of_currents: false }
    }

    #[test]
    fn speeds_that_are_filtered_are_of_the_same_rate() {
        for late in [0.0, 0.02, 0.05] {
            assert_eq!(check(&read(late, 1.0, [1.0; 3]), "log"), Ok(None), "{late} s");
        }
    }

    #[test]
    fn stamps_of_another_rate_show_in_all_joints_alike() {
        for (late, rate) in [(0.0, 1.08), (0.02, 0.95), (0.04, 1.08)] {
            let error = check(&read(late, rate, [1.0; 3]), "log").unwrap_err();
            let told = format!("`dq_n` is {rate} times");
            assert!(error.what.starts_with(&told), "{late} s: {error:?}");
            assert!(error.help.contains(&format!("divide `t` by {rate}")), "{error:?}");
        }
    }

    #[test]
    fn one_joint_that_is_off_by_itself_is_noted() {
        let note = check(&read(0.01, 1.0, [1.0, 1.1, 1.0]), "log").unwrap().unwrap().to_string();
        assert!(note.starts_with("log: `dq_2` is 1.1 times"), "{note}");
    }
}
