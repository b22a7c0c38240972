//! Colours of a region as a mixture of a few, and how well another colour fits them. Regions are the caller's.
//!
//! Source: Lloyd, "Least squares quantization in PCM", 1982 (k-means).

/// A colour, its variance, and the logarithms of that and of its share.
struct Colour {
    mean: [f64; 3],
    variance: [f64; 3],
    ln_variance: [f64; 3],
    ln_share: f64,
}

/// A mixture of a few colours with their spreads and shares.
pub(super) struct Palette {
    colours: Vec<Colour>,
}

impl Palette {
    /// Learns four colours by k-means from seeds spread over the lightness order; `None` of too few cells.
    pub(super) fn learn(cells: &[[f64; 3]]) -> Option<Self> {
        // Chosen: one fewer than GrabCut has (Rother, Kolmogorov and Blake, 2004).
        const K: usize = 4;
        if cells.len() < 4 * K {
            return None;
        }
        let mut sorted: Vec<[f64; 3]> = cells.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut means: Vec<[f64; 3]> =
            (0..K).map(|k| sorted[(2 * k + 1) * sorted.len() / (2 * K)]).collect();
        let far = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
        let nearest = |means: &[[f64; 3]], cell: &[f64; 3]| {
            (0..K)
                .min_by(|&i, &j| far(&means[i], cell).total_cmp(&far(&means[j], cell)))
                .unwrap_or(0)
        };
        let mut colours = Vec::new();
        for _ in 0..6 {
            let mut sums = [([0.0; 3], [0.0; 3], 0.0); K];
            for cell in cells {
                let slot = &mut sums[nearest(&means, cell)];
                for (c, value) in cell.iter().enumerate() {
                    slot.0[c] += value;
                    slot.1[c] += value * value;
                }
                slot.2 += 1.0;
            }
            colours.clear();
            for (k, (sum, square, n)) in sums.into_iter().enumerate() {
                if n < 3.0 {
                    continue;
                }
                let mean = sum.map(|s| s / n);
                means[k] = mean;
                // A floor of one CIELAB keeps a flat colour from being infinitely sure of itself.
                let variance =
                    [0, 1, 2].map(|c| (square[c] / n - mean[c] * mean[c]).max(0.0) + 1.0);
                let ln_share = (n / cells.len() as f64).ln();
                colours.push(Colour {
                    mean,
                    variance,
                    ln_variance: variance.map(f64::ln),
                    ln_share,
                });
            }
        }
        Some(Self { colours })
    }

    /// Returns the negative log-likelihood of a colour.
    pub(super) fn cost(&self, cell: &[f64; 3]) -> f64 {
        self.colours
            .iter()
            .map(|Colour { mean, variance, ln_variance, ln_share }| {
                (0..3)
                    .map(|c| (cell[c] - mean[c]).powi(2) / variance[c] + ln_variance[c])
                    .sum::<f64>()
                    / 2.0
                    - ln_share
            })
            .fold(40.0, f64::min)
    }
}
