//! Random paths as they are timed, for a comparison with others: `cargo run --release --example timed_paths [OUT] [N]`.
//!
//! `N` paths each (default 3) of two, three, five and nine corners: a line for each with its corners, the duration (s) and
//! the least time of five to find it (µs). With `OUT` a file is written with a JSON line for each that has the limits
//! (rad/s, rad/s², rad/s³) and the path as well: its corners, how far they are cut, and samples every 5 ms (rad).
//! `benches/peers/toppra_times.py` and `benches/peers/jerk_bound.py` read it.

#![expect(clippy::unwrap_used, reason = "a failed unwrap here is an argument that is wrong")]
#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::time::Instant;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::json;
use trueup::motion::Robot;
use trueup::motion::trajectory::{Limits, Trajectory};

/// Corners of a path, and how far from the middle of its range a joint goes, rad.
const KINDS: [(usize, f64); 4] = [(2, 2.0), (3, 1.0), (5, 1.0), (9, 0.5)];
/// At most so much of an edge is cut at a corner, rad, as a run does.
const CUT: f64 = 0.05;
/// Time between two samples, s.
const EVERY: f64 = 0.005;

fn main() {
    let out = std::env::args().nth(1);
    let n = std::env::args().nth(2).map_or(3, |n| n.parse().unwrap());
    let mut lines: Vec<String> = Vec::new();
    let limits = Limits::of(&Robot::gen3());
    let mut random = StdRng::seed_from_u64(1);
    for (corners, far) in KINDS {
        for _ in 0..n {
            let mut corner = || (0..7).map(|_| random.random_range(-far..far)).collect();
            let path: Vec<Vec<f64>> = (0..corners).map(|_| corner()).collect();
            let timed = || Trajectory::through_corners(&path, &limits, CUT, &|_, _| true).unwrap();
            let least = (0..5).map(|_| {
                let begin = Instant::now();
                timed();
                begin.elapsed().as_secs_f64()
            });
            let least = least.fold(f64::INFINITY, f64::min);
            let timed = timed();
            let duration = timed.duration();
            let count = (duration / EVERY).ceil() as usize;
            let at = |k: usize| timed.sample((k as f64 * EVERY).min(duration)).q;
            let samples: Vec<Vec<f64>> = (0..=count).map(at).collect();
            let line = json!({
                "corners": corners,
                "velocity": limits.velocity,
                "acceleration": limits.acceleration,
                "jerk": limits.jerk,
                "duration_s": duration,
                "time_us": least * 1e6,
                "samples": samples,
                "path": path,
                "cut": CUT,
            });
            lines.push(line.to_string());
            println!("{corners} corners: {duration:.3} s, found in {:.0} us", least * 1e6);
        }
    }
    if let Some(out) = out {
        std::fs::write(out, lines.join("\n")).unwrap();
    }
}
