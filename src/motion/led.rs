//! A step of a search that is led by the tip: it moves one way in space and turns about an axis, both by chance.
//!
//! Among obstacles the joints of a step that is drawn joint by joint add up to a wide sweep of the hand; here the least motion of the joints is
//! taken that moves the tip so. Of the Panda's problems `cage` then needs half the looks in the median. Nothing here knows what is in the way.
//!
//! Source: Shkolnik and Tedrake, "Path planning in 1000+ dimensions using a task-space Voronoi bias", ICRA 2009 (steps in the
//! space of the task through a pseudoinverse); Nakamura and Hanafusa, "Inverse kinematic solutions with singularity robustness",
//! 1986 (its damping).

use nalgebra::{Matrix6, Vector6};
use rand::RngExt;
use rand::rngs::StdRng;

use super::robot::Robot;
use super::scratch::{FEW, scratch};

/// What the square of a singular value is raised by, m² and rad²: a direction that the arm can hardly move in takes no wild step.
const DAMPING: f64 = 1e-2;
/// A tip that turns by a radian counts as one that moves by so many m. Chosen: of 0.1 to 1 on the Panda's problems.
const TURN: f64 = 0.5;

/// Writes into `end` where a step of `size` rad (Euclidean over the joints) from `node` leads, inside the joint limits.
pub(super) fn led(robot: &Robot, node: &[f64], size: f64, random: &mut StdRng, end: &mut [f64]) {
    let (mut few, mut many) = ([[0.0; 6]; FEW], Vec::new());
    let columns = scratch(node.len(), &mut few, &mut many);
    robot.jacobian_into(node, columns.as_flattened_mut());
    let mut twist = Vector6::from_fn(|_, _| random.random_range(-1.0..1.0));
    twist.fixed_rows_mut::<3>(0).scale_mut(TURN);
    let mut square = Matrix6::from_diagonal_element(DAMPING);
    for column in &*columns {
        let column = Vector6::from_column_slice(column);
        square.ger(1.0, &column, &column, 1.0);
    }
    let Some(factors) = square.cholesky() else { return end.copy_from_slice(node) };
    let weights = factors.solve(&twist);
    let (mut squared, joints) = (0.0, robot.joints());
    for (x, column) in end.iter_mut().zip(&*columns) {
        *x = weights.dot(&Vector6::from_column_slice(column));
        squared += *x * *x;
    }
    let scale = size / f64::sqrt(squared).max(f64::MIN_POSITIVE);
    for ((x, from), joint) in end.iter_mut().zip(node).zip(joints) {
        *x = (from + scale * *x).clamp(joint.lower, joint.upper);
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::super::polyline::l2;
    use super::*;

    #[test]
    fn a_led_step_is_as_long_as_asked_and_moves_no_joint_in_vain() {
        let robot = Robot::gen3();
        let home = robot.pose("home").unwrap().to_vec();
        let jacobian = robot.jacobian(&home).unwrap();
        let mut random = StdRng::seed_from_u64(1);
        let mut end = vec![0.0; home.len()];
        for _ in 0..20 {
            led(&robot, &home, 0.2, &mut random, &mut end);
            assert!((l2(&home, &end) - 0.2).abs() < 1e-9);
            // Of all motions of the joints that move the tip alike none is shorter.
            let step =
                nalgebra::DVector::from_iterator(7, home.iter().zip(&end).map(|(a, b)| b - a));
            let twist = &jacobian * &step;
            let square = &jacobian * jacobian.transpose();
            let least = jacobian.transpose() * square.try_inverse().unwrap() * twist;
            assert!((least - &step).norm() < 1e-6);
        }
    }

    #[test]
    fn a_led_step_ends_inside_the_limits() {
        let robot = Robot::gen3();
        let mut edge = robot.pose("home").unwrap().to_vec();
        edge[1] = robot.joints()[1].upper;
        edge[3] = robot.joints()[3].lower;
        let mut random = StdRng::seed_from_u64(2);
        let mut end = vec![0.0; edge.len()];
        for _ in 0..50 {
            led(&robot, &edge, 0.7, &mut random, &mut end);
            assert_eq!(robot.outside_limits(&end, 0.0), None);
            assert!(l2(&edge, &end) > 0.01);
        }
    }
}
