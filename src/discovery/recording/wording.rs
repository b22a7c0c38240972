//! What is said of a recording that is read: what was assumed, what was left out.

use crate::units::significant;

/// What the `i`-th of `n` runs of a file is called, counted from 1.
pub(super) fn run_of(name: &str, i: usize, n: usize) -> String {
    format!("{name}, run {i} of {n}")
}

pub(super) fn rows_are_poses(name: &str) -> String {
    format!("{name}: there is no time `t`; each row is taken for a pose at rest")
}

pub(super) fn seconds_assumed(name: &str) -> String {
    format!("{name}: `t` has no unit; seconds are assumed")
}

/// Of the `n` runs the shortest has `least` rows, the longest `most`.
pub(super) fn several_runs(name: &str, n: usize, least: usize, most: usize) -> String {
    format!(
        "{name}: its clock starts again, so it is read as {n} recordings of {least} to {most} rows"
    )
}

/// How many columns are named where many are left out.
const TOLD_COLUMNS: usize = 12;

/// Several columns bear each of these names.
pub(super) fn one_of_several(name: &str, columns: &[String]) -> String {
    let told: Vec<String> = columns.iter().take(TOLD_COLUMNS).map(|c| format!("`{c}`")).collect();
    let more = columns.len() - told.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let told = told.join(", ");
    format!("{name}: left out, since several columns bear one name: {told}{more}")
}

/// Which form a time that is no number would do in.
pub(super) fn a_time(text: &str) -> &'static str {
    let is_stamp = text.starts_with(|c: char| c.is_ascii_digit()) && text.contains(['-', ':']);
    if is_stamp {
        "write times as numbers in one unit, such as seconds since the first row or since 1970, which `date -d STAMP +%s.%N` prints: \
         `t[s]`, `t[ms]`, `t[us]` or `t[ns]`"
    } else {
        "every row needs a finite time"
    }
}

/// These columns are blank, or others of their kind are.
pub(super) fn blank(name: &str, columns: &[String]) -> String {
    let told: Vec<String> = columns.iter().take(TOLD_COLUMNS).map(|c| format!("`{c}`")).collect();
    let more = columns.len() - told.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let told = told.join(", ");
    format!(
        "{name}: left out, since nothing stands in them or in another of their kind: {told}{more}"
    )
}

pub(super) fn rows_repeat(name: &str, n: usize) -> String {
    format!("{name}: {n} rows repeat the one before them and are left out")
}

pub(super) fn time_jumps(name: &str, n: usize) -> String {
    format!("{name}: time jumps in {n} places")
}

/// It lasts `duration`, s, of which `judged`, s, are judged, `end` of its `rows`; then nothing comes for `pause`, s.
pub(super) fn only_the_first(
    duration: f64,
    (judged, end): (f64, usize),
    rows: usize,
    pause: f64,
) -> String {
    format!(
        "it goes on for {} s, of which the first {} s with {end} of {rows} rows are judged; \
         the next row comes {} s later",
        significant(duration, 3),
        significant(judged, 3),
        significant(pause, 3),
    )
}

pub(super) fn thinned(rows: usize, every: usize) -> String {
    format!("of {rows} rows every {every}th is judged")
}

#[cfg(feature = "bags")]
pub(super) fn not_every_topic(name: &str, n: usize) -> String {
    format!("{name}: {n} rows lie where not every topic speaks; left out")
}

#[cfg(feature = "bags")]
pub(super) fn without_stamp(name: &str) -> String {
    format!("{name}: messages without a stamp; the time they were logged is taken")
}

#[cfg(feature = "bags")]
pub(super) fn messages_repeat(name: &str, n: usize) -> String {
    format!("{name}: {n} messages repeat a time and are left out")
}
