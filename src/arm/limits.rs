//! The one gate before an arm: speed, acceleration, joint range, workspace, and the fingers' force.
//!
//! [`Limits::clear`] turns a [`Trajectory`] into a [`Cleared`] one, or says what is wrong with it. Every
//! arm takes only `Cleared`, whose field nobody else can fill, so no command goes round this file.

use serde::{Deserialize, Serialize};

use crate::motion::Robot;
use crate::motion::trajectory::{self, Sample, Trajectory};
use crate::world::Pose;
use crate::world::frame::{Base, World};

/// A trajectory that begins no farther than this from the last command begins there, rad. Chosen: a plan is kept so far off the ends of a
/// joint's range, and one step of it asks for 0.06 rad/s² within 4 ms and for 1 rad/s² within the millisecond of a stream.
const THERE: f64 = 1e-6;
/// How fast an arm is led to where a trajectory begins, as a share of full speed, acceleration and jerk. Chosen: as an arm is led to
/// where a rehearsed path begins; 0.02 rad take less than a third of a second.
const LEADING: f64 = 0.3;

/// A trajectory that has passed the limits.
///
/// Nobody else can make one: its field is private to this file.
///
/// ```compile_fail,E0451
/// use trueup::{arm::limits::Cleared, motion::trajectory::Trajectory};
/// let cleared = Cleared { trajectory: Trajectory::resting(&[0.0; 7]), led: 0.0 };
/// ```
#[derive(Debug, Clone)]
pub struct Cleared {
    trajectory: Trajectory,
    led: f64,
}

impl Cleared {
    /// Returns the trajectory: it begins at the last command.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Returns how long it leads from there to where what was to be cleared begins, s: none where it begins there.
    pub fn led(&self) -> f64 {
        self.led
    }
}

/// Where an arm that is led is to be a control period later, after it has passed the limits.
#[derive(Debug, Clone, PartialEq)]
pub struct ClearedTick {
    at: Sample,
}

impl ClearedTick {
    /// Returns joint positions, rad, speeds, rad/s, and what accelerations lead to these, rad/s².
    pub fn into_order(self) -> Sample {
        self.at
    }
}

/// A grip that has passed the limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClearedGrip {
    opening: f64,
    speed: f64,
    force: f64,
}

impl ClearedGrip {
    /// Returns the opening between the pads to go to, m.
    pub fn opening(&self) -> f64 {
        self.opening
    }

    /// Returns the speed of the opening, m/s.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Returns the most force of each pad, N.
    pub fn force(&self) -> f64 {
        self.force
    }
}

/// Bounds every command is held to.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Fraction of the robot's own speed and acceleration limits that may be used.
    pub scale: f64,
    /// The most a trajectory's first point may differ from the last command, rad: over so much the arm is led.
    pub jump: f64,
    /// The lowest the tool centre point may go, m above the table.
    pub floor: f64,
    /// The fastest the fingers may open or close, m/s.
    pub finger_speed: f64,
    /// The most force a pad may press with, N.
    pub finger_force: f64,
    /// The share of its full speed that the arm is held to. What a task may take is said for full speed, and
    /// is stretched as its motions are.
    pub pace: f64,
}

impl Default for Limits {
    fn default() -> Self {
        // 1.02 leaves room for the rounding of a trajectory timed exactly to its limits.
        // Speed and force are the 2F-85's: 150 mm/s and 235 N over both pads.
        Self {
            scale: 1.02,
            jump: 0.02,
            floor: 0.005,
            finger_speed: 0.15,
            finger_force: 117.5,
            pace: 1.0,
        }
    }
}

impl Limits {
    /// Clears a trajectory that begins at the last command `from`, rad, or says what is wrong with it. What begins a little
    /// beside it is led to first: a command never steps.
    ///
    /// Speeds, ranges and the tool's height are looked at every 10 ms: between two looks no joint turns
    /// further than 0.8 deg at the highest speed there is.
    ///
    /// # Errors
    ///
    /// The first thing found, with joint, time, value and limit.
    pub fn clear(
        &self,
        robot: &Robot,
        world_from_base: &Pose<World, Base>,
        trajectory: Trajectory,
        from: &[f64],
    ) -> Result<Cleared, LimitError> {
        let (trajectory, led) = self.led(robot, trajectory, from)?;
        let mut lowest = self.floor;
        let ticks = (trajectory.duration() / 0.01).ceil() as usize;
        for tick in 0..=ticks {
            let time_s = tick as f64 * 0.01;
            let at = trajectory.sample(time_s);
            // A joint that is a hair beyond its range is led back into it.
            self.within(robot, &at, time_s, (time_s < led).then_some(from))?;
            let height = height(robot, world_from_base, &at.q);
            if tick == 0 && height < lowest {
                // A tool that is below the floor already may leave it, and goes no lower than it is.
                lowest = height - 1e-6;
            }
            if height < lowest {
                let (height_mm, floor_mm) = (height * 1e3, self.floor * 1e3);
                return Err(LimitError::Floor { height_mm, floor_mm, time_s });
            }
        }
        Ok(Cleared { trajectory, led })
    }

