//! The closed loop of arm and controller, simulated from the commands.
//!
//! Each tick the controller asks for torques from what the encoders see, the bodies answer as the plant
//! is linearised along the path, and what acts in the joints is solved implicitly where it is stiff: thick
//! fluids, dry friction, and gaps between motor and link. Source: Stewart and Trinkle 1996.

use std::sync::Arc as Shared;

use super::super::chain::MOST_JOINTS;
use super::super::plant::Course;
use super::active::ActiveEffects;
use super::friction::{Gapped, Loop, Smooth};
use super::model::{GridPoint, JointMotion, Model, Motion};
use crate::discovery::recording::sidecar::Controller;
use crate::discovery::selection::ParameterSpec;

const fn own(
    name: &'static str,
    unit: &'static str,
    scale: f64,
    range: (f64, f64),
) -> ParameterSpec {
    ParameterSpec { name, unit, scale, range, neutral: None, least: 0.0 }
}

/// What is known neither of an arm nor of who simulates one, with the values to begin from; both are fitted beside any effects.
///
/// How far it moves within a tick by an acceleration `a`: this part of `a·tick²`. Half of it is the continuous arm, all of it a
/// simulator that takes one semi-implicit step a tick; two half steps are between. At 1 rad/s the two differ by more than an
/// encoder's noise. And how fast a joint caught by dry friction comes to rest: within a hundredth of a second or so, as gears
/// that give a little and the soft constraints of simulators do.
pub(super) const OWN: [(ParameterSpec, f64); 2] = [
    (own("stepping", "", 0.1, (0.5, 1.0)), 0.75),
    (own("stopping", "1/s", 5.0, (20.0, 1000.0)), 100.0),
];

/// A motor without rotor inertia would be nowhere in its gap; this is less than any, kg·m².
const LEAST_ROTOR: f64 = 1e-3;

/// One number a joint.
type Joints = [f64; MOST_JOINTS];

/// What encoders and torque sensors would read at one instant.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// Position of the motor's side of each joint, rad.
    q: Joints,
    dq: Joints,
    tau: Joints,
    load: Joints,
    /// Where the link stands beyond its encoder, rad.
    gap: Joints,
}

/// The simulation at one instant.
struct Run<'a> {
    course: &'a Course,
    controller: &'a Controller,
    armature: &'a [f64],
    active: &'a ActiveEffects,
    /// Ticks are divided by this where contact is lost and made again, which a millisecond is coarse for.
    fine: usize,
    tick: f64,
    /// The part of `a·tick²` that an acceleration adds to an angle.
    part: f64,
    /// How fast dry friction brings a joint to rest, 1/s.
    stop: f64,
    loops: Vec<Loop>,
    gapped: Vec<Gapped>,
    /// The links' positions, rad, and speeds, rad/s.
    q: Joints,
    dq: Joints,
    /// How far zero errors and soft gears put a link from where its joint says, rad.
    flex: Joints,
    now: Reading,
    last: Reading,
    /// What is read at each row that has passed.
    rows: Vec<Reading>,
}

/// Simulates arm and controller from the commands. `None` without a controller, or if the motion runs
/// away.
pub(super) fn simulate(model: &Model, active: &ActiveEffects, own: &[f64]) -> Option<Motion> {
    let course = &model.course;
    let mut run = Run::begin(model, active, own)?;
    for k in 0..course.ticks * run.fine {
        let time = course.plant.start + k as f64 * run.tick;
        // Where the reference and the bodies along it stand at this instant.
        let late = (time - active.delay - course.plant.start).max(0.0);
        let here = GridPoint::at(&course.plant, course.plant.start + late);
        if k % (course.hold * run.fine) == 0 {
            run.control(here, late);
        }
        run.record(time);
        if run.rows.len() == course.data.n_rows() {
            break;
        }
        let since = time - course.data.time[0];
        let mut friction = run.pushes(since);
        // The bodies are where the path says; only a path that is the command's own comes as late.
        let bodies = if course.follows_command { here } else { GridPoint::at(&course.plant, time) };
        let mut ddq = run.accelerations(bodies, &friction);
        let inverse = run.inverse_mass(bodies);
        run.thick_fluid(inverse, &mut ddq, &mut friction);
        run.dry_friction(since, inverse, &mut ddq, &mut friction);
        run.gaps(inverse, &mut ddq, &friction);
        run.advance(&ddq, &friction);
        if !run.q[..course.plant.n].iter().all(|angle| angle.abs() < 1e4) {
            return None;
        }
    }
    Some(run.motion())
}

