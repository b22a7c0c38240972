//! Stepping at the prompt: `:step`, `:break`, `:back`, and the words while a run is paused.
//!
//! The run goes on in the thread that has the cell; when it wants a word it asks here, and the prompt
//! says where it stands: `pour 3/8> `. Lines that are no words of stepping are done as always, as far as
//! they need no arm. The stepping itself is [`crate::teach`].

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use crate::files;
use crate::language::ast::{Item, Step};
use crate::language::{self, Diagnostic, Source, text};
use crate::report::teach::{Earlier, Place, Teller};
use crate::report::{self, Failure};
use crate::teach::stepper::{Setup, Stepper};
use crate::teach::words;
use crate::teach::{answers, record};
use crate::workcell::check::check_step;
use crate::workcell::{Run, archive};

use super::line_source::Typed;
use super::{Next, Session};

/// How often a wish to stop is looked for while a word is waited for.
const LOOK: Duration = Duration::from_millis(20);

/// Asks for a line: the prompt, and where the line is to go; `None` ends the run.
type Asked = (String, Sender<Option<String>>);

impl Session<'_, '_> {
    /// Carries out a step typed at the prompt. A person can be waited for, so breakpoints pause it.
    pub(super) fn perform(&mut self, step: Step) -> Result<Run, Failure> {
        let setup = Setup { stops: self.stops.clone(), ..Setup::default() };
        if self.lines.is_person() {
            return self.led(step, setup);
        }
        let perform = self.hands.perform;
        self.bench.work(move |cell| perform(cell, &step))
    }

    /// Carries out a step with a stepper between its steps, and gives it the words it asks for.
    fn led(&mut self, step: Step, setup: Setup) -> Result<Run, Failure> {
        let (ask, asks) = channel::<Asked>();
        let (place, earlier) = (self.place(), self.earlier(&step));
        let (style, perform) = (self.style, self.hands.perform);
        let what = text::step(&step);
        let cancel = self.bench.cell()?.cancel();
        if self.lines.is_person() && !std::mem::replace(&mut self.is_told_to_stop, true) {
            style.note("Ctrl-C stops the arm; a line that is typed meanwhile does not");
        }
        let begun = self.bench.begin(move |cell| {
            let cancel = cell.cancel();
            let teller = Teller::new(style, place, earlier, move |prompt| {
                if cancel.is_cancelled() {
                    return None;
                }
                let (answer, answers) = channel();
                ask.send((prompt.to_owned(), answer)).ok()?;
                loop {
                    match answers.recv_timeout(LOOK) {
                        Ok(line) => return line,
                        Err(RecvTimeoutError::Timeout) if !cancel.is_cancelled() => {}
                        Err(_) => return None,
                    }
                }
            });
            let setup = Setup { dial: Some(cell.dial()), ..setup };
            cell.led_by(Box::new(Stepper::new(teller, setup)));
            let done = perform(cell, &step);
            cell.led_by_nobody();
            done
        })?;
        loop {
            if let Some(done) = self.bench.wait(&begun) {
                return done;
            }
            self.answer(&asks, &what, &|| cancel.is_cancelled());
        }
    }

    /// Gives a run that waits for a word the next one that is meant for it.
    fn answer(&mut self, asks: &Receiver<Asked>, what: &str, is_stopped: &dyn Fn() -> bool) {
        let Ok((prompt, answer)) = asks.try_recv() else { return };
        self.bench.pause(Some(what.to_owned()));
        // An Enter that was meant for the step before lets this one go nowhere.
        self.forget_typed();
        let line = self.word(&prompt, is_stopped);
        self.bench.pause(None);
        // Whoever asked has been stopped meanwhile, at the latest by this.
        let _ = answer.send(line);
    }

    /// Reads lines until one is a word of stepping; does the others. `None` ends the run.
    fn word(&mut self, prompt: &str, is_stopped: &dyn Fn() -> bool) -> Option<String> {
        loop {
            // No prompt of a run that has been stopped.
            if is_stopped() {
                return None;
            }
            self.lines.stepping(true);
            let typed = self.typed(prompt);
            self.lines.stepping(false);
            let line = match typed {
                Ok(Typed::Statement(statement)) => statement,
                Ok(Typed::Interrupted | Typed::End) => return None,
                Err(failure) => {
                    self.fail(&failure);
                    return None;
                }
            };
            if is_stopped() {
                // Ctrl-C came while it was waited for: the line is not for what has been stopped.
                self.held_back = Some(line);
                return None;
            }
            let is_remark = line.trim_start().starts_with("//");
            let is_for_prompt = line.trim_start().starts_with(['?', '!', ':'])
                || line.contains('(')
                || line.trim_start().starts_with("let ");
            if is_remark {
                continue;
            }
            if words::is_one(&line) || !is_for_prompt {
                return Some(line);
            }
            if self.survive(&line) == Next::Quit {
                return None;
            }
        }
    }

