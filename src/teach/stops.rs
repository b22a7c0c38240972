//! Where stepping pauses: breakpoints that a person sets, beside the `break` marks of a text.

use std::sync::{Arc, Mutex, PoisonError};

use crate::execution::conduct::{Ahead, Part};
use crate::language;
use crate::trace::Line;

/// Breakpoints, as they were named. Cloning shares them.
#[derive(Debug, Clone, Default)]
pub struct Stops(Arc<Mutex<Vec<String>>>);

impl Stops {
    /// Returns all of them, in the order they were set.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Sets one; returns whether it is new.
    pub fn set(&self, name: &str) -> bool {
        let mut stops = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_new = !stops.iter().any(|stop| stop == name);
        if is_new {
            stops.push(name.to_owned());
        }
        is_new
    }

    /// Takes one away, or all of them; returns whether there was any.
    pub fn clear(&self, name: Option<&str>) -> bool {
        let mut stops = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let before = stops.len();
        stops.retain(|stop| name.is_some_and(|name| stop != name));
        stops.len() < before
    }

    /// Returns the breakpoint that names a line of a script.
    pub fn at_line(&self, line: &Line) -> Option<String> {
        let place = line.place();
        self.all().into_iter().find(|stop| *stop == place)
    }

    /// Returns what pauses before a step: the first breakpoint that names it, or a mark in the text.
    pub fn hit(&self, ahead: &Ahead) -> Option<String> {
        let stop = self.all().into_iter().find(|stop| names(stop, ahead));
        stop.or_else(|| {
            let mark = ahead.mark.as_ref().filter(|mark| mark.holds)?;
            Some(mark.when.as_ref().map_or("break".into(), |when| format!("break when {when}")))
        })
    }
}

/// Whether a breakpoint names a line of a script: `lift.rhai:2`.
pub fn is_line(stop: &str) -> bool {
    stop.rsplit_once(':').is_some_and(|(file, line)| {
        file.strip_suffix(".rhai").is_some() && line.parse::<usize>().is_ok_and(|line| line > 0)
    })
}

/// Whether `stop` names a step, or a sub-task that begins with it.
fn names(stop: &str, ahead: &Ahead) -> bool {
    stop.parse() == Ok(ahead.number)
        || is_called(stop, &ahead.path, &ahead.action)
        || ahead.inside().iter().any(|part| part.first == ahead.number && is_part(stop, part))
}

fn is_part(stop: &str, part: &Part) -> bool {
    is_called(stop, &part.path, &part.label)
}

/// Whether `stop` is the path, its last part (which is the label of `as`), the call or its name.
pub(super) fn is_called(stop: &str, path: &str, call: &str) -> bool {
    let last = path.rsplit(['/', '.']).next().unwrap_or(path);
    let name = call.split('(').next().unwrap_or(call);
    [path, last, call, name].contains(&stop)
}

/// Says whether a step of what is left of a run can be meant by a name.
///
/// # Errors
///
/// The name that is near, if one is.
pub fn check(name: &str, ahead: &Ahead) -> Result<(), Option<String>> {
    let names = known(ahead);
    let number = name.parse::<usize>().ok();
    let is_to_come = number.is_some_and(|number| (ahead.number..=ahead.of).contains(&number));
    if is_to_come || names.contains(&name) {
        return Ok(());
    }
    Err(language::nearest(name, names.into_iter()).map(str::to_owned))
}

/// Returns the names that a breakpoint can have in what is left of a run.
pub fn known(ahead: &Ahead) -> Vec<&str> {
    let own = [(ahead.path.as_str(), ahead.action.as_str())];
    let later = ahead.later.iter().map(|step| (step.path.as_str(), step.action.as_str()));
    let parts = ahead.inside().iter().map(|part| (part.path.as_str(), part.label.as_str()));
    own.into_iter()
        .chain(later)
        .chain(parts)
        .flat_map(|(path, call)| {
            let above = path.split('/').map(|part| part.rsplit('.').next().unwrap_or(part));
            above.chain([call.split('(').next().unwrap_or(call), path, call])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execution::conduct::Mark;

    fn ahead() -> Ahead {
        let part = |path: &str, label: &str, first, last| Part {
            path: path.into(),
            label: label.into(),
            is_branch: path.contains('.'),
            first,
            last,
        };
        Ahead {
            number: 2,
            of: 9,
            path: "pour/pick/either.side/rising".into(),
            action: "approach(jar, side)".into(),
            place: None,
            script: None,
            parts: vec![part("pour", "pour(jar, cup)", 1, 9), part("pour/pick", "pick(jar)", 2, 4)],
            needs: Vec::new(),
            keeps: Vec::new(),
            gives: Vec::new(),
            mark: None,
            later: Vec::new(),
        }
    }

    #[test]
    fn a_step_is_named_by_number_path_label_call_or_the_task_it_begins() {
        for name in ["2", "rising", "approach", "approach(jar, side)", "pick", "pour/pick"] {
            let stops = Stops::default();
            assert!(stops.set(name) && !stops.set(name));
            assert_eq!(stops.hit(&ahead()), Some(name.to_owned()));
        }
        for name in ["3", "pour", "side", "jar", ""] {
            let stops = Stops::default();
            stops.set(name);
            assert_eq!(stops.hit(&ahead()), None, "{name}");
        }
    }

    #[test]
    fn what_names_no_step_that_is_left_is_told() {
        for name in ["2", "9", "rising", "approach", "pick", "pour"] {
            assert_eq!(check(name, &ahead()), Ok(()), "{name}");
        }
        assert_eq!(check("aproach", &ahead()), Err(Some("approach".into())));
        for name in ["Quatsch", "1", "10"] {
            assert!(check(name, &ahead()).is_err(), "{name}");
        }
    }

    #[test]
    fn a_mark_in_the_text_pauses_where_its_condition_is_not_false() {
        let stops = Stops::default();
        let when = Some("held(jar)".to_owned());
        let marked = |holds| Ahead { mark: Some(Mark { when: when.clone(), holds }), ..ahead() };
        assert_eq!(stops.hit(&marked(true)), Some("break when held(jar)".into()));
        assert_eq!(stops.hit(&marked(false)), None);
    }

    #[test]
    fn one_is_cleared_or_all_are() {
        let stops = Stops::default();
        for name in ["a", "b", "c"] {
            stops.set(name);
        }
        assert!(stops.clear(Some("b")) && !stops.clear(Some("b")));
        assert_eq!(stops.all(), ["a", "c"]);
        assert!(stops.clear(None) && !stops.clear(None));
    }
}