impl<'a> Run<'a> {
    /// Lays the arm at the start of its reference. `None` without a controller.
    fn begin(model: &'a Model, active: &'a ActiveEffects, own: &[f64]) -> Option<Self> {
        let course = &model.course;
        let n = course.plant.n;
        let (mut q, mut dq) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        q[..n].copy_from_slice(&course.reference[..n]);
        dq[..n].copy_from_slice(&course.reference_speed[..n]);
        let gapped: Vec<Gapped> = (0..n)
            .filter(|&j| active.play[j] > 0.0)
            .map(|j| Gapped {
                joint: j,
                width: active.play[j],
                rotor: model.arm.armature[j].max(LEAST_ROTOR),
                angle: q[j],
                speed: dq[j],
            })
            .collect();
        let fine = if gapped.is_empty() { 1 } else { 2 };
        let [part, stop] = std::array::from_fn(|i| own.get(i).copied().unwrap_or(OWN[i].1));
        // Two half ticks that together move as far.
        let part = if fine == 1 { part } else { 2.0 * part - 0.5 };
        let none = [0.0; MOST_JOINTS];
        let now = Reading { q, dq, tau: none, load: none, gap: none };
        Some(Self {
            course,
            controller: model.arm.controller.as_ref()?,
            armature: &model.arm.armature,
            active,
            fine,
            tick: course.tick / fine as f64,
            part,
            stop,
            loops: active.loops.clone(),
            gapped,
            q,
            dq,
            flex: active.zero,
            now,
            last: now,
            rows: Vec::with_capacity(course.data.n_rows()),
        })
    }

    /// Returns what was read, joint by joint; rows after the last command are 0.
    fn motion(mut self) -> Motion {
        let none = [0.0; MOST_JOINTS];
        let still = Reading { q: none, dq: none, tau: none, load: none, gap: none };
        self.rows.resize(self.course.data.n_rows(), still);
        let of = |of: fn(&Reading) -> &Joints, j: usize| -> Vec<f64> {
            self.rows.iter().map(|row| of(row)[j]).collect()
        };
        let joint = |j| {
            Shared::new(JointMotion {
                q: Shared::new(of(|row| &row.q, j)),
                dq: Shared::new(of(|row| &row.dq, j)),
                tau: of(|row| &row.tau, j),
                load: Shared::new(of(|row| &row.load, j)),
                gap: of(|row| &row.gap, j),
            })
        };
        Motion { joints: (0..self.course.plant.n).map(joint).collect() }
    }

    /// The controller asks for torques, from what the encoders see; `late` is the time since the start
    /// that its commands have reached, s.
    fn control(&mut self, here: GridPoint, late: f64) {
        let Course { plant, reference, reference_speed, .. } = self.course;
        let with_gravity = self.controller.kind != "pd";
        let (kp, kd) = (&self.controller.kp_nm_per_rad, &self.controller.kd_nm_s_per_rad);
        let n = plant.n;
        let at = (late / self.course.tick).min((self.course.ticks - 2) as f64);
        let index = at as usize;
        let there = GridPoint { n, index, part: at - index as f64 };
        let (q, dq) = (there.all(reference), there.all(reference_speed));
        let feedforward = here.all(&plant.feedforward);
        for j in 0..n {
            let mut asked = kp[j] * (q[j] - self.now.q[j]) + kd[j] * (dq[j] - self.now.dq[j]);
            if with_gravity {
                asked += feedforward[j];
            }
            self.now.tau[j] = asked.clamp(-self.active.limit[j], self.active.limit[j]);
        }
    }

