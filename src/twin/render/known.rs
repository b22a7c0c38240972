//! The light of surfaces that are seen more than once in a pixel: it changes slowly along a surface, so not every look asks for it.

/// So many surfaces of a pixel are told apart.
const MOST: usize = 6;

/// Light differs so much, all colours together, where more looks are worth while. Chosen: the mean of four is then off by a few steps
/// of a byte.
const UNEVEN: f32 = 0.15;

/// What is known of the surfaces in a pixel.
#[derive(Default)]
pub(super) struct Known {
    surfaces: [Surface; MOST],
    n: usize,
}

#[derive(Default, Clone, Copy)]
struct Surface {
    number: u64,
    /// The sum of its light where it was lit, and how often it was.
    sum: [f32; 3],
    n: f32,
    /// The least and the greatest of it, of all colours together.
    low: f32,
    high: f32,
}

impl Known {
    /// Returns the mean light of a surface, if it was lit anywhere.
    #[inline]
    pub(super) fn light(&self, number: u64) -> Option<[f32; 3]> {
        let of = |surface: &Surface| surface.sum.map(|sum| sum / surface.n);
        self.surfaces[..self.n].iter().find(|surface| surface.number == number).map(of)
    }

    /// Returns whether a surface was lit so differently that its mean is not yet to be relied on.
    #[inline]
    pub(super) fn is_uneven(&self, number: u64) -> bool {
        let known = self.surfaces[..self.n].iter().find(|surface| surface.number == number);
        known.is_some_and(|surface| surface.high - surface.low > UNEVEN)
    }

    /// Adds light of a surface.
    #[inline]
    pub(super) fn add(&mut self, number: u64, light: [f32; 3]) {
        let at = self.surfaces[..self.n].iter().position(|surface| surface.number == number);
        let at = at.unwrap_or_else(|| {
            let last = self.n.min(MOST - 1);
            self.surfaces[last] = Surface { number, ..Surface::default() };
            self.n = last + 1;
            last
        });
        let Surface { sum, n, low, high, .. } = &mut self.surfaces[at];
        *sum = [sum[0] + light[0], sum[1] + light[1], sum[2] + light[2]];
        let grey = light[0] + light[1] + light[2];
        (*low, *high) = if *n > 0.0 { (low.min(grey), high.max(grey)) } else { (grey, grey) };
        *n += 1.0;
    }

    /// As [`Self::light`] for those of four rays with a bit in `which`; `None` if any of them is not known. Keys are not kept.
    #[inline]
    pub(super) fn four(
        &self,
        number: impl Fn(usize) -> u64,
        which: u32,
    ) -> Option<([[f32; 3]; 4], [u64; 4])> {
        let mut lights = [[0.0; 3]; 4];
        for (k, light) in lights.iter_mut().enumerate() {
            if which >> k & 1 == 1 {
                *light = self.light(number(k))?;
            }
        }
        Some((lights, [0; 4]))
    }

    /// As [`Self::add`] for those of four rays with a bit in `which`.
    #[inline]
    pub(super) fn add_four(
        &mut self,
        number: impl Fn(usize) -> u64,
        which: u32,
        lights: &[[f32; 3]; 4],
    ) {
        for (k, light) in lights.iter().enumerate() {
            if which >> k & 1 == 1 {
                self.add(number(k), *light);
            }
        }
    }
}

/// Returns the number of a surface of something opaque.
#[inline]
pub(super) fn surface_of(thing: u32, face: u8, is_wet: bool, is_marked: bool) -> u64 {
    let extra = u64::from(face) << 2 | u64::from(is_wet) << 1 | u64::from(is_marked);
    2 << 32 | u64::from(thing) << 10 | extra
}

/// Returns the number of what is seen through something clear.
#[inline]
pub(super) fn surface_through(thing: u32) -> u64 {
    1 << 32 | u64::from(thing)
}
