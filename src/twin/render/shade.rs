//! Shadows on the table: how much of the lamp and of the room each place of it sees.
//!
//! They are worked out on a grid, whose cells are asked in rows; between them light is interpolated.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;
use wide::f32x4;

use super::cast::Figure;
use super::options::Options;
use super::scene::Thing;
use super::vectors::Four3;
use super::view::{Light, TABLE, View, WATER};
use crate::motion::widest;

/// How much of the lamp and of the room each place of the table sees.
pub(super) struct Shade {
    low: [f64; 2],
    /// Edge of a cell, m.
    cell: f64,
    columns: usize,
    rows: usize,
    /// The parts of the lamp and of the room, and how much of the lamp a polished table would mirror to
    /// the eye; row by row.
    cells: Vec<[f32; 4]>,
    /// The table's light there but for its grain: red, green, blue, and the part of the lamp's mirror image.
    table: Vec<[f32; 4]>,
    /// How far each cell of that is from what its neighbours on either side let expect: the greatest of its colours.
    bends: Vec<f32>,
}

impl Shade {
    pub(super) fn new(
        view: &View,
        things: &[Thing],
        light: &Light,
        towards: Vector3<f64>,
        options: Options,
        eye: Vector3<f64>,
    ) -> Self {
        let cell = f64::from(options.shadow_cell_mm.max(1)) / 1000.0;
        let [x, y] = view.table.centre;
        let (hx, hy) = (view.table.size.x / 2.0, view.table.size.y / 2.0);
        let columns = (2.0 * hx / cell).ceil() as usize + 2;
        let rows = (2.0 * hy / cell).ceil() as usize + 2;
        let low = [x - hx, y - hy];
        let mut cells = vec![[1.0_f32, 1.0, 0.0, 0.0]; columns * rows];
        if options.shadows && towards.z > 0.1 {
            let casters: Vec<&Thing> =
                things.iter().filter(|thing| thing.id != TABLE && thing.id != WATER).collect();
            let lamp = disc(towards, light.spread, 24);
            let dome: Vec<Vector3<f64>> = [(0.35, 5, 0.0), (0.8, 7, 0.3)]
                .into_iter()
                .flat_map(|(off, n, phase)| ring(Vector3::z(), off, n, phase))
                .collect();
            let shadows = |d: Vector3<f64>| {
                (d, casters.iter().map(|thing| Shadow::new(thing, d)).collect::<Vec<_>>())
            };
            let lamp: Vec<_> = lamp.into_iter().map(shadows).collect();
            let dome: Vec<_> = dome.into_iter().map(shadows).collect();
            cells.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
                widest(
                    #[inline(always)]
                    || {
                        let y = low[1] + (row as f64 - 0.5) * cell;
                        let mut seen = vec![1.0_f32; cells.len()];
                        let mut parts = [seen.clone(), seen.clone()];
                        for (parts, (directions, all)) in
                            parts.iter_mut().zip([(&lamp, 1.0), (&dome, 0.85)])
                        {
                            let part = all / directions.len() as f32;
                            for (d, shadows) in directions {
                                let (mut from, mut to) = (cells.len(), 0);
                                for shadow in shadows.iter().filter(|s| s.reaches(y)) {
                                    let dark = shadow.darken(*d, y, (low[0], cell), &mut seen);
                                    (from, to) = (from.min(dark.start), to.max(dark.end));
                                }
                                let dark = from.min(to)..to;
                                for (left, seen) in
                                    parts[dark.clone()].iter_mut().zip(&mut seen[dark])
                                {
                                    *left -= part * (1.0 - *seen);
                                    *seen = 1.0;
                                }
                            }
                        }
                        for ((cell, lamp), dome) in cells.iter_mut().zip(&parts[0]).zip(&parts[1]) {
                            (cell[0], cell[1]) = (*lamp, *dome);
                        }
                    },
                );
            });
        }
        let mut shade =
            Self { low, cell, columns, rows, cells, table: Vec::new(), bends: Vec::new() };
        shade.uncover(things);
        shade.cells = shade.softened(towards, eye);
        shade
    }

    /// Gives cells under standing things the light of their neighbours, so that the dark below a thing does
    /// not creep out from under its outline.
    fn uncover(&mut self, things: &[Thing]) {
        let mut covered: Vec<usize> = Vec::new();
        for thing in things.iter().filter(|thing| thing.id != TABLE && thing.id != WATER) {
            let row_of = |y: f64| {
                ((y - self.low[1]) / self.cell + 0.5).clamp(0.0, self.rows as f64) as usize
            };
            let column_of = |x: f64| {
                ((x - self.low[0]) / self.cell + 0.5).clamp(0.0, self.columns as f64) as usize
            };
            if thing.centre.z > thing.radius + 0.002 {
                continue;
            }
            let (c, r) = (thing.centre, thing.radius);
            for row in row_of(c.y - r)..row_of(c.y + r) {
                for column in column_of(c.x - r)..column_of(c.x + r) {
                    let at = self.centre(column, row);
                    if thing.holds(at) {
                        covered.push(row * self.columns + column);
                    }
                }
            }
        }
        if covered.is_empty() {
            return;
        }
        let mut known = vec![true; self.cells.len()];
        for &k in &covered {
            known[k] = false;
        }
        // Two rings are as far as interpolation and softening reach.
        for _ in 0..2 {
            let mut found = Vec::new();
            for &k in covered.iter().filter(|&&k| !known[k]) {
                let (row, column) = (k / self.columns, k % self.columns);
                let (mut sum, mut n) = ([0.0; 2], 0.0);
                for j in row.saturating_sub(1)..(row + 2).min(self.rows) {
                    for i in column.saturating_sub(1)..(column + 2).min(self.columns) {
                        let near = j * self.columns + i;
                        if known[near] {
                            sum = [sum[0] + self.cells[near][0], sum[1] + self.cells[near][1]];
                            n += 1.0;
                        }
                    }
                }
                if n > 0.0 {
                    found.push((k, [sum[0] / n, sum[1] / n, 0.0, 0.0]));
                }
            }
            for (k, cell) in found {
                (self.cells[k], known[k]) = (cell, true);
            }
        }
    }

    /// Returns the mean over each cell and its neighbours, which hides that the lamp is a few points, and how much of the lamp a
    /// polished table would mirror from there to the eye.
    fn softened(&self, towards: Vector3<f64>, eye: Vector3<f64>) -> Vec<[f32; 4]> {
        let mut cells = vec![[0.0; 4]; self.cells.len()];
        let columns = self.columns;
        cells.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
            widest(
                #[inline(always)]
                || {
                    let is_inner = row > 0 && row < self.rows - 1;
                    let here = row * columns;
                    if is_inner && columns > 2 {
                        let line = |k: usize| &self.cells[k..k + columns];
                        let lines = [line(here - columns), line(here), line(here + columns)];
                        // Of each column the sum of three, beside each other.
                        let sum = |k: usize| {
                            f32x4::from(lines[0][k])
                                + f32x4::from(lines[1][k])
                                + f32x4::from(lines[2][k])
                        };
                        let (mut before, mut middle) = (sum(0), sum(1));
                        (cells[0], cells[columns - 1]) = (lines[1][0], lines[1][columns - 1]);
                        for (left, cell) in cells[1..columns - 1].iter_mut().enumerate() {
                            let after = sum(left + 2);
                            let mean = (before + middle + after) * f32x4::splat(1.0 / 9.0);
                            *cell = mean.to_array();
                            (before, middle) = (middle, after);
                        }
                    } else {
                        cells.copy_from_slice(&self.cells[here..][..cells.len()]);
                    }
                    let step = f32x4::from([0.0, 1.0, 2.0, 3.0]) * f32x4::splat(self.cell as f32);
                    let towards = Four3::of(towards.cast());
                    for (k, cells) in cells.chunks_mut(4).enumerate() {
                        // From the first of four cells to the eye, and from the others.
                        let to = Four3::of((eye - self.centre(4 * k, row)).cast());
                        let to = Four3 { x: to.x - step, ..to };
                        let halfway = towards + to * (f32x4::splat(1.0) / to.norm());
                        let cos = (halfway.z / halfway.norm()).fast_max(f32x4::splat(0.0));
                        let cos4 = cos * cos * cos * cos;
                        let shines = (cos4 * cos4 * cos4 * f32x4::splat(0.9)).to_array();
                        for (cell, shines) in cells.iter_mut().zip(shines) {
                            cell[2] = shines;
                        }
                    }
                },
            );
        });
        cells
    }

    fn centre(&self, column: usize, row: usize) -> Vector3<f64> {
        let place = |k: usize, low: f64| low + (k as f64 - 0.5) * self.cell;
        Vector3::new(place(column, self.low[0]), place(row, self.low[1]), HEIGHT)
    }

    /// Works out what of the table's light does not depend on the place's grain: `light` makes it of a cell's values.
    pub(super) fn light_table(&mut self, light: impl Fn([f32; 4]) -> f32x4 + Sync) {
        let (columns, rows) = (self.columns, self.rows);
        self.table = vec![[0.0; 4]; self.cells.len()];
        let lines = self.cells.par_chunks(columns);
        self.table.par_chunks_mut(columns).zip(lines).for_each(|(table, cells)| {
            widest(
                #[inline(always)]
                || {
                    for (table, cell) in table.iter_mut().zip(cells) {
                        *table = light(*cell).to_array();
                    }
                },
            );
        });
        self.bends = vec![0.0; self.cells.len()];
        let table = &self.table;
        self.bends.par_chunks_mut(columns).enumerate().for_each(|(row, bends)| {
            widest(
                #[inline(always)]
                || {
                    if row == 0 || row == rows - 1 || columns < 3 {
                        return;
                    }
                    let line = |row: usize| &table[row * columns..][..columns];
                    let lines = [line(row - 1), line(row), line(row + 1)];
                    let inner = &mut bends[1..columns - 1];
                    // Cells three beside each other, row above row.
                    let mut threes =
                        lines[0].windows(3).zip(lines[1].windows(3)).zip(lines[2].windows(3));
                    for bends in inner.chunks_mut(4) {
                        let mut most = [f32x4::splat(0.0); 4];
                        for (most, ((above, line), below)) in most.iter_mut().zip(&mut threes) {
                            let (left, here) = (f32x4::from(line[0]), f32x4::from(line[1]));
                            let over = f32x4::from(above[1]);
                            let twice = here + here;
                            let across = left + f32x4::from(line[2]) - twice;
                            let down = over + f32x4::from(below[1]) - twice;
                            let turned = here - left - over + f32x4::from(above[0]);
                            *most = across.abs().fast_max(down.abs()).fast_max(turned.abs());
                        }
                        let [r, g, b, shine] = f32x4::transpose(most);
                        let most = r.fast_max(g).fast_max(b.fast_max(shine)).to_array();
                        bends.copy_from_slice(&most[..bends.len()]);
                    }
                },
            );
        });
    }

    /// Returns how far the table's light between two places (least and greatest x and y) may be from what is between evenly spaced
    /// places `n` of which lie side by side there.
    pub(super) fn unevenness(&self, low: [f64; 2], high: [f64; 2], n: f32) -> f32 {
        let cells = |k: usize, n: usize| {
            let cell = |at: f64| (at - self.low[k]) / self.cell + 0.5;
            let from = (cell(low[k]).max(0.0) as usize).min(n - 1);
            from..((cell(high[k]).max(0.0) as usize) + 2).min(n)
        };
        let mut most = 0.0_f32;
        let columns = cells(0, self.columns);
        for row in cells(1, self.rows) {
            for bend in &self.bends[row * self.columns..][columns.clone()] {
                most = most.max(*bend);
            }
        }
        let widest = (high[0] - low[0]).max(high[1] - low[1]);
        let apart = (widest / self.cell) as f32 / n;
        // Of a kink midway, and of kinks at every cell.
        most * apart * (0.25 + 0.125 * apart)
    }

    /// Returns what [`Self::light_table`] made, at four places.
    #[inline(always)]
    pub(super) fn four(&self, x: f32x4, y: f32x4) -> [f32x4; 4] {
        let per = f32x4::splat((1.0 / self.cell) as f32);
        let place = |at: f32x4, low: f64, n: usize| {
            let cells = (at - f32x4::splat(low as f32)) * per + f32x4::splat(0.5);
            cells.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(n as f32 - 1.001))
        };
        let (u, v) = (place(x, self.low[0], self.columns), place(y, self.low[1], self.rows));
        let (i, j) = (u.fast_trunc_int(), v.fast_trunc_int());
        let (fu, fv) = (u - f32x4::from_i32x4(i), v - f32x4::from_i32x4(j));
        let (i, j) = (i.to_array(), j.to_array());
        let (fu, fv) = (fu.to_array(), fv.to_array());
        let mut values = [f32x4::splat(0.0); 4];
        for k in 0..4 {
            let at = j[k] as usize * self.columns + i[k] as usize;
            values[k] = self.between(&self.table, at, [fu[k], fv[k]]);
        }
        values
    }

    /// Returns a value between four cells, of which `at` is the lowest.
    #[inline(always)]
    fn between(&self, cells: &[[f32; 4]], at: usize, part: [f32; 2]) -> f32x4 {
        let [fu, fv] = part.map(f32x4::splat);
        let (near, far) = (&cells[at..][..2], &cells[at + self.columns..][..2]);
        let (a, b) = (f32x4::from(near[0]), f32x4::from(near[1]));
        let (c, d) = (f32x4::from(far[0]), f32x4::from(far[1]));
        let (near, far) = (a + (b - a) * fu, c + (d - c) * fu);
        near + (far - near) * fv
    }

    /// Returns a cell's values at a place, between the centres of four cells.
    #[inline]
    pub(super) fn at(&self, x: f64, y: f64) -> [f32; 4] {
        let u = ((x - self.low[0]) / self.cell + 0.5).clamp(0.0, self.columns as f64 - 1.001);
        let v = ((y - self.low[1]) / self.cell + 0.5).clamp(0.0, self.rows as f64 - 1.001);
        let (i, j) = (u as usize, v as usize);
        let part = [u as f32 - i as f32, v as f32 - j as f32];
        self.between(&self.cells, j * self.columns + i, part).to_array()
    }
}

