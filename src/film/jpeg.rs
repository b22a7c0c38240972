//! A picture → a JPEG file: baseline, colour at half the width and height, codes made for this picture.
//!
//! A run keeps a hundred and fifty pictures, which the `image` crate codes with the standard's example codes and colour in
//! full: two thirds more bytes, in more than twice the time. Reading is left to that crate.
//!
//! Sources: ITU-T T.81 (1992), tables K.1 and K.2, §K.2 for the codes, §F.1 for what is coded; JFIF 1.02; Arai, Agui and
//! Nakajima, "A fast DCT-SQ scheme for images", Trans. IEICE 1988, for the transform.

use image::RgbImage;
use wide::f32x8;

use super::huffman::{Code, Counts};

/// Edge of a block, and of the square of four blocks that share their colour, px.
const BLOCK: usize = 8;
const SQUARE: usize = 16;

/// Table K.1, steps of brightness, row by row.
const STEPS_OF_LIGHT: [u16; 64] = [
    16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56,
    14, 17, 22, 29, 51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113,
    92, 49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
];

/// Table K.2, steps of colour, row by row.
const STEPS_OF_COLOUR: [u16; 64] = [
    17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99, 24, 26, 56, 99, 99, 99, 99, 99,
    47, 66, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
    99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
];

/// Figure A.6: where in a block, row by row, the k-th coefficient in zigzag order stands.
const ZIGZAG: [u8; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20,
    13, 6, 7, 14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59,
    52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// By how much the transform's k-th row or column is too large: √2 cos(k π/16), and 1 for the first.
const SCALES: [f32; 8] =
    [1.0, 1.387_039_8, 1.306_563, 1.175_875_6, 1.0, 0.785_694_96, 0.541_196_1, 0.275_899_38];

/// A block's coefficients in steps, in zigzag order; the first as a difference to the block before.
type Coefficients = [i16; 64];

/// Returns a picture as a JPEG file of a `quality` of 1 to 100, as the IJG's library counts it; nothing for a picture
/// without pixels, or one too large for such a file.
pub fn jpeg(image: &RgbImage, quality: u8) -> Vec<u8> {
    let (Ok(width), Ok(height)) = (u16::try_from(image.width()), u16::try_from(image.height()))
    else {
        return Vec::new();
    };
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let steps = [STEPS_OF_LIGHT, STEPS_OF_COLOUR].map(|table| scaled(&table, quality));
    let blocks = blocks(image, &steps);
    let mut counts = [Counts::default(), Counts::default(), Counts::default(), Counts::default()];
    for (k, block) in blocks.iter().enumerate() {
        let table = table_of(k);
        symbols(block, |is_first, symbol, _, _| counts[table + usize::from(!is_first)].add(symbol));
    }
    let codes = counts.map(Counts::into_code);
    let mut file = Vec::with_capacity(blocks.len() * 8);
    head(&mut file, (width, height), &steps, &codes);
    let mut bits = Bits { file, word: 0, n: 0 };
    for (k, block) in blocks.iter().enumerate() {
        let table = table_of(k);
        symbols(block, |is_first, symbol, value, length| {
            let (code, of) = codes[table + usize::from(!is_first)].word(symbol);
            bits.put(u64::from(code) << length | u64::from(value), of + length);
        });
    }
    bits.finish()
}

/// Of the blocks of a square the first four are brightness. Returns which pair of codes a block has.
fn table_of(block: usize) -> usize {
    if block % 6 < 4 { 0 } else { 2 }
}

/// Returns a table of steps for a quality, as the IJG's library does.
fn scaled(table: &[u16; 64], quality: u8) -> [u16; 64] {
    let quality = u32::from(quality.clamp(1, 100));
    let percent = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
    table.map(|step| ((u32::from(step) * percent + 50) / 100).clamp(1, 255) as u16)
}

/// Returns the blocks in the order in which they are coded: of each square four of brightness, one of blue, one of red.
fn blocks(image: &RgbImage, steps: &[[u16; 64]; 2]) -> Vec<Coefficients> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let [light, colour] = [factors(&steps[0]), factors(&steps[1])];
    let (columns, rows) = (width.div_ceil(SQUARE), height.div_ceil(SQUARE));
    let mut blocks = Vec::with_capacity(columns * rows * 6);
    let mut last = [0_i16; 3];
    let mut square = Box::new(Square::default());
    for row in 0..rows {
        for column in 0..columns {
            square.read(image, column * SQUARE, row * SQUARE);
            for k in 0..6 {
                let (mut block, factors, plane) = match k {
                    0..4 => (square.light(k), &light, 0),
                    4 => (half(&square.blue), &colour, 1),
                    _ => (half(&square.red), &colour, 2),
                };
                let mut coefficients = in_steps(&mut block, factors);
                let first = coefficients[0];
                coefficients[0] -= last[plane];
                last[plane] = first;
                blocks.push(coefficients);
            }
        }
    }
    blocks
}

