//! `trueup help` and `--help`: commands by section, what each offers, how things are done.
//!
//! What an option means stands where it is declared; how things are done is in [`super::topics`].

use std::fmt::Write as _;

use clap::{Arg, Args, Command, CommandFactory as _};
use serde_json::json;

use super::offered;
use super::topics::{TOPICS, Topic, topic};
use super::{Cli, Exit};
use crate::language::nearest;
use crate::report::{self, Failure, Style};

/// Widest line of help: a terminal's 80 columns, or fewer.
const WIDEST: usize = 80;

/// The commands by what they are for.
const SECTIONS: &[(&str, &[&str])] = &[
    ("Carry out", &["run", "teach", "trials"]),
    ("Write", &["new", "check", "fmt", "test", "doc", "explain", "say", "graph", "lsp"]),
    ("Look back", &["runs", "replay", "report", "export", "learn"]),
    ("What a model lacks", &["gap", "lab"]),
    ("Table, camera, arm", &["scene", "marks", "camera", "align", "robot"]),
    ("A real Gen3", &["kortex", "emulate"]),
    ("The paper", &["paper", "vqa"]),
    ("This program", &["help", "doctor", "completions"]),
];

/// What stands below the options of `trueup --help`.
const EXAMPLES: &str = "\
Examples:
  trueup                           the prompt
  trueup -c 'pour(jar, cup)'       one line
  trueup run scripts/pour.task     a script
  trueup help gap                  how things are done; `trueup help` lists all
  trueup gap --help                the options of a command";

/// Tell how something is done, with examples.
#[derive(Debug, Args)]
pub(super) struct HelpArgs {
    /// A topic or a command; without one, all topics are listed.
    topic: Option<String>,
}

/// Returns the program's arguments, with help that offers in each command what acts there.
pub(super) fn offering() -> Command {
    let mut command = signed(Cli::command()).max_term_width(WIDEST);
    command.build();
    offered::hidden_elsewhere(command).mut_subcommands(|own| match topic(own.get_name()) {
        Some(topic) => own.after_help(topic.told()),
        None => own,
    })
}

/// Returns the command with negative numbers read as values, so that one out of range is answered with the range.
fn signed(command: Command) -> Command {
    let value = |arg: Arg| {
        let takes_one = arg.get_action().takes_values();
        arg.allow_negative_numbers(takes_one)
    };
    command.mut_args(value).mut_subcommands(signed)
}

/// The same, with a help of its own that lists the commands by section.
pub(super) fn command() -> Command {
    let command = offering();
    let sections = sections(&command);
    command
        .mut_subcommands(|own| own.hide(true))
        .override_usage("trueup [OPTIONS] [COMMAND]")
        .help_template(format!(
            "{{about}}\n\n{{usage-heading}} {{usage}}\n\n{sections}\n{{all-args}}{{after-help}}"
        ))
        .after_help(EXAMPLES)
}

/// Returns the commands with what they do, by section.
fn sections(command: &Command) -> String {
    let mut text = String::new();
    for (title, names) in SECTIONS {
        let _ = writeln!(text, "{title}:");
        // Without a feature its command is not there.
        for own in names.iter().filter_map(|name| command.find_subcommand(name)) {
            let about = own.get_about().map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {:<12} {about}", own.get_name());
        }
    }
    text
}

/// `trueup help [TOPIC]`.
pub(super) fn help(args: &HelpArgs, style: Style) -> Result<Exit, Failure> {
    let Some(wanted) = &args.topic else {
        if style.json {
            let each = |topic: &Topic| json!({"topic": topic.name, "title": topic.title});
            style.document(&json!({"topics": TOPICS.iter().map(each).collect::<Vec<_>>()}));
            return Ok(Exit::Yes);
        }
        let lines = TOPICS.iter().map(|topic| format!("  {:<8} {}", topic.name, topic.title));
        let lines: Vec<String> = lines.collect();
        report::out(&format!(
            "How things are done: `trueup help TOPIC`\n\n{}\n\nAll commands: `trueup --help`; their options: `trueup COMMAND --help`",
            lines.join("\n")
        ));
        return Ok(Exit::Yes);
    };
    let name = wanted.trim();
    let text = match topic(name) {
        Some(topic) => {
            let mut text = topic.told();
            if command().find_subcommand(name).is_some() {
                let _ = write!(text, "\n\nOptions: `trueup {name} --help`");
            }
            text
        }
        None => of_command(name)?,
    };
    if style.json {
        style.document(&json!({"topic": name, "text": text}));
    } else {
        report::out(text.trim_end());
    }
    Ok(Exit::Yes)
}

/// Returns the help of a command that has no topic.
fn of_command(name: &str) -> Result<String, Failure> {
    let mut command = command();
    if let Some(own) = command.find_subcommand_mut(name) {
        return Ok(own.render_long_help().to_string());
    }
    let known = TOPICS.iter().map(|topic| topic.name);
    let known = known.chain(command.get_subcommands().map(Command::get_name));
    let help = match nearest(name, known) {
        Some(near) => format!("did you mean `trueup help {near}`?"),
        None => "`trueup help` lists what there is".to_owned(),
    };
    Err(Failure::input("help::unknown", format!("there is no topic `{name}`")).help(help))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Takes a line apart as a shell would that knows single quotes.
    fn words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        for (k, part) in line.split('\'').enumerate() {
            let mut parts =
                if k % 2 == 1 { vec![part] } else { part.split(' ').collect() }.into_iter();
            if let (Some(first), Some(last)) = (parts.next(), words.last_mut()) {
                last.push_str(first);
            }
            words.extend(parts.map(str::to_owned));
        }
        words.retain(|word| !word.is_empty());
        words
    }

    #[test]
    fn every_command_stands_in_one_section_and_every_topic_is_short() {
        let command = command();
        let mut listed: Vec<&str> =
            SECTIONS.iter().flat_map(|(_, names)| *names).copied().collect();
        let mut there: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
        listed.sort_unstable();
        there.sort_unstable();
        assert_eq!(listed, there);
        for topic in TOPICS {
            let rows = topic.text.lines().count();
            assert!((8..=16).contains(&rows), "{}: {rows} lines", topic.name);
            assert!(
                topic.text.lines().all(|line| line.chars().count() <= WIDEST),
                "{}",
                topic.name
            );
        }
    }

    /// What is shown is read by the program as it is, and names files that are in the checkout.
    #[test]
    fn the_examples_are_lines_that_the_program_reads() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for topic in TOPICS {
            let examples = topic.text.lines().filter(|line| line.starts_with("  trueup"));
            assert!(examples.clone().count() >= 4, "{}", topic.name);
            for line in examples {
                let words = words(line);
                let read = command().try_get_matches_from(&words);
                let matches = read.unwrap_or_else(|error| panic!("{line}: {error}"));
                assert_eq!(offered::without_effect(&command(), &matches), [""; 0], "{line}");
                for word in words.iter().filter(|word| {
                    ["scripts/", "stdlib/", "tests/"].iter().any(|dir| word.starts_with(dir))
                }) {
                    assert!(root.join(word).exists(), "{line}: {word}");
                }
            }
        }
    }
}
