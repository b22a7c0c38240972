//! The lines of a mesh that an eye sees: where its surface turns away, and where it bends.
//!
//! In: where the eye is, in the mesh's frame. Out: points along the visible lines, with the way the line runs and the way
//! out of the body, and points of the surface that is seen. An edge of which one triangle faces the eye and the other does
//! not is where the surface turns away; of those that are seen, one with the mesh itself behind it lies inside the
//! silhouette. Projecting them is the camera's: [`crate::alignment::outline`].
//!
//! A search asks for the lines from millions of places. [`Mesh::roughly_seen`] answers from some directions that are worked
//! out once: between two of them a line of a body moves along its surface, which changes its picture in second order.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

use nalgebra::Vector3;

use super::Mesh;

/// A bend by less shows no line, rad: 15 deg, as of what a lathe makes (`alignment::outline`).
const CREASE: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// A line that turns by more ends there and another begins, rad: 40 deg. Chosen: the sides of an octagon are eight lines, a
/// circle of ten sides or more is one.
const TURNS: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// No line is longer than this share of all: a fit weighs lines against each other, and a smooth body has one alone.
const LONGEST: f64 = 1.0 / 8.0;
/// A line shorter than this share of the way between two points has none.
const SHORTEST: f64 = 0.25;
/// How far off the surface it is asked whether a point is seen, as a share of the largest side: 0.1 mm of 10 cm.
const OFF: f64 = 1e-3;
/// Points of the surface that are seen.
const WITHIN: usize = 24;
/// Directions that are worked out: round about, and up; and distances, by factors. Chosen: 7.5 deg are half of the step in
/// which turns are looked for; at a metre 25 % change the direction to the rim of a thing of 10 cm by 0.6 deg.
const AROUND: f64 = 48.0;
const FARTHER: f64 = 1.25;

/// An edge between two triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    corners: [u32; 2],
    faces: [u32; 2],
    /// How much of a line its faces show where they bend: 1 for a right angle, 0 for none.
    bend: f64,
}

/// A point of a line that is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Where, m.
    pub at: Vector3<f64>,
    /// The way the line runs, of length 1.
    pub along: Vector3<f64>,
    /// Away from the body, of length 1.
    pub out: Vector3<f64>,
    /// How much of the line it stands for, m.
    pub length: f64,
    /// Whether the body ends here, to the eye; else it is seen on both sides.
    pub is_rim: bool,
    /// How much of a line it shows: 1 where the surface turns away, less where it bends by less than a right angle.
    pub shows: f64,
    /// Which line; points of one line follow each other.
    pub line: usize,
}

/// What an eye sees of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seen {
    /// Along the lines.
    pub spots: Vec<Spot>,
    /// On the surface, spread as they are seen, m.
    pub within: Vec<Vector3<f64>>,
}

/// What was seen from some directions, by direction, distance and how many points were asked for.
#[derive(Default)]
pub(super) struct Aspects(RwLock<BTreeMap<[i32; 4], Arc<Seen>>>);

/// Returns the edges of a closed surface.
pub(super) fn edges(
    corners: &[Vector3<f64>],
    triangles: &[[u32; 3]],
    normals: &[Vector3<f64>],
) -> Vec<Edge> {
    let mut sides: BTreeMap<(u32, u32), [Vec<u32>; 2]> = BTreeMap::new();
    for (face, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            sides.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)].push(face as u32);
        }
    }
    let crease = CREASE.cos();
    sides
        .into_iter()
        .filter(|((a, b), _)| corners[*a as usize] != corners[*b as usize])
        .flat_map(|((a, b), [up, down])| {
            up.into_iter().zip(down).map(move |(f, g)| ([a, b], [f, g]))
        })
        .map(|(corners, faces)| {
            let [f, g] = faces.map(|face| normals[face as usize]);
            // Two matt faces differ in any light, on average, as their normals do: by twice the sine of half the bend.
            let bend =
                if f.dot(&g) < crease { (f - g).norm() / std::f64::consts::SQRT_2 } else { 0.0 };
            Edge { corners, faces, bend: bend.min(1.0) }
        })
        .collect()
}

