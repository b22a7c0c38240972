//! Vessels that run over.

use crate::language::names_in;
use crate::units::Dimension;

use super::super::edit::{Patch, fresh};
use super::super::wording;
use super::{Draft, depends, p, velocities};

/// Vessels that run over: the state spills what is above a level, and what is spilt may go on.
pub(super) fn levels(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    let found = velocities(ground);
    for (s, state) in model.states.iter().enumerate() {
        let mechanical = found.iter().any(|(v, q)| *v == s || *q == Some(s));
        let range = ground.states[s];
        if mechanical || range.low < -0.05 * range.span() || range.span() <= 0.0 {
            continue;
        }
        let name = state.name.clone();
        let dimension = model.units.of(&name);
        // Over the brim a level falls back within half a step of the recording; quicker would shake a step of RK4.
        let brim = crate::units::significant(2.0 / ground.step, 2);
        let spill = fresh(ground.model, &format!("{name}_spill"));
        let at = |part: f64| range.low + part * range.span();
        let starts = [at(0.95), at(0.85), at(0.7), at(0.5)];
        let level = || {
            p("level", "full", dimension, &starts)
                .within(at(0.05), at(1.0) + 0.02 * range.span())
                .shape()
        };
        let next: Vec<String> = model
            .states
            .iter()
            .filter(|other| other.name != name)
            .filter(|other| {
                ground.model.equations.iter().any(|e| {
                    e.name.text == other.name
                        && names_in(&e.formula).iter().any(|n| depends(ground.model, n, &name))
                })
            })
            .map(|other| other.name.clone())
            .collect();
        let write = |n: &[String], to: Option<&String>| {
            let mut patch = Patch::default();
            patch.lets.push((spill.clone(), format!("{brim}*max({name} - {}, 0)", n[0])));
            patch.rates.push((name.clone(), format!("- {spill}")));
            let mut equation = format!("{name} spills above {}", n[0]);
            if let Some(to) = to {
                patch.rates.push((to.clone(), format!("+ {}*{spill}", n[1])));
                equation.push_str(&wording::spill_goes_on(&n[1], to));
            }
            (patch, equation)
        };
        draft.add(("overflow", &name), &[level()], &[], |n| write(n, None));
        for to in &next {
            let share = p("share", "share", Some(Dimension::NONE), &[0.5]).within(0.0, 3.0);
            draft.add(("overflow", &name), &[level(), share], &[], |n| write(n, Some(to)));
        }
    }
}
