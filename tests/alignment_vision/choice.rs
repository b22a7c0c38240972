//! Choosing one place for each of several things.

use trueup::alignment::choice::assign;
use trueup::alignment::evidence::Score;
use trueup::alignment::placement::Candidate;

fn at(x: f64, total: f64) -> Candidate {
    let score = Score { total, ..Score::default() };
    Candidate { x, y: 0.0, yaw: 0.0, score, fit: None }
}

/// Seen on a photograph of three painted bottles: of what is absent a tumbler took the place of the third bottle, and that one
/// of its own look-alikes far down the list, because two poor places together count for more than one good one.
#[test]
fn the_end_of_a_long_list_makes_no_room_for_what_is_absent() {
    // Eight places within a hand of each other, as turns and surroundings of one place are, and one far away.
    let mut bottle: Vec<Candidate> = (0..8).map(|k| at(0.002 * f64::from(k), 0.74)).collect();
    bottle.push(at(0.2, 0.55));
    let tumbler = vec![at(0.01, 0.64)];
    let conflict = |a: (usize, &Candidate), b: (usize, &Candidate)| a.1.distance(b.1) < 0.05;
    assert_eq!(assign(&[bottle, tumbler], 0.3, &conflict), vec![Some(0), None]);
}

/// Three of one look get three places, whatever the order in which these are listed.
#[test]
fn things_of_one_look_have_a_place_each() {
    let all = vec![at(0.0, 0.8), at(0.01, 0.79), at(0.2, 0.7), at(0.4, 0.6)];
    let conflict = |a: (usize, &Candidate), b: (usize, &Candidate)| a.1.distance(b.1) < 0.05;
    let mut chosen = assign(&[all.clone(), all.clone(), all], 0.3, &conflict);
    chosen.sort_unstable();
    assert_eq!(chosen, vec![Some(0), Some(2), Some(3)]);
}
