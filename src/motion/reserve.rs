//! How much room is kept to the ends of the joints' ranges, in the unit of each joint.

use super::robot::Robot;

/// Room to the ends of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reserve {
    /// Of a joint that turns, rad.
    pub turning: f64,
    /// Of a joint that slides, m.
    pub sliding: f64,
}

impl Reserve {
    /// Every range is used up to its ends.
    pub const NONE: Self = Self { turning: 0.0, sliding: 0.0 };

    /// Returns a share of it.
    #[must_use]
    pub const fn times(self, share: f64) -> Self {
        Self { turning: share * self.turning, sliding: share * self.sliding }
    }

    /// Returns what is kept of one entry of `q`, rad or m.
    pub fn of(self, robot: &Robot, joint: usize) -> f64 {
        if robot.slides(joint) { self.sliding } else { self.turning }
    }
}

impl Robot {
    /// Returns the first joint that is nearer to an end of its range than `reserve`, or past it, if any.
    pub fn at_an_end(&self, q: &[f64], reserve: Reserve) -> Option<usize> {
        (0..self.n_joints()).find(|&i| {
            let (joint, room) = (&self.joints[i], reserve.of(self, i));
            q[i] < joint.lower + room || q[i] > joint.upper - room
        })
    }

    /// Returns this robot with ranges narrower by `reserve` at each end, wide enough all the same for each
    /// of `within` that its own ranges hold.
    ///
    /// A range too narrow for that keeps its ends.
    #[must_use]
    pub fn with_reserve(mut self, reserve: Reserve, within: &[&[f64]]) -> Self {
        let rooms: Vec<f64> = (0..self.n_joints()).map(|i| reserve.of(&self, i)).collect();
        for (i, (joint, room)) in self.joints.iter_mut().zip(rooms).enumerate() {
            let values = || within.iter().filter_map(|q| q.get(i).copied());
            let lower = values().fold(joint.lower + room, f64::min).max(joint.lower);
            let upper = values().fold(joint.upper - room, f64::max).min(joint.upper);
            if lower < upper {
                (joint.lower, joint.upper) = (lower, upper);
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reserve_narrows_ranges_but_never_shuts_a_given_position_out() {
        let robot = Robot::gen3();
        let own: Vec<(f64, f64)> = robot.joints().iter().map(|j| (j.lower, j.upper)).collect();
        let mut near = vec![0.0; 7];
        near[3] = own[3].1 - 0.001;
        // Outside its own range a position stays outside.
        near[5] = own[5].0 - 0.2;
        let narrow = robot.with_reserve(Reserve { turning: 0.01, sliding: 0.5 }, &[&near]);
        for (i, joint) in narrow.joints().iter().enumerate() {
            let (lower, upper) = own[i];
            if joint.continuous {
                assert!(joint.lower.is_infinite() && joint.upper.is_infinite());
                continue;
            }
            let expected = match i {
                3 => (lower + 0.01, upper - 0.001),
                5 => (lower, upper - 0.01),
                _ => (lower + 0.01, upper - 0.01),
            };
            let off = (joint.lower - expected.0).abs() + (joint.upper - expected.1).abs();
            assert!(off < 1e-12, "joint {}: {} {}", i + 1, joint.lower, joint.upper);
        }
    }

    /// 30 mm at each end of a slide were kept as 0.03 rad of a joint that turns are.
    #[test]
    fn a_slide_keeps_its_own_reserve() {
        const SLIDE_AND_TURN: &str = r#"<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
          <joint name="s" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
            <limit lower="0" upper="0.4" velocity="1" effort="9"/></joint>
          <joint name="t" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
            <limit lower="-1" upper="1" velocity="1" effort="9"/></joint></robot>"#;
        let robot = Robot::from_urdf(SLIDE_AND_TURN, None).unwrap();
        let reserve = Reserve { turning: 0.03, sliding: 0.002 };
        assert_eq!(robot.at_an_end(&[0.397, 0.96], reserve), None);
        assert_eq!(robot.at_an_end(&[0.399, 0.0], reserve), Some(0));
        assert_eq!(robot.at_an_end(&[0.2, -0.98], reserve), Some(1));
        assert_eq!(robot.at_an_end(&[0.399, -0.98], reserve.times(0.1)), None);
        let narrow = robot.with_reserve(reserve, &[]);
        let ends: Vec<f64> = narrow.joints().iter().flat_map(|j| [j.lower, j.upper]).collect();
        for (end, expected) in ends.iter().zip([0.002, 0.398, -0.97, 0.97]) {
            assert!((end - expected).abs() < 1e-12, "{ends:?}");
        }
    }
}
