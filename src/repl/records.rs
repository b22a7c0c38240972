//! Commands that look at runs which are over: `:why`, `:runs`, `:replay`, `:diff`, `:gap`. None moves the arm.

use std::path::Path;

use crate::language::ast::Step;
use crate::report::{self, Failure, kept};
use crate::workcell::Run;
use crate::workcell::archive::{self, Entry};

use super::Session;

/// How many runs `:runs` shows.
const MOST: usize = 20;

impl Session<'_, '_> {
    pub(super) fn entries(&self) -> Vec<Entry> {
        archive::entries(self.hands.record)
    }

    /// Returns the run of that number or folder.
    pub(super) fn entry(&self, wanted: &str) -> Result<Entry, Failure> {
        kept::entry(self.hands.record, wanted)
    }

    pub(super) fn load(&self, entry: &Entry) -> Result<Run, Failure> {
        kept::load(entry, self.style)
    }

    pub(super) fn list_runs(&self) {
        self.style.tell(&kept::list(self.hands.record, Some(MOST)).words);
    }

    pub(super) fn replay(&self, rest: &str) -> Result<(), Failure> {
        let mut words = rest.split_whitespace();
        let Some(wanted) = words.next() else {
            return Err(Failure::input("repl::replay", "`:replay` takes a run")
                .help("`:replay 1`, or `:replay 1 3` for its third step"));
        };
        let step = match words.next() {
            None => None,
            Some(word) => Some(word.parse::<usize>().map_err(|_| {
                Failure::input("repl::replay", format!("`{word}` is not a step"))
                    .help("a step is a number from 1")
            })?),
        };
        let entry = self.entry(wanted)?;
        let run = self.load(&entry)?;
        let name = format!("run {} ({})", entry.number, entry.name);
        self.style.tell(&report::record::again((&name, &entry.dir), &run, step, self.style)?);
        Ok(())
    }

    /// `:fork STEP [CALL]`: what if, from a past step of the last run of this session, else of the newest that
    /// is kept.
    pub(super) fn fork(&mut self, rest: &str) -> Result<(), Failure> {
        let (step, call) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let after: usize = step.parse().map_err(|_| {
            Failure::input("repl::fork", "`:fork` takes a step, and a call if you like").help(
                "`:fork 3` rehearses what came after step 3; `:fork 3 place(jar)` something else",
            )
        })?;
        let run = match (&self.last, self.entries().last()) {
            (Some(run), _) => (**run).clone(),
            (_, Some(newest)) => {
                let mut run = self.load(newest)?;
                // Where it is now, wherever it was made.
                run.run_dir = Some(newest.dir.display().to_string());
                self.style.say(format!("run {} ({}):", newest.number, newest.name));
                run
            }
            (_, None) => return Err(Failure::input("repl::fork", "nothing has run yet")),
        };
        let call = call.trim();
        let call = self.values.fill(call).unwrap_or_else(|| call.to_owned());
        let call = if call.is_empty() {
            None
        } else {
            match self.read(&call) {
                Some(Step::Act(act)) => Some(act.call),
                Some(_) => {
                    let words = format!("`{call}` is no single call");
                    return Err(Failure::input("repl::fork", words).help("`:fork 3 place(jar)`"));
                }
                None => return Ok(()),
            }
        };
        let style = self.style;
        let fork = self.bench.work(move |cell| {
            cell.fork(&run, after, call.as_ref())
                .map_err(|error| report::cell_failure(&error, style))
        })?;
        if style.json {
            style.document(&fork);
        } else {
            style.tell(&report::fork::told(&fork, style));
        }
        Ok(())
    }

    pub(super) fn diff(&self, rest: &str) -> Result<(), Failure> {
        let words: Vec<&str> = rest.split_whitespace().collect();
        let [a, b] = words[..] else {
            return Err(Failure::input("repl::diff", "`:diff` takes two runs")
                .help("`:diff 1 2`; `:runs` lists them"));
        };
        let (a, b) = (self.entry(a)?, self.entry(b)?);
        let (first, second) = (self.load(&a)?, self.load(&b)?);
        let told = report::record::difference((a.number, &first), (b.number, &second));
        self.style.tell(&told.join("\n"));
        Ok(())
    }

    /// `:graph --energy [RUN]`: of the last run when none is named.
    pub(super) fn energy(&self, wanted: &str) -> Result<(), Failure> {
        let entry = if wanted.is_empty() {
            archive::entries(self.hands.record).pop().ok_or_else(|| {
                Failure::input("repl::graph", "nothing has run yet")
                    .help("a run has an energy, a plan has none")
            })?
        } else {
            self.entry(wanted)?
        };
        let run = self.load(&entry)?;
        let name = format!("run {}, {}", entry.number, run.task);
        match report::energy::of(&run) {
            Some(energy) => self.style.say(report::energy::words(&name, &energy)),
            None => self.style.say(format!("{name}: nothing was run")),
        }
        Ok(())
    }

    /// `:why [FLUENT]`: about the last run of this session, else about the newest that is kept; a condition
    /// no run spoke of is read now.
    pub(super) fn why(&mut self, fluent: &str) -> Result<(), Failure> {
        let fluent = (!fluent.is_empty()).then_some(fluent);
        if let (Some(failure), None) = (&self.refused, fluent) {
            self.style.failure(failure);
            if self.last.is_none() {
                return Ok(());
            }
            self.style.say("the run before:");
        }
        let entries = archive::entries(self.hands.record);
        let (run, number) = match &self.last {
            Some(run) => {
                let dir = run.run_dir.as_deref().map(Path::new);
                let entry = entries.iter().find(|entry| dir == Some(entry.dir.as_path()));
                (Some((**run).clone()), entry.map(|entry| entry.number))
            }
            _ => match entries.last() {
                Some(entry) => {
                    let run = self.load(entry)?;
                    self.style.say(format!("run {} ({}):", entry.number, entry.name));
                    (Some(run), Some(entry.number))
                }
                None => (None, None),
            },
        };
        let Some(run) = run else {
            if let Some(condition) = fluent {
                return self.now(condition);
            }
            self.style.say("nothing has run yet");
            return Ok(());
        };
        let earlier = archive::earlier(&run, number, &entries);
        let library = &self.library;
        let place = |name: &str| {
            let (fluent, source) = library.fluent(name)?;
            Some(source.place(fluent.name.span))
        };
        let asked =
            report::why::Question { run: &run, number, fluent, earlier: &earlier, place: &place };
        match (report::why::why(&asked), fluent) {
            (Ok(told), _) => self.style.tell(&told),
            (Err(failure), Some(condition)) if condition.contains('(') => {
                self.style.say(format!("{}; now:", failure.message));
                self.now(condition)?;
            }
            (Err(failure), _) => return Err(failure),
        }
        Ok(())
    }

    pub(super) fn gap(&self, last: &str) -> Result<(), Failure> {
        if self.runs.is_empty() {
            return Err(Failure::input("repl::gap", "nothing has run yet")
                .help("`trueup gap RUN...` takes folders of earlier runs"));
        }
        let n = match last.parse::<usize>() {
            _ if last.is_empty() => self.runs.len(),
            Ok(n) if n > 0 => n,
            _ => {
                return Err(Failure::input(
                    "repl::gap",
                    format!("`{last}` is not a number of runs"),
                )
                .help("`:gap 2` takes the last two runs, `:gap` all of this session"));
            }
        };
        let first = self.runs.len().saturating_sub(n);
        (self.hands.gap)(&self.runs[first..])
    }
}
