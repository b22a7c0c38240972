//! How far a map can be trusted: ± px over the picture, and what a person should be warned of.
//!
//! Nothing here changes a fit. Everything follows from its covariance and from where its points lie; a picture that is
//! larger than the points reach is asked about by its size.
//!
//! Source: Hartley and Zisserman, *Multiple View Geometry*, 2nd ed., §5.2.6 (covariance of a transferred point); Moisan and
//! Stival, "A Probabilistic Criterion to Detect Rigid Point Matches", IJCV 2004 (agreement by chance).

use nalgebra::Vector2;

use super::model::{MapFit, Pair};
use crate::world::Pixel;

/// How unsure the map is at places of the twin's picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Columns' u in the twin's picture, px.
    pub u_px: Vec<f64>,
    /// Rows' v in the twin's picture, px.
    pub v_px: Vec<f64>,
    /// Standard deviation of where the map puts the pixel (root of the sum over both axes), px, a list a row; `None` on or
    /// beyond its horizon.
    pub std_px: Vec<Vec<Option<f64>>>,
}

impl Grid {
    /// Returns the largest value, and where; `None` in place of a value is the largest.
    fn worst(&self) -> Option<(Pixel, Option<f64>)> {
        let all = self.v_px.iter().zip(&self.std_px).flat_map(|(&v, row)| {
            self.u_px.iter().zip(row).map(move |(&u, std)| (Pixel::new(u, v), *std))
        });
        all.max_by(|a, b| a.1.unwrap_or(f64::INFINITY).total_cmp(&b.1.unwrap_or(f64::INFINITY)))
    }
}

/// Which picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The real camera's.
    Real,
    /// The twin's.
    Twin,
}

/// What a person should know before relying on a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warning {
    /// No more pairs than the form has unknowns for: any pairs fit.
    Unchecked {
        /// How many pairs the map rests on.
        kept: usize,
        /// How many others were left out.
        left_out: usize,
    },
    /// The points lie on one line but for their noise.
    OnALine {
        /// In which picture.
        side: Side,
        /// Root mean square distance from the line, px.
        across_px: f64,
        /// Noise of one coordinate, px.
        noise_px: f64,
    },
    /// Between its own points the map is much less sure than one of them.
    HardlyDetermined {
        /// Largest standard deviation inside the points' bounding box, px.
        std_px: f64,
        /// Noise of one coordinate, px.
        noise_px: f64,
    },
    /// Far from the points the map is a guess.
    SmallPatch {
        /// Share of the twin's picture that the points' bounding box covers.
        share: f64,
        /// Where it is least sure.
        at: Pixel,
        /// How unsure, px; `None` beyond the horizon.
        std_px: Option<f64>,
    },
    /// The horizon runs through the twin's picture.
    Horizon {
        /// Share of the picture's grid without an image.
        share: f64,
    },
    /// Near the twin's pixel (0, 0) the map runs to infinity: with a 1 in the corner its entries are huge.
    CornerNearZero {
        /// The homogeneous coordinate of (0, 0) over that of the points' centre.
        ratio: f64,
    },
    /// As many pairs agree by chance.
    ByChance {
        /// How many agree.
        kept: usize,
        /// Of how many.
        given: usize,
        /// Logarithm to base 10 of how many such agreements random pairs would give.
        log_expected: f64,
    },
    /// The real picture is the twin's seen in a mirror.
    Mirrored,
}

/// So many noises are a warning: a map ten times as unsure as one of its points has lost a digit.
const MUCH: f64 = 10.0;
/// Points this many noises across are on a line: a ninth of their scatter across it is then noise.
const ACROSS: f64 = 3.0;
/// The homogeneous coordinate of (0, 0) below this share of that of the points: entries of `M` are a hundred times larger
/// than those of a map about the points' centre, and two digits fewer of them mean anything.
const CORNER: f64 = 0.01;
/// Columns and rows of the grid that is looked at: the sides, the middle, and one between.
const GRID: (usize, usize) = (9, 7);

impl MapFit {
    /// Returns how unsure the map is over the twin's picture of `size` px, on a grid with its corners; `None` when it rests on
    /// no more pairs than it has unknowns for, since then nobody knows the noise.
    pub fn uncertainty(&self, size: Vector2<f64>) -> Option<Grid> {
        (2 * self.kept > self.model.dof()).then(|| self.over(size))
    }

    fn over(&self, size: Vector2<f64>) -> Grid {
        self.grid(Vector2::zeros(), size, GRID)
    }

    fn grid(&self, low: Vector2<f64>, high: Vector2<f64>, (n, m): (usize, usize)) -> Grid {
        let places = |from: f64, to: f64, n: usize| -> Vec<f64> {
            (0..n).map(|i| from + (to - from) * i as f64 / (n - 1) as f64).collect()
        };
        let (u_px, v_px) = (places(low.x, high.x, n), places(low.y, high.y, m));
        let std = |u: f64, v: f64| self.std_at(Pixel::new(u, v)).map(|s| s.norm());
        let std_px = v_px.iter().map(|&v| u_px.iter().map(|&u| std(u, v)).collect()).collect();
        Grid { u_px, v_px, std_px }
    }

