//! A film file, as far as it can be read without a decoder: boxes, tables, units. ffmpeg decodes it to the bits that the
//! encoder keeps, and a film is opened by OpenCV and browsers (ARCHITECTURE.md, `film`).

use image::{Rgb, RgbImage};
use trueup::film::Film;

/// The content of the first box of a name, at any depth of those that hold boxes.
fn content(file: &[u8], name: [u8; 4]) -> Option<&[u8]> {
    let mut rest = file;
    while rest.len() >= 8 {
        let size = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
        let (kind, inside) = (&rest[4..8], &rest[8..size]);
        if kind == name {
            return Some(inside);
        }
        let holds = [b"moov", b"trak", b"mdia", b"minf", b"stbl"].iter().any(|one| kind == *one);
        if holds && let Some(found) = content(inside, name) {
            return Some(found);
        }
        rest = &rest[size..];
    }
    assert!(rest.is_empty(), "bytes are left over");
    None
}

fn words(bytes: &[u8]) -> Vec<usize> {
    bytes
        .chunks_exact(4)
        .map(|word| u32::from_be_bytes(word.try_into().unwrap()) as usize)
        .collect()
}

/// A square that wanders over a slope of grey.
fn picture(k: u32) -> RgbImage {
    RgbImage::from_fn(150, 90, |x, y| {
        let is_inside = (10 + 2 * k..30 + 2 * k).contains(&x) && (20..40).contains(&y);
        if is_inside { Rgb([200, 40, 30]) } else { Rgb([(x + y) as u8, 90, 120]) }
    })
}

#[test]
fn every_picture_is_where_the_tables_say() {
    let mut film = Film::new(150, 90, 5);
    for k in 0..30 {
        film.add(&picture(k));
    }
    let file = film.finish();
    assert_eq!(&file[4..12], b"ftypisom");
    let sizes = words(content(&file, *b"stsz").unwrap());
    assert_eq!((sizes[2], sizes.len()), (30, 3 + 30));
    // Whole pictures every five seconds; a difference is a small part of one.
    assert_eq!(words(content(&file, *b"stss").unwrap()), [0, 2, 1, 26]);
    let (whole, difference) = (sizes[3], sizes[4]);
    assert!(3 * difference < whole, "{difference} of {whole} bytes");
    let mut at = words(content(&file, *b"stco").unwrap())[2];
    for (k, size) in sizes[3..].iter().enumerate() {
        let length = words(&file[at..at + 4])[0];
        assert_eq!(length + 4, *size);
        let kind = file[at + 4] & 0x1f;
        assert_eq!(kind, if k % 25 == 0 { 5 } else { 1 }, "picture {k}");
        at += size;
    }
    assert_eq!(at, file.len());
    // Size in the track's header, and as it is cut out of whole macroblocks.
    let header = words(content(&file, *b"tkhd").unwrap());
    assert_eq!(header[header.len() - 2..], [150 << 16, 90 << 16]);
}

#[test]
fn what_does_not_change_costs_next_to_nothing() {
    let length = |n: u32, moves: bool| {
        let mut film = Film::new(150, 90, 5);
        for k in 0..n {
            film.add(&picture(if moves { k } else { 0 }));
        }
        film.finish().len()
    };
    let still = length(20, false) - length(1, false);
    // Of each picture a header and one count of what is left out, and its place in the table.
    assert!(still < 19 * 24, "{still} bytes for 19 pictures");
    assert!(length(20, true) - length(1, true) > 4 * still);
}