    /// `:step pick(jar)`, `:step breakfast.task`, `:step 3`.
    pub(super) fn step(&mut self, what: &str) -> Result<(), Failure> {
        if what.is_empty() {
            return Err(Failure::input("repl::step", "`:step` takes a call, a script or a run")
                .help("`:step pick(jar)`; `:step 3` steps through run 3, and nothing moves"));
        }
        if what.parse::<usize>().is_ok() {
            return self.step_through(what);
        }
        self.bench.cell()?;
        if Path::new(what).is_file() {
            return self.step_script(what);
        }
        let meant = self.values.fill(what).unwrap_or_else(|| what.to_owned());
        if let Some(step) = self.read(&meant) {
            self.stepped(step, &meant);
        }
        Ok(())
    }

    /// Steps through a call; returns whether it was done.
    fn stepped(&mut self, step: Step, meant: &str) -> bool {
        let setup = Setup {
            teaches: true,
            steps: true,
            answers: Some(self.hands.record.join(answers::FILE)),
            stops: self.stops.clone(),
            dial: None,
        };
        let done = self.led(step, setup);
        let is_done = done.as_ref().is_ok_and(|run| run.outcome.is_done());
        self.remember(done, meant);
        is_done
    }

    /// Steps through the calls of a script, until one is not done.
    fn step_script(&mut self, file: &str) -> Result<(), Failure> {
        let path = Path::new(file);
        let text = files::read::text(path).map_err(|error| Failure::unread(path, &error))?;
        let source = Source::new(file, text.as_str());
        let (program, mut wrong) = language::parse(&text);
        let mut steps = Vec::new();
        for item in program.items {
            match item {
                Item::Run(step) => steps.push(step),
                Item::Bad(_) => {}
                _ => {
                    return Err(Failure::input(
                        "repl::script",
                        format!("{file} defines something"),
                    )
                    .help(format!("leave the prompt and type `trueup teach {file}`")));
                }
            }
        }
        if wrong.is_empty() {
            let check = |step| check_step(step, &source, &self.library, &self.stdlib, &self.scope);
            wrong = steps.iter().flat_map(check).collect();
        }
        if wrong.iter().any(Diagnostic::is_error) {
            return Err(report::text_failure(&wrong, &source, self.style));
        }
        for step in steps {
            let meant = text::step(&step);
            if !self.stepped(step, &meant) {
                break;
            }
        }
        Ok(())
    }

    /// Steps through the record of a run; nothing moves, and no device is asked.
    fn step_through(&mut self, number: &str) -> Result<(), Failure> {
        let entry = self.entry(number)?;
        let run = self.load(&entry)?;
        self.style.say(format!(
            "run {} ({}): {}; this is the record, the arm does not move",
            entry.number, entry.name, run.task
        ));
        let earlier: Earlier = Box::new(Vec::new);
        let setup = Setup {
            teaches: true,
            steps: true,
            answers: Some(self.hands.record.join(answers::FILE)),
            stops: self.stops.clone(),
            dial: None,
        };
        let (ask, asks) = channel::<Asked>();
        let cancel = self.bench.cell()?.cancel();
        // A wish to stop was about an earlier line.
        cancel.clear();
        let (style, place) = (self.style, self.place());
        let steps = record::steps(&run.steps, &run.parse_graphs);
        let (task, dir) = (run.task.clone(), entry.dir.clone());
        let name = format!("run {}", entry.number);
        std::thread::scope(|scope| {
            let walk = scope.spawn(move || {
                let teller = Teller::new(style, place, earlier, move |prompt| {
                    let (answer, answers) = channel();
                    ask.send((prompt.to_owned(), answer)).ok()?;
                    answers.recv().ok()?
                });
                Stepper::new(teller, setup).over_record(&task, Some(&dir), &steps);
            });
            // Ends when the walk has, which drops the other side.
            while let Ok((prompt, answer)) = asks.recv() {
                self.bench.pause(Some(name.clone()));
                self.forget_typed();
                let _ = answer.send(self.word(&prompt, &|| cancel.is_cancelled()));
                self.bench.pause(None);
            }
            if let Err(panic) = walk.join() {
                // Told by whoever survives the line.
                std::panic::resume_unwind(panic);
            }
        });
        Ok(())
    }

    /// `:break`, `:break grasp`, `:break clear [grasp]`.
    pub(super) fn breakpoint(&mut self, what: &str) -> Result<(), Failure> {
        if what == "clear" {
            self.stops.clear(None);
        } else if let Some(name) = what.strip_prefix("clear ") {
            if !self.stops.clear(Some(name.trim())) {
                return Err(Failure::input("repl::break", format!("no breakpoint is `{name}`"))
                    .help("`:break` lists them"));
            }
        } else if !what.is_empty() {
            if let Some(doubt) = self.is_step(what)? {
                self.style.say(doubt);
            }
            self.stops.set(what);
        }
        match self.stops.all().as_slice() {
            [] => self.style.say("no breakpoint is set"),
            stops => {
                let only =
                    if self.lines.is_person() { "" } else { ", in what `:step` carries out" };
                self.style.say(format!("pauses before {}{only}", stops.join(", ")));
            }
        }
        Ok(())
    }

