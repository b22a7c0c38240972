//! Motor currents in the place of torques: what the drives turn an ampere into, told by the sidecar or fitted.
//!
//! A constant that is not told is the one with which the current says what the arm as filed needed, beside friction of both
//! kinds, a rotor and an offset, and beside a load that all joints bear where they agree on one. What the file's masses are off by
//! is in it: whoever has a data sheet should write it into the sidecar (`torque_constant_nm_per_a`). Friction and rotors of a
//! joint are as uncertain as its constant ([`Drives::covariance`]): in a current all three are larger together, and only what
//! the links need tells them apart.
//!
//! Source: Gautier and Briot, "Global identification of joint drive gains and dynamic parameters of robots", 2014, where a load
//! of known mass tells the constants by themselves.

mod fit;

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use rayon::prelude::*;

use super::channels::{Channel, Quantity, SILENT};
use super::error::Misfit;
use super::links::fit::CREEPS;
use super::simulate::Model;
use super::term::{Law, Term};
use super::wording;
use crate::discovery::recording::Error;
use fit::{Borne, Fit, Sensor};

/// A constant is known if its standard deviation is less than this part of it.
const KNOWN: f64 = 0.05;

/// What the drives turn an ampere into, as far as it was fitted; nothing where torques were measured.
#[derive(Debug, Clone, Default)]
pub(super) struct Drives {
    /// Joint by joint with one standard deviation, N·m/A; `None` where the motion does not tell it.
    constants: Vec<Option<(f64, f64)>>,
    /// The load that was fitted beside them: mass, kg, and moment, kg·m, in the tip's frame, with their covariance.
    load: Option<(Vector4<f64>, Matrix4<f64>)>,
}

impl Drives {
    /// Says what was fitted, if anything was.
    pub(super) fn note(&self) -> Option<String> {
        let load = self.load.map(|(load, covariance)| (load[0], covariance[(0, 0)].sqrt()));
        (!self.constants.is_empty()).then(|| wording::currents(&self.constants, load))
    }

    /// Returns how uncertain the parameters of an effect are for what an ampere is worth, beside their own covariance: what is a
    /// torque of a joint is off by the same part as its constant, what weighs something by as much as any.
    pub(super) fn covariance(&self, term: &Term, parameters: &[f64]) -> DMatrix<f64> {
        let n = parameters.len();
        if let (Law::Payload, Some((_, covariance))) = (term.law, self.load) {
            return DMatrix::from_fn(n, n, |i, k| covariance[(i, k)]);
        }
        let part = |constant: &Option<(f64, f64)>| constant.map_or(0.0, |(k, std)| std / k);
        let most = self.constants.iter().map(part).fold(0.0, f64::max);
        let own = self.constants.get(term.joint).map_or(0.0, part);
        let specs = term.law.specs();
        let off = specs.iter().zip(parameters).map(|(spec, value)| match spec.unit {
            "kg" | "kg*m" => most * value,
            unit if unit.contains("N*m") || unit == "kg*m^2" => own * value,
            _ => 0.0,
        });
        let off: Vec<f64> = off.collect();
        DMatrix::from_fn(n, n, |i, k| off[i] * off[k])
    }
}

/// Fits the constants of the drives to recordings of currents, with a load where they agree on one.
///
/// # Errors
///
/// An [`Error`] where currents run against what the arm needs, or none tells anything.
fn drives(models: &[&Model], place: &str) -> Result<Drives, Error> {
    let unrelated = || Misfit::CurrentsUnrelated.at(place);
    let sensors = sensors(models).ok_or_else(unrelated)?;
    let (plain, with) = fit::fits(&sensors, |load| borne(models, load)).ok_or_else(unrelated)?;
    let bears = |with: &Fit| {
        let load = with.load.as_slice();
        models.iter().all(|model| model.arm.chain.bears(load[0], &load[1..]))
    };
    let with = with.filter(bears);
    let fitted = with.as_ref().map_or_else(|| plain.constants(), Fit::constants_with_load);
    let sure = |(value, std): (f64, f64)| std < KNOWN * value.abs();
    let against = |(_, k): &(usize, &(f64, f64))| sure(**k) && k.0 < 0.0;
    let joints: Vec<usize> =
        fitted.iter().enumerate().filter(against).map(|(joint, _)| joint).collect();
    if !joints.is_empty() {
        return Err(Misfit::CurrentsAgainst { joints }.at(place));
    }
    if !fitted.iter().any(|k| sure(*k)) {
        return Err(unrelated());
    }
    let constants = fitted.into_iter().map(|k| sure(k).then_some(k)).collect();
    Ok(Drives { constants, load: with.map(|with| (with.load, with.covariance)) })
}

/// Returns the torque that every joint needs with some effects, over all rows judged of all recordings, N·m.
fn needed(models: &[&Model], terms: &[Term], parameters: &[f64]) -> Option<Vec<Vec<f64>>> {
    let n = models.first().map_or(0, |model| model.arm.chain.n());
    let mut all = vec![Vec::new(); n];
    for model in models {
        let data = &model.course.data;
        let predicted = model.predict(&[], terms, parameters)?;
        let channels = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (channel, values) in channels.zip(predicted.chunks(data.n_rows())) {
            if channel.quantity == Quantity::Torque {
                all[channel.index].extend(judged(model, channel, values));
            }
        }
    }
    Some(all)
}

/// Returns the values of a channel at the rows that are judged and that its sensor has read.
fn judged<'a>(
    model: &Model,
    channel: &'a Channel,
    values: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    let rows = model.course.first_row..model.course.last_row;
    rows.filter(|row| channel.is_read(*row)).map(|row| values[row])
}

