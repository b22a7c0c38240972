//! Public planning problems: every one that is posed is solved, and the motion is free and lawful.

use trueup::motion::ik::Solver;
use trueup::motion::rrt::{Settings, plan};
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Budget, Robot};

use super::problems::problems;
use crate::absent::public;

/// How many problems of each of the seven sets are tried.
const PER_SET: usize = 6;

#[test]
fn public_problems_are_solved_and_the_motions_are_free_and_lawful() {
    let Some(folder) = public("motionbenchmaker") else { return };
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let limits = Limits::of(&robot);
    let home = robot.pose("home").unwrap();
    let run = Budget::new(|| false);
    let (mut posed, mut solved) = (0, 0);
    for problem in problems(&folder, &robot, PER_SET).into_values().flatten() {
        posed += 1;
        let (world, ends) = (&problem.world, &problem.goals);
        let Ok(path) = plan(&solver, world, home, ends, None, &Settings::default(), &run) else {
            continue;
        };
        solved += 1;
        let timed =
            Trajectory::through_corners(&path.corners, &limits, 0.2, &|a, b| world.certify(a, b))
                .unwrap();
        let (speed, acceleration) = timed.worst(&limits, 1e-3);
        assert!(speed <= 1.0 && acceleration <= 1.0, "{}", problem.name);
        let (_, samples) = timed.sampled(5e-3);
        assert!(samples.iter().all(|q| world.free(q)), "{}", problem.name);
    }
    assert!(posed >= 6 && solved == posed, "{solved} of {posed}");
}
