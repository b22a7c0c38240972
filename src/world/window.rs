//! A rectangle of pixels of a picture.

use super::Pixel;

/// What of a picture somebody wants to see; inside the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Its first column, px.
    pub u: u32,
    /// Its first row, px.
    pub v: u32,
    /// How wide it is, px.
    pub width: u32,
    /// How high it is, px.
    pub height: u32,
}

impl Window {
    /// Returns the window that goes `half` px to each side of a pixel, as far as it is in a picture of `width` × `height` px;
    /// `None` when nothing of it is, or where it lies is no number.
    pub fn about(pixel: Pixel, half: f64, width: u32, height: u32) -> Option<Self> {
        let stretch = |at: f64, size: u32| {
            let end = |at: f64| at.clamp(0.0, f64::from(size)) as u32;
            let (from, to) = (end((at - half).floor()), end((at + half).ceil() + 1.0));
            (at.is_finite() && from < to).then(|| (from, to - from))
        };
        let ((u, width), (v, height)) = (stretch(pixel.u, width)?, stretch(pixel.v, height)?);
        Some(Self { u, v, width, height })
    }

    /// Returns this window with `by` px more on each side, its edges at multiples of `square` px, as far as it is in `whole`.
    #[must_use]
    pub fn grown(&self, by: u32, square: u32, whole: &Self) -> Self {
        let stretch = |from: u32, size: u32, most: u32| {
            let square = square.max(1);
            let start = from.saturating_sub(by) / square * square;
            let end = (from + size + by).div_ceil(square) * square;
            (start, end.min(most) - start)
        };
        let (u, width) = stretch(self.u, self.width, whole.width);
        let (v, height) = stretch(self.v, self.height, whole.height);
        Self { u, v, width, height }
    }

    /// Returns where in the whole picture a pixel of the window is.
    pub fn in_whole(&self, pixel: Pixel) -> Pixel {
        Pixel::new(pixel.u + f64::from(self.u), pixel.v + f64::from(self.v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_stays_in_the_picture() {
        let window = Window::about(Pixel::new(100.4, 3.0), 10.0, 640, 480).unwrap();
        assert_eq!(window, Window { u: 90, v: 0, width: 22, height: 14 });
        let whole = Window { u: 0, v: 0, width: 640, height: 480 };
        assert_eq!(window.grown(5, 16, &whole), Window { u: 80, v: 0, width: 48, height: 32 });
        assert_eq!(window.in_whole(Pixel::new(1.0, 2.0)), Pixel::new(91.0, 2.0));
        let corner = Window::about(Pixel::new(639.0, 479.0), 4.0, 640, 480).unwrap();
        assert_eq!(corner.grown(5, 16, &whole), Window { u: 624, v: 464, width: 16, height: 16 });
        for (u, v) in [(-30.0, 5.0), (5.0, 600.0), (f64::NAN, 5.0)] {
            assert_eq!(Window::about(Pixel::new(u, v), 10.0, 640, 480), None, "{u} {v}");
        }
    }
}
