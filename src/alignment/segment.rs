//! Masks: the bare table as a smooth surface of colour, and an object cut out of the picture in a box.
//!
//! [`TableModel`] says where the picture differs from bare table. [`cut`] separates an object from its
//! surroundings by a minimal cut between colours learnt inside and outside; it is the second opinion on a
//! placement and the mask that people see. What is cut badly shows in [`super::contour`] and in the overlap
//! with the placed solid, and is then not used.
//!
//! Source: Rother, Kolmogorov and Blake, "`GrabCut`", SIGGRAPH 2004; Dinitz's maximal flow.

mod chosen;
mod everything;
mod flow;
mod offered;
mod palette;
mod prompt;
mod referee;
mod ring;
mod shade;
mod snap;
mod strokes;

use image::{GrayImage, Luma, imageops};
use imageproc::distance_transform::Norm;
use imageproc::morphology;
use imageproc::region_labelling::{Connectivity, connected_components};
use nalgebra::{SMatrix, SVector, Vector2};

use super::outline::{Projector, inside_convex};
use super::picture::{Picture, median};
use super::plane::Plane;
use crate::world::Table;
use flow::Flow;
use palette::Palette;

pub use everything::everything;
pub(in crate::alignment) use offered::{agreement, inside};
pub use offered::{best, offered};
pub use prompt::{By, LEAST_SIDE, Prompt, Segment, extent, segment};
pub(in crate::alignment) use shade::without_shadow;

type Coefficients = SVector<f64, 6>;

/// The table's colour: per CIELAB channel a quadratic in the picture's coordinates.
#[derive(Debug, Clone)]
pub struct TableModel {
    channels: [Coefficients; 3],
    /// Robust standard deviation of each channel around its surface, CIELAB.
    pub spread: [f64; 3],
    size: (usize, usize),
}

fn basis(x: f64, y: f64) -> Coefficients {
    Coefficients::from([1.0, x, y, x * x, x * y, y * y])
}

impl TableModel {
    /// Fits the surface to the pixels of the table's top by iteratively reweighted least squares.
    ///
    /// Objects, dots and the arm are outliers as long as bare table is the commonest thing to be seen.
    /// `None` when the table covers less than some hundred pixels.
    pub fn fit(picture: &Picture, view: &Projector, table: &Table) -> Option<Self> {
        let polygon = table_polygon(view, table)?;
        Self::fit_where(picture, |p| inside_convex(&polygon, p))
    }

    /// Fits the surface to the part of the picture that may be table; `None` of less than some hundred pixels.
    fn fit_where(picture: &Picture, is_table: impl Fn(Vector2<f64>) -> bool) -> Option<Self> {
        let (w, h) = (picture.small[0].width, picture.small[0].height);
        let mut rows: Vec<(usize, Coefficients)> = Vec::new();
        for y in (0..h).step_by(2) {
            for x in (0..w).step_by(2) {
                let p = Vector2::new(4.0 * x as f64 + 1.5, 4.0 * y as f64 + 1.5);
                if is_table(p) {
                    rows.push((y * w + x, basis(x as f64 / w as f64, y as f64 / h as f64)));
                }
            }
        }
        if rows.len() < 100 {
            return None;
        }
        let colours: Vec<[f64; 3]> = rows
            .iter()
            .map(|(at, _)| [0, 1, 2].map(|c| f64::from(picture.small[c].data[*at])))
            .collect();
        let mut channels = [Coefficients::zeros(); 3];
        let mut spread = [1.0; 3];
        // All channels share the weights: a blue cup is as little table in lightness as in colour.
        let mut weights = vec![1.0; rows.len()];
        let (mut square, mut off) = (vec![0.0; rows.len()], vec![0.0; rows.len()]);
        for round in 0..12 {
            // The lower half is what Cholesky's way looks at.
            let mut normal = SMatrix::<f64, 6, 6>::zeros();
            let mut rhs = [Coefficients::zeros(); 3];
            for (((_, row), colour), weight) in rows.iter().zip(&colours).zip(&weights) {
                let weighted = *weight * row;
                for j in 0..6 {
                    for i in j..6 {
                        normal[(i, j)] += weighted[i] * row[j];
                    }
                }
                for (rhs, value) in rhs.iter_mut().zip(colour) {
                    *rhs += weighted * *value;
                }
            }
            for k in 0..6 {
                normal[(k, k)] += 1e-6;
            }
            let halves = normal.cholesky()?;
            square.fill(0.0);
            for c in 0..3 {
                channels[c] = halves.solve(&rhs[c]);
                for ((off, (_, row)), colour) in off.iter_mut().zip(&rows).zip(&colours) {
                    *off = (colour[c] - row.dot(&channels[c])).abs();
                }
                // The square does not ask for the sign; the median loses the order.
                let mut sorted = off.clone();
                spread[c] = (1.4826 * median(&mut sorted)).max(0.4);
                for (s, r) in square.iter_mut().zip(&off) {
                    *s += (r / spread[c]).powi(2);
                }
            }
            // From mild to firm: first the majority, then only what is close to it.
            let reach: f64 = if round < 4 { 30.0 } else { 12.0 };
            for (weight, s) in weights.iter_mut().zip(&square) {
                *weight = if *s < reach { (1.0 - s / reach).powi(2) } else { 1e-4 };
            }
        }
        Some(Self { channels, spread, size: (w, h) })
    }

