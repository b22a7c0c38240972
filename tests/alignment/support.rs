//! Seeded noise, and numbers out of texts.

use rand::RngExt;
use rand::rngs::StdRng;

/// Draws from the standard normal distribution (Box and Muller).
pub(crate) fn normal(random: &mut StdRng) -> f64 {
    let a: f64 = random.random_range(f64::MIN_POSITIVE..1.0);
    let b: f64 = random.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * a.ln()).sqrt() * b.cos()
}

/// Returns every number in a text, in order.
pub(crate) fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',', '\t', '\n', '\r', '<', '>']).filter_map(|w| w.parse().ok()).collect()
}