impl Mesh {
    /// Returns what an eye at `eye` (m, the mesh's frame) sees, with `per_side` points on a line as long as its mean side.
    pub fn seen(&self, eye: &Vector3<f64>, per_side: usize) -> Seen {
        let mut lines = self.lines(eye, true);
        lines.extend(self.lines(eye, false));
        let step = self.size().mean() / per_side.max(1) as f64;
        let all: f64 = lines.iter().map(Line::length).sum();
        let mut spots = Vec::new();
        let mut number = 0;
        for line in &lines {
            let length = line.length();
            if length < SHORTEST * step {
                continue;
            }
            let pieces = (length / (LONGEST * all)).ceil().max(1.0);
            let count = (length / step).round().max(1.0);
            for k in 0..count as usize {
                let share = (k as f64 + 0.5) / count;
                let piece = number + (share * pieces) as usize;
                let spot = line.at(share * length, length / count, piece);
                spots.extend(self.looked_at(eye, spot));
            }
            number += pieces as usize;
        }
        Seen { spots: renumbered(spots), within: self.within(eye) }
    }

    /// As [`Self::seen`], from the nearest of the directions that are worked out once.
    pub fn roughly_seen(&self, eye: &Vector3<f64>, per_side: usize) -> Arc<Seen> {
        let centre = Vector3::z() * (0.5 * self.size().z);
        let way = eye - centre;
        let step = std::f64::consts::TAU / AROUND;
        let whole = |x: f64| x.round() as i32;
        let round = whole(way.y.atan2(way.x) / step).rem_euclid(AROUND as i32);
        let up = whole(way.z.atan2(way.xy().norm()) / step);
        let far = whole(way.norm().max(1e-6).ln() / FARTHER.ln());
        let key = [round, up, far, i32::try_from(per_side).unwrap_or(i32::MAX)];
        let known =
            self.aspects.0.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        if let Some(known) = known {
            return known;
        }
        let (around, high) = (f64::from(round) * step, f64::from(up) * step);
        let way = Vector3::new(high.cos() * around.cos(), high.cos() * around.sin(), high.sin());
        let seen = Arc::new(self.seen(&(centre + way * FARTHER.powi(far)), per_side));
        let mut all = self.aspects.0.write().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(all.entry(key).or_insert(seen))
    }

    /// Whether a triangle faces the eye.
    fn faces(&self, face: u32, eye: &Vector3<f64>) -> bool {
        let corner = self.corners()[self.triangles()[face as usize][0] as usize];
        self.normals()[face as usize].dot(&(eye - corner)) > 0.0
    }

    /// Returns the lines where the surface turns away, or else where it bends, hidden ones too.
    fn lines(&self, eye: &Vector3<f64>, turns_away: bool) -> Vec<Line> {
        let chosen: Vec<&Edge> = self
            .edges
            .iter()
            .filter(|edge| {
                let [f, g] = edge.faces.map(|face| self.faces(face, eye));
                if turns_away { f != g } else { f && g && edge.bend > 0.0 }
            })
            .collect();
        let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (k, edge) in chosen.iter().enumerate() {
            for corner in edge.corners {
                at.entry(corner).or_default().push(k);
            }
        }
        let mut used = vec![false; chosen.len()];
        let mut lines = Vec::new();
        for first in 0..chosen.len() {
            if used[first] {
                continue;
            }
            used[first] = true;
            let mut run = vec![(first, chosen[first].corners)];
            for is_forward in [true, false] {
                loop {
                    let end = if is_forward { run.last() } else { run.first() };
                    let Some(&(k, ends)) = end else { break };
                    let tip = ends[usize::from(is_forward)];
                    let Some(next) = self.goes_on(&chosen, &at, &used, (k, ends), tip) else {
                        break;
                    };
                    used[next] = true;
                    let [a, b] = chosen[next].corners;
                    let other = if a == tip { b } else { a };
                    if is_forward {
                        run.push((next, [tip, other]));
                    } else {
                        run.insert(0, (next, [other, tip]));
                    }
                }
            }
            let mut line = self.line(&chosen, &run);
            if !turns_away {
                let bends = run.iter().map(|(k, _)| chosen[*k].bend);
                line.shows = bends.sum::<f64>() / run.len() as f64;
            }
            lines.push(line);
        }
        lines
    }