/// Sixteen by sixteen pixels as brightness and two differences of colour, about 0.
struct Square {
    light: [[f32; SQUARE]; SQUARE],
    blue: [[f32; SQUARE]; SQUARE],
    red: [[f32; SQUARE]; SQUARE],
}

impl Default for Square {
    fn default() -> Self {
        let nothing = [[0.0; SQUARE]; SQUARE];
        Self { light: nothing, blue: nothing, red: nothing }
    }
}

impl Square {
    /// Reads the square from `(u, v)`; beyond the picture its last pixels are repeated.
    fn read(&mut self, image: &RgbImage, u: usize, v: usize) {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let bytes: &[u8] = image.as_raw();
        for y in 0..SQUARE {
            let row = &bytes[(v + y).min(height - 1) * width * 3..][..width * 3];
            let (light, blue, red) = (&mut self.light[y], &mut self.blue[y], &mut self.red[y]);
            for x in 0..SQUARE {
                let at = (u + x).min(width - 1) * 3;
                let (r, g, b) =
                    (f32::from(row[at]), f32::from(row[at + 1]), f32::from(row[at + 2]));
                // JFIF's matrix.
                light[x] = 0.299 * r + 0.587 * g + 0.114 * b - 128.0;
                blue[x] = -0.168_736 * r - 0.331_264 * g + 0.5 * b;
                red[x] = 0.5 * r - 0.418_688 * g - 0.081_312 * b;
            }
        }
    }

    /// Returns the k-th block of brightness.
    fn light(&self, k: usize) -> [f32x8; BLOCK] {
        let (x, y) = (k % 2 * BLOCK, k / 2 * BLOCK);
        let mut block = [f32x8::splat(0.0); BLOCK];
        for (row, light) in block.iter_mut().zip(&self.light[y..]) {
            let mut eight = [0.0; BLOCK];
            eight.copy_from_slice(&light[x..x + BLOCK]);
            *row = f32x8::from(eight);
        }
        block
    }
}

/// Returns a plane at half its width and height.
fn half(plane: &[[f32; SQUARE]; SQUARE]) -> [f32x8; BLOCK] {
    let mut block = [f32x8::splat(0.0); BLOCK];
    for (y, row) in block.iter_mut().enumerate() {
        let (above, below) = (&plane[2 * y], &plane[2 * y + 1]);
        let mut eight = [0.0; BLOCK];
        for x in 0..BLOCK {
            let sum = above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1];
            eight[x] = 0.25 * sum;
        }
        *row = f32x8::from(eight);
    }
    block
}

/// Returns what the transform's coefficients are multiplied by to be in steps: by column, then by row, as it leaves them.
fn factors(steps: &[u16; 64]) -> [f32x8; BLOCK] {
    let mut factors = [f32x8::splat(0.0); BLOCK];
    for (u, column) in factors.iter_mut().enumerate() {
        let mut eight = [0.0; BLOCK];
        for (v, factor) in eight.iter_mut().enumerate() {
            *factor = 1.0 / (f32::from(steps[v * BLOCK + u]) * SCALES[u] * SCALES[v] * 8.0);
        }
        *column = f32x8::from(eight);
    }
    factors
}

