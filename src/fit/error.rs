//! Why something cannot be fitted.

/// What can go wrong in a fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Fewer equations than unknowns.
    #[error(
        "{residuals} residuals and {priors} priors cannot determine {parameters} parameters: \
         add measurements, or fix parameters"
    )]
    TooFew {
        /// Number of residuals whose weight is not 0.
        residuals: usize,
        /// Number of priors on free parameters.
        priors: usize,
        /// Number of free parameters.
        parameters: usize,
    },
    /// A residual is not a number at the starting point.
    #[error("residual {residual} is not a finite number at the starting point")]
    NotFinite {
        /// Index of the first such residual.
        residual: usize,
    },
    /// An option does not fit the problem.
    #[error("fit option `{option}`: {why}")]
    Option {
        /// Which option.
        option: &'static str,
        /// What is wrong with it.
        why: Wrong,
    },
}

/// What is wrong with an option of a fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Wrong {
    /// It is about a parameter that does not exist.
    #[error("parameter {index} does not exist, there are {n}")]
    NoParameter {
        /// Which parameter, from 0.
        index: usize,
        /// How many there are.
        n: usize,
    },
    /// There is not one value for each parameter.
    #[error("{given} given for {n} parameters")]
    PerParameter {
        /// How many values there are.
        given: usize,
        /// How many parameters there are.
        n: usize,
    },
    /// There is not one value for each block of residuals.
    #[error("{given} given for {n} blocks")]
    PerBlock {
        /// How many values there are.
        given: usize,
        /// How many blocks there are.
        n: usize,
    },
    /// A weight is negative, or not finite.
    #[error("{0} is not a weight")]
    Weight(f64),
    /// The constant of a robust loss is not positive.
    #[error("its constant {0} is not above 0")]
    Constant(f64),
    /// A prior has no mean, or no spread.
    #[error("N({mean}, {std}²)")]
    Prior {
        /// Its mean.
        mean: f64,
        /// Its standard deviation.
        std: f64,
    },
    /// Nothing lies between two bounds.
    #[error("[{lower}, {upper}] is empty")]
    Empty {
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// Nothing lies between all bounds of a parameter.
    #[error("parameter {0} has none left")]
    NoneLeft(usize),
}