    /// Returns the edge by which a line goes on at its tip: the only one there, and not round a corner.
    fn goes_on(
        &self,
        chosen: &[&Edge],
        at: &BTreeMap<u32, Vec<usize>>,
        used: &[bool],
        (from, ends): (usize, [u32; 2]),
        tip: u32,
    ) -> Option<usize> {
        let there = at.get(&tip)?;
        let [next] = there.iter().copied().filter(|k| *k != from).collect::<Vec<_>>()[..] else {
            return None;
        };
        let place = |corner: u32| self.corners()[corner as usize];
        let back = if ends[0] == tip { ends[1] } else { ends[0] };
        let [a, b] = chosen[next].corners;
        let ahead = if a == tip { b } else { a };
        let (came, goes) = (place(tip) - place(back), place(ahead) - place(tip));
        (!used[next] && came.angle(&goes) < TURNS).then_some(next)
    }

    fn line(&self, chosen: &[&Edge], run: &[(usize, [u32; 2])]) -> Line {
        let place = |corner: u32| self.corners()[corner as usize];
        let mut line =
            Line { points: vec![place(run[0].1[0])], far: vec![0.0], outs: Vec::new(), shows: 1.0 };
        for (k, [_, to]) in run {
            let [f, g] = chosen[*k].faces.map(|face| self.normals()[face as usize]);
            let to = place(*to);
            let (before, far) = (line.points[line.points.len() - 1], line.length());
            line.far.push(far + (to - before).norm());
            line.points.push(to);
            line.outs.push((f + g).try_normalize(1e-9).unwrap_or(f));
        }
        line
    }

    /// Returns a point of a line if the eye sees it, and whether the body ends there.
    fn looked_at(&self, eye: &Vector3<f64>, spot: Spot) -> Option<Spot> {
        let off = spot.at + spot.out * (OFF * self.size().max());
        let sight = eye - off;
        if self.meets(&off, &sight, 0.0).is_some_and(|met| met.far < 1.0) {
            return None;
        }
        Some(Spot { is_rim: self.meets(&off, &-sight, 0.0).is_none(), ..spot })
    }

    /// Returns points of the surface that are seen, spread by how large its triangles look.
    fn within(&self, eye: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let corners = |face: usize| self.triangles()[face].map(|c| self.corners()[c as usize]);
        let looks = |face: usize| {
            let [a, b, c] = corners(face);
            let sight = (eye - a).normalize();
            (0.5 * (b - a).cross(&(c - a)).dot(&sight)).max(0.0)
        };
        let mut sum = 0.0;
        let sums: Vec<f64> = (0..self.triangles().len())
            .map(|face| {
                sum += looks(face);
                sum
            })
            .collect();
        (0..WITHIN)
            .filter_map(|k| {
                let wanted = sum * (k as f64 + 0.5) / WITHIN as f64;
                let face = sums.partition_point(|sum| *sum < wanted).min(sums.len() - 1);
                // Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
                let (u, v) = ((0.7549 * k as f64 + 0.5).fract(), (0.5698 * k as f64 + 0.5).fract());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let [a, b, c] = corners(face);
                let at = a + (b - a) * u + (c - a) * v;
                let off = at + self.normals()[face] * (OFF * self.size().max());
                let is_hidden =
                    self.meets(&off, &(eye - off), 0.0).is_some_and(|met| met.far < 1.0);
                (!is_hidden).then_some(at)
            })
            .collect()
    }
}

