//! Colours → brightness and two differences of colour at half the width and height, 4:2:0 in the narrow range of BT.709.

use image::RgbImage;

/// A picture in planes whose sides are whole macroblocks.
#[derive(Clone)]
pub(super) struct Planes {
    /// Width of the brightness, px, a multiple of 16.
    pub(super) width: usize,
    /// Height of it, px, a multiple of 16.
    pub(super) height: usize,
    /// Brightness, and the two differences with half as many rows and columns.
    pub(super) values: [Vec<u8>; 3],
}

impl Planes {
    /// Returns a black picture that has room for `width` × `height` px.
    pub(super) fn black(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        let (width, height) = (width.next_multiple_of(16), height.next_multiple_of(16));
        let n = width * height;
        Self { width, height, values: [vec![16; n], vec![128; n / 4], vec![128; n / 4]] }
    }

    /// Returns the width of a plane.
    pub(super) fn stride(&self, plane: usize) -> usize {
        if plane == 0 { self.width } else { self.width / 2 }
    }

    /// Takes a picture; its last row and column are repeated to the edge.
    pub(super) fn take(&mut self, picture: &RgbImage) {
        let (w, h) = picture.dimensions();
        if w == 0 || h == 0 {
            return;
        }
        let at = |x: usize, y: usize| {
            picture.get_pixel((x as u32).min(w - 1), (y as u32).min(h - 1)).0.map(f32::from)
        };
        let clip = |x: f32| (x + 0.5).clamp(0.0, 255.0) as u8;
        let width = self.width;
        for y in 0..self.height {
            for x in 0..width {
                let [r, g, b] = at(x, y);
                self.values[0][y * width + x] =
                    clip(16.0 + 219.0 / 255.0 * (0.2126 * r + 0.7152 * g + 0.0722 * b));
            }
        }
        for y in 0..self.height / 2 {
            for x in 0..width / 2 {
                let four =
                    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| at(2 * x + dx, 2 * y + dy));
                let [r, g, b] =
                    [0, 1, 2].map(|c| four.iter().map(|pixel| pixel[c]).sum::<f32>() / 4.0);
                let light = 0.2126 * r + 0.7152 * g + 0.0722 * b;
                let place = y * width / 2 + x;
                self.values[1][place] = clip(128.0 + 224.0 / 255.0 * (b - light) / 1.8556);
                self.values[2][place] = clip(128.0 + 224.0 / 255.0 * (r - light) / 1.5748);
            }
        }
    }
}
