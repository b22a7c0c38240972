//! The 4 × 4 transform of H.264, its quantiser, and back; blocks are in rows, differences and coefficients alike.

/// A block of 4 × 4.
pub(super) type Block = [i32; 16];

/// In which order coefficients are written (§8.5.6): places in a block.
pub(super) const ZIGZAG: [usize; 16] = [0, 1, 4, 8, 5, 2, 3, 6, 9, 12, 13, 10, 7, 11, 14, 15];

/// What coefficients are multiplied by when they are quantised, for the remainder of QP by 6, by place: both even, both
/// odd, other.
const MULTIPLIER: [[i32; 3]; 6] = [
    [13107, 5243, 8066],
    [11916, 4660, 7490],
    [10082, 4194, 6554],
    [9362, 3647, 5825],
    [8192, 3355, 5243],
    [7282, 2893, 4559],
];
/// As [`MULTIPLIER`], when they are restored (§8.5.9).
const SCALE: [[i32; 3]; 6] =
    [[10, 16, 13], [11, 18, 14], [13, 20, 16], [14, 23, 18], [16, 25, 20], [18, 29, 23]];

fn class(place: usize) -> usize {
    match (place % 4 % 2, place / 4 % 2) {
        (0, 0) => 0,
        (1, 1) => 1,
        _ => 2,
    }
}

/// How finely a plane is quantised.
#[derive(Clone, Copy)]
pub(super) struct Quantiser {
    /// QP, 0 (finest) to 51.
    pub(super) qp: usize,
    /// One in how many steps is rounded up: 3 for whole pictures, 6 for differences.
    pub(super) rounding: i64,
}

impl Quantiser {
    fn level(&self, value: i32, place: usize, extra: usize) -> i32 {
        let shift = 15 + self.qp / 6 + extra;
        let multiplier = i64::from(MULTIPLIER[self.qp % 6][class(place)]);
        let level = (i64::from(value.abs()) * multiplier + (1 << shift) / self.rounding) >> shift;
        // What a level may be in the constrained baseline profile without a longer escape.
        (level.min(2000) as i32) * value.signum()
    }

    /// Quantises coefficients.
    pub(super) fn levels(&self, block: &Block) -> Block {
        std::array::from_fn(|place| self.level(block[place], place, 0))
    }

    /// Quantises coefficients of zero frequency that were transformed once more.
    pub(super) fn dc_levels<const N: usize>(&self, dc: &[i32; N]) -> [i32; N] {
        dc.map(|value| self.level(value, 0, 1))
    }

    /// Restores coefficients.
    pub(super) fn restored(&self, levels: &Block) -> Block {
        let scale = &SCALE[self.qp % 6];
        std::array::from_fn(|place| (levels[place] * scale[class(place)]) << (self.qp / 6))
    }

    /// Restores the zero frequencies of sixteen blocks from their transformed levels (§8.5.10).
    pub(super) fn restored_dc(&self, levels: &Block) -> Block {
        let scale = 16 * SCALE[self.qp % 6][0];
        hadamard(levels).map(|value| match self.qp / 6 {
            six @ 6.. => (value * scale) << (six - 6),
            six => (value * scale + (1 << (5 - six))) >> (6 - six),
        })
    }

    /// Restores the zero frequencies of four blocks of a difference of colour (§8.5.11).
    pub(super) fn restored_colour_dc(&self, levels: &[i32; 4]) -> [i32; 4] {
        let scale = 16 * SCALE[self.qp % 6][0];
        hadamard2(levels).map(|value| ((value * scale) << (self.qp / 6)) >> 5)
    }
}

/// Returns the coefficients of differences.
pub(super) fn forward(block: &Block) -> Block {
    let row = |[a, b, c, d]: [i32; 4]| {
        let (sum, inner, outer, inside) = (a + d, b + c, a - d, b - c);
        [sum + inner, 2 * outer + inside, sum - inner, outer - 2 * inside]
    };
    columns(&rows(block, row), row)
}

/// Returns the differences of restored coefficients (§8.5.12).
pub(super) fn inverse(block: &Block) -> Block {
    let row = |[a, b, c, d]: [i32; 4]| {
        let (even, odd) = ([a + c, a - c], [(b >> 1) - d, b + (d >> 1)]);
        [even[0] + odd[1], even[1] + odd[0], even[1] - odd[0], even[0] - odd[1]]
    };
    columns(&rows(block, row), row).map(|value| (value + 32) >> 6)
}

/// The transform of sixteen zero frequencies; its own inverse but for a factor.
pub(super) fn hadamard(block: &Block) -> Block {
    let row = |[a, b, c, d]: [i32; 4]| {
        let (sum, inner, outer, inside) = (a + b, c + d, a - b, c - d);
        [sum + inner, sum - inner, outer - inside, outer + inside]
    };
    columns(&rows(block, row), row)
}

/// As [`hadamard`], of four.
pub(super) fn hadamard2(&[a, b, c, d]: &[i32; 4]) -> [i32; 4] {
    [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]
}

fn rows(block: &Block, row: impl Fn([i32; 4]) -> [i32; 4]) -> Block {
    let mut out = [0; 16];
    for y in 0..4 {
        let done = row(std::array::from_fn(|x| block[4 * y + x]));
        out[4 * y..4 * y + 4].copy_from_slice(&done);
    }
    out
}

fn columns(block: &Block, column: impl Fn([i32; 4]) -> [i32; 4]) -> Block {
    let mut out = [0; 16];
    for x in 0..4 {
        let done = column(std::array::from_fn(|y| block[4 * y + x]));
        for y in 0..4 {
            out[4 * y + x] = done[y];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_finely_quantised_comes_back() {
        let block: Block = std::array::from_fn(|k| i32::try_from(k * 37 % 101).unwrap() - 50);
        let fine = Quantiser { qp: 4, rounding: 3 };
        let back = inverse(&fine.restored(&fine.levels(&forward(&block))));
        for (a, b) in block.iter().zip(back) {
            assert!((a - b).abs() <= 1, "{block:?} {back:?}");
        }
    }
}
