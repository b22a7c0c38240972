//! Motor currents in the place of torques: what the drives turn an ampere into, told by the sidecar or fitted.
//!
//! A constant that is not told is the one with which the current says what the arm as filed needed, beside friction of both
//! kinds, a rotor and an offset. What the file's masses are off by is in it: whoever has a data sheet should write it into
//! the sidecar (`torque_constant_nm_per_a`).
//!
//! Source: Gautier and Briot, "Global identification of joint drive gains and dynamic parameters of robots", 2014, where a load
//! of known mass tells the constants by themselves.

use nalgebra::{DMatrix, DVector};

use super::channels::{Quantity, SILENT};
use super::error::Misfit;
use super::links::CREEPS;
use super::simulate::Model;
use super::term::{Law, Term};
use super::wording;
use crate::discovery::recording::Error;
use crate::discovery::selection::related;

/// A constant is known if its standard deviation is less than this part of it.
const KNOWN: f64 = 0.05;

/// Fits the constants of the drives to recordings of currents, N·m/A; `None` where a joint's motion does not tell it.
///
/// # Errors
///
/// An [`Error`] where a current runs against what the arm needs, or none tells anything.
fn constants(models: &[&Model], place: &str) -> Result<Vec<Option<f64>>, Error> {
    let n = models.first().map_or(0, |model| model.arm.chain.n());
    let fitted: Vec<(f64, f64)> = (0..n).map(|joint| fit(models, joint)).collect();
    let sure = |(value, std): &(f64, f64)| *std < KNOWN * value.abs();
    let joints: Vec<usize> = (0..n).filter(|j| sure(&fitted[*j]) && fitted[*j].0 < 0.0).collect();
    if !joints.is_empty() {
        return Err(Misfit::CurrentsAgainst { joints }.at(place));
    }
    if !fitted.iter().any(sure) {
        return Err(Misfit::CurrentsUnrelated.at(place));
    }
    Ok(fitted.into_iter().map(|k| sure(&k).then_some(k.0)).collect())
}

/// Returns what one joint's drive turns an ampere into, and its standard deviation: the current is regressed on what the arm
/// needed, with the dry friction that fits best.
fn fit(models: &[&Model], joint: usize) -> (f64, f64) {
    let fits = CREEPS.into_iter().filter_map(|creep| regressed(models, joint, creep));
    let best = fits.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((0.0, f64::INFINITY), |(_, value, std)| (value, std))
}

/// Returns the sum of squares that is left beside dry friction with this creep, the constant and its standard deviation.
fn regressed(models: &[&Model], joint: usize, creep: f64) -> Option<(f64, f64, f64)> {
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for model in models {
        let data = &model.course.data;
        let read = data.measured(Quantity::Torque, joint)?;
        let mut channels = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        let at = channels.position(|c| c.quantity == Quantity::Torque && c.index == joint)?;
        let own = at * data.n_rows()..(at + 1) * data.n_rows();
        let predicted = |terms: &[Term], parameters: &[f64]| {
            model.predict(&[], terms, parameters).map(|all| all[own.clone()].to_vec())
        };
        let bare = predicted(&[], &[])?;
        let with = |law, parameters: &[f64]| predicted(&[Term { law, joint }], parameters);
        let fluid = with(Law::Viscous, &[1.0])?;
        let dry = with(Law::Coulomb, &[1.0, creep])?;
        let rotor = with(Law::Armature, &[1.0])?;
        let judged = model.course.first_row..model.course.last_row;
        rows.extend(judged.map(|i| {
            let by = |with: &[f64]| with[i] - bare[i];
            [read[i], bare[i], by(&fluid), by(&dry), by(&rotor), 1.0]
        }));
    }
    let columns = DMatrix::from_fn(rows.len(), 5, |i, k| rows[i][k + 1]);
    let target = DVector::from_fn(rows.len(), |i, _| rows[i][0]);
    let gram = columns.tr_mul(&columns);
    let ridge = DMatrix::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
    let inverse = (&gram + ridge).try_inverse()?;
    let x = &inverse * columns.tr_mul(&target);
    let left = &target - &columns * &x;
    let square = left.norm_squared();
    let each = related(left.as_slice()) * square / (rows.len().max(6) as f64 - 5.0);
    let std = (each * inverse[(0, 0)]).max(0.0).sqrt();
    // Of 1/k to k, to first order.
    Some((square, 1.0 / x[0], std / (x[0] * x[0])))
}

/// Turns the currents of recordings into torques, those with torques left as they are; says with which constants, if there
/// were any currents.
///
/// # Errors
///
/// As [`constants`].
pub(super) fn turned(
    models: &mut [Model],
    n_train: usize,
    place: &str,
) -> Result<Option<String>, Error> {
    let are_currents = |model: &&Model| model.course.data.are_currents;
    let mut read: Vec<&Model> = models[..n_train].iter().filter(are_currents).collect();
    if read.is_empty() {
        read = models.iter().filter(are_currents).collect();
    }
    if read.is_empty() {
        return Ok(None);
    }
    let constants = constants(&read, place)?;
    for model in models.iter_mut().filter(|model| model.course.data.are_currents) {
        *model = in_torques(model, &constants);
    }
    Ok(Some(wording::currents(&constants)))
}

/// Returns a recording's model with its currents turned into torques.
fn in_torques(model: &Model, constants: &[Option<f64>]) -> Model {
    let mut course = model.course.clone();
    let torques = course.data.channels.iter_mut().filter(|c| c.quantity == Quantity::Torque);
    for channel in torques {
        let (by, more) = constants[channel.index].map_or((1.0, SILENT), |by| (by, 1.0));
        channel.values.iter_mut().for_each(|value| *value *= by);
        channel.noise *= by * more;
    }
    Model::new(model.arm.clone(), course, model.loads.clone())
}
