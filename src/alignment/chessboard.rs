//! A printed chessboard in a photograph: its inner corners, to a fraction of a pixel and in order.
//!
//! In comes a picture and the size of the board; out come the corners row by row. Places where two dark and two
//! bright sectors meet are found at several sizes of the picture (`saddle.rs`), joined into grids along the edges
//! between them (`grid.rs`), and put to a fraction of a pixel at full size (`subpixel.rs`). Brightness, contrast, turn and
//! the size of the squares are not known beforehand. Of a board that is partly hidden what is seen is found where its place on the
//! board can be told (`part.rs`); otherwise what was seen is said. Finding the camera from the corners is [`super::intrinsics`]'s work.

mod grid;
mod part;
mod saddle;
mod subpixel;

use image::RgbImage;
use nalgebra::Vector2;

use self::grid::Grid;
use self::saddle::Saddles;
pub(super) use self::subpixel::refine;
use super::picture::Plane;
use crate::world::{Pixel, Point, frame};

/// A chessboard by its inner corners, where four squares meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Inner corners along a row.
    pub columns: usize,
    /// Inner corners along a column.
    pub rows: usize,
    /// Side of a square, m.
    pub square: f64,
}

/// Why a text is no board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BadBoard {
    /// Fewer inner corners than a grid has.
    #[error("a board has at least 3 x 2 inner corners")]
    TooSmall,
    /// More inner corners than a photograph shows.
    #[error("a board has at most {MOST} inner corners a side")]
    TooLarge,
    /// A square without a size.
    #[error("a square has a side longer than 0")]
    NoSide,
}

/// Most inner corners a side. Chosen: with squares of 8 px a picture 4000 px wide shows 500, and nobody prints that.
const MOST: usize = 200;

impl Board {
    /// Returns the board, if it is one that can be looked for; `square` in m.
    ///
    /// # Errors
    ///
    /// [`BadBoard`].
    pub fn new(columns: usize, rows: usize, square: f64) -> Result<Self, BadBoard> {
        if columns.min(rows) < 2 || columns.max(rows) < 3 {
            return Err(BadBoard::TooSmall);
        }
        if columns.max(rows) > MOST {
            return Err(BadBoard::TooLarge);
        }
        if !(square > 0.0 && square.is_finite()) {
            return Err(BadBoard::NoSide);
        }
        Ok(Self { columns, rows, square })
    }

    /// Returns the corners on the board's plane z = 0, m, row by row.
    pub fn points(&self) -> Vec<Point<frame::World>> {
        let place = |i: usize| self.square * i as f64;
        (0..self.rows)
            .flat_map(|r| (0..self.columns).map(move |c| Point::new(place(c), place(r), 0.0)))
            .collect()
    }
}

/// Why a board was not found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotFound {
    /// Nothing like a chessboard.
    #[error("no chessboard seen")]
    Nothing,
    /// A whole board, but another one.
    #[error("found {columns}x{rows}, asked for {}x{}", asked.0, asked.1)]
    OtherSize {
        /// Columns of what was seen.
        columns: usize,
        /// Rows of it.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
    },
    /// A board with corners hidden or outside the picture.
    #[error(
        "found {seen} corners of a board with at least {columns}x{rows}, asked for {}x{}: part of it is hidden, \
         blurred or outside the picture",
        asked.0, asked.1
    )]
    Partly {
        /// Corners that were seen.
        seen: usize,
        /// Columns they span.
        columns: usize,
        /// Rows they span.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
    },
    /// A part of a board that may be this or that part of it.
    #[error(
        "found {seen} corners of {columns}x{rows} of the {}x{} asked for, which may lie in {places} places on the board: show \
         two sides of its margin, or a side more",
        asked.0, asked.1
    )]
    Anywhere {
        /// Corners that were seen.
        seen: usize,
        /// Columns they span.
        columns: usize,
        /// Rows they span.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
        /// In how many places they may lie.
        places: usize,
    },
    /// Corners that are not where edges cross.
    #[error("found the board, but {corners} of its corners are too blurred to be placed")]
    Blurred {
        /// How many.
        corners: usize,
    },
}

