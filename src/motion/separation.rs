//! How near a ball that moves by itself is to the robot and what it holds.
//!
//! Only parts that joints move are looked at: how near it is to a pedestal no motion changes. Where the ball will be is said
//! elsewhere ([`super::sights`]), and what follows from how near it is.

use nalgebra::Vector3;

use super::collision::CollisionWorld;
use super::outward::outward;
use super::posture::Solids;

/// The parts of a robot that move, and what it holds.
#[derive(Debug, Clone)]
pub struct Separation {
    solids: Solids,
}

impl Separation {
    /// Takes over the robot, its opening and what it holds.
    pub fn of(world: &CollisionWorld<'_>) -> Self {
        let frames = world.frames();
        let moves = |link: usize| frames.links[link].0.is_some();
        let parts = world.watched_parts().map(|(link, bodies, _)| (link, bodies));
        Self { solids: Solids::of(frames, parts.filter(|(link, _)| moves(*link))) }
    }

    /// Returns the least distance at joint positions `q` (rad, one a joint) to a ball in the base, m; negative where it reaches into the robot,
    /// infinite where nothing moves.
    pub fn distance(&self, q: &[f64], centre: &Vector3<f64>, radius: f64) -> f64 {
        self.solids.at(q, |posture| {
            let apart = posture.bodies.iter().map(|body| outward(body, centre).distance - radius);
            apart.fold(f64::INFINITY, f64::min)
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::motion::Robot;
    use crate::motion::collision::Obstacle;
    use crate::motion::solid::Solid;

    #[test]
    fn it_is_the_exact_distance_to_what_moves() {
        let robot = Robot::gen3();
        let q = robot.pose("home").unwrap();
        let bare = Separation::of(&CollisionWorld::new(&robot));
        for (x, y, z, radius) in
            [(0.8, 0.1, 0.4, 0.1), (0.2, -0.5, 0.6, 0.05), (0.5, 0.3, 1.0, 0.2)]
        {
            let at = Vector3::new(x, y, z);
            let ball = Obstacle::new("ball", Solid::Sphere { radius }, Isometry3::from(at));
            let world = CollisionWorld::new(&robot).with(&[ball]);
            let exact = world.clearance(q).unwrap();
            let ours = bare.distance(q, &at, radius);
            // The nearest pair of all may be two links.
            assert!(ours >= exact.distance - 1e-6, "{ours} {exact:?}");
            if exact.second == "ball" {
                assert!((ours - exact.distance).abs() < 1e-6, "{ours} {exact:?}");
            }
        }
        // Beside the pedestal, which does not move.
        assert!(bare.distance(q, &Vector3::new(-0.15, 0.0, 0.05), 0.05) > 0.1);
    }
}