    /// Returns what a person should know before relying on the map that was fitted to `pairs`; `size` is that of the twin's
    /// picture, px.
    pub fn warnings(&self, pairs: &[Pair], size: Vector2<f64>) -> Vec<Warning> {
        let left_out = &self.outliers;
        let is_kept = |row: &usize| left_out.binary_search(row).is_err();
        let kept: Vec<Pair> = (0..pairs.len()).filter(is_kept).map(|i| pairs[i]).collect();
        let mut found = Vec::new();
        if 2 * kept.len() <= self.model.dof() {
            let (kept, left_out) = (kept.len(), left_out.len());
            found.push(Warning::Unchecked { kept, left_out });
        } else {
            found.extend(self.by_chance(&kept, pairs.len()));
            let on_a_line = self.on_a_line(&kept);
            found.extend(on_a_line);
            found.extend(self.away(&kept, size, on_a_line.is_some()));
        }
        found.extend(self.near_the_horizon(&kept, size));
        // What is made of noise may be turned over by it.
        let is_noise = |w: &Warning| {
            use Warning::{ByChance, HardlyDetermined, OnALine};
            matches!(w, OnALine { .. } | HardlyDetermined { .. } | ByChance { .. })
        };
        if !found.iter().any(is_noise) && self.is_mirrored(&kept) {
            found.push(Warning::Mirrored);
        }
        found
    }

    /// Whether the map turns the picture over at its points: its Jacobian's determinant, `det M / w³`, is negative. Two cameras
    /// that look at the same side of a table never differ so.
    fn is_mirrored(&self, kept: &[Pair]) -> bool {
        self.m.determinant() * self.weight_at(centre(kept)) < 0.0
    }

    /// Returns the homogeneous coordinate of the image of a twin pixel.
    fn weight_at(&self, twin: Vector2<f64>) -> f64 {
        self.m[(2, 0)] * twin.x + self.m[(2, 1)] * twin.y + self.m[(2, 2)]
    }

    /// Whether pairs at random would agree as well: the number of false alarms of a map that keeps `k` of `n` pairs within
    /// the largest error seen, `(n - m) C(n, k) C(k, m) (π r² / area)^(k - m)`.
    fn by_chance(&self, kept: &[Pair], given: usize) -> Option<Warning> {
        let m = self.model.minimal();
        let k = kept.len();
        let far2 = kept
            .iter()
            .map(|p| self.apply(p.twin).map_or(f64::INFINITY, |at| at.distance(p.real).powi(2)));
        let alpha = (std::f64::consts::PI * far2.fold(0.0, f64::max) / self.area_px2).min(1.0);
        let log10_choose = |n: usize, k: usize| {
            (0..k).map(|i| ((n - i) as f64 / (i + 1) as f64).log10()).sum::<f64>()
        };
        let log_expected = ((given - m).max(1) as f64).log10()
            + log10_choose(given, k.min(given - k))
            + log10_choose(k, m.min(k - m))
            + (k - m) as f64 * alpha.max(f64::MIN_POSITIVE).log10();
        (log_expected > 0.0).then_some(Warning::ByChance { kept: k, given, log_expected })
    }

    fn on_a_line(&self, kept: &[Pair]) -> Option<Warning> {
        let noise_px = self.noise_px;
        [(Side::Twin, (|p: &Pair| p.twin) as fn(&Pair) -> Pixel), (Side::Real, |p| p.real)]
            .into_iter()
            .filter(|_| self.model != super::Model::Scale)
            .find_map(|(side, of)| {
                let across_px = super::normalise::across(kept.iter().map(of));
                (across_px < ACROSS * noise_px).then_some(Warning::OnALine {
                    side,
                    across_px,
                    noise_px,
                })
            })
    }

    /// Between the points and away from them.
    fn away(&self, kept: &[Pair], size: Vector2<f64>, is_line: bool) -> Option<Warning> {
        let noise_px = self.noise_px;
        let (low, high) = bounds(kept.iter().map(|p| p.twin));
        let (_, inside) = self.grid(low, high, GRID).worst()?;
        let inside = inside.unwrap_or(f64::INFINITY);
        if inside > MUCH * noise_px {
            // Said already.
            let said = Warning::HardlyDetermined { std_px: inside, noise_px };
            return (!is_line).then_some(said);
        }
        let (at, std_px) = self.over(size).worst()?;
        let share = ((high.x - low.x) * (high.y - low.y) / (size.x * size.y)).clamp(0.0, 1.0);
        let is_far = std_px.is_none_or(|std| std > MUCH * noise_px);
        is_far.then_some(Warning::SmallPatch { share, at, std_px })
    }

    fn near_the_horizon(&self, kept: &[Pair], size: Vector2<f64>) -> Vec<Warning> {
        let mut found = Vec::new();
        let grid = self.over(size);
        let all = grid.std_px.iter().flatten();
        let share = all.clone().filter(|std| std.is_none()).count() as f64 / all.count() as f64;
        if share > 0.0 {
            found.push(Warning::Horizon { share });
        }
        let w = self.weight_at(centre(kept));
        if w.recip().abs() < CORNER {
            found.push(Warning::CornerNearZero { ratio: w.recip() });
        }
        found
    }
}

/// Returns the size of the twin's picture as far as its points tell: from (0, 0) to beyond the farthest, px.
pub fn reached(pairs: &[Pair]) -> Vector2<f64> {
    let (_, high) = bounds(pairs.iter().map(|p| p.twin));
    high.map(|side| side.max(1.0).ceil())
}

/// Returns the centre of the twin's points, px.
fn centre(pairs: &[Pair]) -> Vector2<f64> {
    let all = pairs.iter().map(|p| Vector2::new(p.twin.u, p.twin.v));
    all.sum::<Vector2<f64>>() / pairs.len().max(1) as f64
}

fn bounds(pixels: impl Iterator<Item = Pixel>) -> (Vector2<f64>, Vector2<f64>) {
    let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    for p in pixels {
        let at = Vector2::new(p.u, p.v);
        low = low.inf(&at);
        high = high.sup(&at);
    }
    (low, high)
}
