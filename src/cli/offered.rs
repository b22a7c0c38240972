//! Which shared options act in which command.
//!
//! Every command takes the shared options, so that a line can be changed from one command to another; its help offers
//! those that do something there, and one that does nothing is noted.

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command};

/// Options that talk to an arm, its camera and its scales.
const DEVICES: &[&str] = &["robot", "camera_at", "scales_at"];
/// What a performance takes beside what a rehearsal does.
const PERFORMS: &[&str] = &["verbose", "speed", "stream", "pace", "yes", "record", "explore"];
/// What a rehearsal, or a laboratory by itself, is made with.
const REHEARSES: &[&str] =
    &["seed", "scene", "stdlib", "candidates", "motion", "without_regression"];
/// A model that answers questions.
const MODEL: &[&str] = &["ask_endpoint", "ask_model", "ask_timeout"];
/// Trials draw their own laboratories.
const TRIES: &[&str] = &["robot", "lab", "explore"];

/// Returns the shared options that act in a command, beside `--json` and `--quiet`, which all take.
///
/// A command is named by its words: `lab hide`; the prompt has none.
fn acting(command: &str) -> Vec<&'static str> {
    let groups: &[&[&str]] = match command {
        "" | "run" | "teach" => &[DEVICES, PERFORMS, REHEARSES, &["lab"], MODEL],
        "trials" | "paper table1" | "paper table2" | "paper table3" => &[TRIES, REHEARSES, MODEL],
        "test" => &[REHEARSES],
        "doctor" => &[DEVICES, MODEL, &["scene", "stdlib", "lab", "record"]],
        "emulate" => &[&["seed", "scene", "stdlib", "lab"]],
        "graph" => &[&["scene", "stdlib", "robot", "record", "explore"]],
        "learn" => &[&["robot", "record", "stdlib"]],
        "gap" | "export" => &[&["record", "scene", "stdlib"]],
        "doc" | "say" | "check" => &[&["scene", "stdlib"]],
        "lsp" | "vqa probe" => &[&["stdlib"]],
        "lab hide" => &[&["seed", "stdlib", "lab"]],
        "robot plan" => &[&["seed", "motion"]],
        "vqa eval" | "robot ik" => &[&["seed"]],
        "replay" | "runs show" => &[&["record", "verbose"]],
        "runs" | "runs ls" | "runs diff" | "runs export" | "report" | "vqa label" => &[&["record"]],
        "marks" | "camera see" | "scene from" | "align hand-eye" => &[&["scene"]],
        _ => &[],
    };
    groups.concat()
}

/// Whether an option is one of those that all commands take.
fn is_shared(arg: &Arg) -> bool {
    arg.is_global_set() && !matches!(arg.get_id().as_str(), "json" | "quiet")
}

/// Hides, in each command below, the shared options that do nothing there.
pub(super) fn hidden_elsewhere(command: Command) -> Command {
    fn within(command: Command, words: &str) -> Command {
        let acting = acting(words);
        let command = command.mut_args(|arg| {
            let hide = is_shared(&arg) && !acting.contains(&arg.get_id().as_str());
            if hide { arg.hide(true) } else { arg }
        });
        command.mut_subcommands(|own| {
            let own_words = format!("{words} {}", own.get_name());
            within(own, own_words.trim_start())
        })
    }
    within(command, "")
}

/// Returns a note for each shared option that was given where it does nothing.
pub(super) fn without_effect(command: &Command, given: &ArgMatches) -> Vec<String> {
    let (mut given, mut words) = (given, Vec::new());
    while let Some((name, own)) = given.subcommand() {
        words.push(name);
        given = own;
    }
    let words = words.join(" ");
    let acting = acting(&words);
    let is_given = |arg: &&Arg| {
        is_shared(arg)
            && !acting.contains(&arg.get_id().as_str())
            && given.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    let name = |arg: &Arg| format!("--{}", arg.get_long().unwrap_or_default());
    let useless = command.get_arguments().filter(is_given).filter(|arg| arg.get_id() != "seed");
    useless.map(|arg| format!("note: {} does nothing in `trueup {words}`", name(arg))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::guide;
    use super::*;

    /// Returns what the help of a command says of itself and of its own arguments.
    fn told_of(command: &Command) -> String {
        let own = command.get_arguments().filter(|arg| !arg.is_global_set());
        let helps = own.flat_map(|arg| [arg.get_help(), arg.get_long_help()]);
        let all = helps.chain([command.get_about(), command.get_long_about()]);
        all.flatten().map(ToString::to_string).collect::<Vec<_>>().join(" ")
    }

    fn what_is_named_acts(command: &Command, words: &str) {
        let told = told_of(command);
        let parts = told.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
        let named: Vec<&str> = parts.filter_map(|part| part.strip_prefix("--")).collect();
        let acting = acting(words);
        for arg in command.get_arguments().filter(|arg| is_shared(arg)) {
            let is_named = arg.get_long().is_some_and(|long| named.contains(&long));
            let id = arg.get_id().as_str();
            assert!(!is_named || acting.contains(&id), "`{words}` speaks of {id}");
        }
        for own in command.get_subcommands() {
            what_is_named_acts(own, format!("{words} {}", own.get_name()).trim_start());
        }
    }

    /// `runs show 1 --record DIR` used the folder, and noted that the option does nothing.
    #[test]
    fn a_shared_option_acts_wherever_help_speaks_of_it() {
        what_is_named_acts(&guide::offering(), "");
    }
}
