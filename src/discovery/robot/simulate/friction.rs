//! Laws of a joint: dry friction that holds, friction that remembers, gaps, and torques of its state.
//!
//! Dry friction holds a joint that it can hold: the torque that would stop the joint within a step,
//! limited to the friction's level, as in a contact solver. Source: Stewart and Trinkle 1996.

use super::super::term::Feature;

/// Beyond this `tanh` is 1 and `exp(-x)` of 1 is nothing, to double precision: both are called for every joint of every row.
const FADED: f64 = 40.0;

/// Returns `tanh x`.
pub(super) fn bent(x: f64) -> f64 {
    if x.abs() > FADED { x.signum() } else { x.tanh() }
}

/// What the level of dry friction goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum By {
    /// Nothing: it stays.
    Nothing,
    /// It fades as a gear warms up, within so many s.
    Fading(f64),
    /// A state of the joint.
    State(Feature),
}

/// Dry friction: level over speed, per direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dry {
    pub(super) joint: usize,
    pub(super) forward: f64,
    pub(super) backward: f64,
    /// Peak above the level and the speed at which it dies.
    pub(super) peak: f64,
    pub(super) velocity: f64,
    /// Below this speed it gives way, rad/s.
    pub(super) creep: f64,
    /// Whether it gives way evenly and then holds its level (a contact solver's friction) rather than
    /// bending smoothly.
    pub(super) sharp: bool,
    /// What its level goes by.
    pub(super) by: By,
}

impl Dry {
    /// Returns it as it is at a moment, its level that of a joint at `q` that bears `load`, N·m.
    pub(super) fn at(&self, q: f64, dq: f64, time: f64, load: f64) -> Self {
        let part = match self.by {
            By::Nothing => return *self,
            By::Fading(tau) => (-time / tau).exp(),
            By::State(feature) => feature.value(q, dq, time, load),
        };
        Self { forward: part * self.forward, backward: part * self.backward, ..*self }
    }

    /// Returns the torque against the motion, its peak judged at `dq`, its creep at `speed`.
    pub(super) fn torque(&self, dq: f64, speed: f64) -> f64 {
        -self.level(dq, speed) * bent(speed / self.creep)
    }

    /// Returns the level in the direction of a speed, with what is left of the peak at `dq`, N·m.
    pub(super) fn level(&self, dq: f64, speed: f64) -> f64 {
        (if speed > 0.0 { self.forward } else { self.backward }) + self.peak_at(dq)
    }

    /// Returns what is left of the peak at a speed, N·m.
    fn peak_at(&self, dq: f64) -> f64 {
        let share = (dq / self.velocity).powi(2);
        if self.peak == 0.0 || share > FADED { 0.0 } else { self.peak * (-share).exp() }
    }

    /// Returns the torque over a step in which the joint would reach the speed `free` without friction;
    /// `own` is the speed that 1 N·m adds in the step, of `tick` s, and `stop` how fast it is brought to rest, 1/s. Implicit, since
    /// a creep is stiff.
    pub(super) fn held(&self, dq: f64, free: f64, own: f64, (tick, stop): (f64, f64)) -> f64 {
        let level = self.level(dq, free);
        if level <= 1e-12 {
            return self.torque(dq, free);
        }
        let slope = own * level / self.creep;
        if self.sharp {
            // A soft stop: the torque that would end the motion within 1/stop, less what gives way.
            let inverse = own / tick;
            let ended = (free - dq) / tick + stop * dq;
            return -(ended / (inverse + self.creep * stop / level)).clamp(-level, level);
        }
        // Newton's method on v = free - own·level·tanh(v/creep), a monotone equation; begun where the
        // tanh is straight or flat.
        let mut v = if free.abs() > own * level + self.creep {
            free - own * level * free.signum()
        } else {
            free / (1.0 + slope)
        };
        for _ in 0..3 {
            let tanh = bent(v / self.creep);
            let error = v - free + own * level * tanh;
            v -= error / (1.0 + slope * (1.0 - tanh * tanh));
        }
        -level * bent(v / self.creep)
    }
}

/// Friction that remembers the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Loop {
    pub(super) joint: usize,
    pub(super) torque: f64,
    pub(super) width: f64,
    pub(super) z: f64,
}

impl Loop {
    /// Carries its state over `span` s at a speed and returns it, -1 to 1.
    pub(super) fn carried(&mut self, span: f64, dq: f64) -> f64 {
        let span = span.max(0.0);
        // Small steps: the state turns within its width.
        let steps = ((span * dq.abs() / (0.2 * self.width)).ceil()).clamp(1.0, 1e4);
        let h = span / steps;
        for _ in 0..steps as usize {
            let rate = (dq - dq.abs() * self.z * self.z.abs()) / self.width;
            self.z = (self.z + h * rate).clamp(-1.0, 1.0);
        }
        self.z
    }
}

/// A joint with a gap between motor and link, and where its motor stands: the link's angle is the
/// joint's own.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gapped {
    pub(super) joint: usize,
    pub(super) width: f64,
    pub(super) rotor: f64,
    pub(super) angle: f64,
    pub(super) speed: f64,
}

/// A torque at a joint that depends on its state and time alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Smooth {
    Viscous(f64),
    Quadratic(f64),
    Ripple { sine: f64, cosine: f64, order: f64 },
    Periodic { sine: f64, cosine: f64, frequency: f64 },
    Stiffness(f64),
    Cubic(f64),
    Feature(Feature, f64),
    Above(f64, f64),
    Below(f64, f64),
    LoadRipple { sine: f64, cosine: f64, order: f64 },
    FadingFluid(f64, f64),
}

impl Smooth {
    /// Returns whether a spring between the links makes it: a cable, a hose, a balancer. That bypasses the gear, and what it pulls a
    /// sensor between gear and link does not bear; what gears and motors do, such a sensor does not see at all.
    pub(super) fn is_between_links(self) -> bool {
        matches!(self, Self::Stiffness(_) | Self::Cubic(_) | Self::Above(..) | Self::Below(..))
    }

    /// Returns the torque where the joint bears `load`, N·m.
    pub(super) fn torque(self, q: f64, dq: f64, time: f64, load: f64) -> f64 {
        match self {
            Self::Viscous(c) => -c * dq,
            Self::Quadratic(c) => -c * dq * dq.abs(),
            Self::Ripple { sine, cosine, order } => {
                let (s, c) = (order * q).sin_cos();
                sine * s + cosine * c
            }
            Self::Periodic { sine, cosine, frequency } => {
                let (s, c) = (std::f64::consts::TAU * frequency * time).sin_cos();
                sine * s + cosine * c
            }
            Self::Above(c, q0) => c * (q - q0).max(0.0),
            Self::Below(c, q0) => c * (q0 - q).max(0.0),
            Self::Stiffness(c) => -c * q,
            Self::Cubic(c) => -c * q * q * q,
            Self::LoadRipple { sine, cosine, order } => {
                let (s, c) = (order * q).sin_cos();
                load * (sine * s + cosine * c)
            }
            Self::FadingFluid(c, tau) => -c * dq * (-time / tau).exp(),
            Self::Feature(feature, c) => c * feature.value(q, dq, time, load),
        }
    }
}