/// Where a thing may shade the table along one direction.
struct Shadow<'t> {
    thing: &'t Thing,
    /// What light of it is left there.
    left: f32,
    figure: Option<Figure>,
    /// Whether all of the figure is dark.
    is_full: bool,
    /// The figure of the ball around the thing: its middle and how far it reaches at most, m.
    foot: [f64; 2],
    reach: f64,
    /// The least and the greatest row that it reaches, m.
    rows: [f64; 2],
}

/// How high above the table light is asked for, m.
const HEIGHT: f64 = 1e-5;

impl<'t> Shadow<'t> {
    fn new(thing: &'t Thing, d: Vector3<f64>) -> Self {
        let (figure, is_full) = thing.figure(d, HEIGHT).unzip();
        let foot = thing.centre - d * (thing.centre.z / d.z);
        let reach = thing.radius / d.z;
        let mut rows = [foot.y - reach, foot.y + reach];
        if let Some(figure) = &figure {
            let [low, high] = figure.rows();
            rows = [rows[0].max(low), rows[1].min(high)];
        }
        Self {
            thing,
            // Glass lets most light through and gathers what it bends; a third is missing beside the bright spots.
            left: if thing.paint.transparent { 0.70 } else { 0.0 },
            figure,
            is_full: is_full.unwrap_or(false),
            foot: [foot.x, foot.y],
            reach,
            rows,
        }
    }

