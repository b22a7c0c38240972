//! The commands that begin with a colon: one table for help, completion and "did you mean".

use std::fmt::Write as _;

use crate::graph::outline;
use crate::language;
use crate::language::ast::Step;
use crate::report::{self, Failure};
use crate::teach::words;
use crate::workcell::WorkCell;

use super::sentences::{Confirm, Pending};
pub(super) use super::table::COMMANDS;
use super::table::Command;
use super::{Next, Session};

fn help() -> String {
    let mut text = String::from(
        "type a call:   pour(jar, cup)      pick(jar)      Tab completes, Up recalls\n\
         a sentence:    pour water from the jar into the cup\n\
         a value:       let dose = 40 mL, then pour(jar, cup, amount: dose); `it` is the last object\n\
         a question:    visible(jar)      height(jar) > 5 cm      where is the jar?\n\
         a sum:         !150 * mL / 3\n\
         ?pour          what a name means: task, action, fluent, object\n\
         Ctrl-C         stops the arm and keeps the prompt; twice comes back at once\n",
    );
    for command in COMMANDS {
        let _ = writeln!(text, "{}", row(command));
    }
    text.trim_end().to_owned()
}

/// What a command takes and does, in a line.
fn row(command: &Command) -> String {
    let head = format!(":{} {}", command.name, command.takes);
    format!("{head:<25} {}", command.what)
}

impl Session<'_, '_> {
    /// Does what stands behind a colon.
    pub(super) fn command(&mut self, command: &str) -> Next {
        let (word, rest) = command.split_once(char::is_whitespace).unwrap_or((command, ""));
        let rest = rest.trim();
        let done = match word {
            "quit" | "q" | "exit" => return Next::Quit,
            "help" | "h" => self.help(rest),
            "objects" => self.objects(),
            "tasks" => {
                self.tasks();
                Ok(())
            }
            "graph" => self.graph(rest),
            "look" => self.moving(WorkCell::perceive, "looked").and_then(|()| self.objects()),
            "align" => self.moving(WorkCell::align, "aligned"),
            "step" => self.step(rest),
            "break" => self.breakpoint(rest),
            "back" => self.back(rest),
            "fork" => self.fork(rest),
            "quiz" => self.quiz(rest),
            "stop" | "halt" => Err(nothing_stepped("stop")),
            "undo-edit" => self.undo_edit(false),
            "redo-edit" => self.undo_edit(true),
            "why" => self.why(rest),
            "gap" => self.gap(rest),
            "runs" => {
                self.list_runs();
                Ok(())
            }
            "replay" => self.replay(rest),
            "diff" => self.diff(rest),
            "twin" => self.take_twin(),
            "real" => {
                self.ask_real();
                Ok(())
            }
            "reset" => self.reset(),
            "seed" => self.seed(rest),
            "confirm" => self.set_confirm(rest),
            "phrase" => self.phrase(rest),
            "set" => self.set(rest),
            "save" => self.save(rest),
            other if words::is_word(other) => Err(nothing_stepped(other)),
            other => Err(unknown(other)),
        };
        if let Err(failure) = done {
            self.fail(&failure);
        }
        Next::Prompt
    }

    /// Does something that may move the arm.
    fn moving(
        &mut self,
        what: fn(&mut WorkCell) -> Result<(), crate::workcell::Error>,
        done: &str,
    ) -> Result<(), Failure> {
        let style = self.style;
        let worked = self
            .bench
            .work(move |cell| what(cell).map_err(|error| report::cell_failure(&error, style)));
        if let Err(failure) = &worked {
            self.look_for_fault(Self::is_fault(failure));
        }
        worked?;
        self.style.say(done);
        Ok(())
    }

    /// Tells how something is done, else what a name means, else what a command does; of nothing in particular, what there is.
    fn help(&self, wanted: &str) -> Result<(), Failure> {
        if wanted.is_empty() {
            self.style.tell(&help());
            return Ok(());
        }
        let word = wanted.trim_start_matches([':', '?']);
        let topics = self.hands.topics;
        let of_topic = topics.iter().find(|(name, _)| *name == word).map(|(_, told)| told.clone());
        let told = of_topic
            .or_else(|| language::assist::describe(&self.library, &self.scope, word))
            .or_else(|| COMMANDS.iter().find(|command| command.name == word).map(row));
        if let Some(told) = told {
            self.style.tell(&told);
            return Ok(());
        }
        let known = topics.iter().map(|(name, _)| *name);
        let known = known.chain(COMMANDS.iter().map(|command| command.name));
        let near = language::nearest(word, known)
            .or_else(|| language::assist::nearest_name(&self.library, &self.scope, word));
        let words = format!("there is no topic, name or command `{word}`");
        let failure = Failure::input("repl::unknown", words);
        Err(match near {
            Some(near) => failure.help(format!("did you mean `:help {near}`?")),
            None => failure.help("`:help` lists the commands, `:tasks` what can be called"),
        })
    }

    fn objects(&mut self) -> Result<(), Failure> {
        let style = self.style;
        let cell = self.bench.cell()?;
        let state = cell.state().map_err(|error| report::cell_failure(&error, style))?;
        style.say(report::objects(cell.scene(), &state));
        Ok(())
    }

    fn tasks(&self) {
        for (task, _) in self.library.tasks() {
            self.style.say(report::signature(&task.name.text, &task.params, &task.doc));
        }
    }