    /// Returns the table's colour at a pixel of the small picture, CIELAB.
    pub fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        let row = basis(x / self.size.0 as f64, y / self.size.1 as f64);
        self.channels.map(|c| row.dot(&c))
    }

    /// Returns, per small pixel, how little it looks like table: 0 (bare) to 1.
    ///
    /// Lightness counts a third: a shadow darkens the table and leaves its colour.
    pub fn change(&self, picture: &Picture) -> Plane {
        let (w, h) = self.size;
        let mut change = Plane::zeros(w, h);
        for y in 0..h {
            for x in 0..w {
                let table = self.colour(x as f64, y as f64);
                let mut far = 0.0;
                for (c, colour) in table.iter().enumerate() {
                    let d = f64::from(picture.small[c].data[y * w + x]) - colour;
                    let share = if c == 0 && !picture.is_grey { 0.33 } else { 1.0 };
                    far += share * (d / (self.spread[c] + 0.6)).powi(2);
                }
                // Three spreads are half a change.
                change.data[y * w + x] = (1.0 - (-far / 13.0).exp()) as f32;
            }
        }
        change
    }
}

/// Returns the table's top in the picture, px, if all of it is in front of the camera.
fn table_polygon(view: &Projector, table: &Table) -> Option<Vec<Vector2<f64>>> {
    table.corners().iter().map(|c| view.pixel(nalgebra::Vector3::new(c[0], c[1], 0.0))).collect()
}

/// Picture pixels per cell of the grid that is cut, along each side.
const CELL: usize = 2;
/// Width of the Gaussian that takes the cells' stairs off a mask's border, px.
const STAIRS_PX: f32 = 2.0;
/// Price of a border between two cells of one colour, in units of log-likelihood: a low one follows faint
/// borders, a high one is not led astray by a thing's own pattern.
pub const BORDERS: [f64; 2] = [25.0, 40.0];

/// What a pixel is expected to be before the picture is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expect {
    /// Known to be something else.
    Ground,
    /// Rather something else.
    Outside,
    /// Rather the object.
    Inside,
    /// Known to be the object.
    Object,
}

