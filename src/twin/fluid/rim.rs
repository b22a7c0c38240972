//! What the particles cannot do by themselves at a vessel's rim: flow thickly, and run over.
//!
//! Particles of a quarter of a millilitre have no calibrated viscosity, and pile up over a rim rather than run over
//! it. So a vessel of thick liquid has a lid: a particle leaves when the law of a sheet falling over the lip
//! ([`crate::twin::hold`]) says that its volume has left, and then the one next to the lip does. A full vessel lets go of what
//! is uppermost, beside the nearest wall. What falls, splashes and is counted afterwards is the particles' own.

use nalgebra::Vector3;

use super::{Dribble, Fluid, Moving, Phase};
use crate::twin::hold::WATER;

/// Time constant with which what stands above a lip leaves, s: that of the particles themselves, where nothing
/// holds them back.
const PACE: f64 = 0.15;

/// No sheet leaves faster, m/s.
const TOP_SPEED: f64 = 0.5;

/// How one vessel's rim lets go of liquid, beyond what water in a rigid vessel does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rim {
    /// What clings to the lip and runs on: `lip_dribble`.
    pub dribble: Option<Dribble>,
    /// How thick the liquid is, Pa·s: `liquid_viscosity`. `None` is water.
    pub viscosity: Option<f64>,
    /// What the vessel holds when it is full, m³, if less than to its rim: `overflow`.
    pub brim: Option<f64>,
}

/// The state of one vessel's rim.
#[derive(Debug, Clone)]
pub(super) struct Lip {
    /// The liquid's viscosity beyond water's, Pa·s.
    thick: Option<f64>,
    /// Most particles it holds.
    most: usize,
    /// How many should have left and did not, as far as a whole one is not yet due.
    due: f64,
    /// How many have left.
    left: u32,
}

impl Lip {
    /// Makes the rim of a vessel that holds `volume` m³ up to its edge; `particle` is the volume of one, m³.
    pub(super) fn new(rim: Rim, volume: f64, particle: f64) -> Self {
        let brim = rim.brim.map_or(volume, |brim| brim.clamp(0.0, volume));
        let thick = rim.viscosity.map(|viscosity| viscosity - WATER).filter(|more| *more > 0.0);
        // Rounding must not let a vessel run over that is filled to the brim.
        let most = (brim / particle + 0.5) as usize;
        Self { thick, most, due: 0.0, left: 0 }
    }

    /// Returns whether particles leave only when they are let go.
    pub(super) fn has_lid(&self) -> bool {
        self.thick.is_some()
    }
}

impl Fluid {
    /// Lets thick liquid leave over its lip, and full vessels run over.
    pub(super) fn let_go(&mut self) {
        for k in 0..self.vessels.len() {
            if let Some(viscosity) = self.lips[k].thick {
                self.creep_out(k, viscosity);
            }
            self.run_over(k);
        }
    }

    /// Returns the particles inside a vessel that do not cling to its lip.
    fn loose_in(&self, k: usize) -> Vec<usize> {
        let loose = |i: &usize| {
            !matches!(self.phase[*i], Phase::Clinging(_)) && self.vessel_of(*i) == Some(k)
        };
        (0..self.phase.len()).filter(loose).collect()
    }

    /// Lets as many particles leave as the law of a falling sheet says.
    fn creep_out(&mut self, k: usize, viscosity: f64) {
        let mut inside = self.loose_in(k);
        let down = self.vessels[k].now.rotation.inverse() * -Vector3::z();
        let tilt = f64::from(down.angle(&-Vector3::z()));
        let hold = self.vessels[k].vessel.hold();
        let above = inside.len() as f64 * self.volume - hold.at(tilt);
        if above <= 0.0 {
            return;
        }
        let pace = PACE + hold.lag(viscosity, tilt, above);
        let leaves = above * (1.0 - (-f64::from(self.dt) / pace).exp());
        let speed = hold.sheet_speed(tilt, above, leaves / f64::from(self.dt)).min(TOP_SPEED);
        self.lips[k].due += leaves / self.volume;
        while self.lips[k].due >= 1.0 && !inside.is_empty() {
            self.lips[k].due -= 1.0;
            self.lips[k].left = self.lips[k].left.wrapping_add(1);
            // One beside the other along the lip: steps of the golden ratio never come together.
            let along = (f64::from(self.lips[k].left) * 0.618_033_988_75).fract() as f32 - 0.5;
            let moving = &self.vessels[k];
            let lip = moving.vessel.on_lip(&down, along, 0.5 * self.spacing);
            let far = |i: usize| (moving.local(&self.position[i]) - lip).norm_squared();
            let nearest =
                (0..inside.len()).min_by(|&a, &b| far(inside[a]).total_cmp(&far(inside[b])));
            let i = inside.swap_remove(nearest.unwrap_or(0));
            let out = moving.turned(&Vector3::z()) * speed as f32;
            self.release(i, k, &lip, &out);
        }
    }

    /// Lets go of what a vessel holds beyond its brim.
    fn run_over(&mut self, k: usize) {
        let mut inside = self.loose_in(k);
        while inside.len() > self.lips[k].most {
            let moving = &self.vessels[k];
            let local = |i: usize| moving.local(&self.position[i]);
            let highest = (0..inside.len())
                .max_by(|&a, &b| local(inside[a]).z.total_cmp(&local(inside[b]).z));
            let i = inside.swap_remove(highest.unwrap_or(0));
            let place = moving.vessel.beside_lip(&local(i), self.spacing);
            self.release(i, k, &place, &Vector3::zeros());
        }
    }

    /// Puts a particle of vessel `k` outside at a place in the vessel's frame, moving with it and with `more` m/s.
    fn release(&mut self, i: usize, k: usize, place: &Vector3<f32>, more: &Vector3<f32>) {
        let moving: &Moving = &self.vessels[k];
        self.position[i] = moving.world(place);
        self.velocity[i] = moving.velocity_at(&self.position[i]) + more;
        self.inside[i] = 0;
        self.phase[i] = Phase::Live;
        self.wet(i, 1 << k);
    }
}