    /// Has a trajectory begin at the last command `from`, rad, at rest: what begins elsewhere, by at most [`Self::jump`], begins with the
    /// way there. Returns it with how long that takes, s.
    fn led(
        &self,
        robot: &Robot,
        trajectory: Trajectory,
        from: &[f64],
    ) -> Result<(Trajectory, f64), LimitError> {
        if !from.iter().all(|q| q.is_finite()) {
            return Err(LimitError::NotFinite { time_s: 0.0 });
        }
        let begin = trajectory.sample(0.0).q;
        let (mut joint, mut gap) = (1, 0.0);
        for (i, (a, b)) in begin.iter().zip(from).enumerate() {
            if (a - b).abs() > gap {
                (joint, gap) = (i + 1, (a - b).abs());
            }
        }
        if gap <= THERE {
            return Ok((trajectory, 0.0));
        }
        let jump = LimitError::Jump { joint, jump_deg: gap.to_degrees() };
        if gap > self.jump {
            return Err(jump);
        }
        let limits = trajectory::Limits::of(robot).scaled(LEADING, LEADING);
        let lead = Trajectory::through_points(&[from.to_vec(), begin], &limits);
        let Ok(lead) = lead else { return Err(jump) };
        let led = lead.duration();
        lead.then(&trajectory).map(|whole| (whole, led)).map_err(|_| jump)
    }

    /// Clears where an arm that is led is to be one control period of `period` s after the last command `from` (rad and rad/s), `time_s`
    /// after it began to be led; or says what is wrong with it.
    ///
    /// # Errors
    ///
    /// The first thing found, as [`Self::clear`]; a jump is what no joint can turn in the period, or is farther from where its speeds lead
    /// than its acceleration brings it in one.
    pub fn clear_tick(
        &self,
        robot: &Robot,
        world_from_base: &Pose<World, Base>,
        [q, dq]: [Vec<f64>; 2],
        from: [&[f64]; 2],
        (time_s, period): (f64, f64),
    ) -> Result<ClearedTick, LimitError> {
        let ddq = dq.iter().zip(from[1]).map(|(now, before)| (now - before) / period).collect();
        let at = Sample { q, dq, ddq };
        self.within(robot, &at, time_s, None)?;
        for (i, limit) in robot.joints().iter().enumerate() {
            let way = at.q[i] - from[0][i];
            // What both speeds make of the period, and what one tick at the limits brings.
            let off = way - 0.5 * period * (at.dq[i] + from[1][i]);
            let (fastest, hardest) =
                (limit.velocity * period, limit.acceleration * period * period);
            if way.abs() > fastest * self.scale + 1e-9 || off.abs() > hardest * self.scale + 1e-9 {
                return Err(LimitError::Jump { joint: i + 1, jump_deg: way.abs().to_degrees() });
            }
        }
        let (is, was) =
            (height(robot, world_from_base, &at.q), height(robot, world_from_base, from[0]));
        if is < self.floor && is < was - 1e-6 {
            let (height_mm, floor_mm) = (is * 1e3, self.floor * 1e3);
            return Err(LimitError::Floor { height_mm, floor_mm, time_s });
        }
        Ok(ClearedTick { at })
    }

    /// Whether joint positions, speeds and accelerations are some that the robot has and may use; a joint may be as far
    /// beyond its range as it is at `from`, rad.
    fn within(
        &self,
        robot: &Robot,
        at: &Sample,
        time_s: f64,
        from: Option<&[f64]>,
    ) -> Result<(), LimitError> {
        if at.q.iter().chain(&at.dq).any(|value| !value.is_finite()) {
            return Err(LimitError::NotFinite { time_s });
        }
        for (i, limit) in robot.joints().iter().enumerate() {
            let (q, dq) = (at.q[i], at.dq[i].abs());
            let (lower, upper) = from.map_or((limit.lower, limit.upper), |from| {
                (limit.lower.min(from[i]), limit.upper.max(from[i]))
            });
            if q < lower - 1e-9 || q > upper + 1e-9 {
                return Err(LimitError::Range {
                    joint: i + 1,
                    time_s,
                    value_deg: q.to_degrees(),
                    lower_deg: limit.lower.to_degrees(),
                    upper_deg: limit.upper.to_degrees(),
                });
            }
            if dq > limit.velocity * self.scale {
                return Err(LimitError::Speed {
                    joint: i + 1,
                    time_s,
                    value_deg_s: dq.to_degrees(),
                    limit_deg_s: limit.velocity.to_degrees(),
                });
            }
        }
        for (i, limit) in robot.joints().iter().enumerate() {
            let ddq = at.ddq[i].abs();
            if ddq > limit.acceleration * self.scale {
                return Err(LimitError::Acceleration {
                    joint: i + 1,
                    time_s,
                    value_deg_s2: ddq.to_degrees(),
                    limit_deg_s2: limit.acceleration.to_degrees(),
                });
            }
        }
        Ok(())
    }