/// Transforms a block; returns it in steps.
fn in_steps(block: &mut [f32x8; BLOCK], factors: &[f32x8; BLOCK]) -> Coefficients {
    transform(block);
    *block = f32x8::transpose(*block);
    transform(block);
    let mut columns = [[0_i32; BLOCK]; BLOCK];
    for u in 0..BLOCK {
        columns[u] = (block[u] * factors[u]).round_int().to_array();
    }
    let mut coefficients = [0; 64];
    for (k, coefficient) in coefficients.iter_mut().enumerate() {
        let at = usize::from(ZIGZAG[k]);
        *coefficient = columns[at % BLOCK][at / BLOCK] as i16;
    }
    coefficients
}

/// The cosine transform of eight columns at once, without [`SCALES`].
fn transform(r: &mut [f32x8; BLOCK]) {
    let by = |x: f32x8, factor: f32| x * f32x8::splat(factor);
    let (s0, s1, s2, s3) = (r[0] + r[7], r[1] + r[6], r[2] + r[5], r[3] + r[4]);
    let (d0, d1, d2, d3) = (r[0] - r[7], r[1] - r[6], r[2] - r[5], r[3] - r[4]);

    let (a, b, c, d) = (s0 + s3, s1 + s2, s1 - s2, s0 - s3);
    let z = by(c + d, 0.707_106_77);
    (r[0], r[4], r[2], r[6]) = (a + b, a - b, d + z, d - z);

    let (a, b, c) = (d3 + d2, d2 + d1, d1 + d0);
    let z5 = by(a - c, 0.382_683_43);
    let (z2, z4, z3) = (by(a, 0.541_196_1) + z5, by(c, 1.306_563) + z5, by(b, 0.707_106_77));
    let (plus, minus) = (d0 + z3, d0 - z3);
    (r[5], r[3], r[1], r[7]) = (minus + z2, minus - z2, plus + z4, plus - z4);
}

/// Tells `told` what is coded of a block, in order: whether it is the first coefficient, the symbol, and the bits after it,
/// with how many there are (§F.1.2).
#[inline]
fn symbols(block: &Coefficients, mut told: impl FnMut(bool, u8, u32, u32)) {
    let (value, length) = bits_of(block[0]);
    told(true, length as u8, value, length);
    let mut zeros = 0;
    for &coefficient in &block[1..] {
        if coefficient == 0 {
            zeros += 1;
            continue;
        }
        while zeros > 15 {
            told(false, 0xF0, 0, 0);
            zeros -= 16;
        }
        let (value, length) = bits_of(coefficient);
        told(false, (zeros << 4) as u8 | length as u8, value, length);
        zeros = 0;
    }
    if zeros > 0 {
        told(false, 0, 0, 0);
    }
}

/// Returns a number's bits, of a negative one those of the number below it, and how many there are.
#[inline]
fn bits_of(number: i16) -> (u32, u32) {
    let length = 16 - number.unsigned_abs().leading_zeros();
    let value = i32::from(number) + if number < 0 { -1 } else { 0 };
    (value as u32 & ((1 << length) - 1), length)
}

