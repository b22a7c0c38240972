//! The table of the commands of the prompt: names, arguments, what each does.

/// A command.
#[derive(Debug, Clone, Copy)]
pub(super) struct Command {
    /// Without its colon.
    pub(super) name: &'static str,
    /// What it takes, empty for nothing.
    pub(super) takes: &'static str,
    /// What it does.
    pub(super) what: &'static str,
}

impl Command {
    /// What completion puts there.
    pub(super) fn typed(&self) -> String {
        let blank = if self.takes.is_empty() { "" } else { " " };
        format!(":{}{blank}", self.name)
    }

    /// Whether its argument of that place, from 0, is of the language, and completed as if it stood alone: a call, a
    /// condition, a value.
    pub(super) fn takes_language(&self, at: usize) -> bool {
        let known = ["CALL", "FLUENT", "VALUE"];
        known.iter().any(|word| self.taken(at).contains(word))
    }

    /// Whether its argument of that place, from 0, is a call and no other line of the language.
    pub(super) fn takes_call(&self, at: usize) -> bool {
        self.taken(at).contains("CALL")
    }

    /// Whether it takes bare names, of what is called or asked: nothing stands in brackets behind them. A step is a number, but
    /// where one is to be paused before.
    pub(super) fn takes_names(&self) -> bool {
        self.name == "break" || self.takes.contains("TASK")
    }

    fn taken(&self, at: usize) -> &'static str {
        let mut takes = self.takes.split(' ');
        takes.nth(at).or_else(|| self.takes.split(' ').next_back()).unwrap_or_default()
    }

    /// The words that it takes one of, if it does: `all|risky|none`, the settings.
    pub(super) fn choices(&self) -> impl Iterator<Item = &'static str> {
        let settings: &[&str] = if self.name == "set" { SETTINGS } else { &[] };
        let is_list = self.takes.chars().all(|c| c.is_ascii_lowercase() || c == '|');
        let listed = self.takes.split('|').filter(move |word| is_list && !word.is_empty());
        settings.iter().copied().chain(listed)
    }
}

pub(super) const fn command(
    name: &'static str,
    takes: &'static str,
    what: &'static str,
) -> Command {
    Command { name, takes, what }
}

/// The settings of `:set`, each a command of its own as well.
pub(super) const SETTINGS: &[&str] = &["confirm", "seed"];

/// Every command, in the order of `:help`.
pub(super) const COMMANDS: &[Command] = &[
    command("help", "[TOPIC]", "this page; how something is done (gap), what a name means (pour)"),
    command("objects", "", "what is on the table and where"),
    command("tasks", "", "what can be called"),
    command(
        "graph",
        "CALL",
        "the And-Or graph of a call; --energy [RUN]: how well a run fits its own",
    ),
    command("look", "", "take a new camera image"),
    command("align", "", "calibrate camera and arm anew: the three regressions"),
    command("step", "CALL|FILE|RUN", "a call step by step; over a run that is kept, nothing moves"),
    command(
        "break",
        "[STEP]",
        "pause before a step, by name or path; alone: the list; clear [STEP]",
    ),
    command("continue", "", "let what is paused go on to the next breakpoint"),
    command("stop", "", "end what is paused; the arm holds its position"),
    command("back", "[STEP]", "look at an earlier step of the last run; the arm does not move"),
    command(
        "fork",
        "STEP [CALL]",
        "what if, in the twin: the rest after a past step, or another call",
    ),
    command("quiz", "[TASK|FLUENT]", "questions over the runs that are kept; nothing moves"),
    command("why", "[FLUENT]", "why the last run went as it did; what a fluent was judged by"),
    command("gap", "[N]", "what the twin lacks, by the last N runs (all of this session)"),
    command("runs", "", "the runs that are kept"),
    command("replay", "RUN [STEP]", "a run again from its record; nothing moves"),
    command("diff", "RUN RUN", "what was different in two runs"),
    command("twin", "", "lines from now on are for the twin alone, as things stand now"),
    command("real", "", "lines from now on move the robot again"),
    command("reset", "", "a fresh laboratory: things stand and are filled as at the start"),
    command("seed", "[N]", "the number that all chance comes from; N sets another"),
    command("confirm", "all|risky|none", "when to ask before acting"),
    command("phrase", "[\"…\" = CALL]", "teach a sentence; alone: the list; clear [\"…\"]"),
    command("set", "NAME VALUE", "a setting (confirm, seed), or a name for a value"),
    command("save", "FILE", "write the calls of this session as a script"),
    command("undo-edit", "", "take back the last change that trueup made to a file of this folder"),
    command("redo-edit", "", "make again what was last taken back"),
    command("quit", "", "leave"),
];
