//! From saddle points to grids: which is whose neighbour, and which column and row each has.
//!
//! Two saddles are neighbours when each is the nearest along a ray of the other and an edge of one sign joins
//! them. Walking from neighbour to neighbour counts columns and rows. Nothing here knows how large the board
//! is that is looked for.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector2;

use super::saddle::{Saddle, Saddles, turn};

/// How far a neighbour may lie from its ray, rad. Chosen: rays are known to some degrees from a small circle; with
/// half of it neighbours in blur are lost, with twice as much the diagonal of a narrow square is a side.
const ASIDE: f64 = 0.3;
/// What a neighbour that lies aside costs, as a part of its distance per rad: at the limit as much as one that is
/// half again as far.
const ASIDE_COST: f64 = 1.7;
/// Where the edge between two neighbours is looked at, as parts of the way.
const ALONG: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// How far beside the edge, as a part of its length, and px at least and at most: past the blur, inside the squares.
const BESIDE: (f64, f64, f64) = (0.15, 1.5, 6.0);
/// How many of the nearest saddles are looked at: those of three squares around, and some that are none of the board.
const NEAREST: usize = 40;
/// How far a filled-in corner may be from where its neighbours put it, as a part of the side of a square. Chosen: a
/// lens and perspective move it by a twentieth; a quarter is half way to the middle of the square.
const FILLED: f64 = 0.25;
/// A line of the grid at its border of which less than this part is there is no line of the board.
const BARE: f64 = 0.5;
/// Least contrast of a corner as a part of its neighbour's, and least step of the edge between two as a part of the
/// lower contrast of both. Chosen: a shadow on a board takes away three quarters of the light; noise and the blocks of
/// a JPEG have some hundredths of the board's contrast.
const WEAK: f64 = 0.2;

/// Corners by column and row.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    /// Columns.
    pub(super) n_columns: usize,
    /// Rows.
    pub(super) n_rows: usize,
    /// Row by row, `None` where none was seen; columns run clockwise to rows as seen in the picture.
    pub(super) corners: Vec<Option<Vector2<f64>>>,
    /// Whether the square right of and below the first corner, along columns and rows, is dark.
    pub(super) is_dark: bool,
}

impl Grid {
    /// Returns how many corners were seen.
    pub(super) fn n_seen(&self) -> usize {
        self.corners.iter().flatten().count()
    }

    /// Returns the grid turned by a quarter: what was a row is a column.
    pub(super) fn turned(&self) -> Self {
        let (n_columns, n_rows) = (self.n_rows, self.n_columns);
        let mut corners = Vec::with_capacity(self.corners.len());
        for row in 0..n_rows {
            for column in 0..n_columns {
                // The new first corner is the old last of the first column.
                corners.push(self.corners[(n_columns - 1 - column) * n_rows + row]);
            }
        }
        // Colours alternate along the column that was walked.
        let is_dark = self.is_dark != (n_columns % 2 == 1);
        Self { n_columns, n_rows, corners, is_dark }
    }
}

/// A saddle's neighbour along each of its rays: which one, and along which of its rays it lies back.
type Links = Vec<[Option<(usize, usize)>; 4]>;

/// A corner in a grid that grows: which saddle, and which of its rays points along the columns.
#[derive(Debug, Clone, Copy)]
struct Node {
    saddle: Saddle,
    ray: usize,
}

type Nodes = BTreeMap<(i32, i32), Node>;

/// Returns the grids in a plane, largest first, without those of fewer than four corners.
pub(super) fn grids(plane: &Saddles, saddles: &[Saddle]) -> Vec<Grid> {
    let links = links(plane, saddles);
    let mut is_taken = vec![false; saddles.len()];
    let mut found = Vec::new();
    for seed in 0..saddles.len() {
        if is_taken[seed] {
            continue;
        }
        let mut nodes = grow(seed, saddles, &links, &mut is_taken);
        if nodes.len() < 4 {
            continue;
        }
        fill(plane, &mut nodes);
        found.extend(whole(nodes));
    }
    found.sort_by_key(|grid: &Grid| std::cmp::Reverse(grid.n_seen()));
    found
}

