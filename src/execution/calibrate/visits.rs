//! Where the touch-off brings the hand: points over the table, and how the hand is turned at each.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

use nalgebra::{Vector2, Vector3};

use crate::world::frame::{Tool, World};
use crate::world::{Camera, Point, Pose, Scene};

use super::super::plan::side_pose;

/// Bearings of the points to visit from the base, rad, and their distances from it, m: on the table where a level
/// hand comes low and high (0.5 to 0.72 m, and 6 cm before it), and 32 deg to either side, which is 0.33 m across at
/// the far end, as wide as the marks on the table of the kitchen. Chosen: at half of it turns of the base are not
/// told from shifts; at twice it points are behind the arm or out of its reach (0.9 m with the arm straight).
const BEARINGS: [f64; 5] = [-0.55, -0.28, 0.0, 0.28, 0.55];
const DISTANCES: [f64; 3] = [0.44, 0.54, 0.64];
/// Heights of the points over the table, m, and how much higher the second round is. Chosen: from a grasp of a jar of
/// 14 cm lifted clear to where it is poured from; at half of it the hand is among the objects, at twice it the arm is
/// where it never works, and joint 4 ends where a level hand is 0.275 m high at 0.5 m (a base on the table). A point that
/// is out of reach is passed over. By inverse kinematics the stdlib's three arms reach 27 to 30 of the thirty from a base
/// 0.3 m below the table to 0.4 m over it.
const HEIGHTS: [f64; 3] = [0.17, 0.23, 0.29];
const HIGHER: f64 = 0.07;
/// Turns of the hand from its bearing, rad, and its pitches: a zero of a joint or a gripper beside its place shows
/// only when the hand turns. Chosen: 52 deg is what a grasp from aside or a pour has; at half of it shift and turn of
/// the gripper are told apart half as well, at twice it the hand points back to the base and the arm is in the
/// picture before its ball.
const ASIDE: [f64; 5] = [0.0, 0.9, -0.9, 0.45, -0.45];
const PITCHES: [f64; 2] = [0.0, 0.35];
/// Pitches of a hand that cannot be had level, rad: straight down is all that a SCARA can, and 60 deg turns the gripper
/// against it for an arm that can do both.
const STEEP: [f64; 2] = [FRAC_PI_3, FRAC_PI_2];
/// Further turns of a steep hand, rad, until its ball is on the camera's side: a quarter turn leaves it within 45 deg of that.
const TURNED: [f64; 4] = [0.0, FRAC_PI_2, -FRAC_PI_2, PI];

/// A point to visit, and how the hand should be there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Visit {
    /// Where the tool comes to, m, world.
    at: Vector3<f64>,
    /// Where the hand points seen from above, rad.
    heading: f64,
    /// How far down it points, rad.
    pitch: f64,
    /// Which of the steep pitches is tried first.
    steep_first: usize,
}

impl Visit {
    /// Returns the tool pose of a hand that is level, or nearly.
    pub(super) fn level(&self) -> Pose<World, Tool> {
        side_pose(self.at, self.heading, self.pitch)
    }

    /// Returns the tool poses of a steep hand at this point at which the ball on it, at `marker` m, is on the camera's side,
    /// best first.
    pub(super) fn steep(&self, marker: Point<Tool>, camera: &Camera) -> Vec<Pose<World, Tool>> {
        let pitches = (0..STEEP.len()).map(|k| STEEP[(k + self.steep_first) % STEEP.len()]);
        let poses = pitches.flat_map(|pitch| {
            TURNED.map(|turned| side_pose(self.at, self.heading + turned, pitch))
        });
        poses.filter(|pose| is_before_hand(pose, marker, camera)).collect()
    }
}

