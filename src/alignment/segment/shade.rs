//! The shadow that a thing casts on the table, taken off a mask that took it in.
//!
//! A shadow has the colours of the table beside it, all weakened by one factor, and reaches the border of the mask. Where
//! lamps are small its own border is as sharp as the thing's, so that edges do not part them; colours do. What is thinner than
//! the borders of a cut are wrong is left as it is.
//!
//! Source: Finlayson, Hordley, Lu and Drew, "On the removal of shadows from images", PAMI 2006 (one light weakened: colours keep
//! their ratios).

use image::{GrayImage, Luma, RgbImage};
use imageproc::distance_transform::Norm;
use imageproc::morphology::{dilate, erode, open};
use imageproc::region_labelling::{Connectivity, connected_components};

use super::extent;
use crate::alignment::picture::linear;

/// How far around a mask the table's colour is taken, as a part of its longer side, and from how far off it, px: beyond blur and
/// what a cut is wrong by.
const AROUND: f64 = 0.15;
const BESIDE: u8 = 4;
/// The light that a shadow leaves, as a part. Chosen: a room's walls send back a tenth at least; what has more than 0.85 is table
/// that is lit unevenly.
const LEFT: [f32; 2] = [0.1, 0.85];
/// The factors of red, green and blue are one within this. Chosen: a shadow drawn with one lamp has 1.02, dark faces of things that
/// the laboratory shows beside a tan table have 1.3 and more.
const ONE: f32 = 1.12;
/// A shadow is at least twice as wide as this, px.
const THIN: u8 = 2;
/// Shares of a mask that its shadow may be: less is chance, more is a thing that has the table's colour.
const SHARES: [f64; 2] = [0.01, 0.7];

/// Returns a mask without the shadow in it, `None` where there is none.
pub(in crate::alignment) fn without_shadow(
    image: &RgbImage,
    mask: &GrayImage,
) -> Option<GrayImage> {
    let (held, area) = extent(mask)?;
    let table = beside(image, mask, held)?;
    let (w, h) = mask.dimensions();
    let is_shaded = |x: u32, y: u32| {
        let light = image.get_pixel(x, y).0.map(linear);
        let left: [f32; 3] = std::array::from_fn(|c| light[c] / table[c]);
        let mean = left.iter().sum::<f32>() / 3.0;
        let is_one = left.iter().all(|of| *of < ONE * mean && *of * ONE > mean);
        is_one && mean > LEFT[0] && mean < LEFT[1]
    };
    let is_in = |mask: &GrayImage, x: u32, y: u32| mask.get_pixel(x, y).0[0] > 0;
    let drawn = |is: &dyn Fn(u32, u32) -> bool| {
        GrayImage::from_fn(w, h, |x, y| Luma([if is(x, y) { 255 } else { 0 }]))
    };
    let shaded = drawn(&|x, y| is_in(mask, x, y) && is_shaded(x, y));
    // Thick parts of it, and all that hangs on them.
    let thick = dilate(&open(&shaded, Norm::L2, THIN), Norm::L2, THIN + 1);
    let whole = drawn(&|x, y| is_in(&thick, x, y) && is_in(&shaded, x, y));
    let pieces = connected_components(&whole, Connectivity::Eight, Luma([0]));
    let inner = erode(mask, Norm::L2, THIN + BESIDE);
    let mut cast = vec![false; w as usize * h as usize + 1];
    for (x, y, label) in pieces.enumerate_pixels() {
        if label.0[0] > 0 && !is_in(&inner, x, y) {
            cast[label.0[0] as usize] = true;
        }
    }
    let is_cast = |x: u32, y: u32| cast[pieces.get_pixel(x, y).0[0] as usize];
    let n = pieces.pixels().filter(|label| cast[label.0[0] as usize]).count();
    let share = n as f64 / area as f64;
    if !(SHARES[0]..=SHARES[1]).contains(&share) {
        return None;
    }
    let lit = drawn(&|x, y| is_in(mask, x, y) && !is_cast(x, y));
    // The shadow's own soft border stays behind as a thread.
    Some(largest(&open(&lit, Norm::L2, THIN)))
}

/// The middle of what is beside a mask in each channel, in linear light; `None` where there is too little of it, or it is black.
fn beside(image: &RgbImage, mask: &GrayImage, [u0, v0, u1, v1]: [f64; 4]) -> Option<[f32; 3]> {
    let far = (AROUND * (u1 - u0).max(v1 - v0)).ceil() as u32 + u32::from(BESIDE);
    let near = dilate(mask, Norm::L2, BESIDE);
    let across = (u0 as u32).saturating_sub(far)..(u1 as u32 + far + 1).min(mask.width());
    let down = (v0 as u32).saturating_sub(far)..(v1 as u32 + far + 1).min(mask.height());
    let mut channels: [Vec<u8>; 3] = std::array::from_fn(|_| Vec::new());
    for (x, y) in down.flat_map(|y| across.clone().map(move |x| (x, y))) {
        if near.get_pixel(x, y).0[0] == 0 {
            let colour = image.get_pixel(x, y).0;
            for (channel, value) in channels.iter_mut().zip(colour) {
                channel.push(value);
            }
        }
    }
    let middle = channels.map(|mut values| {
        let at = values.len() / 2;
        if values.is_empty() { 0.0 } else { linear(*values.select_nth_unstable(at).1) }
    });
    middle.iter().all(|light| *light > 0.0).then_some(middle)
}

/// The largest piece of a mask.
fn largest(mask: &GrayImage) -> GrayImage {
    let pieces = connected_components(mask, Connectivity::Four, Luma([0]));
    let mut sizes = vec![0_usize; mask.width() as usize * mask.height() as usize + 1];
    for label in pieces.pixels() {
        sizes[label.0[0] as usize] += 1;
    }
    sizes[0] = 0;
    let largest = (0..sizes.len()).max_by_key(|&i| sizes[i]).unwrap_or(0);
    GrayImage::from_fn(mask.width(), mask.height(), |x, y| {
        let label = pieces.get_pixel(x, y).0[0] as usize;
        Luma([if label != 0 && label == largest { 255 } else { 0 }])
    })
}
