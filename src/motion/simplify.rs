//! A path of corners made shorter and rounder by straight motions that are free.
//!
//! In rounds: corners that can be passed by are left out; then each edge is halved and each corner drawn towards the chord
//! between the middles beside it, as a B-spline runs inside its control points; until neither changes anything. Between
//! them a few shortcuts from anywhere to anywhere are drawn by chance: all of it from the seed. At the end the path is pulled taut
//! (`tauten`).
//!
//! Source: Thomason, Kingston and Kavraki, "Motions in microseconds via vectorized sampling-based planning", ICRA 2024
//! (the rounds); Pan, Zhang and Manocha, "Collision-free and smooth trajectory computation in cluttered environments", IJRR
//! 2012 (B-splines by halving); Geraerts and Overmars, "Creating high-quality paths for motion planning", IJRR 2007
//! (shortcuts).

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::error::Error;
use super::motions::Motions;
use super::polyline::{l2, length, mix, point_at};
use super::tauten::tautened;

/// Rounds at most.
const ROUNDS: usize = 5;
/// A corner that would move by less than this, rad, stays.
const LEAST_MOVE: f64 = 0.1;
/// A corner that lies nearer than this to the line past it, rad, is none.
const STRAIGHT: f64 = 1e-9;

/// Returns the corners of a shorter path; `shortcuts` are drawn by chance.
///
/// # Errors
///
/// [`Error::Spent`] and [`Error::Cancelled`].
pub(super) fn simplified(
    motions: &mut Motions<'_>,
    mut corners: Vec<Vec<f64>>,
    shortcuts: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>, Error> {
    let mut random = StdRng::seed_from_u64(seed ^ 0x51de);
    for round in 0..ROUNDS {
        let passed = passed_by(motions, &mut corners)?;
        if round == 0 {
            for _ in 0..shortcuts {
                shortcut(motions, &mut corners, &mut random)?;
            }
        }
        let smoothed = smoothed(motions, &mut corners)?;
        if !passed && !smoothed {
            break;
        }
    }
    // Short edges are left behind, which cost time at their corners.
    let mut at = 1;
    while at + 1 < corners.len() {
        if motions.are_free(&corners[at - 1], &corners[at + 1])? {
            corners.remove(at);
        } else {
            at += 1;
        }
    }
    tautened(motions, &mut corners, &mut random)?;
    Ok(corners)
}

/// Leaves out corners: from each the farthest that can be seen comes next. Returns whether any went.
pub(super) fn passed_by(
    motions: &mut Motions<'_>,
    corners: &mut Vec<Vec<f64>>,
) -> Result<bool, Error> {
    let before = corners.len();
    let mut at = 0;
    while at + 2 < corners.len() {
        for far in (at + 2..corners.len()).rev() {
            if motions.are_free(&corners[at], &corners[far])? {
                corners.drain(at + 1..far);
                break;
            }
        }
        at += 1;
    }
    Ok(corners.len() < before)
}

/// Replaces the stretch between two places drawn by chance, if it is not straight and the straight motion is free.
fn shortcut(
    motions: &mut Motions<'_>,
    corners: &mut Vec<Vec<f64>>,
    random: &mut StdRng,
) -> Result<(), Error> {
    if corners.len() < 3 {
        return Ok(());
    }
    let total = length(corners);
    let (a, b) = (random.random_range(0.0..total), random.random_range(0.0..total));
    let (from_edge, from) = point_at(corners, a.min(b));
    let (to_edge, to) = point_at(corners, a.max(b));
    if from_edge == to_edge {
        return Ok(());
    }
    let old = l2(&from, &corners[from_edge + 1])
        + length(&corners[from_edge + 1..=to_edge])
        + l2(&corners[to_edge], &to);
    if l2(&from, &to) < old - 1e-6 && motions.are_free(&from, &to)? {
        corners.splice(from_edge + 1..=to_edge, [from, to]);
    }
    Ok(())
}

/// Halves every edge and draws every corner halfway to the chord between the middles beside it, where that is free. Returns
/// whether any moved.
fn smoothed(motions: &mut Motions<'_>, corners: &mut Vec<Vec<f64>>) -> Result<bool, Error> {
    let mut moved = false;
    let mut round: Vec<Vec<f64>> = Vec::with_capacity(2 * corners.len());
    round.extend(corners.first().cloned());
    for three in corners.windows(3) {
        let (before, after) = (mix(&three[0], &three[1], 0.5), mix(&three[1], &three[2], 0.5));
        let drawn = mix(&three[1], &mix(&before, &after, 0.5), 0.5);
        let moves = l2(&three[1], &drawn) > LEAST_MOVE
            && motions.are_free(&before, &drawn)?
            && motions.are_free(&drawn, &after)?;
        moved |= moves;
        round.extend([before, if moves { drawn } else { three[1].clone() }]);
    }
    if let [.., before, last] = &corners[..] {
        round.extend([mix(before, last, 0.5), last.clone()]);
    }
    let mut at = 1;
    while at + 1 < round.len() {
        let (a, b, c) = (&round[at - 1], &round[at], &round[at + 1]);
        if l2(a, b) + l2(b, c) - l2(a, c) < STRAIGHT {
            round.remove(at);
        } else {
            at += 1;
        }
    }
    *corners = round;
    Ok(moved)
}
