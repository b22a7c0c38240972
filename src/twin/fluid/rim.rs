//! How liquid leaves a vessel: it flows out over the lip, and a full one runs over.
//!
//! A particle leaves when the laws of a weir and of a sheet falling over the lip ([`crate::twin::hold`]) say that its
//! volume has left. The tilt that counts is that against the liquid's surface, which swings. A full vessel lets go
//! beside its wall. (Particles that push each other over a rim of their own pile up before it: at 6 mm each, a jar
//! turned at 4 deg/s held 50 mL more than hydraulics allow.)

use nalgebra::Vector3;

use super::{Dribble, Fluid, Moving, Phase};
use crate::twin::hold::WATER;

/// No sheet leaves faster, m/s: as fast as water falls from 13 mm, about the most that stands over a lip.
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
    thick: f64,
    /// Most particles it holds.
    most: usize,
    /// How many should have left and did not, as far as a whole one is not yet due.
    due: f64,
    /// How many have left.
    left: u32,
    /// Where along the lip the first one does, 0 to 1.
    start: f64,
}

impl Lip {
    /// Makes the rim of a vessel that holds `volume` m³ up to its edge; `particle` is the volume of one, m³.
    pub(super) fn new(rim: Rim, volume: f64, particle: f64, start: f64) -> Self {
        let brim = rim.brim.map_or(volume, |brim| brim.clamp(0.0, volume));
        let thick = rim.viscosity.map_or(0.0, |viscosity| (viscosity - WATER).max(0.0));
        // Rounding must not let a vessel run over that is filled to the brim.
        let most = (brim / particle + 0.5) as usize;
        Self { thick, most, due: 0.0, left: 0, start }
    }

    /// Returns where along the lip the next one leaves, -0.5 to 0.5: one beside the other, since steps of the golden
    /// ratio never come together.
    fn next(&mut self) -> f32 {
        self.left = self.left.wrapping_add(1);
        (f64::from(self.left) * 0.618_033_988_75 + self.start).fract() as f32 - 0.5
    }
}

impl Fluid {
    /// Lets liquid leave over its lip, and full vessels run over.
    pub(super) fn let_go(&mut self) {
        for k in 0..self.vessels.len() {
            let n = self.vessels[k].standing;
            self.flow_out(k);
            if n > self.lips[k].most {
                self.run_over(k);
            }
        }
    }

    /// Returns a particle that stands in a vessel.
    fn one_in(&self, k: usize) -> Option<usize> {
        self.phase.iter().rposition(|phase| *phase == Phase::Standing(k))
    }

    /// Lets as many particles leave as the laws of a weir and of a falling sheet say, one after the other.
    fn flow_out(&mut self, k: usize) {
        let moving = &self.vessels[k];
        let above = moving.above;
        if above <= 0.0 {
            return;
        }
        let (_, up, _) = moving.stand;
        let tilt = up.angle(&Vector3::z());
        let hold = moving.vessel.hold();
        let pace = above / hold.outflow(tilt, above) + hold.lag(self.lips[k].thick, tilt, above);
        let leaves = above * (1.0 - (-f64::from(self.dt) / pace).exp());
        let speed = hold.sheet_speed(tilt, above, leaves / f64::from(self.dt)).min(TOP_SPEED);
        let out = moving.turned(&Vector3::z()) * speed as f32;
        let down = -up.cast();
        self.lips[k].due += leaves / self.volume;
        while self.lips[k].due >= 1.0 {
            let Some(i) = self.one_in(k) else { break };
            self.lips[k].due -= 1.0;
            let along = self.lips[k].next();
            let lip = self.vessels[k].vessel.on_lip(&down, along, 0.5 * self.spacing);
            self.release(i, k, &lip, &out);
        }
    }

    /// Lets go of what a vessel holds beyond its brim.
    fn run_over(&mut self, k: usize) {
        for _ in self.lips[k].most..self.vessels[k].standing {
            let Some(i) = self.one_in(k) else { break };
            let turn = std::f32::consts::TAU * self.lips[k].next();
            let moving = &self.vessels[k];
            let side = Vector3::new(turn.cos(), turn.sin(), 0.0);
            let lip = moving.vessel.on_lip(&side, 0.0, 0.0);
            let place = moving.vessel.beside_lip(&lip, self.spacing);
            self.release(i, k, &place, &Vector3::zeros());
        }
    }

    /// Puts a particle of vessel `k` outside at a place in the vessel's frame, moving with it and with `more` m/s.
    fn release(&mut self, i: usize, k: usize, place: &Vector3<f32>, more: &Vector3<f32>) {
        let moving: &Moving = &self.vessels[k];
        self.position[i] = moving.world(place);
        self.velocity[i] = moving.velocity_at(&self.position[i]) + more;
        // A lip may dip into another vessel.
        let into =
            |(_, other): &(usize, &Moving)| other.vessel.holds(&other.local(&self.position[i]));
        let others = self.vessels.iter().enumerate().filter(|(other, _)| *other != k);
        self.inside[i] = others.filter(into).fold(0, |bits, (other, _)| bits | 1 << other);
        self.phase[i] = Phase::Live;
        self.vessels[k].standing -= 1;
        let before = self.loose.partition_point(|&loose| loose < i);
        self.loose.insert(before, i);
        self.wet(i, k);
    }
}
