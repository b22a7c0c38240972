//! Which of many cuts that overlap are told: those whose outlines together explain the most edge for what they are long.
//!
//! A border has a price for its length and is paid by the edge along it, and an edge pays once: to the outline that is
//! surer of all that run along it. So a neck gives way to its bottle, and the ground between two bottles, whose border is theirs,
//! has nothing left. An edge counts by how few places of the picture have a stronger one, since on a cloth any line finds some.
//! What cuts there are is the caller's.
//!
//! Source: Leclerc, "Constructing simple stable descriptions for image partitioning", IJCV 1989 (the shortest description);
//! Desolneux, Moisan and Morel, "Edge detection by Helmholtz principle", JMIV 2001 (edges by their rank).

use super::everything::SHARED;
use super::prompt::Segment;
use super::referee::FULL_EDGE;
use crate::alignment::picture::Picture;

/// Share of the picture's places that have a stronger edge than one that counts in full. Of the labelled things on the five
/// samples of `ClearGrasp` three tenths and a fifth choose as many, a sixth two fewer: the sides of clear bottles are then none.
const STRONGER: f64 = 0.25;
/// Price of a border, in full edges of its length. On the same samples 0.8 chooses as many, 0.7 one
/// fewer; with 0.5 three fewer, as things are joined with the ground between them.
const PRICE: f64 = 0.75;
/// Power with which form and place in the box (what the referee says beside edges) count. On the same samples 2
/// chooses one fewer and 8 two.
const FORM: i32 = 4;
/// Rounds of trying every cut in place of those it overlaps; later ones change nothing.
const ROUNDS: usize = 4;

/// The edges of a picture in order, to tell how few are stronger.
pub(super) struct Ranks(Vec<f64>);

impl Ranks {
    /// Looks at every place of a picture.
    pub(super) fn new(picture: &Picture) -> Self {
        let (w, h) = picture.size();
        let level = &picture.levels[0];
        let mut all: Vec<f64> = (0..w * h).map(|i| level.strongest(i % w, i / w).0).collect();
        all.sort_by(f64::total_cmp);
        Self(all)
    }

    /// How much an edge of this strength counts, 0 to 1.
    fn counts(&self, strength: f64) -> f64 {
        let n = self.0.len();
        let stronger = (n - self.0.partition_point(|at| *at <= strength)).max(1) as f64 / n as f64;
        (stronger.ln() / STRONGER.ln()).min(1.0) * (strength / FULL_EDGE).min(1.0)
    }
}

/// A cut with what speaks for it.
pub(super) struct Rated {
    pub(super) cut: Segment,
    /// The pixel of each point of its border, and how much the edge counts there.
    border: Vec<(usize, f64)>,
    /// Form and place in the box, 0 to 1.
    form: f64,
    /// Its mask, a bit per pixel, and how many there are.
    held: (Vec<u64>, u32),
}

impl Rated {
    /// Rates a cut by the edges along its border, one strength per point.
    pub(super) fn new(cut: Segment, strengths: &[f64], ranks: &Ranks) -> Self {
        let (w, h) = cut.mask.dimensions();
        let place = |at: f64, n: u32| at.round().clamp(0.0, f64::from(n) - 1.0) as usize;
        let border = cut.contour.iter().zip(strengths).map(|([u, v], strength)| {
            (place(*v, h) * w as usize + place(*u, w), ranks.counts(*strength))
        });
        let border = border.collect();
        let form = cut.agreement / cut.edge.max(1e-6);
        let bits =
            |pixels: &[u8]| pixels.iter().rev().fold(0, |all, p| all << 1 | u64::from(*p > 0));
        let held: Vec<u64> = cut.mask.as_raw().chunks(64).map(bits).collect();
        let area = held.iter().map(|word| word.count_ones()).sum();
        Self { border, form, held: (held, area), cut }
    }

    /// How sure it is, 0 to 1.
    pub(super) fn sure(&self) -> f64 {
        let sum: f64 = self.border.iter().map(|b| b.1).sum();
        self.form * sum / f64::max(self.border.len() as f64, 1.0)
    }

    /// Whether two are not both told.
    fn meets(&self, other: &Self) -> bool {
        let both: u32 =
            self.held.0.iter().zip(&other.held.0).map(|(a, b)| (a & b).count_ones()).sum();
        f64::from(both) >= SHARED * f64::from(self.held.1.min(other.held.1).max(1))
    }
}

/// Chooses of cuts of one picture those that are told.
pub(super) fn chosen(mut cuts: Vec<Rated>) -> Vec<Segment> {
    // From the smallest on, so that parts and their whole are weighed once all the parts are there.
    cuts.sort_by_key(|rated| rated.held.1);
    let (mut told, mut worth) = (Vec::<usize>::new(), 0.0);
    for _ in 0..ROUNDS {
        let before = worth;
        for k in 0..cuts.len() {
            if told.contains(&k) {
                continue;
            }
            let apart = told.iter().copied().filter(|other| !cuts[*other].meets(&cuts[k]));
            let next: Vec<usize> = apart.chain([k]).collect();
            let value = together(&cuts, &next);
            if value > worth {
                (told, worth) = (next, value);
            }
        }
        for k in told.clone() {
            let next: Vec<usize> = told.iter().copied().filter(|other| *other != k).collect();
            let value = together(&cuts, &next);
            if value > worth {
                (told, worth) = (next, value);
            }
        }
        if worth <= before {
            break;
        }
    }
    cuts.into_iter()
        .enumerate()
        .filter(|(k, _)| told.contains(k))
        .map(|(_, rated)| rated.cut)
        .collect()
}

/// What some cuts explain together, in px of full edge beyond the price of their borders.
fn together(cuts: &[Rated], told: &[usize]) -> f64 {
    let mut told: Vec<&Rated> = told.iter().map(|k| &cuts[*k]).collect();
    told.sort_by(|a, b| b.sure().total_cmp(&a.sure()));
    let Some(first) = told.first() else { return 0.0 };
    let (w, h) = first.cut.mask.dimensions();
    let (w, h) = (w as usize, h as usize);
    let mut paid = vec![false; w * h];
    let mut sum = 0.0;
    for rated in told {
        let free = rated.border.iter().filter(|(at, _)| !paid[*at]);
        sum += rated.form.powi(FORM) * free.map(|(_, edge)| edge - PRICE).sum::<f64>();
        // A pixel to each side: two borders along one edge are that far off.
        for (at, _) in &rated.border {
            let (x, y) = (at % w, at / w);
            for v in y.saturating_sub(1)..(y + 2).min(h) {
                for u in x.saturating_sub(1)..(x + 2).min(w) {
                    paid[v * w + u] = true;
                }
            }
        }
    }
    sum
}
