//! Minimal samples: evenly from all rows, or of the likelier ones first where scores say which.
//!
//! Source: Chum and Matas, "Matching with PROSAC: progressive sample consensus", CVPR 2005.

use rand::RngExt;
use rand::rngs::StdRng;

use super::judge::{Judge, Score};
use super::{Regression, TRIES, mix};

/// Where minimal samples come from.
pub(super) struct Samples {
    /// Rows to draw from, the likeliest first where scores say which.
    rows: Vec<usize>,
    /// How far down that list samples reach, and from which draw on it is one further; the whole list without scores.
    reach: usize,
    growth: Option<Growth>,
    drawn: usize,
}

/// Among fewer rows a share is chance: of 32 it is known to ± 0.09 at worst.
const FIRST: usize = 32;

/// How samples come to reach further down the list.
struct Growth {
    /// How many samples of so many draws would lie within reach, and at which draw the reach grows.
    within: f64,
    next: f64,
}

impl Samples {
    pub(super) fn new<R: Regression>(
        regression: &R,
        drawn: &[usize],
        scores: Option<&[f64]>,
        seed: u64,
    ) -> Self {
        let m = regression.minimal();
        let Some(scores) = scores.filter(|scores| scores.len() == regression.len()) else {
            return Self { rows: drawn.to_vec(), reach: drawn.len(), growth: None, drawn: 0 };
        };
        let mut ranked: Vec<(f64, u64, usize)> = scores
            .iter()
            .enumerate()
            .map(|(i, &score)| (score, mix(regression.key(i) ^ seed), i))
            .collect();
        // Of equal scores the value decides, not the row.
        let by_rank = |a: &(f64, u64, usize), b: &(f64, u64, usize)| {
            b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2))
        };
        if ranked.len() > drawn.len() {
            ranked.select_nth_unstable_by(drawn.len(), by_rank);
            ranked.truncate(drawn.len());
        }
        ranked.sort_unstable_by(by_rank);
        let rows: Vec<usize> = ranked.into_iter().map(|(.., i)| i).collect();
        let n = rows.len() as f64;
        // Of TRIES samples from the whole list so many would lie within its first m.
        let within = (0..m).fold(TRIES as f64, |t, i| t * (m - i) as f64 / (n - i as f64));
        Self { rows, reach: m, growth: Some(Growth { within, next: 1.0 }), drawn: 0 }
    }

    /// Returns the largest share of rows that agree with a model among the first of the list, `0` without scores: samples come
    /// from there first, so the search may end as if that were the share of all (PROSAC's rule).
    pub(super) fn share<R: Regression>(
        &self,
        regression: &R,
        judge: &Judge,
        model: &R::Model,
        state: Score,
    ) -> f64 {
        if self.growth.is_none() {
            return 0.0;
        }
        let mut errors = Vec::new();
        regression.errors2(model, &regression.rows(&self.rows), &mut errors);
        let even = judge.even(state);
        let mut agree = 0;
        let shares = errors.iter().enumerate().map(|(i, e2)| {
            agree += usize::from(*e2 <= even);
            if i + 1 < FIRST { 0.0 } else { agree as f64 / (i + 1) as f64 }
        });
        shares.fold(0.0, f64::max)
    }

    /// Fills `picked` with different rows.
    pub(super) fn draw(&mut self, random: &mut StdRng, picked: &mut [usize]) {
        let m = picked.len();
        self.drawn += 1;
        let mut from = 0;
        if let Some(growth) = &mut self.growth
            && self.drawn as f64 >= growth.next
            && self.reach < self.rows.len()
        {
            let grown = growth.within * (self.reach + 1) as f64 / (self.reach + 1 - m) as f64;
            growth.next += (grown - growth.within).ceil().max(1.0);
            growth.within = grown;
            self.reach += 1;
            // The newest is in every sample until the reach grows again.
            picked[0] = self.reach - 1;
            from = 1;
        }
        let reach = self.reach - from;
        for i in from..m {
            loop {
                let candidate = random.random_range(0..reach);
                if !picked[..i].contains(&candidate) {
                    picked[i] = candidate;
                    break;
                }
            }
        }
        for place in picked {
            *place = self.rows[*place];
        }
    }
}