/// The long side of the picture that is searched first, px. Chosen: a board that fills a third of it has squares of
/// 30 px or so; with half of it small boards are lost at first, with twice as much time is.
const FIRST: usize = 1300;
/// The smallest long side that is searched, px: a board of ten squares of 8 px and as much around it.
const LEAST: usize = 160;
/// Saddles that are kept: so many per corner of the board, and so many beside it. Chosen: the board's are among the
/// strongest of a picture, and print beside it has some hundreds.
const KEPT: (usize, usize) = (8, 600);
/// Radius of the window of a corner, as a part of the distance to the nearest edge that is not its own, and px at
/// least. Chosen on OpenCV's 13 left views: the five-term lens fits the corners to 0.178 px at 0.3 and 0.4; at 0.5 the
/// paper's rim beyond the outer squares pulls corners away.
const WINDOW: (f64, f64) = (0.3, 3.0);

/// Finds a chessboard's inner corners in a picture, row by row, px; whole or not at all.
///
/// The first corner is the one whose square inside the board is dark, where colours tell it; of two that colours do
/// not tell apart, the one nearer to the picture's top left corner. Rows follow clockwise to columns as seen.
///
/// # Errors
///
/// [`NotFound`], with what was seen instead.
pub fn find(image: &RgbImage, board: &Board) -> Result<Vec<Pixel>, NotFound> {
    match looked(image, board)? {
        Seen::Whole(pixels) => Ok(pixels),
        Seen::Part { not_whole, .. } => Err(not_whole),
    }
}

/// Finds the inner corners that are seen of a chessboard, with their numbers, row by row, from 0: all of them, or of a board that is
/// partly hidden those of a part of which the place on the board can be told.
///
/// # Errors
///
/// [`NotFound`], with what was seen instead.
pub fn find_seen(image: &RgbImage, board: &Board) -> Result<Vec<(usize, Pixel)>, NotFound> {
    match looked(image, board)? {
        Seen::Whole(pixels) => Ok(pixels.into_iter().enumerate().collect()),
        Seen::Part { corners, .. } => Ok(corners),
    }
}

/// What was seen of a board.
enum Seen {
    /// All corners, row by row.
    Whole(Vec<Pixel>),
    /// Some, with their numbers; and what to say if all are needed.
    Part { corners: Vec<(usize, Pixel)>, not_whole: NotFound },
}

fn looked(image: &RgbImage, board: &Board) -> Result<Seen, NotFound> {
    let mut levels = vec![Plane::grey(image)];
    while let Some(last) = levels.last()
        && last.width.max(last.height) >= 2 * LEAST
    {
        levels.push(last.halved());
    }
    let long = |level: usize| levels[level].width.max(levels[level].height);
    let first = (0..levels.len()).find(|&level| long(level) <= FIRST).unwrap_or(0);
    // Finer ones find small squares, coarser ones those in blur and noise.
    let order = (0..=first).rev().chain(first + 1..levels.len());
    let mut best: Option<(Grid, usize)> = None;
    for level in order {
        for grid in in_plane(&levels[level], board) {
            if let Some(grid) = ordered(&grid, board) {
                let corners = refined(&levels, level, &grid);
                let lost = corners.iter().filter(|corner| corner.is_none()).count();
                if lost > 0 {
                    return Err(NotFound::Blurred { corners: lost });
                }
                return Ok(Seen::Whole(corners.into_iter().flatten().collect()));
            }
            if best.as_ref().is_none_or(|(other, _)| grid.n_seen() > other.n_seen()) {
                best = Some((grid, level));
            }
        }
    }
    let Some((grid, level)) = best else { return Err(NotFound::Nothing) };
    let not_whole = |places| seen(&grid, board, places);
    // A whole board of another size is not a part of this one.
    if matches!(not_whole(0), NotFound::OtherSize { .. }) && !is_inside(&grid, board) {
        return Err(not_whole(0));
    }
    let placed = part::placed(&levels[level], &grid, board).map_err(not_whole)?;
    let corners = refined(&levels, level, &placed.grid).into_iter().enumerate();
    let corners = corners.filter_map(|(k, at)| Some((placed.number(k, board), at?))).collect();
    Ok(Seen::Part { corners, not_whole: not_whole(1) })
}