    fn graph(&mut self, call: &str) -> Result<(), Failure> {
        if call.is_empty() {
            return Err(Failure::input("repl::graph", "`:graph` takes a call")
                .help("type one, such as `:graph pour(jar, cup)`"));
        }
        if let Some(wanted) = call.strip_prefix("--energy") {
            return self.energy(wanted.trim());
        }
        let call = self.values.fill(call).unwrap_or_else(|| call.to_owned());
        let Some(Step::Act(act)) = self.read(&call) else { return Ok(()) };
        let style = self.style;
        let graph = self.bench.cell()?.graph(&act.call);
        let graph = graph.map_err(|error| report::cell_failure(&error, style))?;
        let learnt = outline::Learnt::default();
        style.say(outline::outline(&graph, &learnt).trim_end());
        Ok(())
    }

    fn ask_real(&mut self) {
        if self.robot != "twin" {
            return self.style.say(format!("lines move the {} already", self.robot));
        }
        let question = format!("lines will move the {}: type yes", self.hands.real);
        self.put(question, Pending::Real);
    }

    /// Lets lines move the robot again, once a person has said so.
    pub(super) fn take_real(&mut self) -> Result<(), Failure> {
        let mut aside = self.aside.take();
        let was_lost = aside.as_mut().is_some_and(WorkCell::is_lost);
        let cell = match aside {
            Some(cell) if !was_lost => cell,
            lost => {
                // A server may take one connection at a time.
                drop(lost);
                let seed = self.bench.cell()?.seed();
                (self.hands.open)(self.hands.real, seed)?
            }
        };
        cell.robot_name().clone_into(&mut self.robot);
        self.bench.exchange(cell)?;
        let anew = if was_lost {
            "; the connection was lost, and this is a new one: where arm, camera and things are is found anew"
        } else {
            ""
        };
        self.style.say(format!("lines move the {} now{anew}", self.robot));
        Ok(())
    }

    fn set_confirm(&mut self, word: &str) -> Result<(), Failure> {
        if !word.is_empty() {
            self.confirm = Confirm::named(word).ok_or_else(|| {
                Failure::input("repl::confirm", format!("`{word}` does not say when to ask"))
                    .help("use all, risky or none")
            })?;
        }
        self.style.say(self.confirm.words());
        Ok(())
    }

    fn set(&mut self, rest: &str) -> Result<(), Failure> {
        let (name, value) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let value = value.trim();
        match (name, value) {
            ("", _) => {
                self.style.say(format!("confirm  {}", self.confirm.words()));
                self.style.say(format!("seed     {}", self.bench.cell()?.seed()));
                for (name, value) in self.values.all() {
                    self.style.say(format!("{name} = {value}"));
                }
                Ok(())
            }
            (name, "") => Err(Failure::input("repl::set", format!("`:set {name}` lacks a value"))
                .help("`:set seed 7`, `:set dose 40 mL`; `:set` alone lists what is set")),
            ("confirm", word) => self.set_confirm(word),
            ("seed", number) => self.seed(number),
            (name, value) => self.statement(&format!("let {name} = {value}")),
        }
    }

    /// Shows or changes the number that chance comes from.
    fn seed(&mut self, number: &str) -> Result<(), Failure> {
        if number.is_empty() {
            let seed = self.bench.cell()?.seed();
            self.style.say(format!("seed {seed}"));
            return Ok(());
        }
        let seed = number.parse().map_err(|_| {
            Failure::input("repl::set", format!("`{number}` is not a seed"))
                .help("a seed is a whole number, such as 7")
        })?;
        self.bench.cell()?.set_seed(seed);
        let laboratory =
            if self.robot == "lab" { ", in the laboratory after `:reset`" } else { "" };
        self.style.say(format!("chance in the twin comes from {seed} from now on{laboratory}"));
        Ok(())
    }

    /// Opens the laboratory or the twin anew: everything stands and is filled as at the start.
    fn reset(&mut self) -> Result<(), Failure> {
        if !matches!(self.robot.as_str(), "lab" | "twin") {
            return Err(Failure::input("repl::reset", "a real table cannot be reset from here")
                .help("put things back and fill them by hand, then `:look`"));
        }
        let seed = self.bench.cell()?.seed();
        let cell = (self.hands.open)(&self.robot, seed)?;
        self.bench.exchange(cell)?;
        self.style.say(format!("everything stands and is filled as at the start (seed {seed})"));
        Ok(())
    }
}

/// Says of a word that is for a run which is being stepped that none is.
pub(super) fn nothing_stepped(word: &str) -> Failure {
    let words = match word {
        "stop" => "nothing is under way; the arm holds its position".to_owned(),
        _ => format!("`{word}` is a word of stepping, and nothing is being stepped"),
    };
    Failure::input("repl::paused", words).help(match word {
        "back" => "`:back` looks at the last run's steps, `:step pick(jar)` pauses before each",
        "stop" => "Ctrl-C stops the arm while it moves; what is typed then waits until it is done",
        "clear" => "`:break clear` takes breakpoints away, `:step pick(jar)` pauses at each step",
        _ => "`:step pick(jar)` pauses before each step, `:break grasp` before one",
    })
}

fn unknown(word: &str) -> Failure {
    let failure = Failure::input("repl::command", format!("there is no `:{word}`"));
    match language::nearest(word, COMMANDS.iter().map(|command| command.name)) {
        Some(near) => failure.help(format!("did you mean `:{near}`?")),
        None => failure.help("`:help` lists the commands"),
    }
}
