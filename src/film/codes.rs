//! The variable-length codes of coefficients, as the tables of H.264 have them (§9.2): words of zeros and ones.

use std::sync::LazyLock;

/// A code: its bits, and how many.
pub(super) type Code = (u32, u32);

/// Table 9-5, for fewer than 2, 2 and 3, and 4 to 7 coefficients around: a line for each number of coefficients from 0,
/// in it a word for each number of trailing ones from 0.
const COEFFICIENTS: [&str; 3] = [
    "\
     1;\
     000101 01;\
     00000111 000100 001;\
     000000111 00000110 0000101 00011;\
     0000000111 000000110 00000101 000011;\
     00000000111 0000000110 000000101 0000100;\
     0000000001111 00000000110 0000000101 00000100;\
     0000000001011 0000000001110 00000000101 000000100;\
     0000000001000 0000000001010 0000000001101 0000000100;\
     00000000001111 00000000001110 0000000001001 00000000100;\
     00000000001011 00000000001010 00000000001101 0000000001100;\
     000000000001111 000000000001110 00000000001001 00000000001100;\
     000000000001011 000000000001010 000000000001101 00000000001000;\
     0000000000001111 000000000000001 000000000001001 000000000001100;\
     0000000000001011 0000000000001110 0000000000001101 000000000001000;\
     0000000000000111 0000000000001010 0000000000001001 0000000000001100;\
     0000000000000100 0000000000000110 0000000000000101 0000000000001000\
     ",
    "\
     11;\
     001011 10;\
     000111 00111 011;\
     0000111 001010 001001 0101;\
     00000111 000110 000101 0100;\
     00000100 0000110 0000101 00110;\
     000000111 00000110 00000101 001000;\
     00000001111 000000110 000000101 000100;\
     00000001011 00000001110 00000001101 0000100;\
     000000001111 00000001010 00000001001 000000100;\
     000000001011 000000001110 000000001101 00000001100;\
     000000001000 000000001010 000000001001 00000001000;\
     0000000001111 0000000001110 0000000001101 000000001100;\
     0000000001011 0000000001010 0000000001001 0000000001100;\
     0000000000111 00000000001011 0000000000110 0000000001000;\
     00000000001001 00000000001000 00000000001010 0000000000001;\
     00000000000111 00000000000110 00000000000101 00000000000100\
     ",
    "\
     1111;\
     001111 1110;\
     001011 01111 1101;\
     001000 01100 01110 1100;\
     0001111 01010 01011 1011;\
     0001011 01000 01001 1010;\
     0001001 001110 001101 1001;\
     0001000 001010 001001 1000;\
     00001111 0001110 0001101 01101;\
     00001011 00001110 0001010 001100;\
     000001111 00001010 00001101 0001100;\
     000001011 000001110 00001001 00001100;\
     000001000 000001010 000001101 00001000;\
     0000001101 000000111 000001001 000001100;\
     0000001001 0000001100 0000001011 0000001010;\
     0000000101 0000001000 0000000111 0000000110;\
     0000000001 0000000100 0000000011 0000000010\
     ",
];
/// As [`COEFFICIENTS`], for the zero frequencies of a difference of colour.
const COLOUR_COEFFICIENTS: &str =
    "01;000111 1;000100 000110 001;000011 0000011 0000010 000101;000010 00000011 00000010 0000000";
/// Tables 9-7 and 9-8: a line for each number of coefficients from 1, in it a word for each number of zeros before the
/// last of them from 0.
const ZEROS: &str = "\
    1 011 010 0011 0010 00011 00010 000011 000010 0000011 0000010 00000011 00000010 000000011 000000010 000000001;\
    111 110 101 100 011 0101 0100 0011 0010 00011 00010 000011 000010 000001 000000;\
    0101 111 110 101 0100 0011 100 011 0010 00011 00010 000001 00001 000000;\
    00011 111 0101 0100 110 101 100 0011 011 0010 00010 00001 00000;\
    0101 0100 0011 111 110 101 100 011 0010 00001 0001 00000;\
    000001 00001 111 110 101 100 011 010 0001 001 000000;\
    000001 00001 101 100 011 11 010 0001 001 000000;\
    000001 0001 00001 011 11 10 010 001 000000;\
    000001 000000 0001 11 10 001 01 00001;\
    00001 00000 001 11 10 01 0001;\
    0000 0001 001 010 1 011;\
    0000 0001 01 1 001;\
    000 001 1 01;\
    00 01 1;\
    0 1\
    ";