    /// Says when no step can have that name, or `Ok` with what is not known of it. Paths and labels are believed.
    fn is_step(&self, name: &str) -> Result<Option<String>, Failure> {
        let file = name.rsplit_once(':').map(|(file, _)| file);
        if file.is_some_and(|file| file.strip_suffix(".rhai").is_some()) {
            return self.is_line(name).map(|()| None);
        }
        let head = name.split('(').next().unwrap_or(name);
        if let Ok(number) = head.parse::<usize>() {
            return self.is_number(number);
        }
        let is_word = head.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !is_word || self.library.callable(head).is_some() {
            return Ok(None);
        }
        let tasks = self.library.tasks().map(|(task, _)| task.name.text.as_str());
        let actions = self.library.actions().map(|(action, _)| action.name.text.as_str());
        match language::nearest(head, tasks.chain(actions)) {
            // A label of `as` may be called anything, but hardly almost like an action.
            None => Ok(Some(format!(
                "no action or task is called `{head}`: it pauses only before a step with that label"
            ))),
            Some(near) => {
                Err(Failure::input("repl::break", format!("no action or task is called `{head}`"))
                    .help(format!("did you mean `:break {near}`?")))
            }
        }
    }

    /// Says when a script has no such line: `lift.rhai:99`.
    fn is_line(&self, place: &str) -> Result<(), Failure> {
        let Some((file, line)) = place.rsplit_once(':') else { return Ok(()) };
        let Some(script) = self.stdlib.file(&format!("actions/{file}")) else {
            let near = language::nearest(file, self.stdlib.script_names());
            let failure =
                Failure::input("repl::break", format!("no action runs a script `{file}`"));
            return Err(match near {
                Some(near) => failure.help(format!("did you mean `:break {near}:{line}`?")),
                None => failure.help("`:step` and `into` show the lines of a script"),
            });
        };
        let n_lines = script.lines().count();
        if line.parse::<usize>().is_ok_and(|line| (1..=n_lines).contains(&line)) {
            return Ok(());
        }
        Err(Failure::input("repl::break", format!("`{file}` has {n_lines} lines"))
            .help(format!("`:break {file}:{n_lines}` pauses at its last")))
    }

    /// Says when no step can have that number, or `Ok` with why it may have none.
    fn is_number(&self, number: usize) -> Result<Option<String>, Failure> {
        if number == 0 {
            return Err(Failure::input("repl::break", "steps are counted from 1")
                .help("`:break 1` pauses before the first step"));
        }
        let last = self.last.as_ref().map(|run| run.steps.len()).filter(|last| *last < number);
        Ok(last.map(|last| {
            format!("the last run had {last} steps: it pauses only in one that has {number}")
        }))
    }

    /// `:back [STEP]`: the record of the last run of this session, else of the newest that is kept, from
    /// its end.
    pub(super) fn back(&mut self, step: &str) -> Result<(), Failure> {
        let run = match (&self.last, archive::entries(self.hands.record).last()) {
            (Some(run), _) => (**run).clone(),
            (_, Some(newest)) => self.load(newest)?,
            (_, None) => {
                return Err(Failure::input("repl::back", "nothing has run yet")
                    .help("`:step pick(jar)` carries out a call step by step"));
            }
        };
        let of = run.steps.len();
        let at = match step.parse::<usize>() {
            Ok(number) => run.steps.iter().rposition(|record| record.number == number),
            Err(_) if step.is_empty() => self.looking.unwrap_or(of).checked_sub(1),
            Err(_) => None,
        };
        let Some(at) = at else {
            return Err(Failure::input("repl::back", "there is no such step to look back at")
                .help(match of {
                    0 => "the last run executed no step".to_owned(),
                    _ => format!("the last run has {of} steps; `:back {of}` shows the last"),
                }));
        };
        let number = run.steps[at].number;
        let name = format!("looking at step {number}");
        let dir = PathBuf::from(run.run_dir.as_deref().unwrap_or_default());
        self.style.tell(&report::record::again((&name, &dir), &run, Some(number), self.style)?);
        self.looking = Some(at);
        Ok(())
    }

    fn place(&self) -> Place {
        let library = self.library.clone();
        Box::new(move |name| {
            let (fluent, source) = library.fluent(name)?;
            Some(source.place(fluent.name.span))
        })
    }

    /// Reads earlier runs of the same task when they are asked for.
    fn earlier(&self, step: &Step) -> Earlier {
        let (root, task) = (self.hands.record.to_path_buf(), text::step(step));
        Box::new(move || archive::earlier(&Run::so_far(&task, &[]), None, &archive::entries(&root)))
    }

    /// `:undo-edit`, and `:redo-edit` where it is `again`.
    pub(super) fn undo_edit(&mut self, again: bool) -> Result<(), Failure> {
        let told = if again { self.edits.redo()? } else { self.edits.undo()? };
        self.taught.read_again(self.style);
        self.style.say(told);
        Ok(())
    }
}