/// Numbers lines that have points, one after the other.
fn renumbered(mut spots: Vec<Spot>) -> Vec<Spot> {
    let mut last = None;
    let mut number = 0;
    for spot in &mut spots {
        if last.is_some_and(|last| last != spot.line) {
            number += 1;
        }
        last = Some(spot.line);
        spot.line = number;
    }
    spots
}

/// A line along edges.
struct Line {
    points: Vec<Vector3<f64>>,
    /// How far along each point is, m.
    far: Vec<f64>,
    /// Of each edge, the way out of the body.
    outs: Vec<Vector3<f64>>,
    /// How much of a line it shows.
    shows: f64,
}

impl Line {
    fn length(&self) -> f64 {
        self.far.last().copied().unwrap_or_default()
    }

    /// Returns the place so far along, and on which edge.
    fn place(&self, far: f64) -> (Vector3<f64>, usize) {
        let k = self.far.partition_point(|f| *f <= far).clamp(1, self.outs.len());
        let (a, b) = (self.far[k - 1], self.far[k]);
        let share = if b > a { ((far - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
        (self.points[k - 1] + (self.points[k] - self.points[k - 1]) * share, k - 1)
    }

    /// Returns the point so far along, which stands for `length` m.
    fn at(&self, far: f64, length: f64, line: usize) -> Spot {
        let (at, edge) = self.place(far);
        let (before, after) = (self.place(far - 0.5 * length).0, self.place(far + 0.5 * length).0);
        let straight = self.points[edge + 1] - self.points[edge];
        let along = (after - before).try_normalize(1e-12).unwrap_or(straight.normalize());
        let (out, shows) = (self.outs[edge], self.shows);
        Spot { at, along, out, length, is_rim: false, shows, line }
    }
}

#[cfg(test)]
mod tests {
    use super::super::step;
    use super::*;

    #[test]
    fn a_step_seen_from_before_it_shows_its_rim_and_its_bends() {
        let step = step();
        // From the low side, above: the riser is seen, the back is not.
        let seen = step.seen(&Vector3::new(1.0, 0.0, 0.6), 10);
        let near =
            |spot: &Spot, at: [f64; 3], reach: f64| (spot.at - Vector3::from(at)).norm() < reach;
        // The edge between tread and riser is a bend, and seen; so is the front of the tread.
        for at in [[-0.01, 0.0, 0.03], [0.04, 0.0, 0.03], [-0.01, 0.0, 0.06]] {
            let there = seen.spots.iter().find(|spot| near(spot, at, 0.006));
            assert!(there.is_some_and(|spot| !spot.is_rim), "{at:?}");
        }
        // Its foot, its sides and the far edge of its top end it.
        for at in [[0.04, 0.0, 0.0], [-0.04, 0.0, 0.06], [0.04, 0.025, 0.015]] {
            let there = seen.spots.iter().find(|spot| near(spot, at, 0.006));
            assert!(there.is_some_and(|spot| spot.is_rim), "{at:?}");
        }
        // The foot behind it is not seen.
        assert!(!seen.spots.iter().any(|spot| near(spot, [-0.04, 0.0, 0.0], 0.01)));
        assert!(seen.within.len() > 15);
        let lines: Vec<usize> = seen.spots.iter().map(|spot| spot.line).collect();
        assert!(lines.is_sorted() && *lines.last().unwrap() < 24, "{lines:?}");
    }

    #[test]
    fn what_is_roughly_seen_is_nearly_what_is_seen() {
        let step = step();
        let eye = Vector3::new(0.7, 0.35, 0.8);
        let (one, other) = (step.seen(&eye, 8), step.roughly_seen(&eye, 8));
        let far = |a: &Spot, all: &[Spot]| {
            all.iter().map(|b| (a.at - b.at).norm()).fold(f64::INFINITY, f64::min)
        };
        let worst = one.spots.iter().map(|s| far(s, &other.spots)).fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst}");
        assert!(Arc::ptr_eq(&other, &step.roughly_seen(&(eye * 1.01), 8)));
    }
}
