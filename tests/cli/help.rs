//! `--help` and `trueup help`: by section, with examples, no wider than a terminal, and without options that do nothing.

use crate::program::Scratch;

/// Returns the words of every command, the prompt's first: `""`, `run`, `robot fk`, …
fn commands(scratch: &Scratch) -> Vec<String> {
    let help = scratch.trueup(&["--help"]);
    let mut all = vec![String::new()];
    for name in help.out.lines().filter_map(listed) {
        let own = scratch.trueup(&[name, "--help"]);
        let below = own.out.lines().skip_while(|line| *line != "Commands:").skip(1);
        let below = below.take_while(|line| !line.is_empty()).filter_map(listed);
        all.extend(below.map(|below| format!("{name} {below}")));
        all.push(name.to_owned());
    }
    all
}

/// Returns the command that a line of help is about: two blanks, its name, two blanks, what it does.
fn listed(line: &str) -> Option<&str> {
    let (name, about) = line.strip_prefix("  ")?.split_once(' ')?;
    let is_name = name.starts_with(|c: char| c.is_ascii_lowercase()) && name != "trueup";
    (is_name && about.starts_with(' ')).then_some(name)
}

#[test]
fn every_help_fits_eighty_columns_and_says_what_the_command_does() {
    let scratch = Scratch::new("cli-help-width");
    let all = commands(&scratch);
    assert!(all.len() > 45, "{all:?}");
    for command in &all {
        let mut args: Vec<&str> = command.split_whitespace().collect();
        args.push("--help");
        let own = scratch.trueup(&args);
        assert_eq!((own.code, own.err.as_str()), (0, ""), "{command}");
        let wide = own.out.lines().filter(|line| line.chars().count() > 80);
        // An example is one line of a shell.
        let wide: Vec<&str> = wide.filter(|line| !line.starts_with("  trueup")).collect();
        assert!(wide.is_empty(), "{command}: {wide:#?}");
        assert!(own.out.contains("--json") && own.out.contains("--quiet"), "{command}");
    }
}

/// A shared option is offered where it does something, and nowhere else.
#[test]
fn options_are_offered_where_they_act() {
    let scratch = Scratch::new("cli-help-offers");
    let offers = |command: &str, option: &str| {
        let mut args: Vec<&str> = command.split_whitespace().collect();
        args.push("--help");
        let out = scratch.trueup(&args).out;
        out.lines().any(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            words.contains(&option) && line.trim_start().starts_with('-')
        })
    };
    for (command, option) in [
        ("", "--robot"),
        ("run", "--speed"),
        ("run", "--candidates"),
        ("teach", "--pace"),
        ("trials", "--lab"),
        ("gap", "--scene"),
        ("check", "--stdlib"),
        ("check", "--scene"),
        ("report", "--record"),
        ("lab hide", "--seed"),
        ("robot plan", "--seed"),
        ("doctor", "--camera-at"),
    ] {
        assert!(offers(command, option), "{command} {option}");
    }
    for (command, option) in [
        ("fmt", "--speed"),
        ("fmt", "--seed"),
        ("new", "--scene"),
        ("gap", "--robot"),
        ("gap", "--speed"),
        ("check", "--lab"),
        ("explain", "--stdlib"),
        ("trials", "--record"),
        ("robot fk", "--seed"),
        ("robot fk", "--robot"),
        ("report", "--scene"),
        ("completions", "--candidates"),
        ("kortex status", "--robot"),
        ("marks", "--verbose"),
    ] {
        assert!(!offers(command, option), "{command} {option}");
    }
}

/// A line is easily changed from one command to another: what does nothing is noted, and no mistake.
#[test]
fn an_option_without_effect_is_noted() {
    let scratch = Scratch::new("cli-help-note");
    let told = scratch.trueup(&["explain", "task::unit", "--speed", "0.5"]);
    assert_eq!(told.code, 0);
    assert_eq!(told.err.trim(), "note: --speed does nothing in `trueup explain`");
    let quiet = scratch.trueup(&["explain", "task::unit", "--speed", "0.5", "--quiet"]);
    assert_eq!((quiet.code, quiet.err.as_str()), (0, ""));
    let seeded = scratch.trueup(&["explain", "task::unit", "--seed", "3"]);
    assert_eq!((seeded.code, seeded.err.as_str()), (0, ""), "every command takes a seed");
}