/// Table 9-9 a: as [`ZEROS`], for the zero frequencies of a difference of colour.
const COLOUR_ZEROS: &str = "1 01 001 000;1 01 00;1 0";
/// Table 9-10: a line for each number of zeros left from 1, the last for more than 6; in it a word for each number of
/// zeros before a coefficient from 0.
const RUNS: &str = "\
    1 0;\
    1 01 00;\
    11 10 01 00;\
    11 10 01 001 000;\
    11 10 011 010 001 000;\
    11 000 001 011 010 101 100;\
    111 110 101 100 011 010 001 0001 00001 000001 0000001 00000001 000000001 0000000001 00000000001\
    ";

/// The tables, read.
pub(super) struct Codes {
    coefficients: [Vec<Vec<Code>>; 3],
    colour_coefficients: Vec<Vec<Code>>,
    zeros: Vec<Vec<Code>>,
    colour_zeros: Vec<Vec<Code>>,
    runs: Vec<Vec<Code>>,
}

/// The tables.
pub(super) static CODES: LazyLock<Codes> = LazyLock::new(|| Codes {
    coefficients: COEFFICIENTS.map(table),
    colour_coefficients: table(COLOUR_COEFFICIENTS),
    zeros: table(ZEROS),
    colour_zeros: table(COLOUR_ZEROS),
    runs: table(RUNS),
});

/// What is around a block: the number of coefficients there, or that it is of zero frequencies of a difference of
/// colour.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Around {
    /// So many.
    Coefficients(usize),
    /// A table of its own.
    Colour,
}

impl Codes {
    /// The code of a number of coefficients and of trailing ones among them.
    pub(super) fn coefficients(&self, around: Around, total: usize, ones: usize) -> Code {
        match around {
            Around::Colour => self.colour_coefficients[total][ones],
            Around::Coefficients(0..2) => self.coefficients[0][total][ones],
            Around::Coefficients(2..4) => self.coefficients[1][total][ones],
            Around::Coefficients(4..8) => self.coefficients[2][total][ones],
            // Six bits without a table: 3 for none, else number and ones.
            Around::Coefficients(_) if total == 0 => (3, 6),
            Around::Coefficients(_) => ((4 * (total - 1) + ones) as u32, 6),
        }
    }

    /// The code of the zeros before the last of `total` coefficients.
    pub(super) fn zeros(&self, around: Around, total: usize, zeros: usize) -> Code {
        let table = if around == Around::Colour { &self.colour_zeros } else { &self.zeros };
        table[total - 1][zeros]
    }

    /// The code of the zeros before one coefficient of `left`.
    pub(super) fn run(&self, left: usize, run: usize) -> Code {
        self.runs[left.min(7) - 1][run]
    }
}

fn table(text: &str) -> Vec<Vec<Code>> {
    let code = |word: &str| {
        word.bytes().fold((0, 0), |(bits, n), bit| (bits << 1 | u32::from(bit == b'1'), n + 1))
    };
    text.split(';').map(|line| line.split_whitespace().map(code).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No word begins another, and together they leave as little room as the standard's: what is written can be read.
    #[test]
    fn every_table_is_a_code_that_can_be_read() {
        let codes = &*CODES;
        let whole = |table: &[Vec<Code>]| table.concat();
        let mut sets: Vec<Vec<Code>> = codes.coefficients.iter().map(|t| whole(t)).collect();
        sets.push(whole(&codes.colour_coefficients));
        sets.extend(
            [&codes.zeros, &codes.colour_zeros, &codes.runs].into_iter().flatten().cloned(),
        );
        for set in sets {
            for (k, (a, n)) in set.iter().enumerate() {
                for (other, m) in &set[k + 1..] {
                    let common = (*n).min(*m);
                    assert_ne!(a >> (n - common), other >> (m - common), "{set:?}");
                }
            }
            let room: f64 = set.iter().map(|(_, n)| 0.5_f64.powf(f64::from(*n))).sum();
            assert!(room > 0.98 && room <= 1.0, "{room} {set:?}");
        }
    }
}
