//! Seeded noise and the public data sets, read in place.

use std::path::PathBuf;

use rand::RngExt;
use rand::rngs::StdRng;

/// Draws from the standard normal distribution (Box and Muller).
pub(crate) fn normal(random: &mut StdRng) -> f64 {
    let a: f64 = random.random_range(f64::MIN_POSITIVE..1.0);
    let b: f64 = random.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * a.ln()).sqrt() * b.cos()
}

/// Returns a folder of public data, or `None`, having said so, where it is absent.
pub(crate) fn public(set: &str) -> Option<PathBuf> {
    let dir =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/public")).join(set);
    if dir.is_dir() {
        return Some(dir);
    }
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    {
        eprintln!("skipped: {} is absent", dir.display());
    }
    None
}

/// Returns every number in a text, in order.
pub(crate) fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',', '\t', '\n', '\r', '<', '>']).filter_map(|w| w.parse().ok()).collect()
}