/// Whether a grid may be a part of a board.
fn is_inside(grid: &Grid, board: &Board) -> bool {
    let (long, short) = (grid.n_columns.max(grid.n_rows), grid.n_columns.min(grid.n_rows));
    long <= board.columns.max(board.rows) && short <= board.columns.min(board.rows)
}

fn in_plane(plane: &Plane, board: &Board) -> Vec<Grid> {
    let saddles = Saddles::new(plane);
    let most = KEPT.0 * board.columns * board.rows + KEPT.1;
    grid::grids(&saddles, &saddles.all(most))
}

/// What to say of a grid that is not the board asked for, and may lie in so many places on it.
fn seen(grid: &Grid, board: &Board, places: usize) -> NotFound {
    let asked = (board.columns, board.rows);
    // Named the way it was asked: the long side where the asked one has it.
    let (long, short) = (grid.n_columns.max(grid.n_rows), grid.n_columns.min(grid.n_rows));
    let (columns, rows) = if asked.0 >= asked.1 { (long, short) } else { (short, long) };
    let seen = grid.n_seen();
    if places > 1 {
        NotFound::Anywhere { seen, columns, rows, asked, places }
    } else if seen == columns * rows && (columns, rows) != asked {
        NotFound::OtherSize { columns, rows, asked }
    } else {
        NotFound::Partly { seen, columns, rows, asked }
    }
}

/// Returns the grid turned so that its columns and rows are the board's, `None` if it is not that board.
fn ordered(grid: &Grid, board: &Board) -> Option<Grid> {
    if grid.corners.iter().any(Option::is_none) {
        return None;
    }
    let mut turns = vec![grid.clone()];
    for _ in 0..3 {
        turns.extend(turns.last().map(Grid::turned));
    }
    turns.retain(|g| (g.n_columns, g.n_rows) == (board.columns, board.rows));
    let from_top_left = |g: &Grid| g.corners[0].map_or(f64::INFINITY, |p| p.x + p.y);
    turns.into_iter().min_by(|a, b| {
        b.is_dark.cmp(&a.is_dark).then(from_top_left(a).total_cmp(&from_top_left(b)))
    })
}

/// Puts corners that were found at one size of the picture to a fraction of a pixel at full size; `None` for those that were not
/// seen, and those too blurred to be placed.
fn refined(levels: &[Plane], level: usize, grid: &Grid) -> Vec<Option<Pixel>> {
    let mut corners = grid.corners.clone();
    let mut is_lost = vec![false; corners.len()];
    for (step, plane) in levels[..=level].iter().rev().enumerate() {
        if step > 0 {
            // Pixels' centres are whole numbers, so a pixel of half the size begins at -0.5.
            for corner in corners.iter_mut().flatten() {
                *corner = *corner * 2.0 + Vector2::new(0.5, 0.5);
            }
        }
        for i in 0..corners.len() {
            let Some(corner) = corners[i] else { continue };
            let radius = (WINDOW.0 * free(&corners, i, grid)).max(WINDOW.1);
            let at = refine(plane, corner, radius);
            is_lost[i] = at.is_none();
            corners[i] = at.or(Some(corner));
        }
    }
    let kept = corners.into_iter().zip(is_lost);
    kept.map(|(at, lost)| at.filter(|_| !lost).map(|c| Pixel::new(c.x, c.y))).collect()
}

