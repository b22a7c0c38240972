//! Currents regressed on what an arm needed: each joint's by itself, and beside a load that all of them bear.
//!
//! `i = (needed + borne) / k + friction + rotor + offset`. The noise is the current's, so it stands alone; a load is then
//! multiplied by the constants and is found step by step, with all else, which is linear, as good as it can be beside it.
//!
//! Source: Golub and Pereyra, "Separable nonlinear least squares: the variable projection method", 2003.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::super::links::fit::BETTER;
use crate::discovery::selection::related;

/// A load weighs something if it is this many times its standard deviation.
const TOLD: f64 = 5.0;

/// How many steps towards a load are taken at most; five are usual.
const STEPS: usize = 20;

/// A step that makes no more of a difference than this, in -2 ln of the odds, is the last.
const SETTLED: f64 = 1e-2;

/// The current of one joint with what it may be of, a row each.
#[derive(Debug)]
pub(super) struct Sensor {
    /// What is read, A.
    pub(super) current: DVector<f64>,
    /// What the arm as filed needs, N·m.
    pub(super) needed: DVector<f64>,
    /// One unit of fluid friction, of a rotor and of an offset, N·m.
    pub(super) smooth: [DVector<f64>; 3],
    /// One N·m of dry friction, for each of the speeds below which it may give way.
    pub(super) dry: Vec<DVector<f64>>,
}

/// What a load takes at one joint, a row each.
#[derive(Debug)]
pub(super) struct Borne {
    /// N·m.
    pub(super) torque: DVector<f64>,
    /// By how much that grows for one unit more of its mass, kg, and of its moment, kg·m: a column each.
    pub(super) change: DMatrix<f64>,
}

/// What the current of one joint says beside a load.
#[derive(Debug)]
struct Share {
    /// One over the constant, A/(N·m).
    inverse: f64,
    /// Its variance, were the load known.
    variance: f64,
    /// By how much it grows for one unit more of the load's numbers.
    by_load: Vector4<f64>,
    /// What it says of the load's numbers, which it is to be moved by: normal equations.
    gram: Matrix4<f64>,
    along: Vector4<f64>,
    /// The sum of squares that is left, A², and of how many rows.
    square: f64,
    rows: f64,
}

impl Share {
    /// Returns what is said with the dry friction that fits best.
    fn of(sensor: &Sensor, borne: &Borne) -> Option<Self> {
        let shares = sensor.dry.iter().filter_map(|dry| Self::with(sensor, dry, borne));
        shares.min_by(|a, b| a.square.total_cmp(&b.square))
    }

    fn with(sensor: &Sensor, dry: &DVector<f64>, borne: &Borne) -> Option<Self> {
        let [fluid, rotor, offset] = sensor.smooth.clone();
        let needed = &sensor.needed + &borne.torque;
        let columns = DMatrix::from_columns(&[needed, fluid, dry.clone(), rotor, offset]);
        let gram = columns.tr_mul(&columns);
        let ridge = DMatrix::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
        let inverse = (&gram + ridge).try_inverse()?;
        let x = &inverse * columns.tr_mul(&sensor.current);
        let left = &sensor.current - &columns * &x;
        let (square, rows) = (left.norm_squared().max(1e-300), left.len() as f64);
        let each = related(left.as_slice()) * square / (rows.max(6.0) - 5.0);
        // Of what a load would add, the other numbers take up what they can.
        let added = &borne.change * x[0];
        let taken = &inverse * columns.tr_mul(&added);
        let beyond = &added - &columns * &taken;
        let (gram, along) = (beyond.tr_mul(&beyond) / each, beyond.tr_mul(&left) / each);
        Some(Self {
            inverse: x[0],
            variance: (each * inverse[(0, 0)]).max(0.0),
            by_load: Vector4::from_fn(|k, _| -taken[(0, k)]),
            gram: Matrix4::from_fn(|i, k| gram[(i, k)]),
            along: Vector4::from_fn(|k, _| along[k]),
            square,
            rows,
        })
    }

