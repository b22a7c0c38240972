//! What a recording says of a pour.

use super::wording;
use crate::discovery::recording::{Error, Recording};
use crate::twin::hold::Hold;
use crate::units::Dimension;
use crate::world::{Object, Scene, WATER_DENSITY};

/// Rows this far apart are independent enough, s: what the model does not know of sloshing lasts longer.
const STRIDE: f64 = 0.1;

/// The scale's noise is at least this, kg, whatever its rows at rest say: the last drop hangs.
const LEAST_NOISE: f64 = 5e-4;

/// Where the scale's reading changes, the model is late or early by as much, s.
const PACE: f64 = 0.12;

/// Half the time over which the reading's change is taken, s.
const SLOPE: f64 = 0.25;

/// One pour, in rows of a tenth of a second.
#[derive(Debug, Clone)]
pub struct Pour {
    /// The recording's name.
    pub name: String,
    /// The vessel poured from, and the one on the scale.
    pub vessels: [String; 2],
    /// What the first is declared to hold, m³.
    pub declared: f64,
    /// What it held at first, if scales said so afterwards, m³.
    pub held: Option<f64>,
    /// What it was believed to hold at first, m³, if not what is declared.
    pub first: Option<f64>,
    /// What the second held at first, m³.
    pub there: f64,
    /// What was beside both vessels at the end, if scales said so, m³.
    pub beside: Option<f64>,
    /// What the first is declared to weigh when it is empty, kg.
    pub empty: f64,
    /// What it weighed with what was in it before it poured, if the hand felt it, kg.
    pub borne: Option<f64>,
    /// What the second holds when it is full, m³; nobody knows of a thing that is no vessel.
    pub brim: f64,
    /// What it holds at a tilt.
    pub(super) hold: Hold,
    /// When each row was taken, s.
    pub time: Vec<f64>,
    /// Tilt of the vessel, rad.
    pub tilt: Vec<f64>,
    /// How far inside the other one's mouth its lip is, m; negative outside.
    pub inside: Vec<f64>,
    /// What the scale read, kg, less what it read at first.
    pub mass: Vec<f64>,
    /// What it read at first, kg.
    pub zero: f64,
    /// Standard deviation of each row, kg: the scale's, and more where the reading changes fast or a surface that swings may have
    /// let more or less leave since the last.
    pub noise: Vec<f64>,
    /// How much of what is left at a row stays for all that follow: 0 but for a vessel that is held leaning.
    stays: Vec<f64>,
    /// The scale's own noise, kg.
    pub scale_noise: f64,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

impl Pour {
    /// Returns whether a recording is of a pour: it has `tilt` and `mass`.
    pub fn is_one(recording: &Recording) -> bool {
        recording.has("tilt") && recording.has("mass")
    }

    /// Takes a pour out of a recording with columns `tilt[rad]`, `mass[kg]` and, if known, `inside[m]`.
    /// The sidecar names the vessels; without it they are the first of the scene that holds water and
    /// the next one.
    ///
    /// # Errors
    ///
    /// An [`Error`] for columns that are missing or wrong, or vessels the scene does not have.
    pub fn of(recording: &Recording, scene: &Scene) -> Result<Self, Error> {
        let [source, target] = vessels(recording, scene)?;
        let hold =
            Hold::of(source).ok_or_else(|| wording::no_vessel(&source.name, &recording.name))?;
        let (tilt, mass) = (
            recording.column("tilt", Dimension::ANGLE)?,
            recording.column("mass", Dimension::MASS)?,
        );
        let mut notes = Vec::new();
        let inside = if recording.has("inside") {
            recording.column("inside", Dimension::LENGTH)?.to_vec()
        } else {
            notes.push(wording::inside_unknown(&recording.name, &target.name));
            vec![1.0; tilt.len()]
        };
        let time = &recording.time;
        let own = scale_noise(mass);
        let every = ((STRIDE / recording.step()).round() as usize).max(1);
        let rows: Vec<usize> = (0..time.len()).step_by(every).collect();
        let pick = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        let zero = mean(&mass[..every.min(mass.len())]);
        let noise: Vec<f64> =
            rows.iter().map(|row| own.hypot(PACE * slope(time, mass, *row))).collect();
        let named = recording.sidecar.pour.as_ref();
        let declared = source.cavity.map_or(0.0, |cavity| cavity.filled);
        let (held, first) =
            (named.and_then(|pour| pour.held_m3), named.and_then(|pour| pour.first_m3));
        let (time, tilt) = (pick(time), pick(tilt));
        let swings = swings(&hold, held.or(first).unwrap_or(declared), &time, &tilt);
        let (noise, stays) = followed(&noise, &swings);
        Ok(Self {
            name: recording.name.clone(),
            vessels: [source.name.clone(), target.name.clone()],
            declared,
            held,
            first,
            there: named.and_then(|pour| pour.there_m3).unwrap_or(0.0),
            beside: named.and_then(|pour| pour.spilt_m3),
            empty: source.mass,
            borne: named.and_then(|pour| pour.borne_kg),
            brim: target.cavity.map_or(f64::INFINITY, |cavity| cavity.capacity),
            hold,
            noise,
            stays,
            time,
            tilt,
            inside: pick(&inside),
            mass: pick(mass).into_iter().map(|value| value - zero).collect(),
            zero,
            scale_noise: own,
            notes,
        })
    }