/// Finds every saddle's neighbours; only those that choose each other are kept.
fn links(plane: &Saddles, saddles: &[Saddle]) -> Links {
    let chosen: Links = (0..saddles.len())
        .map(|a| {
            let mut near: Vec<(f64, usize)> = (0..saddles.len())
                .filter(|&b| b != a)
                .map(|b| ((saddles[b].at - saddles[a].at).norm(), b))
                .collect();
            if near.len() > NEAREST {
                near.select_nth_unstable_by(NEAREST, |p, q| p.0.total_cmp(&q.0));
                near.truncate(NEAREST);
            }
            [0, 1, 2, 3].map(|ray| neighbour(plane, saddles, a, ray, &near))
        })
        .collect();
    let is_mutual =
        |a: usize, ray: usize, (b, back): (usize, usize)| chosen[b][back] == Some((a, ray));
    (0..saddles.len())
        .map(|a| [0, 1, 2, 3].map(|ray| chosen[a][ray].filter(|&link| is_mutual(a, ray, link))))
        .collect()
}

/// The cheapest saddle along a ray with an edge on the way.
fn neighbour(
    plane: &Saddles,
    saddles: &[Saddle],
    a: usize,
    ray: usize,
    near: &[(f64, usize)],
) -> Option<(usize, usize)> {
    let mut best: Option<(f64, (usize, usize))> = None;
    for &(distance, b) in near {
        let way = saddles[b].at - saddles[a].at;
        let angle = way.y.atan2(way.x);
        let aside = turn(saddles[a].rays[ray], angle).abs();
        let cost = distance * (1.0 + ASIDE_COST * aside);
        if aside > ASIDE || best.is_some_and(|(least, _)| cost >= least) {
            continue;
        }
        // Bright lies right of a ray here and left of the one that comes back, so they differ in parity.
        let backs = (0..4).filter(|k| k % 2 != ray % 2);
        let back = backs.map(|k| (turn(saddles[b].rays[k] + std::f64::consts::PI, angle).abs(), k));
        let Some((off, back)) = back.min_by(|p, q| p.0.total_cmp(&q.0)) else { continue };
        let contrasts = [saddles[a].contrast, saddles[b].contrast];
        let (least, most) = (contrasts[0].min(contrasts[1]), contrasts[0].max(contrasts[1]));
        let bright = if ray.is_multiple_of(2) { WEAK * least } else { -WEAK * least };
        if off <= ASIDE && least > WEAK * most && has_edge(plane, saddles[a].at, way, bright) {
            best = Some((cost, (b, back)));
        }
    }
    best.map(|(_, link)| link)
}

/// Whether the right side of the way is brighter than the left one all along, by so much at least; negative for darker.
fn has_edge(plane: &Saddles, from: Vector2<f64>, way: Vector2<f64>, bright: f64) -> bool {
    let length = way.norm();
    let right = Vector2::new(-way.y, way.x) / length;
    let beside = right * (BESIDE.0 * length).clamp(BESIDE.1, BESIDE.2);
    ALONG.iter().all(|t| {
        let at = from + way * *t;
        let side = |p: Vector2<f64>| f64::from(plane.smooth.sample(p.x, p.y));
        (side(at + beside) - side(at - beside)) * bright.signum() > bright.abs()
    })
}

