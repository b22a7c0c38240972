//! Pixels where surfaces meet, looked at many times, so that an edge lies where it belongs to a small fraction of a pixel.

use wide::f32x4;

use super::Drawing;
use super::known::Known;
use super::lens::Lens;
use super::opaque::Asked;
use super::tile::TILE;
use super::tone::clamped;
use super::trace::{Candidates, Stage};
use crate::motion::widest;

/// Where surfaces meet in a picture, to be looked at closely.
pub(super) struct Edges<'d> {
    drawing: &'d Drawing<'d>,
    keys: &'d [u32],
    looks: Vec<Look>,
}

/// A look at a place in a pixel.
struct Look {
    /// How far right of and below the pixel's middle, px.
    off: [f64; 2],
    /// Whether what is seen there is lit, also where light of it is known: something clear, something clear of which the light known so
    /// far is uneven, and something opaque.
    lights_clear: bool,
    lights_uneven: bool,
    lights_opaque: bool,
}

impl Look {
    /// Returns the k-th of n.
    fn new(k: u16, n: u16) -> Self {
        let is_few = n < 10;
        // Every fifth, or those with an even number of ones: both choices are spread over the pixel as all points are.
        let (is_fifth, is_half) = (k.is_multiple_of(5), k.count_ones().is_multiple_of(2));
        Self {
            off: offset(k, n),
            lights_clear: if is_few { is_half } else { is_fifth },
            lights_uneven: is_half,
            lights_opaque: is_few || is_fifth,
        }
    }
}

impl<'d> Edges<'d> {
    pub(super) fn new(drawing: &'d Drawing<'_>, keys: &'d [u32]) -> Self {
        let n = drawing.edge_samples;
        let mut looks: Vec<Look> = (0..n).map(|k| Look::new(k, n)).collect();
        // What takes its light from others comes after them.
        looks.sort_by_key(|look| (!look.lights_clear, !look.lights_uneven));
        Self { drawing, keys, looks }
    }

    /// Looks at those of row `v` and hands out the light of each by its column.
    pub(super) fn look(&self, v: usize, mut put: impl FnMut(usize, [f32; 3])) {
        let Drawing { stage, lens, tiles, width, height, .. } = self.drawing;
        let mut edges = Vec::new();
        find_edges(self.keys, *width, *height, v, &mut edges);
        for u in edges {
            let (_, candidates) = tiles.of(u, v).part(u % TILE, v % TILE);
            put(u, look_closely(stage, lens, candidates, (u, v), &self.looks));
        }
    }
}

/// Looks many times at a pixel where surfaces meet and returns the mean.
///
/// Which surface is seen is asked at each of the places; how bright it is only at a few of each surface,
/// for light changes slowly along a surface.
fn look_closely(
    stage: &Stage<'_>,
    lens: &Lens,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    looks: &[Look],
) -> [f32; 3] {
    if stage.are_plain(candidates.things) {
        return look_closely_at_plain(stage, lens, candidates, (u, v), looks);
    }
    let mut known = Known::default();
    let mut sum = [0.0_f32; 3];
    for look in looks {
        let [du, dv] = look.off;
        let d = lens.direction(u as f64 + du, v as f64 + dv).normalize();
        let seen = stage.see(lens.centre, d, Some(candidates), 0);
        let surface = seen.surface();
        let is_asked = if seen.is_clear() {
            look.lights_clear || look.lights_uneven && known.is_uneven(surface)
        } else {
            look.lights_opaque
        };
        let light = known.light(surface).filter(|_| !is_asked).unwrap_or_else(|| {
            let light = clamped(stage.develop(&seen, lens.centre, d, 0).light);
            known.add(surface, light);
            light
        });
        sum = [sum[0] + light[0], sum[1] + light[1], sum[2] + light[2]];
    }
    let n = looks.len() as f32;
    [sum[0] / n, sum[1] / n, sum[2] / n]
}

/// As [`look_closely`], where only plain solids can be seen.
fn look_closely_at_plain(
    stage: &Stage<'_>,
    lens: &Lens,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    looks: &[Look],
) -> [f32; 3] {
    widest(
        #[inline(always)]
        || {
            let mut known = Known::default();
            let mut sum = [0.0_f32; 3];
            for some in looks.chunks(4) {
                let mut off = [[0.0_f32; 4]; 2];
                let mut asked =
                    Asked { clear: 0, uneven: 0, opaque: false, is_kept: looks.len() > 4 };
                for (k, look) in some.iter().enumerate() {
                    (off[0][k], off[1][k]) = (look.off[0] as f32, look.off[1] as f32);
                    asked.clear |= u32::from(look.lights_clear) << k;
                    asked.uneven |= u32::from(look.lights_uneven) << k;
                    asked.opaque |= look.lights_opaque;
                }
                let (d, _) = lens.four_rays((u, v), off.map(f32x4::from));
                let seen = stage.see_four(d, candidates.things);
                let seen = stage.look_four(d, seen, candidates.marks, asked, &mut known);
                for light in &seen.light[..some.len()] {
                    sum = [sum[0] + light[0], sum[1] + light[1], sum[2] + light[2]];
                }
            }
            let n = looks.len() as f32;
            [sum[0] / n, sum[1] / n, sum[2] / n]
        },
    )
}

/// Collects the columns of row `v` of which the pixel beside, above or below sees another surface.
///
/// Neighbours across a corner need not be asked: the corner lies midway between the two others beside it, so
/// a straight edge that leaves both on the pixel's side does not reach into the pixel.
fn find_edges(keys: &[u32], width: usize, height: usize, v: usize, edges: &mut Vec<usize>) {
    let row = |v: usize| &keys[v * width..(v + 1) * width];
    let here = row(v);
    let (above, below) = (row(v.saturating_sub(1)), row((v + 1).min(height - 1)));
    for first in (0..width).step_by(MANY) {
        let end = (first + MANY).min(width);
        // Nearly everywhere many neighbours see the same.
        if let (Some(here), Some(above), Some(below)) = (
            here[first..].first_chunk(),
            above[first..].first_chunk(),
            below[first..].first_chunk(),
        ) && here[0] == row(v)[first.saturating_sub(1)]
            && here[0] == row(v)[end.min(width - 1)]
            && are_alike(here, above, below)
        {
            continue;
        }
        for u in first..end {
            let (left, right) = (here[u.saturating_sub(1)], here[(u + 1).min(width - 1)]);
            let key = here[u];
            if left != key || right != key || above[u] != key || below[u] != key {
                edges.push(u);
            }
        }
    }
}

/// So many keys are looked at together.
const MANY: usize = 16;

/// Returns whether all keys are the same.
#[inline]
fn are_alike(here: &[u32; MANY], above: &[u32; MANY], below: &[u32; MANY]) -> bool {
    let (key, mut apart) = (here[0], 0);
    for k in 0..MANY {
        apart |= (here[k] ^ key) | (above[k] ^ key) | (below[k] ^ key);
    }
    apart == 0
}

/// Returns the k-th of n places in a pixel (Hammersley's points): all their columns and all their rows
/// differ, so that an edge along either axis is measured to 1/n of a pixel.
fn offset(k: u16, n: u16) -> [f64; 2] {
    let across = (f64::from(k) + 0.5) / f64::from(n);
    let down = f64::from(k.reverse_bits()) / 65536.0 + 0.5 / f64::from(n.next_power_of_two());
    [across - 0.5, down - 0.5]
}
