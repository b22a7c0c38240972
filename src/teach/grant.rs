//! What a word does at a pause: it lets the run go on, looks at an earlier step, or asks about one.

use crate::execution::conduct::{Ahead, Dial, Word};

use super::questions::without_riddles;
use super::shown::{Front, Shown};
use super::stepper::{At, Going, Stepper};
use super::stops;
use super::words::Wish;

impl<F: Front> Stepper<F> {
    /// Does what a word asks for; returns what the run is told, if it is told anything.
    pub(super) fn grant(&mut self, wish: Wish, at: At<'_>) -> Option<Word> {
        let next = match at {
            At::Before(ahead) | At::Line(ahead, _) => Some(ahead),
            At::Failed | At::End => None,
        };
        match wish {
            Wish::Next if self.looking.is_some() => self.forward(next),
            Wish::Over | Wish::Out | Wish::Continue | Wish::Into if self.looking.is_some() => {
                self.present(next);
            }
            Wish::Next | Wish::Over | Wish::Out if matches!(at, At::Line(..)) => {
                return Some(self.in_script(&wish, at));
            }
            Wish::Next => return Some(self.go(Going::Step)),
            Wish::Continue => return Some(self.go(Going::Free)),
            Wish::Quit if matches!(at, At::End) => return Some(Word::Go),
            Wish::Quit => return Some(Word::Stop),
            Wish::Over => {
                let through = next.and_then(|ahead| self.unit(ahead)).map(|unit| unit.path.clone());
                return Some(self.go(through.map_or(Going::Step, Going::Through)));
            }
            Wish::Out => {
                let inner = next.and_then(|ahead| {
                    ahead
                        .inside()
                        .iter()
                        .rev()
                        .find(|part| !part.is_branch && part.last > part.first)
                });
                // What is part of nothing but the run is a step by itself.
                let through = inner.map(|part| part.path.clone());
                return Some(self.go(through.map_or(Going::Step, Going::Through)));
            }
            Wish::Into => return self.into(at),
            Wish::Back(number) => self.back(number, next),
            Wish::Forward => self.forward(next),
            Wish::Why(fluent) => {
                let upto = self.looking.map_or(self.seen.len(), |at| at + 1);
                let (fluent, steps) = (fluent.as_deref(), &self.seen[..upto]);
                self.front.show(&Shown::Why { fluent, steps });
            }
            Wish::Hint => self.hint(),
            Wish::Slow(percent) => {
                if let (Some(dial), Some(percent)) = (&self.setup.dial, percent) {
                    dial.turn(percent);
                }
                let percent = self.setup.dial.as_ref().map(Dial::percent);
                self.front.show(&Shown::Slow { percent });
            }
            Wish::Stops => self.show_stops(None, next),
            Wish::Break(name) => {
                self.show_stops(Some(name), next);
            }
            Wish::Clear(name) => {
                self.setup.stops.clear(name.as_deref());
                self.show_stops(None, next);
            }
            Wish::Help => self.front.show(&Shown::Help),
        }
        None
    }

    /// One line of a script, or the rest of it and a pause before the next step.
    fn in_script(&mut self, wish: &Wish, at: At<'_>) -> Word {
        match (wish, at) {
            (Wish::Next | Wish::Over, At::Line(ahead, _)) => self.go(Going::Line(ahead.number)),
            _ => self.go(Going::Step),
        }
    }

    fn go(&mut self, going: Going) -> Word {
        self.going = going;
        Word::Go
    }

    /// Shows what a sub-task is made of; of a single step, lets its script begin and pauses at its lines.
    fn into(&mut self, at: At<'_>) -> Option<Word> {
        let At::Before(ahead) = at else {
            match at {
                At::Line(ahead, _) => self.front.show(&Shown::Inside { task: None, ahead }),
                _ => self.present(None),
            }
            return None;
        };
        if let Some(task) = self.unit(ahead).cloned() {
            self.front.show(&Shown::Inside { task: Some(&task), ahead });
            self.entered.push(task.path);
            return None;
        }
        if ahead.script.is_some() {
            return Some(self.go(Going::Line(ahead.number)));
        }
        self.front.show(&Shown::Inside { task: None, ahead });
        None
    }

    fn back(&mut self, number: Option<usize>, next: Option<&Ahead>) {
        let wanted = match (number, self.looking) {
            (Some(number), _) => self.seen.iter().rposition(|record| record.number == number),
            (None, Some(at)) => at.checked_sub(1),
            (None, None) => self.seen.len().checked_sub(1),
        };
        match wanted {
            Some(at) => self.look(at, next),
            None => self.front.show(&Shown::NoStep { of: self.seen.len() }),
        }
    }

    fn forward(&mut self, next: Option<&Ahead>) {
        match self.looking {
            Some(at) if at + 1 < self.seen.len() => self.look(at + 1, next),
            _ => self.present(next),
        }
    }

    fn look(&mut self, at: usize, next: Option<&Ahead>) {
        self.looking = Some(at);
        let next = next.map(|ahead| ahead.number);
        let run_dir = self.run_dir.as_deref();
        let record = &self.seen[at];
        let (record, withheld) =
            if self.setup.teaches { without_riddles(record) } else { (record.clone(), 0) };
        self.front.show(&Shown::Looking { record: &record, next, run_dir, withheld });
    }

    fn present(&mut self, next: Option<&Ahead>) {
        self.looking = None;
        self.front.show(&Shown::Present { next: next.map(|ahead| ahead.number) });
    }

    /// Shows the breakpoints, after setting a new one that names a step of what is left of the run.
    fn show_stops(&mut self, new: Option<String>, next: Option<&Ahead>) {
        let (mut unknown, mut near) = (None, None);
        if let Some(name) = new {
            let checked = next.map_or(Ok(()), |ahead| stops::check(&name, ahead));
            match checked {
                Err(close) if !stops::is_line(&name) => (unknown, near) = (Some(name), close),
                _ => {
                    self.setup.stops.set(&name);
                }
            }
        }
        self.front.show(&Shown::Stops { stops: self.setup.stops.all(), unknown, near });
    }
}
