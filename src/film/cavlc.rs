//! A block's levels → bits: context-adaptive variable-length coding (§9.2).

use super::bits::Bits;
use super::codes::{Around, CODES};

/// Writes levels, lowest frequency first, and returns how many are not zero.
pub(super) fn write(bits: &mut Bits, levels: &[i32], around: Around) -> usize {
    let mut put = |(code, n): (u32, u32)| bits.put(code, n);
    // Highest frequency first from here on: places and values.
    let places: Vec<usize> = (0..levels.len()).rev().filter(|&k| levels[k] != 0).collect();
    let total = places.len();
    let ones = places.iter().take(3).take_while(|&&k| levels[k].abs() == 1).count();
    put(CODES.coefficients(around, total, ones));
    let Some(&last) = places.first() else { return 0 };
    for &k in &places[..ones] {
        put((u32::from(levels[k] < 0), 1));
    }
    let mut suffix = u32::from(total > 10 && ones < 3);
    for (n, &k) in places[ones..].iter().enumerate() {
        let size = levels[k].unsigned_abs();
        let mut code = 2 * size - 2 + u32::from(levels[k] < 0);
        if n == 0 && ones < 3 {
            // Were it a one it would be among those.
            code -= 2;
        }
        put(prefix(code, suffix));
        let (rest, length) = rest(code, suffix);
        put((rest, length));
        suffix = suffix.max(1);
        if size > 3 << (suffix - 1) && suffix < 6 {
            suffix += 1;
        }
    }
    let mut zeros = last + 1 - total;
    if total < levels.len() {
        put(CODES.zeros(around, total, zeros));
    }
    for pair in places.windows(2) {
        if zeros == 0 {
            break;
        }
        let run = pair[0] - pair[1] - 1;
        put(CODES.run(zeros, run));
        zeros -= run;
    }
    total
}

/// The zeros before the one that begins a level.
fn prefix(code: u32, suffix: u32) -> (u32, u32) {
    let zeros = match suffix {
        0 if code < 14 => code,
        0 if code < 30 => 14,
        0 => 15,
        _ => (code >> suffix).min(15),
    };
    (1, zeros + 1)
}

/// What follows that one.
fn rest(code: u32, suffix: u32) -> (u32, u32) {
    match suffix {
        0 if code < 14 => (0, 0),
        0 if code < 30 => (code - 14, 4),
        0 => (code - 30, 12),
        _ if code >> suffix < 15 => (code & ((1 << suffix) - 1), suffix),
        _ => (code - (15 << suffix), 12),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads bits as they were written.
    struct Reader(Vec<bool>);

    impl Reader {
        fn bit(&mut self) -> bool {
            self.0.remove(0)
        }

        fn number(&mut self, n: u32) -> u32 {
            (0..n).fold(0, |number, _| number << 1 | u32::from(self.bit()))
        }

        /// The choice of which the code comes next.
        fn choose<T>(&mut self, codes: impl Iterator<Item = (T, (u32, u32))>) -> T {
            let starts = |&(code, n): &(u32, u32)| {
                (0..n).all(|k| self.0.get(k as usize) == Some(&(code >> (n - 1 - k) & 1 == 1)))
            };
            let (choice, (_, n)) =
                codes.into_iter().find(|(_, code)| starts(code)).expect("a code");
            self.number(n);
            choice
        }

        /// What a decoder does (§9.2.1 to §9.2.4).
        fn levels(&mut self, n: usize, around: Around) -> Vec<i32> {
            let pairs = (0..=n).flat_map(|total| (0..=total.min(3)).map(move |ones| (total, ones)));
            let codes =
                pairs.map(|(total, ones)| ((total, ones), CODES.coefficients(around, total, ones)));
            let (total, ones) = self.choose(codes);
            let mut values: Vec<i32> = Vec::new();
            let mut suffix = u32::from(total > 10 && ones < 3);
            for k in 0..total {
                if k < ones {
                    values.push(if self.bit() { -1 } else { 1 });
                    continue;
                }
                let mut zeros = 0;
                while !self.bit() {
                    zeros += 1;
                }
                let length = if zeros == 15 {
                    12
                } else if zeros == 14 && suffix == 0 {
                    4
                } else {
                    suffix
                };
                let mut code = (zeros.min(15) << suffix) + self.number(length);
                if zeros == 15 && suffix == 0 {
                    code += 15;
                }
                if k == ones && ones < 3 {
                    code += 2;
                }
                let size = i32::try_from((code + 2) >> 1).unwrap();
                values.push(if code.is_multiple_of(2) { size } else { -size });
                suffix = suffix.max(1);
                if size > 3 << (suffix - 1) && suffix < 6 {
                    suffix += 1;
                }
            }
            let mut levels = vec![0; n];
            if total == 0 {
                return levels;
            }
            let mut zeros = 0;
            if total < n {
                zeros = self.choose(
                    (0..=n - total).map(|zeros| (zeros, CODES.zeros(around, total, zeros))),
                );
            }
            let mut at = total - 1 + zeros;
            for (k, value) in values.iter().enumerate() {
                levels[at] = *value;
                if k + 1 < total {
                    let run = match zeros {
                        0 => 0,
                        left => self.choose((0..=left).map(|run| (run, CODES.run(left, run)))),
                    };
                    zeros -= run;
                    at -= run + 1;
                }
            }
            levels
        }
    }

    #[test]
    fn what_is_written_is_read_by_the_standards_rules() {
        let mut seed = 7_u32;
        let mut next = move |n: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % n
        };
        for round in 0..4000 {
            let (n, around) = match round % 3 {
                0 => (16, Around::Coefficients(next(17) as usize)),
                1 => (15, Around::Coefficients(next(17) as usize)),
                _ => (4, Around::Colour),
            };
            let dense = next(10) + 1;
            let largest = [2, 4, 30, 1900][next(4) as usize];
            let levels: Vec<i32> = (0..n)
                .map(|_| {
                    if next(10) < dense {
                        i32::try_from(next(2 * largest + 1)).unwrap()
                            - i32::try_from(largest).unwrap()
                    } else {
                        0
                    }
                })
                .collect();
            let mut bits = Bits::default();
            let total = write(&mut bits, &levels, around);
            assert_eq!(total, levels.iter().filter(|level| **level != 0).count());
            assert_eq!(Reader(bits.plain()).levels(n, around), levels);
        }
    }
}