/// The steps of the four directions: along columns, rows, and back.
const STEPS: [(i32, i32); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// Counts columns and rows from a saddle, over neighbours.
fn grow(seed: usize, saddles: &[Saddle], links: &Links, is_taken: &mut [bool]) -> Nodes {
    let mut nodes = Nodes::new();
    let mut places: BTreeMap<usize, (i32, i32)> = BTreeMap::new();
    let mut open = VecDeque::from([(seed, (0, 0), 0)]);
    while let Some((idx, place, ray)) = open.pop_front() {
        if places.contains_key(&idx) || nodes.contains_key(&place) || is_taken[idx] {
            continue;
        }
        is_taken[idx] = true;
        places.insert(idx, place);
        nodes.insert(place, Node { saddle: saddles[idx], ray });
        for (direction, step) in STEPS.iter().enumerate() {
            if let Some((next, back)) = links[idx][(ray + direction) % 4] {
                // `back` points against the direction.
                let next_ray = (back + 8 - direction - 2) % 4;
                open.push_back((next, (place.0 + step.0, place.1 + step.1), next_ray));
            }
        }
    }
    nodes
}

/// Where two corners of a line put the next one.
struct Guess {
    at: Vector2<f64>,
    /// How far it is from the last one, px.
    side: f64,
    /// Of the last one.
    contrast: f64,
    /// The last one's ray along the columns.
    ray: usize,
}

/// Adds corners that were not linked where two or more lines of neighbours put them.
fn fill(plane: &Saddles, nodes: &mut Nodes) {
    loop {
        let mut gaps: BTreeMap<(i32, i32), Vec<Guess>> = BTreeMap::new();
        for (&(x, y), node) in nodes.iter() {
            for (dx, dy) in STEPS {
                let (gap, behind) = ((x + dx, y + dy), (x - dx, y - dy));
                let Some(before) = nodes.get(&behind).filter(|_| !nodes.contains_key(&gap)) else {
                    continue;
                };
                let side = node.saddle.at - before.saddle.at;
                let guess = Guess {
                    at: node.saddle.at + side,
                    side: side.norm(),
                    contrast: node.saddle.contrast,
                    ray: node.ray,
                };
                gaps.entry(gap).or_default().push(guess);
            }
        }
        let mut is_new = false;
        for (gap, guesses) in gaps {
            if guesses.len() < 2 {
                continue;
            }
            let n = guesses.len() as f64;
            let place = guesses.iter().map(|g| g.at).sum::<Vector2<f64>>() / n;
            let side = guesses.iter().map(|g| g.side).fold(f64::INFINITY, f64::min);
            let contrast = guesses.iter().map(|g| g.contrast).sum::<f64>() / n;
            let Some(saddle) = plane.near(place, FILLED * side) else { continue };
            let is_free = nodes.values().all(|node| (node.saddle.at - saddle.at).norm() > 1.0);
            // Colours alternate: the rays' order is that of a neighbour, moved on by one. Which of the two that fit
            // points along the columns is told by the neighbour's own direction.
            let Some(ray) = aligned(nodes, gap, &saddle) else { continue };
            if is_free && saddle.contrast > WEAK * contrast && ray % 2 != guesses[0].ray % 2 {
                nodes.insert(gap, Node { saddle, ray });
                is_new = true;
            }
        }
        if !is_new {
            return;
        }
    }
}

/// Which ray of a saddle points along the columns, as its neighbours' do.
fn aligned(nodes: &Nodes, (x, y): (i32, i32), saddle: &Saddle) -> Option<usize> {
    let neighbour = STEPS.iter().find_map(|(dx, dy)| nodes.get(&(x + dx, y + dy)))?;
    let along = neighbour.saddle.rays[neighbour.ray];
    let off = |ray: usize| turn(saddle.rays[ray], along).abs();
    (0..4).min_by(|&a, &b| off(a).total_cmp(&off(b)))
}

/// Takes away lines at the border that are hardly there, and lays the rest out.
fn whole(mut nodes: Nodes) -> Option<Grid> {
    loop {
        let (x0, x1) = (nodes.keys().map(|k| k.0).min()?, nodes.keys().map(|k| k.0).max()?);
        let (y0, y1) = (nodes.keys().map(|k| k.1).min()?, nodes.keys().map(|k| k.1).max()?);
        if x1 - x0 < 1 || y1 - y0 < 1 {
            return None;
        }
        let part = |is_in: &dyn Fn(&(i32, i32)) -> bool, length: i32| {
            nodes.keys().filter(|k| is_in(k)).count() as f64 / f64::from(length)
        };
        let (w, h) = (x1 - x0 + 1, y1 - y0 + 1);
        let borders = [
            (part(&|k| k.0 == x0, h), (x0, 0)),
            (part(&|k| k.0 == x1, h), (x1, 0)),
            (part(&|k| k.1 == y0, w), (y0, 1)),
            (part(&|k| k.1 == y1, w), (y1, 1)),
        ];
        let (least, (line, axis)) = borders.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        if least < BARE {
            nodes.retain(|k, _| if axis == 0 { k.0 != line } else { k.1 != line });
            continue;
        }
        let mut corners = Vec::with_capacity((w * h) as usize);
        for y in y0..=y1 {
            for x in x0..=x1 {
                corners.push(nodes.get(&(x, y)).map(|node| node.saddle.at));
            }
        }
        // After an even ray comes a bright sector, and every step changes the colour.
        let (&(x, y), node) = nodes.iter().next()?;
        let is_dark = (node.ray % 2 == 1) != ((x - x0 + y - y0) % 2 == 1);
        return Some(Grid { n_columns: w as usize, n_rows: h as usize, corners, is_dark });
    }
}
