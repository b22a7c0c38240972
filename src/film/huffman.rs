//! Codes made for what is coded: short for what is frequent, none longer than 16 bits.
//!
//! Source: ITU-T T.81 (1992), §K.2, after Huffman, "A method for the construction of minimum-redundancy codes", 1952.

/// How often each symbol occurs.
pub(super) struct Counts([u32; 256]);

/// The word of each symbol.
pub(super) struct Code {
    /// Word and length, bits; a length of 0 for what does not occur.
    words: [(u32, u32); 256],
    /// How many words have 1, 2, … 16 bits.
    lengths: [u8; 16],
    /// Symbols, shortest words first.
    symbols: Vec<u8>,
}

impl Default for Counts {
    fn default() -> Self {
        Self([0; 256])
    }
}

impl Counts {
    #[inline]
    pub(super) fn add(&mut self, symbol: u8) {
        self.0[usize::from(symbol)] += 1;
    }

    /// Returns the best code.
    pub(super) fn into_code(self) -> Code {
        let lengths = limited(lengths(&self.0));
        let mut symbols: Vec<u8> = (0..=255).filter(|s| self.0[usize::from(*s)] > 0).collect();
        // The more frequent the shorter; among equals the lower symbol.
        symbols.sort_by_key(|s| std::cmp::Reverse(self.0[usize::from(*s)]));
        let mut words = [(0, 0); 256];
        let (mut word, mut at) = (0, 0);
        for (k, &n) in lengths.iter().enumerate() {
            for _ in 0..n {
                words[usize::from(symbols[at])] = (word, k as u32 + 1);
                (word, at) = (word + 1, at + 1);
            }
            word <<= 1;
        }
        Code { words, lengths, symbols }
    }
}

impl Code {
    /// Returns a symbol's word and how many bits it has.
    #[inline]
    pub(super) fn word(&self, symbol: u8) -> (u32, u32) {
        self.words[usize::from(symbol)]
    }

    /// Returns the code as a file tells it.
    pub(super) fn table(&self) -> impl Iterator<Item = u8> {
        self.lengths.iter().chain(&self.symbols).copied()
    }
}

/// Returns how many words have 1, 2, … bits, of any length. A symbol that never occurs takes the longest word, so that none
/// is all ones, which a file may not have.
fn lengths(counts: &[u32; 256]) -> [u32; 64] {
    // Trees: how often something of them occurs, and what is in them.
    let mut trees: Vec<(u32, Vec<usize>)> =
        (0..256).filter(|s| counts[*s] > 0).map(|s| (counts[s], vec![s])).collect();
    trees.push((1, vec![256]));
    let mut depths = [0_usize; 257];
    while trees.len() > 1 {
        // The two rarest last.
        trees.sort_by(|a, b| b.0.cmp(&a.0).then(b.1[0].cmp(&a.1[0])));
        let (Some((n, mut all)), Some((m, more))) = (trees.pop(), trees.pop()) else { break };
        all.extend(more);
        for symbol in &all {
            depths[*symbol] += 1;
        }
        trees.push((n + m, all));
    }
    let mut lengths = [0; 64];
    for depth in depths.iter().filter(|depth| **depth > 0) {
        lengths[(depth - 1).min(63)] += 1;
    }
    lengths
}

/// Returns the same with no word of more than 16 bits, and without the word of what never occurs.
fn limited(mut lengths: [u32; 64]) -> [u8; 16] {
    for k in (16..64).rev() {
        while lengths[k] > 0 {
            // Two of the longest words: one takes the place of the word that both begin with, and the other, with a shorter
            // word, becomes the two that this one begins.
            let Some(shorter) = (0..k - 1).rev().find(|j| lengths[*j] > 0) else { break };
            lengths[k] -= 2;
            lengths[k - 1] += 1;
            lengths[shorter + 1] += 2;
            lengths[shorter] -= 1;
        }
    }
    if let Some(longest) = lengths.iter().rposition(|n| *n > 0) {
        lengths[longest] -= 1;
    }
    let mut short = [0; 16];
    for (short, n) in short.iter_mut().zip(lengths) {
        *short = n as u8;
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_short_for_what_is_frequent_and_none_begins_another() {
        // As steep as counts can be: without a limit the words would have up to 40 bits.
        let mut counts = Counts::default();
        let (mut a, mut b) = (1_u32, 1_u32);
        for symbol in 0..40 {
            counts.0[symbol] = a;
            (a, b) = (b, a + b);
        }
        let code = counts.into_code();
        let words: Vec<(u32, u32)> = (0..40).map(|symbol| code.word(symbol)).collect();
        for (k, &(word, length)) in words.iter().enumerate() {
            assert!((1..=16).contains(&length) && word != (1 << length) - 1, "{k}");
            for (j, &(other, longer)) in words.iter().enumerate() {
                assert!(k == j || longer < length || other >> (longer - length) != word, "{k} {j}");
            }
        }
        assert!(words[39].1 < 3 && words[0].1 == 16);
        assert_eq!(code.table().count(), 56);
    }
}
