//! Choices: the names of their branches, their priors and what each branch does.

use std::collections::BTreeMap;

use super::super::ast::{Branch, Either, Span};
use super::super::diagnostic::Diagnostic;
use super::{Checker, Names};

impl Checker<'_> {
    /// Checks a choice branch by branch, then that its priors add up.
    pub(super) fn either(&mut self, either: &Either, names: &Names) {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        for branch in &either.branches {
            if let Some(first) = seen.insert(&branch.name.text, branch.name.span) {
                self.branch_named_twice(branch, first);
            }
            self.prior_is_a_probability(branch);
            for was in &branch.was {
                let taken = either.branches.iter().any(|b| b.name.text == was.text);
                self.was(was, taken, "branch");
            }
            if let Some(when) = &branch.when {
                self.condition("when", when, names);
            }
            self.block(&branch.block, names);
        }
        self.priors_add_up(either);
    }

    /// Complains about a branch that has the name of the one at `first`.
    fn branch_named_twice(&mut self, branch: &Branch, first: Span) {
        self.tell(
            Diagnostic::error(
                "task::duplicate",
                branch.name.span,
                format!("two branches are called `{}`", branch.name.text),
                "the second one",
            )
            .label(first, "the first one")
            .help("learnt counts hang on the name, so each needs its own"),
        );
    }

    /// Complains about a prior outside 0 to 1.
    fn prior_is_a_probability(&mut self, branch: &Branch) {
        if branch.prior.is_some_and(|prior| !(0.0..=1.0).contains(&prior)) {
            self.tell(
                Diagnostic::error(
                    "task::prior",
                    branch.name.span,
                    format!("the prior of `{}` is not a probability", branch.name.text),
                    "of this branch",
                )
                .help("write a number from 0 to 1"),
            );
        }
    }

    /// Tells when all priors are 0; warns when those given exceed 1, or when all are given and fall short of 1.
    fn priors_add_up(&mut self, either: &Either) {
        let given: Vec<f64> = either.branches.iter().filter_map(|b| b.prior).collect();
        let sum: f64 = given.iter().sum();
        if given.len() == either.branches.len() && sum <= 0.0 {
            self.tell(
                Diagnostic::error(
                    "task::prior",
                    either.span,
                    "every prior here is 0",
                    "no branch can be chosen",
                )
                .help("write priors that add up to 1"),
            );
            return;
        }
        let wrong = sum > 1.001 || (given.len() == either.branches.len() && sum < 0.999);
        if wrong {
            self.tell(
                Diagnostic::warning(
                    "task::prior",
                    either.span,
                    format!("the priors of these branches add up to {sum:.2}, not to 1"),
                    "they will be scaled",
                )
                .help("write priors that add up to 1"),
            );
        }
    }
}
