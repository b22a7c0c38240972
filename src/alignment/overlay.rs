//! A picture for people: what was seen, drawn over the photograph.

use image::{Rgb, RgbImage};

use super::outline::{Outline, Projector};
use super::vision::Sighting;
use crate::world::frame::World;
use crate::world::{Camera, Point, Unknown};

/// Colours that stay apart for the colour-blind (Okabe and Ito), one per object in turn.
const COLOURS: [[u8; 3]; 6] =
    [[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66], [213, 94, 0], [204, 121, 167]];

/// The colour around what no scene declares: none of those above.
const UNDECLARED: [u8; 3] = [230, 20, 20];

/// Steps of a dashed line, px of a picture 640 px wide: a dash and a gap are each this long.
const DASH: f64 = 6.0;

/// Draws outlines, key points, names and how sure over a copy of the picture.
///
/// Objects that were not found are listed in the top left corner, and where each most probably is if it is there at all
/// is dashed.
pub fn annotate(image: &RgbImage, sightings: &[Sighting]) -> RgbImage {
    let mut out = image.clone();
    let scale = (image.width() / 640).max(1);
    let mut line = 0;
    for (i, s) in sightings.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        if !s.found {
            text(
                &mut out,
                (8, f64::from(8 + 10 * line * scale)),
                scale,
                colour,
                &format!("{}: not found {:.0}%", s.name, 100.0 * s.confidence),
            );
            line += 1;
            if s.likeliest.is_some() {
                dashed(&mut out, &s.hull, f64::from(scale) * DASH, colour);
            }
            continue;
        }
        for (k, a) in s.hull.iter().enumerate() {
            let b = s.hull[(k + 1) % s.hull.len()];
            stroke(&mut out, *a, b, colour);
        }
        for p in &s.key_points {
            for dy in -2..=2 {
                for dx in -2..=2 {
                    put(&mut out, p[0] + f64::from(dx), p[1] + f64::from(dy), colour);
                }
            }
        }
        let place = s.world_from_object.map(|pose| pose.origin()).unwrap_or_default();
        let label = format!(
            "{} {:.0} {:.0} MM {:.0}%",
            s.name,
            1e3 * place.x,
            1e3 * place.y,
            100.0 * s.confidence
        );
        let others = sightings.iter().enumerate().filter(|(k, other)| *k != i && other.found);
        let others: Vec<[f64; 4]> = others.map(|(_, other)| other.bbox).collect();
        let long = 6.0 * label.chars().count() as f64;
        let at = beside(s.bbox, f64::from(scale) * long, f64::from(10 * scale), &others);
        text(&mut out, (at[0] as u32, at[1]), scale, colour, &label);
    }
    out
}

/// Where the label of a thing in a box begins, `long` and `high` px: above it, below it or beside it, the first of these that lies over
/// no other; above it where all do.
fn beside([u0, v0, u1, v1]: [f64; 4], long: f64, high: f64, others: &[[f64; 4]]) -> [f64; 2] {
    let above = [u0, (v0 - high).max(1.0)];
    let middle = 0.5 * (v0 + v1 - high);
    let places = [above, [u0, v1 + 2.0], [u1 + 2.0, middle], [(u0 - long - 2.0).max(0.0), middle]];
    let is_free = |[u, v]: &[f64; 2]| {
        let meets = |other: &[f64; 4]| {
            *u < other[2] && u + long > other[0] && *v < other[3] && v + high > other[1]
        };
        !others.iter().any(meets)
    };
    places.into_iter().find(is_free).unwrap_or(above)
}

/// Draws a closed line of dashes of `dash` px.
fn dashed(image: &mut RgbImage, closed: &[[f64; 2]], dash: f64, colour: [u8; 3]) {
    let mut gone = 0.0;
    for (k, a) in closed.iter().enumerate() {
        let b = closed[(k + 1) % closed.len()];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        // Hulls of what is not wholly in view may reach far beyond the picture.
        let steps = length.clamp(1.0, 10_000.0).ceil() as u32;
        for i in 0..steps {
            let t = f64::from(i) / f64::from(steps);
            if ((gone + t * length) / dash).rem_euclid(2.0) < 1.0 {
                put(image, a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, colour);
            }
        }
        gone += length;
    }
}