/// Whether the camera is on that side of the hand on which its ball sits: the hand, which is on the other side of it, hides
/// nothing then. A ball on the hand's axis is on every side.
fn is_before_hand(tool: &Pose<World, Tool>, marker: Point<Tool>, camera: &Camera) -> bool {
    let outward = tool.rotation() * Vector3::new(marker.coords().x, marker.coords().y, 0.0);
    let to_camera = camera.world_from_camera.origin() - (*tool * marker).coords();
    outward.dot(&to_camera) >= 0.0
}

/// Points over the table, near and far, left and right, low and high, the hand ahead and aside, level and
/// pitched down: as it will come to take and to pour, since an error is known where it was looked at.
pub(super) fn visits(scene: &Scene) -> Vec<Visit> {
    let base = scene.world_from_base.origin().xy();
    let mut visits = Vec::new();
    // The second round, higher and turned otherwise, is for what stands in the way of the first.
    for (round, higher) in [(0, 0.0), (1, HIGHER)] {
        for (i, bearing) in BEARINGS.into_iter().enumerate() {
            for (j, reach) in DISTANCES.into_iter().enumerate() {
                let height = HEIGHTS[(i + j) % HEIGHTS.len()] + higher;
                let aside = ASIDE[(2 * i + 3 * j + 2 * round) % ASIDE.len()];
                let pitch = PITCHES[(i + j) % PITCHES.len()];
                let at = base + reach * Vector2::new(bearing.cos(), bearing.sin());
                let at = Vector3::new(at.x, at.y, height);
                visits.push(Visit { at, heading: bearing + aside, pitch, steep_first: i + j });
            }
        }
    }
    visits
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene;
    use super::*;

    /// On a pedestal of 40 cm the hand was shown to a camera that looks at the table from beside it, where it saw none of 27 points;
    /// of a base 20 cm below the table all but four were in the table.
    #[test]
    fn points_are_over_the_table_wherever_the_base_is() {
        let on_table = visits(&scene(Vector3::zeros()));
        for z in [0.4, -0.2] {
            let base = Vector3::new(0.1, -0.2, z);
            for (at, level) in visits(&scene(base)).iter().zip(&on_table) {
                let by = at.level().origin() - level.level().origin();
                assert!((by - Vector3::new(0.1, -0.2, 0.0)).norm() < 1e-12, "{by}");
            }
        }
    }

    /// A SCARA was asked for level hands alone, of which it takes none.
    #[test]
    fn each_point_has_steep_hands_whose_ball_is_before_them_wherever_the_camera_is() {
        let on_table = scene(Vector3::zeros());
        let lens = on_table.camera.intrinsics;
        let looked_at = Vector3::new(0.55, 0.0, 0.2);
        let marker = Point::<Tool>::new(0.0, 0.06, -0.058);
        for (x, y) in [(1.4, 0.0), (-0.4, 0.1), (0.5, 1.0), (0.6, -1.0)] {
            let camera = Camera::looking(lens, Vector3::new(x, y, 0.9), looked_at);
            for visit in visits(&on_table) {
                let steep = visit.steep(marker, &camera);
                let down = steep.iter().filter(|pose| pose.axis(2).z < -0.999);
                assert!(down.count() > 0, "{visit:?}");
                for pose in &steep {
                    assert!((pose.origin() - visit.at).norm() < 1e-12);
                    // From the tool's axis to the ball, seen from above, is towards the camera.
                    let ball = (*pose * marker).coords();
                    let middle = pose.origin() - 0.058 * pose.axis(2);
                    let eye = camera.world_from_camera.origin();
                    assert!((ball - eye).norm() < (middle - eye).norm(), "{visit:?}");
                }
            }
        }
        // With the camera ahead of the arm the hand stays as it is turned, and turns from point to point.
        let ahead: Vec<f64> = visits(&on_table)
            .iter()
            .map(|visit| visit.steep(marker, &on_table.camera)[0].axis(1).xy().normalize().x)
            .collect();
        let (least, most) =
            ahead.iter().fold((1.0_f64, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
        assert!(least < 0.7 && most > 0.95, "{least} to {most}");
    }
}
