//! One or two effects exchanged for two others at once.
//!
//! Effects join one by one, and the first to join explains what it can of what belongs to all of them: a dead
//! zone may stand in for dry friction until another force is there that needs the one or the other. No
//! exchange of one effect alone leads back then.

use rayon::prelude::*;

use super::hypothesis::{Chosen, Hypothesis, Question, TIE};
use super::rivals::others;
use super::search::Tried;

/// Of how many effects that were tried the pairs are made.
const MOST: usize = 5;

impl Question<'_> {
    /// The hypothesis, or a better one with one or two of its effects exchanged for two others that were tried.
    pub(super) fn exchanged(
        &self,
        nominal: &Hypothesis,
        best: Hypothesis,
        rounds: &[Vec<Tried>],
    ) -> Hypothesis {
        // Where noise is all that is left, no other pair leaves less.
        if best.effects.is_empty() || self.is_noise(&best) {
            return best;
        }
        let tried: Vec<Hypothesis> = pairs(&best, rounds)
            .into_par_iter()
            .filter_map(|effects| self.rebuilt(nominal, &effects, &best, 15))
            .collect();
        let worth = |h: &Hypothesis| self.gain(&best, h, 1).evidence();
        let first = tried.into_iter().max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let Some(first) = first.filter(|h| worth(h) > 0.0) else { return best };
        let settled = self.rebuilt(nominal, &first.effects, &first, 40).unwrap_or(first);
        let degenerate = settled.effects.iter().any(|effect| settled.is_degenerate(effect));
        if degenerate || worth(&settled) < TIE { best } else { settled }
    }
}

/// Every set of effects in which the only one, or two, are exchanged for two others.
fn pairs(best: &Hypothesis, rounds: &[Vec<Tried>]) -> Vec<Vec<Chosen>> {
    let mut found = Vec::new();
    let n = best.effects.len();
    for i in 0..n {
        // Of a single effect only itself is exchanged.
        for j in if n == 1 { 0..1 } else { i + 1..n } {
            let mut beside = best.effects.clone();
            let mut own = vec![beside.remove(j)];
            if j > i {
                own.push(beside.remove(i));
            }
            let same = |a: &Chosen, b: &Chosen| {
                a.candidate.kind == b.candidate.kind && a.candidate.at == b.candidate.at
            };
            let list: Vec<Chosen> = others(&own[0], &beside, rounds)
                .into_iter()
                .filter(|other| own.iter().all(|o| !same(o, other)))
                .take(MOST)
                .collect();
            for (k, a) in list.iter().enumerate() {
                for b in list[k + 1..].iter().filter(|b| !a.candidate.excludes(&b.candidate)) {
                    let mut effects = beside.clone();
                    // What either was by itself is a poor beginning for both.
                    effects.extend([a.from_none(), b.from_none()]);
                    found.push(effects);
                }
            }
        }
    }
    found
}