/// `runs ls --record DIR` used the folder, and noted that the option does nothing; `runs list`, as its help has it, was no command.
#[test]
fn a_folder_of_runs_is_heeded_and_not_noted() {
    let scratch = Scratch::new("cli-help-record");
    for args in [
        &["runs"][..],
        &["runs", "ls"],
        &["runs", "list"],
        &["runs", "show", "1"],
        &["runs", "diff", "1", "2"],
        &["runs", "compare", "1", "2"],
        &["runs", "export", "1"],
        &["replay", "1"],
        &["gap", "1", "2"],
    ] {
        let told = scratch.trueup(&[args, &["--record", "."]].concat());
        assert!(!told.err.contains("does nothing"), "{args:?}: {}", told.err);
        assert!(!told.err.contains("unrecognized"), "{args:?}: {}", told.err);
    }
    let listed = scratch.trueup(&["runs", "list", "--record", "."]);
    assert_eq!(listed.code, scratch.trueup(&["runs", "ls", "--record", "."]).code);
}

#[test]
fn a_topic_is_told_by_itself_and_below_the_command() {
    let scratch = Scratch::new("cli-help-topics");
    let topics = scratch.trueup(&["help"]).out;
    for topic in [
        "run", "task", "scene", "robot", "bridge", "teach", "gap", "lab", "camera", "export",
        "trials",
    ] {
        let line = topics.lines().find_map(listed_topic(topic));
        assert!(line.is_some(), "{topic} in {topics}");
        let told = scratch.trueup(&["help", topic]);
        assert_eq!((told.code, told.err.as_str()), (0, ""), "{topic}");
        assert!(
            told.out.lines().filter(|line| line.starts_with("  trueup")).count() >= 4,
            "{}",
            told.out
        );
    }
    let below = scratch.trueup(&["gap", "--help"]).out;
    assert!(below.contains("trueup gap coulomb_a.csv coulomb_b.csv --out gap/"), "{below}");
    let command = scratch.trueup(&["help", "fmt"]);
    assert!(command.out.contains("Usage: trueup fmt"), "{}", command.out);
    let unknown = scratch.trueup(&["help", "gpa"]);
    assert_eq!(unknown.code, 2);
    assert!(unknown.err.contains("did you mean `trueup help gap`?"), "{}", unknown.err);
    let json = scratch.trueup(&["help", "gap", "--json"]);
    let document: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(document["topic"], "gap");
}

fn listed_topic(topic: &str) -> impl Fn(&str) -> Option<&str> {
    move |line| (line.split_whitespace().next() == Some(topic)).then_some(line)
}

#[test]
fn a_negative_number_is_answered_with_the_range() {
    let scratch = Scratch::new("cli-help-negative");
    for (args, range) in [
        (["--candidates", "-3", "doctor"].as_slice(), "it should be from 1 to 64"),
        (
            ["trials", "--task", "scripts/pour.task", "-n", "-2"].as_slice(),
            "it should be from 1 to 100000",
        ),
        (["--seed", "-1", "doctor"].as_slice(), "it should be a whole number from 0"),
    ] {
        let said = scratch.trueup(args);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains(range), "{args:?}: {}", said.err);
    }
}

/// `compare` was taken for `completions`, which is written alike.
#[test]
fn a_command_by_the_name_it_has_elsewhere_is_pointed_to() {
    let scratch = Scratch::new("cli-help-elsewhere");
    for (word, command) in [("compare", "'runs diff'"), ("list", "'runs ls'")] {
        let said = scratch.trueup(&[word, "1", "2"]);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains(command), "{word}: {}", said.err);
        assert!(!said.err.contains("completions"), "{word}: {}", said.err);
        assert!(scratch.trueup(&[word, "--json"]).error("help").contains(command));
    }
    // Misspelt is told as before, and below a command it is the command's.
    assert!(scratch.trueup(&["repaly"]).err.contains("'replay'"));
    assert!(!scratch.trueup(&["camera", "show"]).err.contains("runs show"));
}