/// The distance from a corner to the nearest edge that does not run through it, px; 0 of one without neighbours.
fn free(corners: &[Option<Vector2<f64>>], i: usize, grid: &Grid) -> f64 {
    let (column, row, w) = (i % grid.n_columns, i / grid.n_columns, grid.n_columns);
    let beside = [(column > 0).then(|| i - 1), (column + 1 < w).then_some(i + 1)];
    let above = [(row > 0).then(|| i - w), (row + 1 < grid.n_rows).then_some(i + w)];
    let seen = |k: Option<usize>| k.and_then(|k| Some(corners[k]? - corners[i]?));
    let mut least = f64::INFINITY;
    for a in beside.into_iter().filter_map(seen) {
        for b in above.into_iter().filter_map(seen) {
            // The heights of the square over its sides.
            least = least.min(a.perp(&b).abs() / a.norm().max(b.norm()).max(f64::MIN_POSITIVE));
        }
    }
    if least.is_finite() { least } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    use rand::rngs::StdRng;
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;
    use crate::world::{Camera, Intrinsics, Pose};

    /// How a board is photographed.
    struct Photo {
        board: Board,
        /// Turns about x, y, z of the camera, rad, and the distance to the board's middle, m.
        turns: [f64; 3],
        distance: f64,
        /// Dark and bright, grey levels.
        ink: [f64; 2],
        blur: f32,
        noise: f64,
    }

    fn board(columns: usize, rows: usize) -> Board {
        Board::new(columns, rows, 0.025).unwrap()
    }

    fn photo(board: Board, turns: [f64; 3]) -> Photo {
        Photo { board, turns, distance: 0.5, ink: [30.0, 220.0], blur: 0.7, noise: 2.0 }
    }

    fn lens() -> Intrinsics {
        let mut k = Intrinsics::centred(600.0, 640, 480);
        (k.k1, k.k2, k.p1, k.p2) = (-0.2, 0.06, 1e-3, -5e-4);
        k
    }

    impl Photo {
        fn camera(&self) -> Camera {
            let [x, y, z] = self.turns;
            let turn = Rotation3::from_euler_angles(x, y, z);
            let side = self.board.square;
            let middle = Vector3::new(
                0.5 * side * (self.board.columns as f64 - 1.0),
                0.5 * side * (self.board.rows as f64 - 1.0),
                0.0,
            );
            let eye = middle - turn.inverse() * Vector3::new(0.0, 0.0, self.distance);
            let world_from_camera = Pose::from_parts(eye, turn.inverse().into());
            Camera { intrinsics: lens(), world_from_camera }
        }

        fn truth(&self) -> Vec<Pixel> {
            let camera = self.camera();
            self.board.points().into_iter().map(|p| camera.project(p).unwrap()).collect()
        }

        /// Squares around the inner corners, a margin as wide, and a grey table.
        fn taken(&self) -> RgbImage {
            let camera = self.camera();
            let (w, h) = (640, 480);
            let shade = |u: f64, v: f64| {
                let Some(p) = camera.on_plane(Pixel::new(u, v), 0.0) else { return 90.0 };
                let (x, y) = (p.coords().x / self.board.square, p.coords().y / self.board.square);
                let (c, r) = (self.board.columns as f64, self.board.rows as f64);
                if x < -2.0 || y < -2.0 || x > c + 1.0 || y > r + 1.0 {
                    90.0
                } else if x < -1.0 || y < -1.0 || x > c || y > r {
                    self.ink[1]
                } else {
                    // The first square inside is dark.
                    self.ink[usize::from((x.floor() + y.floor()).rem_euclid(2.0) > 0.5)]
                }
            };
            let mut plane = Plane::zeros(w, h);
            for v in 0..h {
                for u in 0..w {
                    // Hammersley's points: an edge along an axis is seen to a sixteenth of a pixel.
                    let sum: f64 = (0_u8..16)
                        .map(|i| {
                            let (a, b) =
                                (f64::from(i) - 7.5, f64::from(i.reverse_bits() >> 4) - 7.5);
                            shade(u as f64 + a / 16.0, v as f64 + b / 16.0)
                        })
                        .sum();
                    plane.data[v * w + u] = (sum / 16.0) as f32;
                }
            }
            let plane = plane.blurred(self.blur);
            let mut random = StdRng::seed_from_u64(7);
            RgbImage::from_fn(w as u32, h as u32, |u, v| {
                // Twelve even draws have a variance of 1 and are nearly normal.
                let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
                let value = f64::from(plane.at(i64::from(u), i64::from(v))) + self.noise * noise;
                image::Rgb([value.round().clamp(0.0, 255.0) as u8; 3])
            })
        }

        /// Root mean square and largest distance from the truth, px.
        fn errors(&self) -> (f64, f64) {
            let found = find(&self.taken(), &self.board).unwrap();
            let truth = self.truth();
            assert_eq!(found.len(), truth.len());
            let far: Vec<f64> = found.iter().zip(&truth).map(|(a, b)| a.distance(*b)).collect();
            let rms = (far.iter().map(|d| d * d).sum::<f64>() / far.len() as f64).sqrt();
            (rms, far.iter().copied().fold(0.0, f64::max))
        }
    }

    #[test]
    fn boards_of_any_size_and_turn_are_found_in_order_to_some_hundredths_of_a_pixel() {
        for (columns, rows, turns) in [
            (9, 6, [0.0, 0.0, 0.0]),
            (9, 6, [0.5, 0.2, 0.3]),
            (9, 6, [-0.4, 0.7, -0.6]),
            (6, 9, [0.2, -0.6, 0.1]),
            (7, 4, [0.3, 0.3, 2.0]),
            (8, 5, [0.6, -0.3, -2.8]),
            (4, 3, [0.3, 0.3, 0.8]),
        ] {
            let (rms, most) = photo(board(columns, rows), turns).errors();
            // Measured: 0.03 to 0.056, of which 0.024 to 0.045 without noise, from drawing and the lens's bent edges.
            assert!(rms < 0.07 && most < 0.15, "{columns}x{rows} {turns:?}: {rms} {most}");
        }
    }

    #[test]
    fn dark_bright_blurred_noisy_and_small_boards_are_found() {
        let plain = || photo(board(9, 6), [0.3, 0.4, 0.2]);
        for (name, photo, within) in [
            ("dark", Photo { ink: [5.0, 40.0], ..plain() }, 0.15),
            ("bright", Photo { ink: [190.0, 250.0], ..plain() }, 0.1),
            ("blurred", Photo { blur: 3.0, ..plain() }, 0.1),
            ("noisy", Photo { noise: 12.0, ..plain() }, 0.2),
            ("small", Photo { distance: 1.6, ..plain() }, 0.1),
        ] {
            let (rms, _) = photo.errors();
            assert!(rms < within, "{name}: {rms}");
        }
    }

    #[test]
    fn a_board_of_another_size_is_named() {
        let image = photo(board(8, 6), [0.2, 0.3, 0.1]).taken();
        let error = find(&image, &board(9, 6)).unwrap_err();
        assert_eq!(error, NotFound::OtherSize { columns: 8, rows: 6, asked: (9, 6) });
        assert_eq!(error.to_string(), "found 8x6, asked for 9x6");
    }

    #[test]
    fn a_hidden_corner_is_left_out_and_an_empty_table_is_told() {
        let photo = photo(board(9, 6), [0.2, 0.3, 0.1]);
        let mut image = photo.taken();
        let hidden = photo.truth()[22];
        for v in 0..24 {
            for u in 0..24 {
                let (u, v) = (hidden.u as u32 - 12 + u, hidden.v as u32 - 12 + v);
                image.put_pixel(u, v, image::Rgb([140; 3]));
            }
        }
        match find(&image, &photo.board) {
            Err(NotFound::Partly { seen, .. }) => assert!((50..54).contains(&seen), "{seen}"),
            other => panic!("{other:?}"),
        }
        let seen = find_seen(&image, &photo.board).unwrap();
        assert!(
            (50..54).contains(&seen.len()) && seen.iter().all(|(k, _)| *k != 22),
            "{}",
            seen.len()
        );
        for (k, at) in seen {
            assert!(at.distance(photo.truth()[k]) < 0.5, "{k}: {}", at.distance(photo.truth()[k]));
        }
        let empty = RgbImage::from_pixel(320, 240, image::Rgb([120; 3]));
        assert_eq!(find(&empty, &photo.board), Err(NotFound::Nothing));
        for (w, h) in [(1, 1), (3, 400), (17, 9)] {
            assert!(find(&RgbImage::new(w, h), &photo.board).is_err());
        }
    }

    /// A sheet over one side: the place is told by the other sides' margins and the colours; of a board whose ends look alike, too.
    #[test]
    fn a_part_is_placed_where_only_one_place_will_do() {
        for (columns, rows, turns) in [
            (9, 6, [0.2, 0.3, 0.1]),
            (9, 6, [-0.3, 0.2, 2.9]),
            (6, 9, [0.2, -0.3, 0.1]),
            (8, 6, [0.2, 0.2, 0.0]),
        ] {
            let photo = photo(board(columns, rows), turns);
            let (plain, truth) = (photo.taken(), photo.truth());
            for side in 0..4 {
                let mut image = plain.clone();
                let (low, high) = truth.iter().fold(([f64::MAX; 2], [0.0_f64; 2]), |(a, b), p| {
                    ([a[0].min(p.u), a[1].min(p.v)], [b[0].max(p.u), b[1].max(p.v)])
                });
                let cut = |axis: usize, part: f64| low[axis] + part * (high[axis] - low[axis]);
                for (u, v, pixel) in image.enumerate_pixels_mut() {
                    let is_hidden = match side {
                        0 => f64::from(v) < cut(1, 0.25),
                        1 => f64::from(v) > cut(1, 0.75),
                        2 => f64::from(u) < cut(0, 0.25),
                        _ => f64::from(u) > cut(0, 0.75),
                    };
                    if is_hidden {
                        *pixel = image::Rgb([150, 110, 90]);
                    }
                }
                match find_seen(&image, &photo.board) {
                    Ok(seen) => {
                        assert!(seen.len() >= truth.len() / 2, "{columns}x{rows} {side}");
                        let last = truth.len() - 1;
                        let off = |turned: bool| {
                            let far = seen.iter().map(|(k, at)| {
                                at.distance(truth[if turned { last - k } else { *k }])
                            });
                            far.fold(0.0, f64::max)
                        };
                        // Nobody can tell the ends of 8x6 apart, whole or in part.
                        let far = if (columns + rows) % 2 == 0 {
                            off(false).min(off(true))
                        } else {
                            off(false)
                        };
                        // Placed wrongly it would be off by whole squares, some 40 px; beside what covers the board a
                        // corner is off by 1.3 px.
                        assert!(far < 2.0, "{columns}x{rows} {side}: {far}");
                    }
                    Err(why) => panic!("{columns}x{rows} {side}: {why}"),
                }
            }
            // Only the middle is seen: it may lie in several places.
            let mut image = plain.clone();
            let middle = truth.iter().fold([0.0, 0.0], |a, p| {
                [a[0] + p.u / truth.len() as f64, a[1] + p.v / truth.len() as f64]
            });
            let reach =
                truth.iter().map(|p| (p.u - middle[0]).hypot(p.v - middle[1])).fold(0.0, f64::max);
            for (u, v, pixel) in image.enumerate_pixels_mut() {
                if (f64::from(u) - middle[0]).hypot(f64::from(v) - middle[1]) > 0.8 * reach {
                    *pixel = image::Rgb([150, 110, 90]);
                }
            }
            if let Ok(seen) = find_seen(&image, &photo.board) {
                // Where the corners that are left span the board after all, they must be right.
                for (k, at) in seen {
                    let far = at.distance(truth[k]).min(at.distance(truth[truth.len() - 1 - k]));
                    assert!(far < 1.0, "{columns}x{rows}: {k} {far}");
                }
            }
        }
    }

    #[test]
    fn noise_alone_has_no_board() {
        let mut random = StdRng::seed_from_u64(3);
        let image = RgbImage::from_fn(320, 240, |_, _| image::Rgb([random.random::<u8>(); 3]));
        assert!(find(&image, &board(9, 6)).is_err());
    }
}
