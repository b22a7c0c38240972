//! What is left of every channel over time, with the numbers of the file and with what was found: for pictures.

use super::against::against;
use super::explain::ArmGap;
use super::term::Term;
use crate::discovery::Trace;
use crate::discovery::selection::{Hypothesis, Outcome};

/// Returns measured minus model for every channel of every recording: before, with the numbers of the file, and after.
pub(super) fn traces(
    filed: &ArmGap,
    gap: &ArmGap,
    outcome: &Outcome<Term>,
    names: &[&str],
) -> Vec<Trace> {
    let mut found = Vec::new();
    let with = |gap: &ArmGap, h: &Hypothesis<Term>| gap.with_known(&h.terms, &h.parameters);
    let (nothing, best) = (with(filed, &outcome.nothing), with(gap, &outcome.best));
    let befores = filed.train.iter().chain(&filed.heldout);
    let models = gap.train.iter().map(|m| (m, false)).chain(gap.heldout.iter().map(|m| (m, true)));
    for ((before, (model, held_out)), name) in befores.zip(models).zip(names) {
        let (Some(before), Some(after)) = (nothing.residuals(before), best.residuals(model)) else {
            continue;
        };
        let data = &model.course.data;
        let rows = data.n_rows();
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let in_units = |residuals: &[f64]| -> Vec<f64> {
                residuals[at * rows..(at + 1) * rows].iter().map(|r| r * channel.noise).collect()
            };
            let after = in_units(&after);
            found.push(Trace {
                against: against(model, channel, &after),
                recording: (*name).to_owned(),
                channel: channel.name.clone(),
                unit: channel.quantity.unit().to_owned(),
                noise: channel.noise,
                held_out,
                unseen: model.course.unseen.iter().map(|unseen| held_out && *unseen).collect(),
                along: "s",
                time: data.time.clone(),
                before: in_units(&before),
                after,
            });
        }
    }
    found
}