/// Cuts an object out of the picture: 255 inside, the picture's size; `None` when nothing separates.
///
/// `bounds` is the box it is expected in, `[u0, v0, u1, v1]` px; `expect` says of a pixel what it is
/// expected to be. The box is grown by 15 % and its border taken for background; `border` is the price of
/// [`BORDERS`].
pub fn cut(
    picture: &Picture,
    bounds: [f64; 4],
    expect: impl Fn(Vector2<f64>) -> Expect,
    border: f64,
) -> Option<GrayImage> {
    let (w, h) = picture.size();
    let grow = [0.15 * (bounds[2] - bounds[0]) + 6.0, 0.15 * (bounds[3] - bounds[1]) + 6.0];
    let x0 = (bounds[0] - grow[0]).max(0.0) as usize / CELL;
    let y0 = (bounds[1] - grow[1]).max(0.0) as usize / CELL;
    let x1 = ((bounds[2] + grow[0]).min(w as f64 - 1.0).max(0.0) as usize / CELL).max(x0);
    let y1 = ((bounds[3] + grow[1]).min(h as f64 - 1.0).max(0.0) as usize / CELL).max(y0);
    let (cols, rows) = (x1 - x0 + 1, y1 - y0 + 1);
    if cols < 8 || rows < 8 || cols * rows > 200_000 {
        return None;
    }
    let place = |i: usize| {
        let (x, y) = ((x0 + i % cols) * CELL, (y0 + i / cols) * CELL);
        Vector2::new(x as f64 + 0.5, y as f64 + 0.5)
    };
    let cells: Vec<[f64; 3]> =
        (0..cols * rows).map(|i| picture.lab_at(place(i).x, place(i).y).map(f64::from)).collect();
    let expected: Vec<Expect> = (0..cols * rows)
        .map(|i| {
            let (x, y) = (i % cols, i / cols);
            // Where the box ends at the picture's border the object may go on beyond it.
            let rim = (x < 2 && x0 > 0)
                || (y < 2 && y0 > 0)
                || (x + 2 >= cols && (x1 + 1) * CELL < w)
                || (y + 2 >= rows && (y1 + 1) * CELL < h);
            if rim { Expect::Ground } else { expect(place(i)) }
        })
        .collect();
    let mut object: Vec<bool> =
        expected.iter().map(|e| matches!(e, Expect::Inside | Expect::Object)).collect();
    let pairs: Vec<(usize, usize)> = (0..cols * rows)
        .flat_map(|i| {
            let (x, y) = (i % cols, i / cols);
            [(x + 1 < cols).then_some((i, i + 1)), (y + 1 < rows).then_some((i, i + cols))]
        })
        .flatten()
        .collect();
    let far = |a: usize, b: usize| (0..3).map(|c| (cells[a][c] - cells[b][c]).powi(2)).sum::<f64>();
    let mean = pairs.iter().map(|&(a, b)| far(a, b)).sum::<f64>() / pairs.len() as f64;
    let links: Vec<f64> =
        pairs.iter().map(|&(a, b)| border * (-far(a, b) / (2.0 * mean + 1e-9)).exp()).collect();
    for _ in 0..3 {
        let of = |wanted: bool| -> Vec<[f64; 3]> {
            (0..cells.len()).filter(|&i| object[i] == wanted).map(|i| cells[i]).collect()
        };
        let (own, other) = (Palette::learn(&of(true))?, Palette::learn(&of(false))?);
        let mut flow = Flow::new(cells.len());
        for (i, cell) in cells.iter().enumerate() {
            let (as_object, as_ground) = match expected[i] {
                Expect::Ground => (1e6, 0.0),
                Expect::Object => (0.0, 1e6),
                Expect::Outside | Expect::Inside => (own.cost(cell), other.cost(cell)),
            };
            flow.terminal(i, as_ground - as_object);
        }
        for (&(a, b), capacity) in pairs.iter().zip(&links) {
            flow.link(a, b, *capacity);
        }
        object = flow.source_side();
    }
    let mut mask = GrayImage::new(w as u32, h as u32);
    for (i, _) in object.iter().enumerate().filter(|(_, inside)| **inside) {
        let (x, y) = ((x0 + i % cols) * CELL, (y0 + i / cols) * CELL);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            if x + dx < w && y + dy < h {
                mask.put_pixel((x + dx) as u32, (y + dy) as u32, Luma([255]));
            }
        }
    }
    Some(tidy(&mask, [x0 * CELL, y0 * CELL, (x1 + 1) * CELL, (y1 + 1) * CELL]))
}

