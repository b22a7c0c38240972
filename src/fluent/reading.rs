//! A reading: what one condition is worth, and how it came about.

use serde::{Deserialize, Serialize};

use crate::language::ast::{Expr, Span};
use crate::language::text;
use crate::units::Quantity;

/// Why an expression has no value at all, whatever the state.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[serde(tag = "code", rename_all = "snake_case")]
pub enum Error {
    /// A name that stands for nothing.
    #[error("nothing here is called `{name}`{}", suggestion.as_ref()
        .map(|s| format!("; did you mean `{s}`?")).unwrap_or_default())]
    UnknownName {
        /// The name.
        name: String,
        /// The nearest there is.
        suggestion: Option<String>,
    },
    /// A function that nobody defines.
    #[error("there is no fluent or function `{name}`")]
    UnknownFunction {
        /// The name.
        name: String,
    },
    /// Arguments that do not fit.
    #[error("{message}")]
    Arguments {
        /// What does not fit.
        message: String,
    },
    /// Two quantities that cannot be compared or added.
    #[error("`{left}` and `{right}` do not measure the same thing")]
    Dimension {
        /// Left of the operator.
        left: String,
        /// Right of the operator.
        right: String,
    },
    /// `==` on quantities without a tolerance.
    #[error("`{term}` compares quantities exactly; add `within`, for example `within 5 mm`")]
    NoTolerance {
        /// The comparison.
        term: String,
    },
    /// A tolerance that is nothing, or less.
    #[error("the tolerance is {is}; it should be more than {least}")]
    Tolerance {
        /// What it is.
        is: String,
        /// Nothing, in its unit.
        least: String,
    },
    /// Something else was wanted.
    #[error("`{term}` is {is}, and {wanted} is wanted here")]
    Kind {
        /// The expression.
        term: String,
        /// What it is.
        is: String,
        /// What it should be.
        wanted: String,
    },
    /// A vessel was wanted.
    #[error("`{object}` holds nothing, so it has no {what}")]
    NotAVessel {
        /// The object.
        object: String,
        /// What was asked of it.
        what: String,
    },
    /// A drawer was wanted.
    #[error("`{object}` slides in nothing, so it has no {what}")]
    NotADrawer {
        /// The object.
        object: String,
        /// What was asked of it.
        what: String,
    },
    /// A fluent defined in terms of itself.
    #[error("`{name}` is defined in terms of itself")]
    Circular {
        /// The fluent.
        name: String,
    },
    /// What the parser could not read.
    #[error("this expression could not be read")]
    Unreadable,
}

/// What a condition is worth in one state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Whether it holds; `None` when nobody knows.
    pub truth: Option<bool>,
    /// The deciding term's value.
    pub value: Option<Quantity>,
    /// The deciding term's limit.
    pub limit: Option<Quantity>,
    /// Signed margin of the deciding term, positive when it holds, in its own unit. `None` for a term
    /// that is yes or no.
    pub margin: Option<Quantity>,
    /// One standard deviation of the margin, SI; 0 when the state claims to be exact.
    pub sigma: f64,
    /// Margin over the term's tolerance: what ranks terms of different units.
    pub rank: f64,
    /// The deciding term as text, arguments filled in.
    pub term: String,
    /// Its bytes, in the file the fluent or the condition was read from.
    pub span: Span,
    /// The fluent whose body the term is part of, if any: `span` points into that fluent's file.
    pub fluent: Option<String>,
    /// Which way the thing is off, and what would mend it; when a place decides and it does not hold.
    pub direction: Option<Direction>,
    /// Why nobody knows.
    pub unknown: Option<String>,
    /// What is wrong with the program.
    pub error: Option<Error>,
    /// Every comparison and yes-or-no term that went into it, in order.
    pub terms: Vec<Term>,
}

/// One comparison or yes-or-no term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// As text.
    pub text: String,
    /// Its bytes.
    pub span: Span,
    /// Whether it holds.
    pub truth: Option<bool>,
    /// Its value.
    pub value: Option<Quantity>,
    /// Its limit.
    pub limit: Option<Quantity>,
    /// Its margin.
    pub margin: Option<Quantity>,
    /// One standard deviation, SI.
    pub sigma: f64,
}

/// Which way a thing would have to move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Direction {
    /// The thing.
    pub object: String,
    /// Unit vector in world coordinates, the way it would have to move.
    pub world: [f64; 3],
    /// The same as the camera sees it: `left`, `right`, `up`, `down`, `nearer` or `farther`.
    pub camera: String,
}

impl Reading {
    /// A term that is yes, no or unknown.
    pub(super) fn plain(expr: &Expr, truth: Option<bool>, unknown: Option<String>) -> Self {
        let rank = match truth {
            Some(true) => f64::MAX,
            Some(false) => f64::MIN,
            None => 0.0,
        };
        let term = text::expr(expr);
        let terms = vec![Term {
            text: term.clone(),
            span: expr.span,
            truth,
            value: None,
            limit: None,
            margin: None,
            sigma: 0.0,
        }];
        Self {
            truth,
            value: None,
            limit: None,
            margin: None,
            sigma: 0.0,
            rank,
            term,
            span: expr.span,
            fluent: None,
            direction: None,
            unknown: if truth.is_none() { unknown } else { None },
            error: None,
            terms,
        }
    }

    /// A condition that makes no sense.
    pub(super) fn wrong(expr: &Expr, error: Error) -> Self {
        let mut reading = Self::plain(expr, None, Some(error.to_string()));
        reading.error = Some(error);
        reading
    }

    /// The reading of `not`: truth and margin turned over.
    pub(super) fn negated(mut self) -> Self {
        self.truth = self.truth.map(|truth| !truth);
        self.rank = -self.rank;
        for margin in
            self.margin.iter_mut().chain(self.terms.iter_mut().filter_map(|t| t.margin.as_mut()))
        {
            margin.value = -margin.value;
        }
        for term in &mut self.terms {
            term.truth = term.truth.map(|truth| !truth);
        }
        // What would make it false is not what makes it true, and the text says the opposite now.
        self.direction = None;
        let negate = |said: &str| match said.strip_prefix("not ") {
            Some(bare) => bare.to_owned(),
            None => format!("not {said}"),
        };
        self.term = negate(&self.term);
        for term in &mut self.terms {
            term.text = negate(&term.text);
        }
        self
    }

    /// Says after the text of its comparison what it is about, where one condition has several.
    pub(super) fn about(mut self, what: &str) -> Self {
        for term in &mut self.terms {
            term.text = format!("{}: {what}", term.text);
        }
        self
    }

    /// The reading of `and` (`is_and`) or `or`: the deciding part's numbers, both parts' terms.
    pub(super) fn joined(self, other: Self, is_and: bool) -> Self {
        // For `and`, false beats unknown beats true, and among equals the smaller rank; `or` the reverse.
        let class = |reading: &Self| match reading.truth {
            Some(false) => 0,
            None => 1,
            Some(true) => 2,
        };
        let order = class(&self).cmp(&class(&other)).then(self.rank.total_cmp(&other.rank));
        let first = if is_and { order.is_le() } else { order.is_ge() };
        let mut terms = self.terms.clone();
        terms.extend(other.terms.iter().cloned());
        let mut decides = if first { self } else { other };
        decides.terms = terms;
        decides
    }
}
