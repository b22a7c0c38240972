//! Pictures → coded pictures: parameter sets, slices, macroblocks.
//!
//! Every picture is one slice. Of a whole picture each macroblock is predicted from the rows above or the columns to the
//! left (Intra 16×16); of a difference it is the same place of the picture before (P 16×16 without motion), and left
//! out where nothing is to be said.

use image::RgbImage;

use super::bits::Bits;
use super::cavlc;
use super::codes::Around;
use super::planes::Planes;
use super::transform::{Block, Quantiser, ZIGZAG, forward, hadamard, hadamard2, inverse};

/// QP of everything. Chosen: lettering stays clean, and a minute of a run takes 2 MB.
const QP: usize = 24;
/// QP of the differences of colour that belongs to it (Table 8-15).
const COLOUR_QP: usize = 24;
/// How the levels of a difference of 8 × 8 px may add up, with those beside others counted in full, and it is left out all the same.
const NOTHING: i32 = 4;

/// Code of a coded block pattern of a difference (Table 9-4): the brightness in the lower four bits.
const PATTERNS: [u32; 48] = {
    /// The patterns in the order of their codes.
    const ORDER: [usize; 48] = [
        0, 16, 1, 2, 4, 8, 32, 3, 5, 10, 12, 15, 47, 7, 11, 13, 14, 6, 9, 31, 35, 37, 42, 44, 33,
        34, 36, 40, 39, 43, 45, 46, 17, 18, 20, 24, 19, 21, 26, 28, 23, 27, 29, 30, 22, 25, 38, 41,
    ];
    let mut codes = [0; 48];
    let mut code = 0;
    while code < 48 {
        codes[ORDER[code]] = code as u32;
        code += 1;
    }
    codes
};

/// An encoder of pictures of one size.
pub(super) struct Encoder {
    /// Size of the film, px.
    pub(super) size: (u32, u32),
    /// The picture to be coded.
    input: Planes,
    /// The picture as who plays the film has it; before a picture is coded, the one before.
    shown: Planes,
    /// How many coefficients each block of 4 × 4 of each plane has, row by row.
    counts: [Vec<u8>; 3],
    /// Counts pictures since the last whole one.
    number: u32,
}

/// The levels of a macroblock.
#[derive(Default)]
struct Levels {
    /// Of the brightness, block by block in rows.
    luma: [Block; 16],
    /// Of its zero frequencies, where those are coded apart.
    luma_dc: Block,
    /// Of the differences of colour, block by block in rows.
    colour: [[Block; 4]; 2],
    colour_dc: [[i32; 4]; 2],
}

/// The place of the k-th block that is coded: four by four, in Z order (§6.4.3).
fn place(k: usize) -> (usize, usize) {
    ((k & 1) + 2 * (k >> 2 & 1), (k >> 1 & 1) + 2 * (k >> 3))
}

fn is_empty(levels: &[i32]) -> bool {
    levels.iter().all(|&level| level == 0)
}