    /// Writes the rows of the recording that have passed, and keeps what is read now for the next.
    fn record(&mut self, time: f64) {
        let data = &self.course.data;
        let (now, last) = (&self.now, &self.last);
        while let Some(at) = data.time.get(self.rows.len()).filter(|at| **at <= time + 1e-9) {
            // Rows between two ticks are interpolated; most fall on one.
            let back = ((time - at) / self.tick).clamp(0.0, 1.0);
            let between = |now: &Joints, last: &Joints| -> Joints {
                std::array::from_fn(|j| now[j] - back * (now[j] - last[j]))
            };
            self.rows.push(Reading {
                q: between(&now.q, &last.q),
                dq: between(&now.dq, &last.dq),
                tau: between(&now.tau, &last.tau),
                load: between(&now.load, &last.load),
                gap: between(&now.gap, &last.gap),
            });
        }
        self.last = self.now;
    }

    /// Returns the torques of everything in the joints that is not stiff, N·m.
    fn pushes(&mut self, time: f64) -> Joints {
        let mut friction = [0.0; MOST_JOINTS];
        for &(j, law) in &self.active.smooth {
            if !matches!(law, Smooth::Viscous(_)) {
                friction[j] += law.torque(self.now.q[j], self.now.dq[j], time, self.now.load[j]);
            }
        }
        for each in &mut self.loops {
            let (j, speed) = (each.joint, self.now.dq[each.joint]);
            friction[j] -= each.torque * each.z;
            let rate = (speed - speed.abs() * each.z * each.z.abs()) / each.width;
            each.z = (each.z + self.tick * rate).clamp(-1.0, 1.0);
        }
        friction
    }

    /// Returns the accelerations that the torque beyond what the path needs gives, `M q̈ = push`, rad/s².
    fn accelerations(&self, here: GridPoint, friction: &Joints) -> Joints {
        let plant = &self.course.plant;
        let n = plant.n;
        let (mut push, mut ddq) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        let (mut off, mut off_speed) = ([0.0; MOST_JOINTS], [0.0; MOST_JOINTS]);
        let (bias, q, dq) = (here.all(&plant.bias), here.all(&plant.q), here.all(&plant.dq));
        for j in 0..n {
            push[j] = self.active.gain[j] * self.now.tau[j] - bias[j];
            off[j] = self.q[j] + self.flex[j] - q[j];
            off_speed[j] = self.dq[j] - dq[j];
        }
        if !self.active.needed.is_empty() {
            let needed = here.all(&self.active.needed);
            for j in 0..n {
                push[j] -= needed[j];
            }
        }
        let square = here.index * n * n..(here.index + 1) * n * n;
        let (stiffness, damping) = (&plant.stiffness[square.clone()], &plant.damping[square]);
        for i in 0..n {
            let (stiffness, damping) = (&stiffness[i * n..][..n], &damping[i * n..][..n]);
            let mut back = 0.0;
            for j in 0..n {
                back += stiffness[j] * off[j] + damping[j] * off_speed[j];
            }
            push[i] += friction[i];
            push[i] -= back;
        }
        let inverse = self.inverse_mass(here);
        for i in 0..n {
            let inverse = &inverse[i * n..][..n];
            for j in 0..n {
                ddq[i] += inverse[j] * push[j];
            }
        }
        ddq
    }

