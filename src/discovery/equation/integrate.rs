//! Runge–Kutta methods: the classical one of order 4 with a fixed step, and Dormand–Prince 5(4) with an
//! adaptive one.
//!
//! The fixed step differentiates well, so fits use it; the adaptive one says how small it must be.
//! Source: Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., 1993, §II.1
//! and §II.5 (table 5.2, step control of §II.4).

use super::number::Number;

/// Rates of change: `dx = f(t, x)`.
pub trait Rates<N> {
    /// Writes the rates at a time and state.
    fn rates(&mut self, t: f64, x: &[N], dx: &mut [N]);
}

/// Storage for a step, so that none is allocated in the loop.
#[derive(Debug, Clone)]
pub struct Work<N> {
    k: Vec<Vec<N>>,
    y: Vec<N>,
}

impl<N: Number> Work<N> {
    /// Storage for `n` states.
    pub fn new(n: usize) -> Self {
        let zero = N::constant(0.0);
        Self { k: vec![vec![zero; n]; 7], y: vec![zero; n] }
    }

    /// The rates at the beginning of a step: room for one vector of them.
    pub fn first(&mut self) -> &mut [N] {
        &mut self.k[0]
    }
}

/// One classical Runge–Kutta step of length `h`, s, from `t`; with `begun` the rates there are known already
/// ([`Work::first`]).
pub fn rk4<N: Number>(
    f: &mut impl Rates<N>,
    (t, h): (f64, f64),
    begun: bool,
    x: &mut [N],
    work: &mut Work<N>,
) {
    let Work { k, y } = work;
    let [k1, k2, k3, k4, ..] = &mut k[..] else { return };
    if !begun {
        f.rates(t, x, k1);
    }
    for i in 0..x.len() {
        y[i] = x[i] + k1[i].scaled(0.5 * h);
    }
    f.rates(t + 0.5 * h, y, k2);
    for i in 0..x.len() {
        y[i] = x[i] + k2[i].scaled(0.5 * h);
    }
    f.rates(t + 0.5 * h, y, k3);
    for i in 0..x.len() {
        y[i] = x[i] + k3[i].scaled(h);
    }
    f.rates(t + h, y, k4);
    for i in 0..x.len() {
        x[i] = x[i] + (k1[i] + k4[i]).scaled(h / 6.0) + (k2[i] + k3[i]).scaled(h / 3.0);
    }
}

/// Nodes of Dormand–Prince.
const C: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// Coefficients of its stages; the last row is the solution of order 5.
const A: [[f64; 6]; 7] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Order 5 minus order 4.
const E: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Tolerances of [`dopri5`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative.
    pub relative: f64,
    /// Absolute.
    pub absolute: f64,
}

/// Why an adaptive integration gave up.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Stuck {
    /// A state or a rate is not a finite number.
    #[error("a state is not a finite number at t = {t} s")]
    NotFinite {
        /// When, s.
        t: f64,
    },
    /// The steps became too small to move time, or too many.
    #[error("the steps shrank to nothing at t = {t} s; the equations are too stiff or jump")]
    TooStiff {
        /// When, s.
        t: f64,
    },
}

/// Integrates from `t0` to `t1` with steps as long as the tolerance allows; returns how many it took.
///
/// # Errors
///
/// [`Stuck`] when a state is no longer finite or the step shrinks to nothing.
pub fn dopri5(
    f: &mut impl Rates<f64>,
    (t0, t1): (f64, f64),
    x: &mut [f64],
    tolerance: Tolerance,
    work: &mut Work<f64>,
) -> Result<usize, Stuck> {
    // Equations of a few effects take some tens of steps from row to row.
    const MOST: usize = 1_000_000;
    let span = t1 - t0;
    let (mut t, mut h) = (t0, span);
    let mut steps = 0;
    let mut tried = 0;
    while t < t1 {
        tried += 1;
        if tried > MOST {
            return Err(Stuck::TooStiff { t });
        }
        h = h.min(t1 - t);
        let Work { k, y } = work;
        let mut error: f64 = 0.0;
        for stage in 0..7 {
            y.copy_from_slice(x);
            for (j, &a) in A[stage].iter().enumerate().take(stage) {
                for i in 0..x.len() {
                    y[i] += h * a * k[j][i];
                }
            }
            f.rates(t + C[stage] * h, y, &mut k[stage]);
        }
        // The last stage stands at the solution of order 5.
        for i in 0..x.len() {
            let e: f64 = (0..7).map(|s| E[s] * k[s][i]).sum::<f64>() * h;
            let scale = tolerance.absolute + tolerance.relative * x[i].abs().max(y[i].abs());
            error = error.max((e / scale).abs());
        }
        if error.is_finite() && error <= 1.0 {
            t += h;
            x.copy_from_slice(y);
            steps += 1;
            if t1 - t < 1e-12 * span {
                break;
            }
        } else if x.iter().any(|v| !v.is_finite()) {
            return Err(Stuck::NotFinite { t });
        }
        let factor = if error.is_finite() { 0.9 * error.max(1e-10).powf(-0.2) } else { 0.2 };
        h *= factor.clamp(0.2, 5.0);
        if h < 1e-12 * span.max(t.abs() * 1e-3) {
            return Err(if error.is_finite() {
                Stuck::TooStiff { t }
            } else {
                Stuck::NotFinite { t }
            });
        }
    }
    Ok(steps)
}
