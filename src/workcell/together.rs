//! Which steps of a `together` cannot go on at the same time: the language knows the steps, the stdlib knows
//! what their scripts work with.

use std::collections::BTreeSet;

use crate::execution::uses::Uses;
use crate::execution::walk::Texts as _;
use crate::language::ast::{Act, Hold, Item, Program, Recovery, Step, Together};
use crate::language::{Diagnostic, Library};

use super::{Stdlib, wording};

/// Complains about every `together` of a program that cannot be carried out.
pub(super) fn check(program: &Program, library: &Library, stdlib: &Stdlib) -> Vec<Diagnostic> {
    let checker = Checker { library, stdlib };
    let mut found = Vec::new();
    for item in &program.items {
        match item {
            Item::Task(task) => {
                let recoveries = task.recoveries.iter().flat_map(|Recovery { steps, .. }| steps);
                task.steps.iter().chain(recoveries).for_each(|s| checker.step(s, &mut found));
            }
            Item::Run(step) => checker.step(step, &mut found),
            _ => {}
        }
    }
    found
}

/// Complains about a step typed at the prompt.
pub(super) fn check_step(step: &Step, library: &Library, stdlib: &Stdlib) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    Checker { library, stdlib }.step(step, &mut found);
    found
}

struct Checker<'a> {
    library: &'a Library,
    stdlib: &'a Stdlib,
}

impl Checker<'_> {
    fn step(&self, step: &Step, found: &mut Vec<Diagnostic>) {
        if let Step::Together(together) = step {
            self.together(together, found);
        }
        for inner in step.inside() {
            self.step(inner, found);
        }
    }

    fn together(&self, together: &Together, found: &mut Vec<Diagnostic>) {
        let strands: Vec<(&Step, Uses)> =
            together.steps.iter().map(|step| (step, self.uses(step))).collect();
        for (k, (step, uses)) in strands.iter().enumerate() {
            let rival = strands[..k]
                .iter()
                .find_map(|(other, theirs)| Some((other.span(), uses.shared(*theirs)?)));
            if let Some((first, both)) = rival {
                found.push(wording::both_need(step.span(), first, both));
            }
            let until = match step {
                Step::Act(Act { holds, .. }) => holds.iter().any(|h| matches!(h, Hold::Until(_))),
                _ => false,
            };
            if until && !uses.joints && strands.iter().any(|(_, uses)| uses.joints) {
                found.push(wording::until_beside(step.span()));
            }
        }
        for step in &together.steps {
            if let Some(inner) = nested(step) {
                found.push(wording::nested_together(inner.span, together.span));
            }
        }
    }

    /// What a step works with, whatever it calls.
    fn uses(&self, step: &Step) -> Uses {
        let mut uses = Uses::default();
        let (mut open, mut seen) = (vec![step], BTreeSet::new());
        while let Some(step) = open.pop() {
            open.extend(step.inside());
            let Step::Act(act) = step else { continue };
            let name = act.call.name.text.as_str();
            if !seen.insert(name) {
                continue;
            }
            if let Some((task, _)) = self.library.task(name) {
                open.extend(&task.steps);
            }
            let action = self.library.action(name).and_then(|(action, _)| action.script.as_ref());
            let text = action.and_then(|(file, _)| {
                let own = self.library.scripts().get(file).map(String::as_str);
                own.or_else(|| self.stdlib.script(file))
            });
            uses = uses.and(text.map(Uses::of_script).unwrap_or_default());
        }
        uses
    }
}

/// Returns the first `together` at or below a step.
fn nested(step: &Step) -> Option<&Together> {
    match step {
        Step::Together(together) => Some(together),
        step => step.inside().into_iter().find_map(nested),
    }
}
