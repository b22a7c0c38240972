//! What a word does at a pause: it lets the run go on, looks at an earlier step, or asks about one.

use crate::execution::conduct::{Ahead, Dial, Word};
use crate::language;

use super::questions::without_riddles;
use super::shown::{Front, Shown};
use super::stepper::{At, Going, Stepper};
use super::stops::known;
use super::words::Wish;

impl<F: Front> Stepper<F> {
    /// Does what a word asks for; returns what the run is told, if it is told anything.
    pub(super) fn grant(&mut self, wish: Wish, at: At<'_>) -> Option<Word> {
        let next = match at {
            At::Before(ahead) => Some(ahead),
            At::Failed | At::End => None,
        };
        match wish {
            Wish::Next if self.looking.is_some() => self.forward(next),
            Wish::Over | Wish::Out | Wish::Continue | Wish::Into if self.looking.is_some() => {
                self.present(next);
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
            Wish::Into => self.into(next),
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

    fn go(&mut self, going: Going) -> Word {
        self.going = going;
        Word::Go
    }

    fn into(&mut self, next: Option<&Ahead>) {
        let Some(ahead) = next else { return self.present(None) };
        match self.unit(ahead).cloned() {
            Some(task) => {
                self.front.show(&Shown::Inside { task: Some(&task), ahead });
                self.entered.push(task.path);
            }
            None => self.front.show(&Shown::Inside { task: None, ahead }),
        }
    }

    fn back(&mut self, number: Option<usize>, next: Option<&Ahead>) {
        let wanted = match (number, self.looking) {
            (Some(number), _) => self.seen.iter().rposition(|record| record.number == number),
            (None, Some(at)) => at.checked_sub(1),
            // After a step the last one is what is on the screen already.
            (None, None) => self.seen.len().checked_sub(if next.is_some() { 1 } else { 2 }),
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
        let record = if self.setup.teaches { &without_riddles(record) } else { record };
        self.front.show(&Shown::Looking { record, next, run_dir });
    }

    fn present(&mut self, next: Option<&Ahead>) {
        self.looking = None;
        self.front.show(&Shown::Present { next: next.map(|ahead| ahead.number) });
    }

    /// Shows the breakpoints, after setting a new one that names a step of what is left of the run.
    fn show_stops(&mut self, new: Option<String>, next: Option<&Ahead>) {
        let names = next.map(known).unwrap_or_default();
        let is_known = |name: &String| {
            name.parse::<usize>().is_ok() || names.contains(&name.as_str()) || next.is_none()
        };
        let (mut unknown, mut near) = (None, None);
        match new {
            Some(name) if !is_known(&name) => {
                near = language::nearest(&name, names.into_iter()).map(str::to_owned);
                unknown = Some(name);
            }
            Some(name) => {
                self.setup.stops.set(&name);
            }
            None => {}
        }
        self.front.show(&Shown::Stops { stops: self.setup.stops.all(), unknown, near });
    }
}
