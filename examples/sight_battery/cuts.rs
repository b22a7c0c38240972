//! How well things are cut out without a scene: overlap with the masks of the photographs of clear things and their painted
//! twins, from a box, from a point, and with nothing said.

use std::path::Path;

use image::{GrayImage, Luma, RgbImage};
use imageproc::region_labelling::{Connectivity, connected_components};
use trueup::alignment::picture::Picture;
use trueup::alignment::segment::{Prompt, everything, segment};

/// How much too large a box is on each side, as a share of the piece in it: as drawn by hand.
const LOOSE: f64 = 0.15;
/// A piece of a mask is a thing from this share of the picture on; smaller ones are specks of the mask.
const LEAST: f64 = 0.001;

/// The pieces of a mask.
fn pieces(mask: &GrayImage) -> Vec<GrayImage> {
    let (w, h) = mask.dimensions();
    let dark = GrayImage::from_fn(w, h, |x, y| {
        Luma([if mask.get_pixel(x, y).0[0] > 127 { 255 } else { 0 }])
    });
    let labels = connected_components(&dark, Connectivity::Eight, Luma([0]));
    let count = labels.pixels().map(|label| label.0[0]).max().unwrap_or(0);
    (1..=count)
        .map(|k| {
            GrayImage::from_fn(w, h, |x, y| {
                Luma([if labels.get_pixel(x, y).0[0] == k { 255 } else { 0 }])
            })
        })
        .filter(|piece| area(piece) > LEAST * f64::from(w * h))
        .collect()
}

fn area(mask: &GrayImage) -> f64 {
    mask.pixels().filter(|pixel| pixel.0[0] > 0).count() as f64
}

/// What two masks share over what either has.
fn overlap(a: &GrayImage, b: &GrayImage) -> f64 {
    let both = a.pixels().zip(b.pixels()).filter(|(p, q)| p.0[0] > 0 && q.0[0] > 0).count() as f64;
    both / (area(a) + area(b) - both).max(1.0)
}

/// The box of a piece and its middle pixel: the one of the piece that is nearest to its centre of area.
fn place(piece: &GrayImage) -> ([f64; 4], [f64; 2]) {
    let mut held = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    let inside = || piece.enumerate_pixels().filter(|(_, _, pixel)| pixel.0[0] > 0);
    for (x, y, _) in inside() {
        let (x, y) = (f64::from(x), f64::from(y));
        held = [held[0].min(x), held[1].min(y), held[2].max(x), held[3].max(y)];
        sum = [sum[0] + x, sum[1] + y];
        count += 1.0;
    }
    let centre = sum.map(|s| s / count);
    let far = |x: u32, y: u32| (f64::from(x) - centre[0]).hypot(f64::from(y) - centre[1]);
    let middle = inside().min_by(|a, b| far(a.0, a.1).total_cmp(&far(b.0, b.1)));
    let middle = middle.map_or(centre, |(x, y, _)| [f64::from(x), f64::from(y)]);
    let (du, dv) = (LOOSE * (held[2] - held[0]), LOOSE * (held[3] - held[1]));
    ([held[0] - du, held[1] - dv, held[2] + du, held[3] + dv], middle)
}

/// Prints the overlaps of every piece in one picture; returns them by box, by point and with nothing said.
fn one(name: &str, image: &RgbImage, mask: &GrayImage) -> Vec<[f64; 3]> {
    let picture = Picture::new(image);
    let all = everything(&picture);
    let with = |piece: &GrayImage, prompt: &Prompt| {
        segment(&picture, prompt).map_or(0.0, |cut| overlap(&cut.mask, piece))
    };
    pieces(mask)
        .iter()
        .enumerate()
        .map(|(k, piece)| {
            let (bounds, middle) = place(piece);
            let by_box = with(piece, &Prompt::Box(bounds));
            let by_point = with(piece, &Prompt::Point(middle));
            let alone = all.iter().map(|cut| overlap(&cut.mask, piece)).fold(0.0, f64::max);
            println!("{name} {k}: box {by_box:.2}, point {by_point:.2}, nothing {alone:.2}");
            [by_box, by_point, alone]
        })
        .collect()
}

/// Cuts everything out of every photograph in a folder that has a mask.
pub(crate) fn all(folder: &Path) {
    let read = |name: String| image::open(folder.join(name)).ok();
    for (what, pictures) in [
        (
            "clear",
            ["080", "123", "130", "153"]
                .map(|s| (format!("real_{s}"), "-transparent-rgb-img.jpg"))
                .to_vec(),
        ),
        (
            "rendered",
            ["000", "002", "004"].map(|s| (format!("synthetic_{s}"), "-rgb.jpg")).to_vec(),
        ),
        (
            "opaque",
            ["080", "123", "130", "153"]
                .map(|s| (format!("real_{s}"), "-opaque-rgb-img.jpg"))
                .to_vec(),
        ),
    ] {
        let mut rows = Vec::new();
        for (name, end) in pictures {
            let both = read(format!("{name}{end}")).zip(read(format!("{name}-mask.png")));
            let Some((image, mask)) = both else {
                println!("# {name} is not here");
                continue;
            };
            rows.extend(one(&format!("{what} {name}"), &image.to_rgb8(), &mask.to_luma8()));
        }
        for (k, said) in ["a box", "a point", "nothing said"].iter().enumerate() {
            let mut column: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            column.sort_by(f64::total_cmp);
            let good = column.iter().filter(|iou| **iou > 0.8).count();
            let median = column.get(column.len() / 2).copied().unwrap_or(0.0);
            println!("{what}, {said}: {good} of {} above 0.8, median {median:.2}", column.len());
        }
    }
}
