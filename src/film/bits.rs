//! Bits in a row, as H.264 writes them: fixed lengths, Exp-Golomb codes, and units that hold no start code.

/// Bits being written, the highest of a byte first.
#[derive(Default)]
pub(super) struct Bits {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet, and how many.
    rest: u64,
    n: u32,
}

impl Bits {
    /// Writes the lowest `n` bits of a value, at most 32.
    pub(super) fn put(&mut self, value: u32, n: u32) {
        self.rest = self.rest << n | u64::from(value) & ((1 << n) - 1);
        self.n += n;
        while self.n >= 8 {
            self.n -= 8;
            self.bytes.push((self.rest >> self.n) as u8);
        }
    }

    /// Writes an unsigned Exp-Golomb code (§9.1).
    pub(super) fn ue(&mut self, value: u32) {
        let code = value + 1;
        let length = u32::BITS - code.leading_zeros();
        self.put(0, length - 1);
        self.put(code, length);
    }

    /// Writes a signed Exp-Golomb code (§9.1.1).
    pub(super) fn se(&mut self, value: i32) {
        let code = if value > 0 { 2 * value.unsigned_abs() - 1 } else { 2 * value.unsigned_abs() };
        self.ue(code);
    }

    /// Ends with a one and zeros to a whole byte, and returns a unit of a kind with its header: wherever two zero bytes
    /// would be followed by a byte of at most 3, a 3 is put between (§7.4.1).
    pub(super) fn unit(mut self, header: u8) -> Vec<u8> {
        self.put(1, 1);
        let missing = (8 - self.n % 8) % 8;
        self.put(0, missing);
        let mut unit = vec![header];
        let mut zeros = 0;
        for byte in self.bytes {
            if zeros == 2 && byte <= 3 {
                unit.push(3);
                zeros = 0;
            }
            zeros = if byte == 0 { zeros + 1 } else { 0 };
            unit.push(byte);
        }
        unit
    }
}

#[cfg(test)]
impl Bits {
    /// What was written, bit by bit.
    pub(super) fn plain(&self) -> Vec<bool> {
        let whole =
            self.bytes.iter().flat_map(|byte| (0..8).rev().map(move |k| byte >> k & 1 == 1));
        whole.chain((0..self.n).rev().map(|k| self.rest >> k & 1 == 1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_golomb_codes_are_those_of_the_standard() {
        let mut bits = Bits::default();
        // 1, 010, 00101; -1 is 011: 1010 0010 1011, then the closing one.
        bits.ue(0);
        bits.ue(1);
        bits.ue(4);
        bits.se(-1);
        assert_eq!(bits.unit(0x67), [0x67, 0b1010_0010, 0b1011_1000]);
    }

    #[test]
    fn a_unit_holds_no_start_code() {
        let mut bits = Bits::default();
        for byte in [0, 0, 1, 0, 0, 0] {
            bits.put(byte, 8);
        }
        assert_eq!(bits.unit(1), [1, 0, 0, 3, 1, 0, 0, 3, 0, 0x80]);
    }
}
