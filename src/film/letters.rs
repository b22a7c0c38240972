//! Letters on pictures: one size of one face, drawn once and kept as a picture.
//!
//! `letters.png` has the printable ASCII characters and a few signs in cells of 9 × 18 px, sixteen a row: `DejaVu Sans
//! Mono` at 15 px. A font file and what draws it would be forty times as large.

use std::sync::LazyLock;

use image::{GrayImage, Rgb, RgbImage};

/// Size of a cell, px.
pub const CELL: (u32, u32) = (9, 18);
/// The signs after ASCII, in the order of the picture.
const SIGNS: &str = "·°×≥≤−±²³µ…✓";

static LETTERS: LazyLock<GrayImage> = LazyLock::new(|| {
    image::load_from_memory(include_bytes!("letters.png"))
        .map(image::DynamicImage::into_luma8)
        .unwrap_or_default()
});

/// Writes a line with its upper left corner at a place; what does not fit is left out.
pub fn write(picture: &mut RgbImage, (x, y): (u32, u32), line: &str, colour: [u8; 3]) {
    for (n, letter) in (0_u32..).zip(line.chars()) {
        let Some((column, row)) = place(letter) else { continue };
        for (dx, dy) in (0..CELL.1).flat_map(|dy| (0..CELL.0).map(move |dx| (dx, dy))) {
            let at = (x + n * CELL.0 + dx, y + dy);
            let ink = LETTERS.get_pixel_checked(column + dx, row + dy).map_or(0, |ink| ink.0[0]);
            if let Some(Rgb(pixel)) = picture.get_pixel_mut_checked(at.0, at.1) {
                for (value, colour) in pixel.iter_mut().zip(colour) {
                    let mixed = u32::from(*value) * (255 - u32::from(ink))
                        + u32::from(colour) * u32::from(ink);
                    *value = (mixed / 255) as u8;
                }
            }
        }
    }
}

/// Where a letter is in the picture of letters; an unknown one is a question mark.
fn place(letter: char) -> Option<(u32, u32)> {
    let number = match letter {
        ' ' => return None,
        '!'..='~' => letter as u32 - 32,
        other => match SIGNS.chars().position(|sign| sign == other) {
            Some(at) => 95 + at as u32,
            None => '?' as u32 - 32,
        },
    };
    Some((number % 16 * CELL.0, number / 16 * CELL.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_leaves_ink_and_a_blank_leaves_none() {
        let ink = |line: &str| {
            let mut picture = RgbImage::new(40, 20);
            write(&mut picture, (3, 1), line, [255; 3]);
            picture.pixels().map(|pixel| u32::from(pixel.0[0])).sum::<u32>()
        };
        assert_eq!(ink("  "), 0);
        for sign in SIGNS.chars().chain('!'..='~') {
            assert!(ink(&sign.to_string()) > 100, "{sign}");
        }
        assert_eq!(ink("雨"), ink("?"));
        // Off the edge nothing is drawn and nothing fails.
        write(&mut RgbImage::new(5, 5), (3, 3), "outside", [255; 3]);
    }
}