/// Closes gaps, fills holes, removes spurs and keeps the largest piece of a mask, inside a box.
fn tidy(mask: &GrayImage, [x0, y0, x1, y1]: [usize; 4]) -> GrayImage {
    let (x1, y1) = (x1.min(mask.width() as usize), y1.min(mask.height() as usize));
    let (w, h) = ((x1 - x0) as u32, (y1 - y0) as u32);
    let part = imageops::crop_imm(mask, x0 as u32, y0 as u32, w, h).to_image();
    let reach = (0.03 * f64::from(w.min(h))).round().clamp(1.0, 12.0) as u8;
    let closed = morphology::close(&part, Norm::L2, reach);
    // Holes: background that the border of the box does not reach.
    let holes = connected_components(
        &GrayImage::from_fn(w, h, |x, y| Luma([255 - closed.get_pixel(x, y).0[0]])),
        Connectivity::Four,
        Luma([0]),
    );
    let mut open = vec![false; w as usize * h as usize + 1];
    for (x, y, label) in holes.enumerate_pixels() {
        if x == 0 || y == 0 || x + 1 == w || y + 1 == h {
            open[label.0[0] as usize] = true;
        }
    }
    let filled = GrayImage::from_fn(w, h, |x, y| {
        let label = holes.get_pixel(x, y).0[0] as usize;
        Luma([if closed.get_pixel(x, y).0[0] > 0 || !open[label] { 255 } else { 0 }])
    });
    let opened = morphology::open(&filled, Norm::L2, reach);
    let labels = connected_components(&opened, Connectivity::Four, Luma([0]));
    let mut sizes = vec![0_usize; w as usize * h as usize + 1];
    for label in labels.pixels() {
        sizes[label.0[0] as usize] += 1;
    }
    sizes[0] = 0;
    let largest = (0..sizes.len()).max_by_key(|&i| sizes[i]).unwrap_or(0);
    let piece = GrayImage::from_fn(w, h, |x, y| {
        let label = labels.get_pixel(x, y).0[0] as usize;
        Luma([if label != 0 && label == largest { 255 } else { 0 }])
    });
    // The cells' stairs are no property of the thing: its border runs where half of the surroundings are in.
    let mut soft = Plane::zeros(w as usize, h as usize);
    for (value, pixel) in soft.data.iter_mut().zip(piece.pixels()) {
        *value = f32::from(pixel.0[0]);
    }
    let soft = soft.blurred(STAIRS_PX);
    let mut out = GrayImage::new(mask.width(), mask.height());
    for (at, value) in soft.data.iter().enumerate() {
        if *value > 127.5 {
            let (x, y) = (at % w as usize, at / w as usize);
            out.put_pixel((x0 + x) as u32, (y0 + y) as u32, Luma([255]));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_is_cut_out_of_a_gradient() {
        let image = image::RgbImage::from_fn(200, 160, |x, y| {
            let far = (f64::from(x) - 100.0).hypot(f64::from(y) - 80.0);
            let light = 150 + (x / 8) as u8;
            image::Rgb(if far < 40.0 { [60, 90, 160] } else { [light, light, light - 10] })
        });
        let picture = Picture::new(&image);
        // Expected eight pixels to the left of where it is.
        let guess = |p: Vector2<f64>| {
            let inside = (p - Vector2::new(92.0, 80.0)).norm() < 40.0;
            if inside { Expect::Inside } else { Expect::Outside }
        };
        let mask = cut(&picture, [52.0, 40.0, 140.0, 120.0], guess, BORDERS[0]).unwrap();
        let (mut both, mut either) = (0.0, 0.0);
        for (x, y, p) in mask.enumerate_pixels() {
            let truth = (f64::from(x) - 100.0).hypot(f64::from(y) - 80.0) < 40.0;
            both += f64::from(u8::from(truth && p.0[0] > 0));
            either += f64::from(u8::from(truth || p.0[0] > 0));
        }
        assert!(both / either > 0.95, "IoU {}", both / either);
    }
}