impl Encoder {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let black = Planes::black(width.max(1), height.max(1));
        let n = black.width * black.height / 16;
        let counts = [vec![0; n], vec![0; n / 4], vec![0; n / 4]];
        let size = (width.max(1), height.max(1));
        Self { size, input: black.clone(), shown: black, counts, number: 0 }
    }

    /// Returns the sequence's parameters (§7.3.2.1.1): constrained baseline, level 3.1.
    pub(super) fn sequence(&self) -> Vec<u8> {
        let mut bits = Bits::default();
        bits.put(66, 8);
        bits.put(0b1100_0000, 8);
        bits.put(31, 8);
        bits.ue(0);
        // Pictures are counted to 16, and shown in the order they are coded.
        bits.ue(0);
        bits.ue(2);
        bits.ue(1);
        bits.put(0, 1);
        bits.ue((self.input.width / 16 - 1) as u32);
        bits.ue((self.input.height / 16 - 1) as u32);
        bits.put(0b11, 2);
        let (right, below) = (
            (self.input.width as u32 - self.size.0) / 2,
            (self.input.height as u32 - self.size.1) / 2,
        );
        bits.put(1, 1);
        for edge in [0, right, 0, below] {
            bits.ue(edge);
        }
        // Colours as BT.709 has them, in the narrow range (§E.1.1); nothing else is said.
        bits.put(1, 1);
        bits.put(0b00, 2);
        bits.put(1, 1);
        bits.put(5, 3);
        bits.put(0, 1);
        bits.put(1, 1);
        for _ in 0..3 {
            bits.put(1, 8);
        }
        bits.put(0, 6);
        bits.unit(0x67)
    }

    /// Returns the pictures' parameters (§7.3.2.2).
    pub(super) fn parameters() -> Vec<u8> {
        let mut bits = Bits::default();
        bits.ue(0);
        bits.ue(0);
        bits.put(0, 2);
        bits.ue(0);
        bits.ue(0);
        bits.ue(0);
        bits.put(0, 3);
        bits.se(i32::try_from(QP).unwrap_or(26) - 26);
        bits.se(0);
        bits.se(0);
        bits.put(0b100, 3);
        bits.unit(0x68)
    }

    /// Codes a picture, whole or as a difference to the one before.
    pub(super) fn picture(&mut self, picture: &RgbImage, is_whole: bool) -> Vec<u8> {
        self.input.take(picture);
        self.number = if is_whole { 0 } else { self.number + 1 };
        let mut bits = Bits::default();
        bits.ue(0);
        bits.ue(if is_whole { 7 } else { 5 });
        bits.ue(0);
        bits.put(self.number % 16, 4);
        if is_whole {
            bits.ue(0);
            bits.put(0, 2);
        } else {
            bits.put(0, 3);
        }
        bits.se(0);
        // No deblocking: at this QP there are no blocks to be seen.
        bits.ue(1);
        let mut skipped = 0;
        for y in 0..self.input.height / 16 {
            for x in 0..self.input.width / 16 {
                if is_whole {
                    self.whole(&mut bits, (x, y));
                } else if self.difference(&mut bits, (x, y), skipped) {
                    skipped = 0;
                } else {
                    skipped += 1;
                }
            }
        }
        if skipped > 0 {
            bits.ue(skipped);
        }
        bits.unit(if is_whole { 0x65 } else { 0x61 })
    }

    /// Codes a macroblock by itself.
    fn whole(&mut self, bits: &mut Bits, (x, y): (usize, usize)) {
        let (mode, luma) = self.predicted(x, y);
        let colours = [1, 2].map(|plane| self.mean_colour(plane, x, y));
        let quantiser = Quantiser { qp: QP, rounding: 3 };
        let mut levels = Levels::default();
        let mut dc = [0; 16];
        for (k, dc) in dc.iter_mut().enumerate() {
            let (bx, by) = (k % 4, k / 4);
            let guess = |i: usize| luma[(4 * by + i / 4) * 16 + 4 * bx + i % 4];
            let block = forward(&self.residual(0, (16 * x + 4 * bx, 16 * y + 4 * by), guess));
            *dc = block[0];
            levels.luma[k] = quantiser.levels(&block);
            levels.luma[k][0] = 0;
        }
        levels.luma_dc = quantiser.dc_levels(&hadamard(&dc).map(|value| value / 2));
        self.colour_levels(&mut levels, (x, y), 3, &|plane, i| colours[plane - 1][i]);
        let has_luma = levels.luma.iter().any(|block| !is_empty(block));
        let colour = colour_pattern(&levels);
        bits.ue((1 + mode + 4 * colour + if has_luma { 12 } else { 0 }) as u32);
        // The differences of colour are predicted by their mean; QP stays as it is.
        bits.ue(0);
        bits.se(0);
        let zigzag: Vec<i32> = ZIGZAG.iter().map(|&at| levels.luma_dc[at]).collect();
        cavlc::write(bits, &zigzag, self.around(0, 4 * x, 4 * y));
        self.luma(bits, &levels, (x, y), if has_luma { 15 } else { 0 }, true);
        self.colour(bits, &levels, (x, y), colour);
        let dc = quantiser.restored_dc(&levels.luma_dc);
        for (k, dc) in dc.into_iter().enumerate() {
            let (bx, by) = (k % 4, k / 4);
            let mut block = quantiser.restored(&levels.luma[k]);
            block[0] = dc;
            let guess = |i: usize| luma[(4 * by + i / 4) * 16 + 4 * bx + i % 4];
            self.show(0, (16 * x + 4 * bx, 16 * y + 4 * by), &inverse(&block), guess);
        }
        self.show_colour(&levels, (x, y), 3, |plane, i| colours[plane - 1][i]);
    }

    /// Codes a macroblock as a difference, after so many that were left out; `false` when it is left out too.
    fn difference(&mut self, bits: &mut Bits, (x, y): (usize, usize), skipped: u32) -> bool {
        let quantiser = Quantiser { qp: QP, rounding: 6 };
        let mut levels = Levels::default();
        let before = |shown: &Planes, plane: usize, (px, py): (usize, usize), i: usize| {
            i32::from(shown.values[plane][(py + i / 4) * shown.stride(plane) + px + i % 4])
        };
        for k in 0..16 {
            let at = (16 * x + 4 * (k % 4), 16 * y + 4 * (k / 4));
            let block = forward(&self.residual(0, at, |i| before(&self.shown, 0, at, i)));
            levels.luma[k] = quantiser.levels(&block);
        }
        let mut pattern = 0;
        for quarter in 0..4 {
            let (qx, qy) = (2 * (quarter % 2), 2 * (quarter / 2));
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| 4 * (qy + dy) + qx + dx);
            // A few lonely ones are not worth their bits, nor seen.
            let worth: i32 = four.iter().map(|&k| worth(&levels.luma[k])).sum();
            if worth > NOTHING {
                pattern |= 1 << quarter;
            } else {
                for k in four {
                    levels.luma[k] = [0; 16];
                }
            }
        }
        let corner = (8 * x, 8 * y);
        let shown = self.shown.clone_colours(corner);
        self.colour_levels(&mut levels, (x, y), 6, &|plane, i| shown[plane - 1][i]);
        let colour = colour_pattern(&levels);
        pattern |= colour << 4;
        if pattern == 0 {
            self.forget((x, y));
            return false;
        }
        bits.ue(skipped);
        // P 16×16, no motion.
        bits.ue(0);
        bits.se(0);
        bits.se(0);
        bits.ue(PATTERNS[pattern]);
        bits.se(0);
        self.luma(bits, &levels, (x, y), pattern & 15, false);
        self.colour(bits, &levels, (x, y), colour);
        for k in 0..16 {
            if is_empty(&levels.luma[k]) {
                continue;
            }
            let at = (16 * x + 4 * (k % 4), 16 * y + 4 * (k / 4));
            let block = inverse(&quantiser.restored(&levels.luma[k]));
            let guess: Block = std::array::from_fn(|i| before(&self.shown, 0, at, i));
            self.show(0, at, &block, |i| guess[i]);
        }
        if colour > 0 {
            self.show_colour(&levels, (x, y), 6, |plane, i| shown[plane - 1][i]);
        }
        true
    }

    /// The best of three predictions of a macroblock's brightness: its number (Table 7-11), and 16 × 16 values.
    fn predicted(&self, x: usize, y: usize) -> (usize, Vec<i32>) {
        let stride = self.shown.width;
        let plane = &self.shown.values[0];
        let above: Option<Vec<i32>> = (y > 0).then(|| {
            (0..16).map(|i| i32::from(plane[(16 * y - 1) * stride + 16 * x + i])).collect()
        });
        let left: Option<Vec<i32>> = (x > 0).then(|| {
            (0..16).map(|i| i32::from(plane[(16 * y + i) * stride + 16 * x - 1])).collect()
        });
        let sum = |side: &Option<Vec<i32>>| side.as_ref().map(|side| side.iter().sum::<i32>());
        let mean = match (sum(&above), sum(&left)) {
            (Some(a), Some(b)) => (a + b + 16) >> 5,
            (Some(one), None) | (None, Some(one)) => (one + 8) >> 4,
            (None, None) => 128,
        };
        let mut all = vec![(2, vec![mean; 256])];
        if let Some(above) = above {
            all.push((0, (0..256).map(|i| above[i % 16]).collect()));
        }
        if let Some(left) = left {
            all.push((1, (0..256).map(|i| left[i / 16]).collect()));
        }
        let off = |guess: &[i32]| -> i32 {
            let input = &self.input.values[0];
            (0..256)
                .map(|i| {
                    let value = input[(16 * y + i / 16) * stride + 16 * x + i % 16];
                    (i32::from(value) - guess[i]).abs()
                })
                .sum()
        };
        all.into_iter().min_by_key(|(_, guess)| off(guess)).unwrap_or((2, vec![mean; 256]))
    }

    /// The prediction of a difference of colour by means, 8 × 8 values (§8.3.4.1).
    fn mean_colour(&self, plane: usize, x: usize, y: usize) -> Vec<i32> {
        let stride = self.shown.stride(plane);
        let values = &self.shown.values[plane];
        let sum =
            |at: &dyn Fn(usize) -> usize| (0..4).map(|i| i32::from(values[at(i)])).sum::<i32>();
        let mut guess = vec![128; 64];
        for block in 0..4 {
            let (bx, by) = (block % 2, block / 2);
            let above = (y > 0).then(|| sum(&|i| (8 * y - 1) * stride + 8 * x + 4 * bx + i));
            let left = (x > 0).then(|| sum(&|i| (8 * y + 4 * by + i) * stride + 8 * x - 1));
            // Off the diagonal the nearer side counts alone.
            let mean = match (above, left) {
                (Some(above), Some(left)) if bx == by => (above + left + 4) >> 3,
                (Some(above), left) if bx > by || left.is_none() => (above + 2) >> 2,
                (_, Some(left)) => (left + 2) >> 2,
                _ => 128,
            };
            for i in 0..16 {
                guess[(4 * by + i / 4) * 8 + 4 * bx + i % 4] = mean;
            }
        }
        guess
    }

    fn residual(
        &self,
        plane: usize,
        (px, py): (usize, usize),
        guess: impl Fn(usize) -> i32,
    ) -> Block {
        let (stride, values) = (self.input.stride(plane), &self.input.values[plane]);
        std::array::from_fn(|i| i32::from(values[(py + i / 4) * stride + px + i % 4]) - guess(i))
    }

    fn show(
        &mut self,
        plane: usize,
        (px, py): (usize, usize),
        difference: &Block,
        guess: impl Fn(usize) -> i32,
    ) {
        let stride = self.shown.stride(plane);
        for (i, difference) in difference.iter().enumerate() {
            let value = (guess(i) + difference).clamp(0, 255) as u8;
            self.shown.values[plane][(py + i / 4) * stride + px + i % 4] = value;
        }
    }

    /// Quantises the differences of colour against a prediction of 8 × 8 values for each plane.
    fn colour_levels(
        &self,
        levels: &mut Levels,
        (x, y): (usize, usize),
        rounding: i64,
        guess: &dyn Fn(usize, usize) -> i32,
    ) {
        let quantiser = Quantiser { qp: COLOUR_QP, rounding };
        for plane in 1..3 {
            let mut dc = [0; 4];
            for (k, dc) in dc.iter_mut().enumerate() {
                let (bx, by) = (4 * (k % 2), 4 * (k / 2));
                let guess = |i: usize| guess(plane, (by + i / 4) * 8 + bx + i % 4);
                let block = forward(&self.residual(plane, (8 * x + bx, 8 * y + by), guess));
                *dc = block[0];
                levels.colour[plane - 1][k] = quantiser.levels(&block);
                levels.colour[plane - 1][k][0] = 0;
            }
            levels.colour_dc[plane - 1] = quantiser.dc_levels(&hadamard2(&dc));
        }
    }

    fn show_colour(
        &mut self,
        levels: &Levels,
        (x, y): (usize, usize),
        rounding: i64,
        guess: impl Fn(usize, usize) -> i32,
    ) {
        let quantiser = Quantiser { qp: COLOUR_QP, rounding };
        for plane in 1..3 {
            let dc = quantiser.restored_colour_dc(&levels.colour_dc[plane - 1]);
            for (k, dc) in dc.into_iter().enumerate() {
                let (bx, by) = (4 * (k % 2), 4 * (k / 2));
                let mut block = quantiser.restored(&levels.colour[plane - 1][k]);
                block[0] = dc;
                let at = (8 * x + bx, 8 * y + by);
                self.show(plane, at, &inverse(&block), |i| {
                    guess(plane, (by + i / 4) * 8 + bx + i % 4)
                });
            }
        }
    }

    /// Writes the blocks of the quarters of the brightness that a pattern names; `is_apart` leaves the zero frequencies
    /// out.
    fn luma(
        &mut self,
        bits: &mut Bits,
        levels: &Levels,
        (x, y): (usize, usize),
        pattern: usize,
        is_apart: bool,
    ) {
        for k in 0..16 {
            let (bx, by) = place(k);
            let (column, row) = (4 * x + bx, 4 * y + by);
            let mut n = 0;
            if pattern >> (k / 4) & 1 == 1 {
                let block = &levels.luma[4 * by + bx];
                let zigzag: Vec<i32> =
                    ZIGZAG[usize::from(is_apart)..].iter().map(|&at| block[at]).collect();
                n = cavlc::write(bits, &zigzag, self.around(0, column, row));
            }
            self.count(0, column, row, n);
        }
    }

    /// Writes the differences of colour: nothing, the zero frequencies, or all.
    fn colour(&mut self, bits: &mut Bits, levels: &Levels, (x, y): (usize, usize), pattern: usize) {
        if pattern > 0 {
            for dc in &levels.colour_dc {
                cavlc::write(bits, dc, Around::Colour);
            }
        }
        for plane in 1..3 {
            for k in 0..4 {
                let (column, row) = (2 * x + k % 2, 2 * y + k / 2);
                let mut n = 0;
                if pattern == 2 {
                    let block = &levels.colour[plane - 1][k];
                    let zigzag: Vec<i32> = ZIGZAG[1..].iter().map(|&at| block[at]).collect();
                    n = cavlc::write(bits, &zigzag, self.around(plane, column, row));
                }
                self.count(plane, column, row, n);
            }
        }
    }

    /// How many coefficients the blocks to the left and above have, on the mean (§9.2.1).
    fn around(&self, plane: usize, column: usize, row: usize) -> Around {
        let stride = self.input.stride(plane) / 4;
        let at = |column: usize, row: usize| usize::from(self.counts[plane][row * stride + column]);
        Around::Coefficients(match (column, row) {
            (0, 0) => 0,
            (0, _) => at(0, row - 1),
            (_, 0) => at(column - 1, 0),
            _ => (at(column - 1, row) + at(column, row - 1)).div_ceil(2),
        })
    }

    fn count(&mut self, plane: usize, column: usize, row: usize, n: usize) {
        let stride = self.input.stride(plane) / 4;
        self.counts[plane][row * stride + column] = n as u8;
    }

    /// A macroblock that is left out has no coefficients.
    fn forget(&mut self, (x, y): (usize, usize)) {
        self.luma(&mut Bits::default(), &Levels::default(), (x, y), 0, false);
        self.colour(&mut Bits::default(), &Levels::default(), (x, y), 0);
    }
}

impl Planes {
    /// Returns the 8 × 8 values of both differences of colour at a corner.
    fn clone_colours(&self, (px, py): (usize, usize)) -> [Vec<i32>; 2] {
        let stride = self.stride(1);
        [1, 2].map(|plane| {
            let value = |i: usize| self.values[plane][(py + i / 8) * stride + px + i % 8];
            (0..64).map(|i| i32::from(value(i))).collect()
        })
    }
}

/// Which of the differences of colour are worth writing: 0 none, 1 zero frequencies, 2 all.
fn colour_pattern(levels: &Levels) -> usize {
    if levels.colour.as_flattened().iter().any(|block| !is_empty(block)) {
        2
    } else {
        usize::from(!levels.colour_dc.iter().all(|dc| is_empty(dc)))
    }
}

/// What a block of levels is worth: a lonely one of high frequency little, anything larger much.
fn worth(block: &Block) -> i32 {
    ZIGZAG
        .iter()
        .enumerate()
        .map(|(k, &at)| match block[at].abs() {
            0 => 0,
            1 if k > 5 => 1,
            1 => 3,
            _ => 9,
        })
        .sum()
}