    /// Returns the constant, N·m/A, and its standard deviation: of 1/k to k, to first order.
    fn constant(&self, variance: f64) -> (f64, f64) {
        (1.0 / self.inverse, variance.sqrt() / self.inverse.powi(2))
    }
}

/// What the currents of all joints say beside a load.
#[derive(Debug)]
pub(super) struct Fit {
    /// Mass, kg, and moment, kg·m, in the tip's frame.
    pub(super) load: Vector4<f64>,
    pub(super) covariance: Matrix4<f64>,
    shares: Vec<Share>,
    /// By how much the load should be another.
    step: Vector4<f64>,
}

impl Fit {
    fn of(sensors: &[Sensor], load: Vector4<f64>, borne: &[Borne]) -> Option<Self> {
        let shares = sensors.iter().zip(borne).map(|(sensor, borne)| Share::of(sensor, borne));
        let shares: Vec<Share> = shares.collect::<Option<_>>()?;
        let gram: Matrix4<f64> = shares.iter().map(|share| share.gram).sum();
        let along: Vector4<f64> = shares.iter().map(|share| share.along).sum();
        let ridge = Matrix4::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
        let covariance = (gram + ridge).cholesky()?.inverse();
        Some(Self { load, covariance, shares, step: covariance * along })
    }

    /// Returns every joint's constant, N·m/A, with its standard deviation, were the load known.
    pub(super) fn constants(&self) -> Vec<(f64, f64)> {
        self.shares.iter().map(|share| share.constant(share.variance)).collect()
    }

    /// Returns the same beside a load that is as uncertain as it is.
    pub(super) fn constants_with_load(&self) -> Vec<(f64, f64)> {
        let of = |share: &Share| {
            let by_load = share.by_load.dot(&(self.covariance * share.by_load));
            share.constant(share.variance + by_load.max(0.0))
        };
        self.shares.iter().map(of).collect()
    }

    /// Returns how little it says for itself, in -2 ln of the odds.
    fn cost(&self) -> f64 {
        self.shares.iter().map(|share| share.rows * (share.square / share.rows.max(1.0)).ln()).sum()
    }

    /// Returns whether its load weighs something and takes away a part of what is left without it.
    fn is_needed(&self, plain: &Self) -> bool {
        let parts = plain.shares.iter().zip(&self.shares).map(|(p, own)| p.square / own.square);
        let more = parts.sum::<f64>() / self.shares.len().max(1) as f64;
        self.load[0] > TOLD * self.covariance[(0, 0)].sqrt() && BETTER * more > 1.0
    }
}