/// Draws a closed outline two pixels wide, in the colour of the `k`-th thing.
pub fn outline(image: &mut RgbImage, contour: &[[f64; 2]], k: usize) {
    let colour = COLOURS[k % COLOURS.len()];
    for (i, a) in contour.iter().enumerate() {
        let b = contour[(i + 1) % contour.len()];
        for (du, dv) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            stroke(image, [a[0] + du, a[1] + dv], [b[0] + du, b[1] + dv], colour);
        }
    }
}

/// Draws a dashed box `[u0, v0, u1, v1]`, px, in red, around what could not be measured.
pub fn unmeasured(image: &mut RgbImage, [u0, v0, u1, v1]: [f64; 4]) {
    let scale = f64::from((image.width() / 640).max(1));
    dashed(image, &[[u0, v0], [u1, v0], [u1, v1], [u0, v1]], scale * DASH, UNDECLARED);
}

/// Draws around each thing that no scene declares, in red: its outline if it was measured, else the circle on the table that
/// bounds it.
pub fn outline_unknown(image: &mut RgbImage, camera: &Camera, others: &[Unknown]) {
    // Chosen: on a picture chords of 48 leave a circle of 300 px radius by 0.6 px.
    const CORNERS: u32 = 48;
    let view = Projector::new(camera);
    for other in others {
        if let Some(form) = &other.form {
            let outline = Outline::new(&view, &form.shape, &form.world_from_object, 2).hull;
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                stroke(image, [a.x, a.y], [b.x, b.y], UNDECLARED);
            }
            continue;
        }
        let rim = (0..=CORNERS).filter_map(|k| {
            let turn = std::f64::consts::TAU * f64::from(k) / f64::from(CORNERS);
            let (x, y) = (other.radius * turn.cos(), other.radius * turn.sin());
            camera.project(Point::<World>::new(other.at[0] + x, other.at[1] + y, 0.0))
        });
        let rim: Vec<[f64; 2]> = rim.map(|pixel| [pixel.u, pixel.v]).collect();
        for pair in rim.windows(2) {
            stroke(image, pair[0], pair[1], UNDECLARED);
        }
    }
}

fn put(image: &mut RgbImage, u: f64, v: f64, colour: [u8; 3]) {
    let (x, y) = (u.round(), v.round());
    if x >= 0.0 && y >= 0.0 && x < f64::from(image.width()) && y < f64::from(image.height()) {
        image.put_pixel(x as u32, y as u32, Rgb(colour));
    }
}

fn stroke(image: &mut RgbImage, a: [f64; 2], b: [f64; 2], colour: [u8; 3]) {
    let n = ((b[0] - a[0]).hypot(b[1] - a[1])).clamp(1.0, 10_000.0).ceil() as u32;
    for i in 0..=n {
        let t = f64::from(i) / f64::from(n);
        put(image, a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, colour);
    }
}

