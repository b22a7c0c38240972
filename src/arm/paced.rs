//! A plant that is stepped no faster than time passes: a simulated arm that moves as slowly as a real one.
//!
//! Between its steps nothing is waited for: while a plan is made, the plant's time stands still as ever.

use std::thread::sleep;
use std::time::Duration;

use super::ticked::Plant;
use super::{DeviceError, Feedback};

/// What may be owed before it is slept, s: a sleep is late by a tenth of a millisecond, which is then taken off the next.
const LEAST: f64 = 0.002;

/// A plant at the pace of a clock.
pub struct Paced<P> {
    plant: P,
    /// Returns seconds since some instant.
    clock: fn() -> f64,
    /// How much further the plant is than the clock, s; less than nothing when it cannot keep up.
    ahead: f64,
}

impl<P: Plant> Paced<P> {
    /// Holds a plant back by a clock, of which only differences are used, s.
    pub fn new(plant: P, clock: fn() -> f64) -> Self {
        Self { plant, clock, ahead: 0.0 }
    }
}

impl<P: Plant> Plant for Paced<P> {
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError> {
        self.plant.command(q, dq)
    }

    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError> {
        self.plant.aim(opening, speed, force)
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        let begin = (self.clock)();
        self.plant.advance(seconds)?;
        // What could not be kept up with is not hurried after.
        self.ahead = (self.ahead + seconds - ((self.clock)() - begin)).max(-LEAST);
        if self.ahead > LEAST {
            let begin = (self.clock)();
            sleep(Duration::from_secs_f64(self.ahead));
            self.ahead -= (self.clock)() - begin;
        }
        Ok(())
    }

    fn offers(&mut self, on: bool) {
        self.plant.offers(on);
    }

    fn refresh(&mut self) -> Result<(), DeviceError> {
        self.plant.refresh()
    }

    fn is_lost(&self) -> bool {
        self.plant.is_lost()
    }

    fn is_led_to_rest(&self) -> bool {
        self.plant.is_led_to_rest()
    }

    fn fingers_begin_within(&self) -> f64 {
        self.plant.fingers_begin_within()
    }

    fn most_behind(&self) -> Option<f64> {
        self.plant.most_behind()
    }

    fn is_ideal(&self) -> bool {
        self.plant.is_ideal()
    }

    fn hold(&mut self) -> Result<bool, DeviceError> {
        self.plant.hold()
    }

    fn report(&mut self) -> Feedback {
        self.plant.report()
    }
}