    /// Returns whether it may shade cells of row `y`.
    #[inline(always)]
    fn reaches(&self, y: f64) -> bool {
        y >= self.rows[0] && y <= self.rows[1]
    }

    /// Marks the cells of row `y`, which it [`Self::reaches`] and which begins at `low` with edges of `cell` m, that it shades along `d`, and returns the range they
    /// are in.
    #[inline]
    fn darken(
        &self,
        d: Vector3<f64>,
        y: f64,
        (low, cell): (f64, f64),
        seen: &mut [f32],
    ) -> Range<usize> {
        let off = y - self.foot[1];
        let found = if let Some(figure) = &self.figure {
            figure.on(y)
        } else {
            let half = (self.reach * self.reach - off * off).sqrt();
            Some((self.foot[0] - half, self.foot[0] + half))
        };
        let Some((from, to)) = found else { return seen.len()..0 };
        // Cells count by their middles, and a cast cuts.
        let cells = |x: f64| ((x - low) / cell + 0.5).clamp(-1.0, seen.len() as f64);
        let from = (cells(from) + 1.0).ceil() as usize;
        let dark = from.saturating_sub(1)..(cells(to) + 1.0) as usize;
        let dark = dark.start..dark.end.min(seen.len());
        let hides = |k: &usize| {
            let place = Vector3::new(low + (*k as f64 - 0.5) * cell, y, HEIGHT);
            self.thing.hides(place, d)
        };
        let left = self.left;
        let darken = |seen: &mut f32| *seen = if *seen < left { *seen } else { left };
        if self.thing.is_convex() {
            // What of it is above the table is dark from one cell to another.
            let mut dark = dark;
            if !self.is_full {
                let Some(first) = dark.clone().find(hides) else { return seen.len()..0 };
                let last = dark.rfind(hides).unwrap_or(first);
                dark = first..last + 1;
            }
            seen[dark.clone()].iter_mut().for_each(darken);
            return dark;
        }
        for k in dark.clone() {
            if self.is_full || hides(&k) {
                darken(&mut seen[k]);
            }
        }
        dark
    }
}

/// Returns `n` directions spread evenly over a cone of half angle `spread` (Vogel's spiral).
pub(super) fn disc(towards: Vector3<f64>, spread: f64, n: usize) -> Vec<Vector3<f64>> {
    (0..n)
        .flat_map(|k| {
            let off = spread * ((k as f64 + 0.5) / n as f64).sqrt();
            ring(towards, off, 1, k as f64 * 2.399_963)
        })
        .collect()
}

/// Returns `n` directions at an angle `off` from an axis.
fn ring(axis: Vector3<f64>, off: f64, n: usize, phase: f64) -> Vec<Vector3<f64>> {
    let side = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&side).normalize();
    let v = axis.cross(&u);
    (0..n)
        .map(|k| {
            let turn = phase + std::f64::consts::TAU * k as f64 / n as f64;
            axis * off.cos() + (u * turn.cos() + v * turn.sin()) * off.sin()
        })
        .collect()
}
