//! What was assumed of a recording before anything was fitted to it, as it is told to people.

use std::fmt;

use crate::units::significant;

/// Something assumed of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// Nobody says how noisy the sensors are.
    NoiseEstimated {
        /// Which recording.
        recording: String,
    },
    /// A group of columns holds what was not measured.
    Unmeasured {
        /// Which recording.
        recording: String,
        /// What the columns' names begin with.
        stem: &'static str,
    },
    /// The logger wrote rows twice.
    Repeats {
        /// Which recording.
        recording: String,
        /// How many are left out.
        repeats: usize,
        /// Out of how many.
        rows: usize,
    },
    /// Single cells show what nothing else of their sensor comes near to.
    Wild {
        /// Which recording.
        recording: String,
        /// The columns, each with the lines of the file, as far as it has any, and the times, s.
        columns: Vec<(String, Vec<usize>, Vec<f64>)>,
    },
    /// Cells are blank.
    Blank {
        /// Which recording.
        recording: String,
        /// The columns, each with how many cells of it are.
        columns: Vec<(String, usize)>,
    },
    /// A sensor is read less often than the log is written.
    Held {
        /// Which recording.
        recording: String,
        /// What its columns' names begin with.
        stem: &'static str,
        /// In how many rows it shows something new.
        new: usize,
        /// Out of how many.
        rows: usize,
    },
    /// A sensor shows its last reading though the arm moves on.
    Stopped {
        /// Which recording.
        recording: String,
        /// What its columns' names begin with.
        stem: &'static str,
        /// From when until when, s.
        spans: Vec<[f64; 2]>,
        /// In how many rows.
        rows: usize,
    },
    /// The arm leaned on something, nobody knows how hard.
    Contacts {
        /// Which recording.
        recording: String,
        /// What it did, from when until when, s.
        spans: Vec<(String, [f64; 2])>,
        /// In how many rows.
        rows: usize,
    },
    /// Joints stand still, held by friction.
    Standing {
        /// Which recording.
        recording: String,
        /// Columns of torque, and in how many rows their joints stand still.
        joints: Vec<(String, usize)>,
        /// Of how many rows.
        rows: usize,
    },
    /// The time stamps are less even than the motion.
    Jitter {
        /// Which recording.
        recording: String,
        /// By how much they are off, s.
        off: f64,
    },
    /// The speeds of joints are not the change of their angles.
    Paced {
        /// Which recording.
        recording: String,
        /// Which joints, from 0, each with its speed over the change of its angle.
        joints: Vec<(usize, f64)>,
    },
    /// A channel tells nothing in any recording.
    NeverChanges {
        /// Which channel.
        channel: String,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoiseEstimated { recording } => write!(
                f,
                "{recording}: no noise is given; it is estimated from the channels themselves"
            ),
            Self::Unmeasured { recording, stem } => write!(
                f,
                "{recording}: `{stem}` is the same in every row while the arm moves; it is taken as not measured"
            ),
            Self::Repeats { recording, repeats, rows } => write!(
                f,
                "{recording}: {repeats} of {rows} rows repeat the row before and are left out"
            ),
            Self::Wild { recording, columns } => {
                let n: usize = columns.iter().map(|(_, _, times)| times.len()).sum();
                let places: Vec<String> = columns.iter().map(rows_of).collect();
                write!(
                    f,
                    "{recording}: {n} {} many times larger than anything else of that sensor and gone with the next \
                     rows; left out as not read: {}",
                    if n == 1 { "cell is" } else { "cells are" },
                    places.join("; ")
                )
            }
            Self::Blank { recording, columns } => {
                let columns = columns.iter().map(|(column, n)| format!("{n} of `{column}`"));
                let columns: Vec<String> = columns.collect();
                write!(f, "{recording}: cells are blank and not judged: {}", columns.join(", "))
            }
            Self::Held { recording, stem, new, rows } => write!(
                f,
                "{recording}: `{stem}` shows something new in {new} of {rows} rows and repeats itself in the others; \
                 it is judged where it is new"
            ),
            Self::Stopped { recording, stem, spans, rows } => {
                let spans = spans.iter().map(|[from, to]| format!("from {from} s to {to} s"));
                write!(
                    f,
                    "{recording}: `{stem}` repeats one reading while the arm moves on, {}; these {rows} rows are not judged",
                    told(spans.collect())
                )
            }
            Self::Contacts { recording, spans, rows } => {
                let spans = spans.iter().map(|(what, span)| {
                    let [from, to] = span.map(|time| significant(time, 4));
                    format!("from {from} s to {to} s ({what})")
                });
                write!(
                    f,
                    "{recording}: the arm pushed, pulled or pressed {}; the torques of these {rows} rows are not judged",
                    told(spans.collect())
                )
            }
            Self::Standing { recording, joints, rows } => {
                let joints: Vec<String> = joints
                    .iter()
                    .map(|(column, n)| format!("`{column}` in {n} of {rows} rows"))
                    .collect();
                write!(
                    f,
                    "{recording}: torques of joints at rest are not judged, as static friction is not determined by the motion: {}",
                    joints.join(", ")
                )
            }
            Self::Jitter { recording, off } => write!(
                f,
                "{recording}: the samples are evenly spaced, their time stamps jitter by {} ms; an even clock is used",
                significant(off * 1e3, 2)
            ),
            Self::Paced { recording, joints } => {
                let off = |(joint, ratio): &(usize, f64)| {
                    let (n, ratio) = (joint + 1, significant(*ratio, 3));
                    format!("`dq_{n}` is {ratio} times what the change of `q_{n}` says")
                };
                let off: Vec<String> = joints.iter().map(off).collect();
                write!(
                    f,
                    "{recording}: {}; check units and gear ratios of the encoders",
                    off.join(", ")
                )
            }
            Self::NeverChanges { channel } => {
                write!(f, "{channel} never changes: nothing is said of it")
            }
        }
    }
}

/// So many rows of a column are told at most.
const TOLD: usize = 5;

/// Tells the first few of a list, and how many more there are.
fn told(values: Vec<String>) -> String {
    let rest = values.len().saturating_sub(TOLD);
    let rest = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    let first: Vec<String> = values.into_iter().take(TOLD).collect();
    format!("{}{rest}", first.join(", "))
}

/// Says which rows of a column are meant: by the lines of its file, or by their times where it has none.
fn rows_of((column, lines, times): &(String, Vec<usize>, Vec<f64>)) -> String {
    if lines.is_empty() {
        let times = times.iter().map(|t| format!("{t} s")).collect();
        return format!("`{column}` at t = {}", told(times));
    }
    let word = if lines.len() == 1 { "line" } else { "lines" };
    format!("`{column}` in {word} {}", told(lines.iter().map(usize::to_string).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_wild_cells_the_first_few_are_told_by_line_or_time() {
        let columns = vec![
            ("tau_6".to_owned(), vec![3, 7, 20, 21, 22, 90, 95], vec![0.0; 7]),
            ("tau_1".to_owned(), Vec::new(), vec![0.25]),
        ];
        let told = Note::Wild { recording: "log".into(), columns }.to_string();
        assert!(told.contains("8 cells are"), "{told}");
        assert!(
            told.contains("`tau_6` in lines 3, 7, 20, 21, 22 and 2 more; `tau_1` at t = 0.25 s"),
            "{told}"
        );
    }
}
