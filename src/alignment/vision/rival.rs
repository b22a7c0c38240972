//! Where the place of a thing ends and another place of it begins, and how unsure one is between places that fit about as well.
//!
//! A compact thing a little beside its place is at another one. A long thing shifted along itself covers most of its place as
//! before, and only its ends tell: that is uncertainty along it, and no other place.

use nalgebra::{Rotation2, Vector2};

use crate::alignment::placement::Candidate;
use crate::world::Shape;

/// A second place is a rival when it is this far off, as a share of how far the thing reaches that way (of the radius inside
/// what is not long), and at least so far, m. Chosen: nearer ones are the same place, a little beside it; with twice as much a
/// neighbour of the same look is overlooked.
const RIVAL: f64 = 0.6;
pub(super) const RIVAL_LEAST: f64 = 0.02;
/// How far behind the second place must be, as a share, for the first to be believed in full. A rival within 5 % marked two of
/// three wrong placements and one right one of real photographs (measured with a prototype of this fit). Chosen around that:
/// at 9 % nothing is taken off, at 4 % half.
pub(super) const GAP: f64 = 0.1;
/// What is so many times as long as it is wide is long. Chosen: the ends of a wall are a small part of its outline then, and the
/// weights of [`super::probability`] were fitted to boxes up to 2.2 times as long as wide, which count as they did; with
/// twice as much a plank of 10 by 60 cm is its own rival.
const LONG: f64 = 3.0;
/// What keeps a score of none from dividing; scores that matter are above 0.3.
const TINY: f64 = 1e-9;

/// Returns the sides along x and y, m, of what is long.
fn long_sides(shape: &Shape) -> Option<[f64; 2]> {
    shape.faces().filter(|[x, y]| x.max(*y) >= LONG * x.min(*y))
}

/// Whether `other` is another place of a thing at `best`, and not the same, a little beside it.
pub(super) fn is_another(shape: &Shape, best: &Candidate, other: &Candidate) -> bool {
    if other.distance(best) <= (RIVAL * shape.inner_radius()).max(RIVAL_LEAST) {
        return false;
    }
    let Some(sides) = long_sides(shape) else { return true };
    let [x, y] = sides.map(|side| (0.5 * RIVAL * side).max(RIVAL_LEAST));
    let symmetry = shape.symmetry();
    let turns = other.yaw - best.yaw;
    let turns = if symmetry > 0.0 { turns - symmetry * (turns / symmetry).round() } else { turns };
    let shift = Rotation2::new(-best.yaw) * Vector2::new(other.x - best.x, other.y - best.y);
    // Where its ends come to: a long thing that is turned is somewhere else there.
    let end = if sides[0] > sides[1] {
        Vector2::new(0.5 * sides[0], 0.0)
    } else {
        Vector2::new(0.0, 0.5 * sides[1])
    };
    let by_turn = Rotation2::new(turns) * end - end;
    [shift + by_turn, shift - by_turn].iter().any(|moved| (moved.x / x).hypot(moved.y / y) > 1.0)
}

/// Returns how far a long thing may be off along itself, m, by the places there that fit about as well; none of what is not
/// long.
pub(super) fn along_std(shape: &Shape, best: &Candidate, places: &[Candidate]) -> f64 {
    if long_sides(shape).is_none() {
        return 0.0;
    }
    // Nearer ones are the best place itself, before it was looked at closely.
    let is_beside = |c: &&Candidate| c.distance(best) > 0.5 * RIVAL_LEAST;
    let along = places.iter().filter(is_beside).filter(|c| !is_another(shape, best, c));
    apart_std(best, along, shape.symmetry()).0
}