    /// Clears a move of the fingers to `opening` m at `speed` m/s with at most `force` N a pad.
    ///
    /// # Errors
    ///
    /// [`LimitError::Fingers`] for what the gripper cannot or may not do.
    pub fn clear_grip(
        &self,
        robot: &Robot,
        opening: f64,
        speed: f64,
        force: f64,
    ) -> Result<ClearedGrip, LimitError> {
        let widest = robot.max_opening();
        let within = |what: Fingers, value: f64, limit: f64| {
            // NaN is in no range.
            if (0.0..=limit).contains(&value) {
                Ok(())
            } else {
                Err(LimitError::Fingers { what, value, limit })
            }
        };
        within(Fingers::Opening, opening, widest + 1e-9)?;
        within(Fingers::Speed, speed, self.finger_speed)?;
        within(Fingers::Force, force, self.finger_force)?;
        Ok(ClearedGrip { opening, speed, force })
    }
}

/// Returns how high the tool is above the table at `q`, m.
fn height(robot: &Robot, world_from_base: &Pose<World, Base>, q: &[f64]) -> f64 {
    let base_from_tool = robot.forward_tool(q).expect("a command has one angle per joint");
    (*world_from_base * base_from_tool).origin().z
}

/// What of the fingers is limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fingers {
    /// The opening between the pads, m.
    Opening,
    /// Its speed, m/s.
    Speed,
    /// The force of each pad, N.
    Force,
}

impl Fingers {
    /// Returns the unit it is counted in.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Opening => "m",
            Self::Speed => "m/s",
            Self::Force => "N",
        }
    }

    fn verb(self) -> &'static str {
        match self {
            Self::Opening => "go to",
            Self::Speed => "move at",
            Self::Force => "press with",
        }
    }
}

/// Why a trajectory may not be followed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum LimitError {
    /// It asks for a joint position outside the joint's range.
    #[error(
        "joint {joint} would go to {value_deg:.1} deg at {time_s:.2} s; its range is {lower_deg:.1} to {upper_deg:.1} deg"
    )]
    Range {
        /// Joint number from 1.
        joint: usize,
        /// When, s.
        time_s: f64,
        /// What is asked for, degrees.
        value_deg: f64,
        /// Lower end of the range, degrees.
        lower_deg: f64,
        /// Upper end of the range, degrees.
        upper_deg: f64,
    },
    /// It asks for too much speed.
    #[error(
        "joint {joint} would turn at {value_deg_s:.1} deg/s at {time_s:.2} s; its limit is {limit_deg_s:.1} deg/s"
    )]
    Speed {
        /// Joint number from 1.
        joint: usize,
        /// When, s.
        time_s: f64,
        /// What is asked for, deg/s.
        value_deg_s: f64,
        /// The limit, deg/s.
        limit_deg_s: f64,
    },
    /// It asks for too much acceleration.
    #[error(
        "joint {joint} would accelerate at {value_deg_s2:.0} deg/s² at {time_s:.2} s; its limit is {limit_deg_s2:.0} deg/s²"
    )]
    Acceleration {
        /// Joint number from 1.
        joint: usize,
        /// When, s.
        time_s: f64,
        /// What is asked for, deg/s².
        value_deg_s2: f64,
        /// The limit, deg/s².
        limit_deg_s2: f64,
    },
    /// It asks too much of the fingers.
    #[error(
        "the fingers would have to {} {value:.3} {unit}; the limit is {limit:.3} {unit}", .what.verb(), unit = .what.unit()
    )]
    Fingers {
        /// Of what.
        what: Fingers,
        /// What is asked for.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// It does not begin where the arm is.
    #[error("the path begins {jump_deg:.1} deg from where joint {joint} is")]
    Jump {
        /// Joint number from 1.
        joint: usize,
        /// How far off, degrees.
        jump_deg: f64,
    },
    /// It leads the tool into the table.
    #[error(
        "the tool would go to {height_mm:.0} mm above the table at {time_s:.2} s; the limit is {floor_mm:.0} mm"
    )]
    Floor {
        /// Height of the tool centre point, mm.
        height_mm: f64,
        /// The lowest allowed, mm.
        floor_mm: f64,
        /// When, s.
        time_s: f64,
    },
    /// It is not a number.
    #[error("the path is not a number at {time_s:.2} s")]
    NotFinite {
        /// When, s.
        time_s: f64,
    },
}