/// Writes all that comes before the coded blocks.
fn head(
    file: &mut Vec<u8>,
    (width, height): (u16, u16),
    steps: &[[u16; 64]; 2],
    codes: &[Code; 4],
) {
    let mut segment = |marker: u8, body: &[u8]| {
        file.extend_from_slice(&[0xFF, marker]);
        file.extend_from_slice(&(body.len() as u16 + 2).to_be_bytes());
        file.extend_from_slice(body);
    };
    // JFIF 1.02, without a density.
    segment(0xE0, &[b'J', b'F', b'I', b'F', 0, 1, 2, 0, 0, 1, 0, 1, 0, 0]);
    for (k, steps) in steps.iter().enumerate() {
        let mut body = vec![k as u8];
        body.extend(ZIGZAG.map(|at| steps[usize::from(at)] as u8));
        segment(0xDB, &body);
    }
    let mut frame = vec![8];
    frame.extend_from_slice(&height.to_be_bytes());
    frame.extend_from_slice(&width.to_be_bytes());
    // Brightness at twice the colours' width and height.
    frame.extend_from_slice(&[3, 1, 0x22, 0, 2, 0x11, 1, 3, 0x11, 1]);
    segment(0xC0, &frame);
    for (code, class) in codes.iter().zip([0x00, 0x10, 0x01, 0x11]) {
        let mut body = vec![class];
        body.extend(code.table());
        segment(0xC4, &body);
    }
    segment(0xDA, &[3, 1, 0x00, 2, 0x11, 3, 0x11, 0, 63, 0]);
    file.splice(0..0, [0xFF, 0xD8]);
}

/// Bits that become bytes, the first the highest.
struct Bits {
    file: Vec<u8>,
    word: u64,
    n: u32,
}

impl Bits {
    /// Adds the lowest `length` bits of `value`, at most 32.
    #[inline]
    fn put(&mut self, value: u64, length: u32) {
        self.word = self.word << length | value;
        self.n += length;
        while self.n >= 8 {
            self.n -= 8;
            let byte = (self.word >> self.n) as u8;
            self.file.push(byte);
            if byte == 0xFF {
                // So that it is not taken for a marker.
                self.file.push(0);
            }
        }
    }

    fn finish(mut self) -> Vec<u8> {
        // Ones fill the last byte.
        self.put(0x7F, 7);
        self.file.extend_from_slice(&[0xFF, 0xD9]);
        self.file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with sharp edges of brightness, noise, and colours that change slowly.
    fn picture(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let (warm, cold) = ((f64::from(x) * 0.05).sin() * 30.0, f64::from(y) * 0.3);
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            let grey = noise + if (x / 20 + y / 30) % 2 == 0 { 170.0 } else { 70.0 };
            let of = |colour: f64| (grey + colour).clamp(0.0, 255.0) as u8;
            image::Rgb([of(warm), of(-warm - cold), of(cold)])
        })
    }

    fn error(a: &RgbImage, b: &RgbImage) -> f64 {
        let sum: f64 = a
            .as_raw()
            .iter()
            .zip(b.as_raw())
            .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
            .sum();
        (sum / a.as_raw().len() as f64).sqrt()
    }

    #[test]
    fn a_reader_sees_the_picture_that_was_written() {
        for (width, height) in [(160, 96), (161, 97), (1, 1), (7, 33)] {
            let drawn = picture(width, height);
            let read = |quality| image::load_from_memory(&jpeg(&drawn, quality)).unwrap().to_rgb8();
            let (fine, coarse) = (read(95), read(50));
            assert_eq!(fine.dimensions(), drawn.dimensions());
            // Steps of 1 to 10 and of 16 to 120 in the coefficients; a step of s adds s/√12 to the pixels.
            assert!(error(&fine, &drawn) < 4.0, "{width} {height} {}", error(&fine, &drawn));
            assert!(error(&coarse, &drawn) < 9.0, "{width} {height} {}", error(&coarse, &drawn));
        }
    }

    #[test]
    fn grey_pictures_lose_only_what_steps_take() {
        let grey = RgbImage::from_fn(64, 48, |x, y| image::Rgb([(x * 3 + y) as u8; 3]));
        let read = image::load_from_memory(&jpeg(&grey, 100)).unwrap().to_rgb8();
        // A step of 1 in each coefficient, and rounding.
        assert!(error(&read, &grey) < 0.7, "{}", error(&read, &grey));
        assert!(jpeg(&RgbImage::new(0, 4), 80).is_empty());
    }
}