/// Glyphs five pixels wide, a column per byte, the lowest bit on top.
const GLYPHS: &[(char, [u8; 5])] = &[
    ('A', [0x7e, 0x11, 0x11, 0x11, 0x7e]),
    ('B', [0x7f, 0x49, 0x49, 0x49, 0x36]),
    ('C', [0x3e, 0x41, 0x41, 0x41, 0x22]),
    ('D', [0x7f, 0x41, 0x41, 0x22, 0x1c]),
    ('E', [0x7f, 0x49, 0x49, 0x49, 0x41]),
    ('F', [0x7f, 0x09, 0x09, 0x09, 0x01]),
    ('G', [0x3e, 0x41, 0x49, 0x49, 0x7a]),
    ('H', [0x7f, 0x08, 0x08, 0x08, 0x7f]),
    ('I', [0x00, 0x41, 0x7f, 0x41, 0x00]),
    ('J', [0x20, 0x40, 0x41, 0x3f, 0x01]),
    ('K', [0x7f, 0x08, 0x14, 0x22, 0x41]),
    ('L', [0x7f, 0x40, 0x40, 0x40, 0x40]),
    ('M', [0x7f, 0x02, 0x0c, 0x02, 0x7f]),
    ('N', [0x7f, 0x04, 0x08, 0x10, 0x7f]),
    ('O', [0x3e, 0x41, 0x41, 0x41, 0x3e]),
    ('P', [0x7f, 0x09, 0x09, 0x09, 0x06]),
    ('Q', [0x3e, 0x41, 0x51, 0x21, 0x5e]),
    ('R', [0x7f, 0x09, 0x19, 0x29, 0x46]),
    ('S', [0x46, 0x49, 0x49, 0x49, 0x31]),
    ('T', [0x01, 0x01, 0x7f, 0x01, 0x01]),
    ('U', [0x3f, 0x40, 0x40, 0x40, 0x3f]),
    ('V', [0x1f, 0x20, 0x40, 0x20, 0x1f]),
    ('W', [0x3f, 0x40, 0x38, 0x40, 0x3f]),
    ('X', [0x63, 0x14, 0x08, 0x14, 0x63]),
    ('Y', [0x07, 0x08, 0x70, 0x08, 0x07]),
    ('Z', [0x61, 0x51, 0x49, 0x45, 0x43]),
    ('0', [0x3e, 0x51, 0x49, 0x45, 0x3e]),
    ('1', [0x00, 0x42, 0x7f, 0x40, 0x00]),
    ('2', [0x42, 0x61, 0x51, 0x49, 0x46]),
    ('3', [0x21, 0x41, 0x45, 0x4b, 0x31]),
    ('4', [0x18, 0x14, 0x12, 0x7f, 0x10]),
    ('5', [0x27, 0x45, 0x45, 0x45, 0x39]),
    ('6', [0x3c, 0x4a, 0x49, 0x49, 0x30]),
    ('7', [0x01, 0x71, 0x09, 0x05, 0x03]),
    ('8', [0x36, 0x49, 0x49, 0x49, 0x36]),
    ('9', [0x06, 0x49, 0x49, 0x29, 0x1e]),
    ('%', [0x23, 0x13, 0x08, 0x64, 0x62]),
    ('-', [0x08, 0x08, 0x08, 0x08, 0x08]),
    ('_', [0x40, 0x40, 0x40, 0x40, 0x40]),
    (':', [0x00, 0x36, 0x36, 0x00, 0x00]),
];

/// Writes on a dark ground so that it reads on any picture; letters without a glyph are left blank.
fn text(image: &mut RgbImage, at: (u32, f64), scale: u32, colour: [u8; 3], words: &str) {
    let (x0, y0) = (f64::from(at.0), at.1);
    let size = f64::from(scale);
    for (i, letter) in words.to_uppercase().chars().enumerate() {
        let glyph = GLYPHS.iter().find(|g| g.0 == letter).map_or([0; 5], |g| g.1);
        for column in 0..6_u32 {
            for row in 0..8_u32 {
                let ink = column < 5 && glyph[column as usize] >> row & 1 == 1;
                for dy in 0..scale {
                    for dx in 0..scale {
                        let u = x0 + size * (6.0 * i as f64 + f64::from(column)) + f64::from(dx);
                        let v = y0 + size * f64::from(row) + f64::from(dy);
                        put(image, u, v, if ink { colour } else { [20, 20, 20] });
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The label of one thing was written over the thing behind it.
    #[test]
    fn a_label_lies_over_no_other_thing() {
        let at = |others: &[[f64; 4]]| {
            let [u, v] = beside([100.0, 100.0, 160.0, 150.0], 80.0, 10.0, others);
            (u, v)
        };
        assert_eq!(at(&[]), (100.0, 90.0));
        let behind = [110.0, 60.0, 150.0, 95.0];
        assert_eq!(at(&[behind]), (100.0, 152.0));
        assert_eq!(at(&[behind, [90.0, 140.0, 200.0, 180.0]]), (162.0, 120.0));
        // Where nothing is free it stays above.
        assert_eq!(at(&[[0.0, 0.0, 640.0, 480.0]]), (100.0, 90.0));
    }
}