/// Fits the constants without a load, and with one if it is needed; `borne` says what a load of some mass, kg, and moment, kg·m,
/// takes at every joint.
pub(super) fn fits(
    sensors: &[Sensor],
    borne: impl Fn(&Vector4<f64>) -> Option<Vec<Borne>>,
) -> Option<(Fit, Option<Fit>)> {
    let with = |load: Vector4<f64>| Fit::of(sensors, load, &borne(&load)?);
    let plain = with(Vector4::zeros())?;
    let (mut here, mut cost, mut step) = (plain.load, plain.cost(), plain.step);
    let mut best = None;
    for _ in 0..STEPS {
        let Some(next) = with(here + step) else { break };
        let fallen = cost - next.cost();
        if fallen > 0.0 {
            (here, cost, step) = (next.load, next.cost(), next.step);
            best = Some(next);
        } else {
            step *= 0.5;
        }
        if (0.0..SETTLED).contains(&fallen) {
            break;
        }
    }
    let best = best.filter(|best| best.is_needed(&plain));
    Some((plain, best))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 800;
    /// What the links beyond each joint of an arm in a plane weigh, times their distance, N·m.
    const LINKS: [f64; 3] = [40.0, 15.0, 3.0];
    /// How long its first two links are, m.
    const LENGTHS: [f64; 2] = [0.4, 0.3];
    /// N·m/A.
    const CONSTANTS: [f64; 3] = [11.0, 9.0, 5.0];

    /// A number between -1 and 1 that looks like chance.
    fn scatter(i: usize) -> f64 {
        let x = (i as f64 * 12.9898).sin() * 43758.547;
        2.0 * (x - x.floor()) - 1.0
    }

    /// The angle of a link from the horizontal, rad, and its joint's speed, rad/s, and acceleration, rad/s².
    fn motion(row: usize, link: usize) -> [f64; 3] {
        let (t, w) = (row as f64 * 0.02, 0.9 + 0.35 * link as f64);
        let (sine, cosine) = (w * t + link as f64).sin_cos();
        [0.2 * link as f64 + 0.9 * sine, 0.9 * w * cosine, -0.9 * w * w * sine]
    }

    fn rows(of: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(ROWS, |row, _| of(row))
    }

    /// What joint `from` bears of weights that act at the links, N·m.
    fn weighed(weights: [f64; 3], from: usize) -> DVector<f64> {
        rows(|row| (from..3).map(|link| weights[link] * motion(row, link)[0].cos()).sum())
    }

    /// What a mass at the third link with a moment along it weighs at the links, N·m.
    fn weights(mass: f64, moment: f64) -> [f64; 3] {
        [mass * LENGTHS[0], mass * LENGTHS[1], moment].map(|arm| 9.81 * arm)
    }

    fn bears(load: &Vector4<f64>) -> Vec<Borne> {
        let of_joint = |joint: usize| Borne {
            torque: weighed(weights(load[0], load[1]), joint),
            change: DMatrix::from_columns(&[
                weighed(weights(1.0, 0.0), joint),
                weighed(weights(0.0, 1.0), joint),
                rows(|_| 0.0),
                rows(|_| 0.0),
            ]),
        };
        (0..3).map(of_joint).collect()
    }

    /// Currents of an arm that bears a mass, kg, 0.12 m from its third joint, with friction in every joint.
    fn sensors(mass: f64) -> Vec<Sensor> {
        let of_joint = |joint: usize| {
            let needed = weighed(LINKS, joint);
            let load = weighed(weights(mass, 0.12 * mass), joint);
            let speed = rows(|row| motion(row, joint)[1]);
            let dry = speed.map(|dq| (dq / 1e-3).tanh());
            let noise = rows(|row| 0.02 * scatter(3 * row + joint));
            let torque = &needed + load + 2.0 * &speed + 1.5 * &dry + noise;
            Sensor {
                current: torque / CONSTANTS[joint],
                needed,
                smooth: [speed, rows(|row| motion(row, joint)[2]), rows(|_| 1.0)],
                dry: vec![dry],
            }
        };
        (0..3).map(of_joint).collect()
    }

    #[test]
    fn constants_are_found_beside_a_load_that_all_joints_share() {
        let (plain, with) = fits(&sensors(1.2), |load| Some(bears(load))).unwrap();
        let with = with.expect("a load is needed");
        assert!((with.load[0] - 1.2).abs() < 0.05, "{}", with.load);
        assert!((with.load[1] - 0.144).abs() < 0.01, "{}", with.load);
        let alone = plain.constants();
        for (joint, (value, std)) in with.constants_with_load().into_iter().enumerate() {
            let off = (value - CONSTANTS[joint]).abs();
            assert!(off < 0.02 * value && off < 5.0 * std, "joint {}: {value} +- {std}", joint + 1);
        }
        // By itself the last joint has no way to tell the load from its constant.
        assert!((alone[2].0 / CONSTANTS[2] - 1.0).abs() > 0.2, "{alone:?}");
    }

    #[test]
    fn no_load_is_found_where_there_is_none() {
        let (plain, with) = fits(&sensors(0.0), |load| Some(bears(load))).unwrap();
        assert!(with.is_none());
        for (joint, (value, _)) in plain.constants().into_iter().enumerate() {
            assert!((value / CONSTANTS[joint] - 1.0).abs() < 0.01, "joint {}: {value}", joint + 1);
        }
    }
}
