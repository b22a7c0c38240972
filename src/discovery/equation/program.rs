//! Equations as a flat list of operations over registers: no tree is walked while a model runs.
//!
//! Registers hold constants, parameters, states, inputs, delayed inputs, time, then every intermediate
//! result once (equal sub-expressions share a register). Operations that depend on parameters alone run
//! once for a simulation, those the rates need at every stage, those only the outputs need at every row.

use super::number::Number;

/// A register.
pub(super) type Reg = u16;

/// Functions of one value that are not written with a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unary {
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    Log,
    Sinh,
    Cosh,
    Tanh,
    Abs,
}

/// Functions of two values that are not written with a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Min,
    Max,
    Pow,
    Atan2,
    Hypot,
}

/// One operation: where its arguments are; its result goes to the register of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    Add(Reg, Reg),
    Sub(Reg, Reg),
    Mul(Reg, Reg),
    Div(Reg, Reg),
    Neg(Reg),
    Unary(Unary, Reg),
    Binary(Binary, Reg, Reg),
    /// A power with a whole exponent.
    PowI(Reg, i32),
    /// A power with another exponent that is written out; 0 below 0, as for a root.
    PowF(Reg, f64),
    /// Sign, as a steep ramp whose width is that of the site.
    Sign(Reg, u16),
    /// 0 or 1, as a steep ramp.
    Step(Reg, u16),
}

/// Below this a root's slope is held, so that a tank that runs dry does not make a derivative infinite.
const LEAST_ROOT: f64 = 1e-12;

impl Unary {
    /// Returns its value at `a`.
    #[inline]
    fn apply<N: Number>(self, a: N) -> N {
        let x = a.value();
        match self {
            Self::Sqrt if x <= 0.0 => N::constant(0.0),
            Self::Sqrt => a.chain(x.sqrt(), 0.5 / x.max(LEAST_ROOT).sqrt()),
            Self::Sin => a.chain(x.sin(), x.cos()),
            Self::Cos => a.chain(x.cos(), -x.sin()),
            Self::Tan => {
                let f = x.tan();
                a.chain(f, 1.0 + f * f)
            }
            Self::Asin => a.chain(x.asin(), 1.0 / (1.0 - x * x).sqrt()),
            Self::Acos => a.chain(x.acos(), -1.0 / (1.0 - x * x).sqrt()),
            Self::Atan => a.chain(x.atan(), 1.0 / (1.0 + x * x)),
            Self::Exp => {
                let f = x.exp();
                a.chain(f, f)
            }
            Self::Log => a.chain(x.ln(), 1.0 / x),
            Self::Sinh => a.chain(x.sinh(), x.cosh()),
            Self::Cosh => a.chain(x.cosh(), x.sinh()),
            Self::Tanh => {
                let f = x.tanh();
                a.chain(f, 1.0 - f * f)
            }
            Self::Abs => {
                if x < 0.0 {
                    -a
                } else {
                    a
                }
            }
        }
    }
}

impl Binary {
    /// Returns its value at `a` and `b`.
    #[inline]
    fn apply<N: Number>(self, a: N, b: N) -> N {
        match self {
            Self::Min => {
                if a.value() <= b.value() {
                    a
                } else {
                    b
                }
            }
            Self::Max => {
                if a.value() >= b.value() {
                    a
                } else {
                    b
                }
            }
            Self::Pow => {
                let (x, y) = (a.value(), b.value());
                if x <= 0.0 {
                    return N::constant(if y == 0.0 { 1.0 } else { 0.0 });
                }
                let f = x.powf(y);
                a.chain(0.0, f * y / x) + b.chain(f, f * x.ln())
            }
            Self::Atan2 => {
                let (y, x) = (a.value(), b.value());
                let r2 = (x * x + y * y).max(f64::MIN_POSITIVE);
                a.chain(y.atan2(x), x / r2) + b.chain(0.0, -y / r2)
            }
            Self::Hypot => {
                let (x, y) = (a.value(), b.value());
                let r = x.hypot(y);
                let by = 1.0 / r.max(f64::MIN_POSITIVE);
                a.chain(r, x * by) + b.chain(0.0, y * by)
            }
        }
    }
}

impl Op {
    /// Carries it out.
    #[inline]
    pub(super) fn apply<N: Number>(self, frame: &[N], widths: &[f64]) -> N {
        let at = |reg: Reg| frame[usize::from(reg)];
        match self {
            Self::Add(a, b) => at(a) + at(b),
            Self::Sub(a, b) => at(a) - at(b),
            Self::Mul(a, b) => at(a) * at(b),
            Self::Div(a, b) => at(a) / at(b),
            Self::Neg(a) => -at(a),
            Self::Unary(f, a) => f.apply(at(a)),
            Self::Binary(f, a, b) => f.apply(at(a), at(b)),
            Self::PowI(a, n) => {
                let a = at(a);
                let x = a.value();
                a.chain(x.powi(n), f64::from(n) * x.powi(n - 1))
            }
            Self::PowF(a, n) => {
                let a = at(a);
                let x = a.value();
                if x <= 0.0 {
                    return N::constant(0.0);
                }
                a.chain(x.powf(n), n * x.max(LEAST_ROOT).powf(n - 1.0))
            }
            Self::Sign(a, site) => {
                let a = at(a);
                let (f, df) = ramp(a.value(), widths[usize::from(site)]);
                a.chain(f, df)
            }
            Self::Step(a, site) => {
                let a = at(a);
                let (f, df) = ramp(a.value(), widths[usize::from(site)]);
                a.chain(0.5 + 0.5 * f, 0.5 * df)
            }
        }
    }

    /// Returns the registers of its arguments, the second of which only some have.
    pub(super) fn args(self) -> (Reg, Option<Reg>) {
        match self {
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::Binary(_, a, b) => (a, Some(b)),
            Self::Neg(a)
            | Self::Unary(_, a)
            | Self::PowI(a, _)
            | Self::PowF(a, _)
            | Self::Sign(a, _)
            | Self::Step(a, _) => (a, None),
        }
    }
}

/// `sign(x)` with a smooth cubic within `width` of 0, and its slope.
///
/// A jump at every reversal is neither in the metal (bristles bend before they slip) nor good for an
/// integrator, which would lose its order and shake around 0.
fn ramp(x: f64, width: f64) -> (f64, f64) {
    let s = x / width;
    if s >= 1.0 {
        (1.0, 0.0)
    } else if s <= -1.0 {
        (-1.0, 0.0)
    } else {
        (s * (1.5 - 0.5 * s * s), 1.5 * (1.0 - s * s) / width)
    }
}

/// The operations of a model in an order in which every argument comes before its use.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    /// Values of the constant registers, which come first.
    pub(super) constants: Vec<(Reg, f64)>,
    /// Register and operation, arguments first.
    pub(super) ops: Vec<(Reg, Op)>,
    /// Number of registers.
    pub(super) n_registers: usize,
    /// Indices into `ops` that depend on parameters alone.
    pub(super) once: Vec<u32>,
    /// Those the rates need besides.
    pub(super) rates: Vec<u32>,
    /// Those the outputs need besides `once`.
    pub(super) outputs: Vec<u32>,
}

impl Program {
    /// Carries out a selection of operations.
    #[inline(never)]
    pub(super) fn run<N: Number>(&self, selection: &[u32], frame: &mut [N], widths: &[f64]) {
        for &i in selection {
            let (reg, op) = self.ops[i as usize];
            frame[usize::from(reg)] = op.apply(frame, widths);
        }
    }
}