/// Returns how far place, m, and turn, rad, may be off because the thing looks nearly the same at other places: the deviation
/// of their mixture about the best, in which each counts by how nearly; `symmetry` is the turn that looks the same, rad.
pub(super) fn apart_std<'c>(
    best: &Candidate,
    others: impl IntoIterator<Item = &'c Candidate>,
    symmetry: f64,
) -> (f64, f64) {
    let (mut squares, mut weights) = ([0.0_f64; 2], 1.0_f64);
    for other in others {
        let behind = 1.0 - other.score.total / best.score.total.max(TINY);
        if behind < GAP {
            let weight = 1.0 - (behind / GAP).max(0.0);
            squares[0] += weight * best.distance(other).powi(2);
            squares[1] += weight * best.turned(other, symmetry).powi(2);
            weights += weight;
        }
    }
    ((squares[0] / weights).sqrt(), (squares[1] / weights).sqrt())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Vector3;

    use super::*;
    use crate::alignment::evidence::Score;

    fn at(x: f64, y: f64, yaw: f64, total: f64) -> Candidate {
        let score = Score { total, ..Score::default() };
        Candidate { x, y, yaw, score, fit: None }
    }

    #[test]
    fn places_count_by_how_nearly_they_fit_as_well() {
        let at = |x: f64, yaw: f64, total: f64| at(x, 0.0, yaw, total);
        let (best, quarter) = (at(0.5, 0.1, 0.8), FRAC_PI_2);
        assert_eq!(apart_std(&best, &[], quarter), (0.0, 0.0));
        // As good: half of the mixture is 6 mm and 0.2 rad off. Far behind: it does not count.
        let others = [at(0.506, 0.3 - quarter, 0.8), at(0.6, 0.5, 0.8 * (1.0 - GAP))];
        let (place, turn) = apart_std(&best, &others, quarter);
        assert!((place - 0.006 / 2.0_f64.sqrt()).abs() < 1e-9, "{place}");
        assert!((turn - 0.2 / 2.0_f64.sqrt()).abs() < 1e-9, "{turn}");
        // Half as far behind counts half, and what is round is not turned.
        let (place, turn) = apart_std(&best, &[at(0.506, 0.3, 0.8 * (1.0 - 0.5 * GAP))], 0.0);
        assert!((place - 0.006 / 3.0_f64.sqrt()).abs() < 1e-9 && turn == 0.0, "{place} {turn}");
    }

    /// A wall of 80 cm in full view was not found: 2 cm along it was another place that fits almost as well.
    #[test]
    fn a_wall_shifted_along_itself_is_at_its_place_and_across_at_another() {
        let wall = Shape::Cuboid { size: Vector3::new(0.04, 0.8, 0.3) };
        for turned in [0.0, 0.7] {
            let best = at(0.95, 0.0, turned, 0.9);
            let place = |x: f64, y: f64, yaw: f64| {
                let there = Rotation2::new(turned) * Vector2::new(x, y);
                at(0.95 + there.x, there.y, turned + yaw, 0.86)
            };
            for along in [0.02, -0.02, 0.07] {
                assert!(!is_another(&wall, &best, &place(0.001, along, 0.0)), "{along} m");
            }
            assert!(is_another(&wall, &best, &place(0.0, 0.3, 0.0)), "far along it");
            assert!(is_another(&wall, &best, &place(0.025, 0.0, 0.0)), "beside it");
            assert!(is_another(&wall, &best, &place(0.0, 0.07, FRAC_PI_2)), "across it");
            assert!(!is_another(&wall, &best, &place(0.0, 0.07, std::f64::consts::PI)));
            let near = [place(0.0, 0.0, 0.0), place(0.0, 0.02, 0.0), place(0.1, 0.0, 0.0)];
            let off = along_std(&wall, &best, &near);
            assert!((0.005..0.02).contains(&off), "{off} m");
        }
    }

    /// What is not long has another place from where it always had.
    #[test]
    fn of_what_is_compact_nothing_changes() {
        let cube = Shape::Cuboid { size: Vector3::repeat(0.055) };
        let can = Shape::Cylinder { radius: 0.05, height: 0.1 };
        let tray = Shape::Cuboid { size: Vector3::new(0.2, 0.09, 0.02) };
        let best = at(0.5, 0.1, 0.4, 0.9);
        for (shape, apart) in [(&cube, 0.02), (&can, 0.03), (&tray, 0.027)] {
            for k in 0..16 {
                let way = Rotation2::new(f64::from(k) * 0.4) * Vector2::x();
                let moved = |by: f64| at(0.5 + by * way.x, 0.1 + by * way.y, 0.1, 0.9);
                assert!(is_another(shape, &best, &moved(apart + 1e-6)));
                assert!(!is_another(shape, &best, &moved(apart - 1e-6)));
                assert!(along_std(shape, &best, &[moved(apart - 1e-6)]) == 0.0);
            }
        }
    }
}
