//! The pieces of a mask that was made of a whole picture, and those that lie at a place.

use image::{GrayImage, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};

use super::Where;

/// Pieces with less of the picture than this share are specks. Chosen: a twentieth of each side, as the least that `camera
/// segment` proposes, would be a 400th; a tenth of that is still no thing.
const SPECK: f64 = 1.0 / 4000.0;

/// Every piece but specks, as a mask of its own, the largest first.
pub(super) fn all(mask: &GrayImage) -> Vec<GrayImage> {
    let labels = connected_components(mask, Connectivity::Eight, Luma([0]));
    let n = labels.pixels().map(|label| label.0[0]).max().unwrap_or(0) as usize;
    let mut sizes = vec![0_usize; n + 1];
    for label in labels.pixels() {
        sizes[label.0[0] as usize] += 1;
    }
    let least = (SPECK * f64::from(mask.width()) * f64::from(mask.height())) as usize;
    let mut pieces: Vec<usize> = (1..=n).filter(|&k| sizes[k] > least).collect();
    pieces.sort_by_key(|&k| std::cmp::Reverse(sizes[k]));
    let one = |k: usize| {
        GrayImage::from_fn(mask.width(), mask.height(), |x, y| {
            Luma([if labels.get_pixel(x, y).0[0] as usize == k { 255 } else { 0 }])
        })
    };
    pieces.into_iter().map(one).collect()
}

/// The pieces that have more of themselves in a box than beside it, or the one that a point is on; `None` where there is none.
pub(super) fn at_place(mask: &GrayImage, at: &Where) -> Option<GrayImage> {
    let labels = connected_components(mask, Connectivity::Eight, Luma([0]));
    let n = labels.pixels().map(|label| label.0[0]).max().unwrap_or(0) as usize;
    let is_in: Vec<bool> = match at {
        Where::Point([x, y]) => {
            let inside = |at: f64, side: u32| at.round().clamp(0.0, f64::from(side) - 1.0) as u32;
            let at = (inside(*x, mask.width()), inside(*y, mask.height()));
            let own = labels.get_pixel(at.0, at.1).0[0] as usize;
            (0..=n).map(|k| k == own && k > 0).collect()
        }
        Where::Box([x0, y0, x1, y1]) => {
            let mut sizes = vec![(0_usize, 0_usize); n + 1];
            for (x, y, label) in labels.enumerate_pixels() {
                let (size, inside) = &mut sizes[label.0[0] as usize];
                let (x, y) = (f64::from(x), f64::from(y));
                *size += 1;
                *inside += usize::from(x >= *x0 && x <= *x1 && y >= *y0 && y <= *y1);
            }
            let is_in = |(k, (size, inside)): (usize, &(usize, usize))| k > 0 && 2 * inside > *size;
            sizes.iter().enumerate().map(is_in).collect()
        }
    };
    let found = GrayImage::from_fn(mask.width(), mask.height(), |x, y| {
        Luma([if is_in[labels.get_pixel(x, y).0[0] as usize] { 255 } else { 0 }])
    });
    is_in.contains(&true).then_some(found)
}