/// Returns the current of every joint with what it may be of.
fn sensors(models: &[&Model]) -> Option<Vec<Sensor>> {
    let bare = needed(models, &[], &[])?;
    let sensor = |(joint, bare): (usize, &Vec<f64>)| -> Option<Sensor> {
        let by = |law, parameters: &[f64]| -> Option<DVector<f64>> {
            let with = needed(models, &[Term { law, joint }], parameters)?;
            Some(difference(&with[joint], bare))
        };
        let of_joint = |c: &&Channel| c.quantity == Quantity::Torque && c.index == joint;
        let read = models.iter().flat_map(|model| {
            let channel = model.course.data.channels.iter().find(of_joint);
            channel.into_iter().flat_map(|channel| judged(model, channel, &channel.values))
        });
        let dry = CREEPS.into_iter().map(|creep| by(Law::Coulomb, &[1.0, creep]));
        Some(Sensor {
            current: DVector::from_vec(read.collect()),
            needed: DVector::from_column_slice(bare),
            smooth: [
                by(Law::Viscous, &[1.0])?,
                by(Law::Armature, &[1.0])?,
                DVector::from_element(bare.len(), 1.0),
            ],
            dry: dry.collect::<Option<Vec<_>>>()?,
        })
    };
    bare.par_iter().enumerate().map(sensor).collect()
}

/// Returns what a load takes at every joint; its inertia is that of a mass at a place.
fn borne(models: &[&Model], load: &Vector4<f64>) -> Option<Vec<Borne>> {
    let with = |load: &Vector4<f64>| {
        needed(models, &[Term { law: Law::Payload, joint: 0 }], load.as_slice())
    };
    let bare = needed(models, &[], &[])?;
    let here = with(load)?;
    let specs = Law::Payload.specs();
    let nearby = specs.iter().enumerate().map(|(number, spec)| {
        let mut moved = *load;
        moved[number] += spec.scale;
        with(&moved)
    });
    let nearby: Vec<Vec<Vec<f64>>> = nearby.collect::<Option<_>>()?;
    let of_joint = |joint: usize| {
        let change = |(there, number): (&Vec<Vec<f64>>, usize)| {
            difference(&there[joint], &here[joint]) / specs[number].scale
        };
        let changes: Vec<DVector<f64>> = nearby.iter().zip(0..).map(change).collect();
        Borne {
            torque: difference(&here[joint], &bare[joint]),
            change: DMatrix::from_columns(&changes),
        }
    };
    Some((0..bare.len()).map(of_joint).collect())
}

/// Returns how much more one list holds than another of the same length.
fn difference(one: &[f64], other: &[f64]) -> DVector<f64> {
    DVector::from_iterator(other.len(), one.iter().zip(other).map(|(one, other)| one - other))
}

/// Turns the currents of recordings into torques, those with torques left as they are; returns with which constants.
///
/// # Errors
///
/// As [`drives`].
pub(super) fn turned(models: &mut [Model], n_train: usize, place: &str) -> Result<Drives, Error> {
    let are_currents = |model: &&Model| model.course.data.are_currents;
    let mut read: Vec<&Model> = models[..n_train].iter().filter(are_currents).collect();
    if read.is_empty() {
        read = models.iter().filter(are_currents).collect();
    }
    if read.is_empty() {
        return Ok(Drives::default());
    }
    let drives = drives(&read, place)?;
    for model in models.iter_mut().filter(|model| model.course.data.are_currents) {
        *model = in_torques(model, &drives.constants);
    }
    Ok(drives)
}

/// Returns a recording's model with its currents turned into torques.
fn in_torques(model: &Model, constants: &[Option<(f64, f64)>]) -> Model {
    let mut course = model.course.clone();
    let torques = course.data.channels.iter_mut().filter(|c| c.quantity == Quantity::Torque);
    for channel in torques {
        let (by, more) = constants[channel.index].map_or((1.0, SILENT), |(by, _)| (by, 1.0));
        channel.values.iter_mut().for_each(|value| *value *= by);
        channel.noise *= by * more;
    }
    Model::new(model.arm.clone(), course, model.loads.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_in_currents_is_as_uncertain_as_what_an_ampere_is_worth() {
        let load = (Vector4::new(1.0, 0.0, 0.0, 0.1), Matrix4::from_diagonal_element(4e-4));
        let constants = vec![Some((10.0, 0.2)), None, Some((5.0, 0.05))];
        let drives = Drives { constants, load: None };
        let std = |drives: &Drives, law, joint, parameters: &[f64]| {
            drives.covariance(&Term { law, joint }, parameters).diagonal().map(f64::sqrt)
        };
        let friction = std(&drives, Law::Coulomb, 0, &[3.0, 1e-3]);
        assert!((friction[0] - 0.06).abs() < 1e-12 && friction[1] <= 0.0, "{friction}");
        assert!((std(&drives, Law::Armature, 2, &[0.5])[0] - 0.005).abs() < 1e-12);
        assert!((std(&drives, Law::LinkMass, 2, &[0.5])[0] - 0.01).abs() < 1e-12);
        assert!(std(&Drives::default(), Law::Viscous, 1, &[2.0])[0] <= 0.0);
        let beside = Drives { load: Some(load), ..drives };
        assert!((std(&beside, Law::Payload, 0, &[1.0, 0.0, 0.0, 0.1])[0] - 0.02).abs() < 1e-12);
    }
}
