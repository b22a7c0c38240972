//! Sentences at the prompt, and what it asks before it acts.
//!
//! A line that is no call is tried as a sentence. What it comes to is shown first; only a person's `y` has
//! it done. Sentences that it is taught are in `phrases`.

use std::cell::{LazyCell, RefCell};
use std::fmt::Write as _;

use crate::language::ast::{Expr, Step};
use crate::language::parse_line;
use crate::language::sentence::{self, Knowledge, Meaning, Understood};
use crate::report::exit::Exit;
use crate::report::{self, Failure};

use super::Session;

/// When the prompt asks before it acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Confirm {
    /// Before every call.
    All,
    /// Before what a sentence was taken to mean, and before anything on a real arm.
    #[default]
    Risky,
    /// Never.
    None,
}

impl Confirm {
    /// Reads `all`, `risky` or `none`.
    pub(super) fn named(word: &str) -> Option<Self> {
        match word {
            "all" => Some(Self::All),
            "risky" => Some(Self::Risky),
            "none" => Some(Self::None),
            _ => None,
        }
    }

    /// Says when it asks.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::All => "all: asks before every call",
            Self::Risky => "risky: asks before a sentence is acted on, and before a real arm moves",
            Self::None => "none: asks nothing",
        }
    }
}

/// A question that the prompt has put.
pub(super) enum Pending {
    /// Whether to carry this out.
    Run(Box<Step>, String),
    /// Which of these was meant.
    Which(Vec<Understood>),
    /// Whether lines are to move the real arm.
    Real,
}

/// Whether a line that is no call may be a sentence: words, and nothing of a call's punctuation.
pub(super) fn looks_like_one(line: &str) -> bool {
    line.split_whitespace().count() > 1
        && !line.contains(['(', ')', '{', '}', '=', '"'])
        && line.starts_with(char::is_alphabetic)
}

/// Reads what is worked out from what is measured: `filled(jar) / 2`; `None` of a name or a number, which say themselves what
/// they are.
fn quantity_of(value: &str) -> Option<Expr> {
    let Some(Step::Let(_, expr, _)) = parse_line(&format!("let value = {value}")).0 else {
        return None;
    };
    (!expr.calls().is_empty()).then_some(expr)
}

/// Asks which of several is meant.
fn which(choices: &[Understood]) -> String {
    format!("type a number from 1 to {}, or n", choices.len())
}

impl Session<'_, '_> {
    /// Tries a line as a sentence; `line` is as it was typed, before the names in it were put in.
    pub(super) fn sentence(&mut self, said: &str, line: &str) -> Result<(), Failure> {
        let phrases = self.taught.all();
        let cell = self.bench.cell()?;
        let library = cell.library().clone();
        let things = library.scene(&cell.scene().name).map(|(scene, _)| scene);
        let things = things.map(sentence::things).unwrap_or_default();
        // What is held is what "it" is, and is looked at only for a sentence that says so.
        let says_it = sentence::words(said).split(' ').any(|word| word == "it");
        let held = if says_it { cell.state().ok().and_then(|state| state.held) } else { None };
        let cell = RefCell::new(cell);
        let spots = LazyCell::new(|| cell.borrow_mut().spots().unwrap_or_default());
        let mut meaning = sentence::understand(
            said,
            &Knowledge {
                library: &library,
                things: &things,
                phrases: &phrases,
                it: held.as_deref(),
                spot: &|name| {
                    spots.iter().find(|(known, _)| known == name).map(|(_, spot)| spot.clone())
                },
                hindrance: &|call| cell.borrow_mut().hindrance(call),
            },
        );
        if let Meaning::Clear(found) = &mut meaning {
            for (_, _, value) in &mut found.slots {
                let worth = quantity_of(value).map(|expr| cell.borrow_mut().quantity(&expr));
                if let Some(Ok(Some(worth))) = worth {
                    let _ = write!(value, ", {worth} now");
                }
            }
        }
        let told = report::sentence::told(&meaning);
        match meaning {
            Meaning::Clear(found) => {
                self.style.say(told);
                let step = parse_line(&found.text).0;
                if let Some(step) = step {
                    self.ask_or_run(step, &found.text, true);
                }
            }
            Meaning::Ambiguous { choices, .. } => {
                self.style.say(told);
                self.put(which(&choices), Pending::Which(choices));
            }
            Meaning::Asked { line, .. } => {
                self.style.say(told);
                match line.strip_prefix(':') {
                    // None of these commands leaves the prompt.
                    Some(command) => _ = self.command(command),
                    None => _ = self.asked(&line)?,
                }
            }
            Meaning::Impossible { .. } => {
                self.style.say(told);
                self.worsen(Exit::No as u8);
            }
            Meaning::Unknown { help } => {
                if sentence::is_again(&sentence::words(line)) {
                    return self.again();
                }
                if self.proposed(said)? {
                    return Ok(());
                }
                let words = "not understood: neither a call nor a sentence that a task knows";
                return Err(Failure::input("repl::sentence", words).help(help));
            }
        }
        Ok(())
    }

