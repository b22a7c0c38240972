//! What stands in the way of building a graph: each kind with its names and numbers, its code, and what would
//! help. Where it is, [`Problem`](crate::graph::Problem) says.

/// One thing that stands in the way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Obstacle {
    #[error("tasks call each other more than {most} deep")]
    TooDeep { most: usize },
    #[error("this task unrolls to more than {most} nodes")]
    TooLarge { most: usize },
    #[error("nothing called `{name}` can be done")]
    Unknown { name: String },
    /// The calls that lead back, first and last the same.
    #[error("`{name}` calls itself: {}", ring.join(" → "))]
    Recursion { name: String, ring: Vec<String> },
    /// As the language says it.
    #[error("{message}")]
    Arguments { message: String, help: Option<String> },
    #[error("`{call}` has no branch `{branch}`")]
    NoBranch { call: String, branch: String, known: Vec<String> },
    #[error("this step could not be read")]
    Unreadable,
    #[error("this is repeated 0 times")]
    NoRound,
    #[error("no step here is labelled `{label}`")]
    NoLabel { label: String, known: Vec<String> },
    #[error(transparent)]
    Priors(#[from] BadPriors),
}

/// Why priors are no probabilities.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum BadPriors {
    #[error("a prior is a number from 0 to 1, not {0}")]
    NoShare(f64),
    /// What those that are written add up to.
    #[error("the priors written here add up to {0}, so the others would never be taken")]
    NothingLeft(f64),
    #[error("every prior here is 0")]
    AllZero,
}

impl Obstacle {
    /// A short stable code.
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::TooDeep { .. } | Self::TooLarge { .. } => "graph::too_large",
            Self::Unknown { .. } => "graph::unknown",
            Self::Recursion { .. } => "graph::recursion",
            Self::Arguments { .. } => "graph::arguments",
            Self::NoBranch { .. } => "graph::via",
            Self::Unreadable => "graph::unreadable",
            Self::NoRound => "graph::repeat",
            Self::NoLabel { .. } => "graph::label",
            Self::Priors(_) => "graph::prior",
        }
    }

    /// What would help.
    pub(super) fn help(&self) -> Option<String> {
        let said = match self {
            Self::TooDeep { .. } => "let a task call what it does, and not the next one",
            Self::TooLarge { .. } => "repeat fewer times, or nest fewer loops",
            Self::Unknown { .. } => "a step is a call of a task or an action",
            Self::Recursion { .. } => "use `repeat upto n times { … }`",
            Self::Arguments { help, .. } => return help.clone(),
            Self::NoBranch { known, .. } if known.is_empty() => "there is nothing to choose in it",
            Self::NoBranch { known, .. } => {
                return Some(format!("branches in it: {}", known.join(", ")));
            }
            Self::Unreadable => "mend what `check` says about it first",
            Self::NoRound => "say how often it may be done at most",
            Self::NoLabel { label, known } if known.is_empty() => {
                return Some(format!("label a step: `… as {label}`"));
            }
            Self::NoLabel { known, .. } => {
                return Some(format!("steps labelled here: {}", known.join(", ")));
            }
            Self::Priors(_) => return None,
        };
        Some(said.to_owned())
    }
}
