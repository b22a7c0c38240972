//! Water that clings to a lip, and runs on once the vessel is upright again.
//!
//! What leaves a vessel first wets its lip: so much is held there, rides along, and drains as a film does,
//! exponentially from the moment the vessel is upright. It falls beside the wall, wherever the lip then is.

use nalgebra::Vector3;

use super::{Fluid, Phase};

/// A vessel tilted by less than this is upright, rad.
const UPRIGHT: f32 = 0.5;

/// How much water runs on, and how slowly: the effect `lip_dribble` of the vocabulary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dribble {
    /// Water that clings to the lip, m³.
    pub volume: f64,
    /// Time constant with which it drains once the vessel is upright, s.
    pub delay: f64,
}

/// The water on one vessel's lip.
#[derive(Debug, Clone, Default)]
pub(super) struct Film {
    /// How many particles may cling; none without a dribble.
    room: usize,
    delay: f32,
    /// How many cling or did, and how many of them have drained.
    caught: usize,
    drained: usize,
    /// For how long the vessel has been upright since it poured, s.
    upright: f32,
}

impl Film {
    pub(super) fn new(dribble: Option<Dribble>, particle: f64) -> Self {
        dribble.map_or_else(Self::default, |dribble| Self {
            room: (dribble.volume / particle).round().max(0.0) as usize,
            delay: dribble.delay.max(1e-3) as f32,
            ..Self::default()
        })
    }

    /// Returns how many particles cling.
    fn clinging(&self) -> usize {
        self.caught - self.drained
    }

    /// Returns how many particles should have drained by now.
    fn due(&self) -> usize {
        let drained = 1.0 - (-self.upright / self.delay).exp();
        // The last half particle of an exponential is a whole one.
        ((self.caught as f32 * drained + 0.5) as usize).min(self.caught)
    }
}

impl Fluid {
    /// Lets a particle that has just left vessel `k` cling to its lip if that is not yet wet.
    pub(super) fn wet(&mut self, i: usize, k: usize) {
        if self.films[k].caught < self.films[k].room {
            self.films[k].caught += 1;
            self.films[k].upright = 0.0;
            self.phase[i] = Phase::Clinging(k);
            self.inside[i] = 1 << k;
            self.ride[i] = self.vessels[k].local(&self.position[i]);
        }
    }

    /// Lets the films of upright vessels drain.
    pub(super) fn drain(&mut self) {
        for k in 0..self.vessels.len() {
            if self.films[k].clinging() == 0 {
                continue;
            }
            let up = self.vessels[k].now.rotation * Vector3::z();
            if up.angle(&Vector3::z()) > UPRIGHT {
                continue;
            }
            self.films[k].upright += self.dt;
            while self.films[k].drained < self.films[k].due() {
                let clings = |i: &usize| self.phase[*i] == Phase::Clinging(k);
                let Some(i) = self.loose.iter().copied().find(clings) else {
                    break;
                };
                let moving = &self.vessels[k];
                let place = moving.vessel.beside_lip(&self.ride[i], self.spacing);
                self.position[i] = moving.world(&place);
                self.velocity[i] = moving.velocity_at(&self.position[i]);
                self.inside[i] = 0;
                self.phase[i] = Phase::Live;
                self.films[k].drained += 1;
            }
        }
    }

    /// Returns the volume that clings to the lip of vessel `k`, m³.
    pub fn clinging(&self, k: usize) -> f64 {
        self.films[k].clinging() as f64 * self.volume
    }
}