    /// "Again": shows the last call that was begun, and asks whether to carry it out once more.
    pub(super) fn again(&mut self) -> Result<(), Failure> {
        let Some(call) = self.made.last().map(|made| made.call.clone()) else {
            return Err(Failure::input(
                "repl::sentence",
                "nothing has run yet that could be repeated",
            )
            .help("type a call such as `pick(jar)`; the Up key recalls what was typed"));
        };
        let Some(step) = parse_line(&call).0 else { return Ok(()) };
        let hindrance = match &step {
            Step::Act(act) => self.bench.cell()?.hindrance(&act.call),
            _ => None,
        };
        if let Some(why) = hindrance {
            let told = report::sentence::told(&Meaning::Impossible { why, help: None });
            self.style.say(format!("= {call}\n{told}"));
            self.worsen(Exit::No as u8);
            return Ok(());
        }
        self.style.say(format!("= {call}"));
        self.ask_or_run(step, &call, true);
        Ok(())
    }

    /// Has a model propose a call for a sentence; whether it is carried out is asked in any case.
    fn proposed(&mut self, said: &str) -> Result<bool, Failure> {
        let Some(propose) = self.hands.propose else { return Ok(false) };
        let cell = self.bench.cell()?;
        let Some(call) = propose(said, cell.library(), &cell.scene().name)? else {
            return Ok(false);
        };
        let Some(step) = parse_line(&call).0 else { return Ok(false) };
        self.style.say(report::sentence::proposed(&call));
        let question = format!("carry it out with the {}? y or n", self.robot);
        self.put(question, Pending::Run(Box::new(step), call));
        Ok(true)
    }

    /// Carries out a step, after asking when the person wants to be asked.
    pub(super) fn ask_or_run(&mut self, step: Step, meant: &str, is_guess: bool) {
        let is_simulated = matches!(self.robot.as_str(), "lab" | "twin");
        let asks = match self.confirm {
            Confirm::All => true,
            Confirm::Risky => is_guess || !is_simulated,
            Confirm::None => false,
        };
        if asks {
            let robot = &self.robot;
            // `--yes` is not meant for the calls of a prompt; who gave it looks for what is.
            let spared = if is_simulated { "" } else { "; `:confirm none` asks no more" };
            let question = format!("carry it out with the {robot}? y or n{spared}");
            self.put(question, Pending::Run(Box::new(step), meant.to_owned()));
        } else {
            self.run(step, meant);
        }
    }

    /// Takes a line as the answer to an open question; `false` when it is none, and the question is gone.
    pub(super) fn answered(&mut self, pending: Pending, line: &str) -> bool {
        // "Yes, please" says as much; which robot lines move is changed by the bare word alone.
        let answer = match pending {
            Pending::Real => line.to_lowercase(),
            _ => sentence::words(line),
        };
        if matches!(answer.as_str(), "n" | "no") {
            self.style.say("left undone");
            return true;
        }
        match pending {
            Pending::Run(step, meant) if matches!(answer.as_str(), "y" | "yes") => {
                self.run(*step, &meant);
                true
            }
            Pending::Which(choices) => {
                let Ok(number) = answer.parse::<usize>() else {
                    self.style.say("left undone");
                    return false;
                };
                let chosen = number.checked_sub(1).and_then(|at| choices.get(at));
                let Some(chosen) = chosen else {
                    self.put(which(&choices), Pending::Which(choices));
                    return true;
                };
                self.style.say(format!("= {}", chosen.text));
                if let Some(step) = parse_line(&chosen.text).0 {
                    // The person has just said which; that is the confirmation.
                    self.run(step, &chosen.text);
                }
                true
            }
            Pending::Real if answer == "yes" => {
                if let Err(failure) = self.take_real() {
                    self.fail(&failure);
                }
                true
            }
            Pending::Run(..) => {
                self.style.say("left undone");
                false
            }
            Pending::Real => {
                self.style.say(format!(
                    "left undone: that was not yes; lines are for the {} still",
                    self.robot
                ));
                false
            }
        }
    }
}