    /// Whether it was held leaning and turned on, so that how the surface lies decides what leaves.
    pub(super) fn is_in_steps(&self) -> bool {
        self.stays.iter().any(|stays| *stays > 0.0)
    }

    /// Returns what was read less what is predicted, row by row, kg; of a vessel that is held leaning, less what the rows
    /// before say of it.
    pub(super) fn left(&self, predicted: &[f64]) -> Vec<f64> {
        let mut known = 0.0;
        let rows = self.mass.iter().zip(predicted).zip(&self.stays);
        rows.map(|((mass, value), stays)| {
            let left = mass - value - known;
            known += stays * left;
            left
        })
        .collect()
    }
}

/// How far the liquid's surface may lie from where the tilt says, rad: it swings for seconds after the vessel was turned, and
/// the grip gives. Measured: 0.06 at the first stop, 0.01 at later ones.
const LIES: f64 = 0.05;

/// A vessel that turns by less than this in half a second to either side is held, rad.
const HELD: f64 = 0.02;

/// How often a surface that swings is somewhere else, s.
const SWING: f64 = 1.0;

/// Returns how much more or less may have left since the last row than the tilt says, kg, standard deviation. A vessel that is
/// turned once is followed, its grasp's lean being fitted; one that is held leaning and turned on, time and again, lets go of
/// what the surface's swing and the grip decide, which nobody recorded.
fn swings(hold: &Hold, volume: f64, time: &[f64], tilt: &[f64]) -> Vec<f64> {
    let near = |row: usize| {
        let from = time.partition_point(|t| *t < time[row] - 0.5);
        let to = time.partition_point(|t| *t <= time[row] + 0.5);
        tilt[from..to].iter().map(|tilt| tilt.abs())
    };
    // By what it holds a little more or less tilted, of what is in it.
    let may_leave = |tilt: f64| {
        let held = |tilt: f64| hold.at(tilt.max(0.0)).min(volume);
        0.25 * (held(tilt - 2.0 * LIES) - held(tilt + 2.0 * LIES))
    };
    let leans: Vec<f64> = tilt.iter().map(|tilt| tilt.abs()).collect();
    let is_held = |row: &usize| {
        let most = near(*row).fold(0.0, f64::max);
        let least = near(*row).fold(f64::INFINITY, f64::min);
        most - least < HELD && may_leave(leans[*row]) > 0.0
    };
    let first = (0..leans.len()).find(is_held);
    // Held once, at the furthest: then that is its end.
    let turned_on = first.is_some_and(|first| {
        leans[first..].iter().copied().fold(0.0, f64::max) > leans[first] + HELD
    });
    if !turned_on {
        return vec![0.0; leans.len()];
    }
    let since = |row: usize| if row == 0 { 0.0 } else { time[row] - time[row - 1] };
    (0..leans.len())
        .map(|row| WATER_DENSITY * may_leave(leans[row]) * (since(row) / SWING).sqrt())
        .collect()
}

/// Follows what is left as something that stays and changes by so much (kg) from row to row, read with a noise (Kalman's
/// filter for one number): returns the standard deviation of each row given those before, kg, and which part of it stays.
fn followed(noise: &[f64], changes: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut variance = 0.0;
    let rows = noise.iter().zip(changes);
    rows.map(|(noise, change)| {
        variance += change * change;
        let whole = variance + noise * noise;
        let stays = variance / whole;
        variance *= 1.0 - stays;
        (whole.sqrt(), stays)
    })
    .unzip()
}

/// Finds the two vessels.
fn vessels<'a>(recording: &Recording, scene: &'a Scene) -> Result<[&'a Object; 2], Error> {
    if let Some(pour) = &recording.sidecar.pour {
        let named = |name: &String| {
            scene.object(name).ok_or_else(|| wording::no_such(name, recording, scene))
        };
        return Ok([named(&pour.source)?, named(&pour.target)?]);
    }
    let filled = |object: &&Object| object.cavity.is_some_and(|cavity| cavity.filled > 0.0);
    let source = scene.objects.iter().find(filled);
    let source = source.ok_or_else(|| wording::none_filled(recording, scene))?;
    let other = |object: &&Object| object.cavity.is_some() && object.name != source.name;
    let target = scene.objects.iter().find(other);
    let target = target.ok_or_else(|| wording::no_second(recording, scene))?;
    Ok([source, target])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Returns the scale's noise, kg: half the usual step between rows, which flow hardly changes.
fn scale_noise(mass: &[f64]) -> f64 {
    let mut steps: Vec<f64> = mass.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    // The median of |x - y| of two normal numbers is 0.954 of their standard deviation.
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    (usual / 0.954).max(LEAST_NOISE)
}

/// Returns how fast the reading changes about a row, kg/s.
fn slope(time: &[f64], mass: &[f64], row: usize) -> f64 {
    let from = time.partition_point(|t| *t < time[row] - SLOPE);
    let to = time.partition_point(|t| *t <= time[row] + SLOPE) - 1;
    let span = time[to] - time[from];
    if span > 0.0 { (mass[to] - mass[from]).abs() / span } else { 0.0 }
}