    /// Returns the inverse of the mass matrix here, `n × n`.
    fn inverse_mass(&self, here: GridPoint) -> &'a [f64] {
        let n = self.course.plant.n;
        &self.course.plant.inverse_mass[here.index * n * n..(here.index + 1) * n * n]
    }

    /// Adds a torque at joint `j` to the accelerations.
    fn push(inverse: &[f64], ddq: &mut Joints, n: usize, j: usize, torque: f64) {
        for (i, acceleration) in ddq[..n].iter_mut().enumerate() {
            *acceleration += inverse[i * n + j] * torque;
        }
    }

    /// Fluid friction, implicitly: a thick fluid on a light joint is stiff.
    fn thick_fluid(&self, inverse: &[f64], ddq: &mut Joints, friction: &mut Joints) {
        let n = self.course.plant.n;
        for &(j, law) in &self.active.smooth {
            if let Smooth::Viscous(c) = law {
                let ahead = self.part * self.tick;
                let own = inverse[j * n + j] * ahead;
                let torque = -c * (self.now.dq[j] + ahead * ddq[j]) / (1.0 + c * own);
                friction[j] += torque;
                Self::push(inverse, ddq, n, j, torque);
            }
        }
    }

    /// Dry friction, joint by joint, `time` s after the first row.
    fn dry_friction(&self, time: f64, inverse: &[f64], ddq: &mut Joints, friction: &mut Joints) {
        let n = self.course.plant.n;
        for dry in &self.active.dry {
            let j = dry.joint;
            let own = inverse[j * n + j] * self.tick;
            let free = self.dq[j] + self.tick * ddq[j];
            let now = &self.now;
            let here = dry.at(now.q[j], now.dq[j], time, now.load[j]);
            let torque = here.held(self.dq[j], free, own, (self.tick, self.stop));
            friction[j] += torque;
            Self::push(inverse, ddq, n, j, torque);
        }
    }

    /// The link of a joint with a gap swings free of its rotor, unless that would leave the gap: then the
    /// impulse between the two keeps it inside (Stewart and Trinkle's time stepping).
    fn gaps(&mut self, inverse: &[f64], ddq: &mut Joints, friction: &Joints) {
        let n = self.course.plant.n;
        let tick = self.tick;
        for gap in &mut self.gapped {
            let j = gap.joint;
            let own = inverse[j * n + j];
            let motor = self.active.gain[j] * self.now.tau[j] + friction[j];
            let share = (1.0 - gap.rotor * own).max(1e-3);
            // Without rotor and motor torque: the inverse of the mass matrix less the rotor.
            Self::push(inverse, ddq, n, j, (ddq[j] * gap.rotor - motor) / share);
            let free = self.dq[j] + tick * ddq[j] - (gap.speed + tick * motor / gap.rotor);
            let offset = self.q[j] - gap.angle;
            let half = 0.5 * gap.width;
            let kept = free.clamp((-half - offset) / tick, (half - offset) / tick);
            let link_own = own / share;
            let through = (kept - free) / (tick * (link_own + 1.0 / gap.rotor));
            Self::push(inverse, ddq, n, j, through / share);
            gap.speed += tick * (motor - through) / gap.rotor;
            gap.angle += tick * gap.speed;
            self.now.load[j] = through;
        }
    }

    /// Moves the joints by one tick.
    fn advance(&mut self, ddq: &Joints, friction: &Joints) {
        let tick = self.tick;
        for j in 0..self.course.plant.n {
            // What goes through the gear: the motor's torque and what acts beside it, less what turns the
            // rotor.
            if self.active.play[j] <= 0.0 {
                let motor = self.active.gain[j] * self.now.tau[j] + friction[j];
                self.now.load[j] = motor - self.armature[j] * ddq[j];
            }
            self.q[j] += tick * (self.dq[j] + self.part * tick * ddq[j]);
            self.dq[j] += tick * ddq[j];
            self.flex[j] = self.active.zero[j] - self.active.compliance[j] * self.now.load[j];
        }
        (self.now.q, self.now.dq) = (self.q, self.dq);
        // The encoders see the motor's side of a gap.
        for gap in &self.gapped {
            let j = gap.joint;
            self.now.q[j] = gap.angle;
            self.now.dq[j] = gap.speed;
            self.now.gap[j] = self.q[j] - gap.angle;
        }
    }
}
