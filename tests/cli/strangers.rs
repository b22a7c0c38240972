//! Files from strangers: lines of kilobytes with thousands of mistakes, pipes, escape sequences, recordings whose
//! clock makes no sense. Each gets an answer or one message, soon, and never longer than a screen or two.

use std::fmt::Write as _;

use crate::program::{Said, Scratch};
use crate::schema::Schemas;

/// A screen, in bytes, and one for each kind of mistake that is drawn.
const SCREENS: usize = 60_000;

fn refused(said: &Said, code: &str, says: &str) {
    assert_eq!((said.code, said.error("code").as_str()), (2, code), "{said:?}");
    let message = format!("{} ({})", said.error("message"), said.error("where"));
    assert!(message.contains(says), "{message}");
    assert!(said.out.len() < 4000, "{} bytes", said.out.len());
}

#[test]
fn a_line_with_thousands_of_mistakes_is_told_in_windows() {
    let scratch = Scratch::new("cli-strangers-line");
    scratch.file("line.task", format!("task t() {{ {}}}\n", "kup(a) ".repeat(4000)));
    let said = scratch.trueup(&["check", "line.task"]);
    assert_eq!(said.code, 1);
    assert!(said.out.len() < SCREENS, "{} bytes", said.out.len());
    assert!(said.out.contains("more of task::unknown_name"), "{}", said.out);
    assert!(said.out.contains("more mistakes are not listed"), "{}", said.out);
    let listed = scratch.trueup(&["check", "line.task", "--json"]).json();
    let listed = listed["diagnostics"].as_array().unwrap();
    assert!((1000..1010).contains(&listed.len()), "{}", listed.len());
    let last = listed.last().unwrap();
    assert_eq!(last["code"], "task::more");
    assert!(last["message"].as_str().unwrap().contains("more mistakes are not listed"));
}

#[test]
fn a_name_of_a_megabyte_is_told_by_its_ends() {
    let scratch = Scratch::new("cli-strangers-name");
    let name = "a".repeat(1_000_000);
    scratch.file("name.task", format!("pick({name})\n"));
    for args in [["check", "name.task"], ["run", "name.task"]] {
        let said = scratch.trueup(&args);
        let words = said.out + said.err.as_str();
        assert!(words.contains('…') && words.len() < 4000, "{args:?}: {} bytes", words.len());
    }
    scratch.file("head.csv", format!("{name}[m]\n1\n2\n3\n"));
    refused(&scratch.trueup(&["gap", "head.csv", "--json"]), "gap::recording", "no time column");
    refused(&scratch.trueup(&["align", "map", "head.csv", "--json"]), "align::table", "u_x");
}

#[test]
fn what_a_terminal_would_obey_is_shown_and_not_sent() {
    // Each call of the program is looked through for escapes by the scratch.
    let scratch = Scratch::new("cli-strangers-escape");
    let hostile = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\u{202e}";
    scratch.file(
        "e.task",
        format!("pick(jar) // {hostile}\nsay \"{hostile}\"\nimport \"{hostile}\"\n"),
    );
    let said = scratch.trueup(&["check", "e.task"]);
    assert!(said.out.contains("␛[2J"), "{}", said.out);
    assert!(!said.out.contains(['\u{7}', '\u{9b}', '\u{202e}']), "{:?}", said.out);
    scratch.file("e.csv", format!("t[s],{hostile}[rad]\n0,1\n1,2\n2,3\n"));
    let said = scratch.trueup(&["gap", "e.csv"]);
    assert!(said.err.contains("␛[2J") && said.code == 2, "{}", said.err);
    scratch.file(
        "e.toml",
        format!("[\"{}\"]\n", hostile.replace('\u{1b}', "\\u001b").replace('\u{7}', "")),
    );
    let said = scratch.trueup(&["-c", "pick(jar)", "--lab", "e.toml"]);
    assert!(said.err.contains('␛') && said.code == 2, "{}", said.err);
    let said = scratch.trueup(&[hostile]);
    // The usage errors are clap's, which leaves escapes out.
    assert!(said.err.contains("unrecognized") && said.code == 2, "{}", said.err);
    assert!(!said.err.contains(['\u{1b}', '\u{7}', '\u{9b}', '\u{202e}']), "{:?}", said.err);
    let said = scratch.trueup(&["check", hostile, "--json"]);
    assert!(said.error("where").contains("\u{9b}"), "JSON says what it is");
    assert!(!said.out.contains('\u{9b}'), "{:?}", said.out);
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_is_not_waited_for() {
    let scratch = Scratch::new("cli-strangers-pipe");
    let pipes = [scratch.path("pipe"), scratch.path("pipe.task")];
    let made = std::process::Command::new("mkfifo").args(pipes).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo is part of every unix");
    for name in ["pipe", "/dev/zero"] {
        for args in [
            &["check", name][..],
            &["run", name],
            &["gap", name],
            &["align", "offset", name],
            &["-c", "pick(jar)", "--scene", name],
            &["-c", "pick(jar)", "--lab", name],
            &["robot", "plan", "--problem", name],
        ] {
            let said = scratch.trueup(&[args, &["--json"]].concat());
            refused(&said, "io::read", "not a regular file");
        }
        let said = scratch.trueup(&["camera", "see", name, "--json"]);
        refused(&said, "io::image", "not a regular file");
    }
    let imports = [("pipe.task", "not a regular file"), ("/dev/zero", "neither a `.task` file")];
    for (name, why) in imports {
        scratch.file("i.task", format!("import \"{name}\"\npick(jar)\n"));
        let said = scratch.trueup(&["check", "i.task"]);
        assert!(said.code == 1 && said.out.contains(why), "{}", said.out);
    }
}

/// A recording of one joint that swings, with a time for each row.
fn swing(times: &[f64]) -> String {
    let mut text = "t[s],q_1[rad],tau_1[N*m]\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        let k = k as f64;
        let _ = writeln!(text, "{t},{:.5},{:.4}", (0.02 * k).sin(), (0.02 * k + 1.0).cos());
    }
    text
}

#[test]
fn a_clock_that_shows_what_no_clock_shows_is_told() {
    let scratch = Scratch::new("cli-strangers-clock");
    let even: Vec<f64> = (0..60).map(|k| f64::from(k) * 0.01).collect();
    let with = |times: &[f64]| swing(times);
    let cases = [
        (with(&[&even[..], &[1e300]].concat()), "no time that a clock shows"),
        (with(&even.iter().map(|t| t * 1e-300).collect::<Vec<_>>()), "which no clock tells"),
        (with(&[&even[..], &[1e9, 0.6]].concat()), "time goes back"),
        (with(&(0..3000).map(|k| f64::from(k % 12)).collect::<Vec<_>>()), "starts again 249 times"),
        (with(&[f64::NAN; 5]), "is not a time"),
        (with(&[0.0]), "there is one row"),
        (",".repeat(300_000), "300001 columns"),
        ("t[s],q_1[rad],q_1[rad]\n".into(), "two columns are called"),
    ];
    for (text, says) in cases {
        scratch.file("r.csv", text);
        refused(&scratch.trueup(&["gap", "r.csv", "--json"]), "gap::recording", says);
    }
}

#[test]
fn a_hundred_thousand_columns_are_read_at_once() {
    let scratch = Scratch::new("cli-strangers-columns");
    let names: Vec<String> = (1..=100_000).map(|i| format!("q_{i}")).collect();
    let zeros = vec!["0"; 100_000].join(",");
    let rows: Vec<String> = (0..9).map(|k| format!("{k},{zeros}")).collect();
    scratch.file("wide.csv", format!("t[s],{}\n{}\n", names.join(","), rows.join("\n")));
    let said = scratch.trueup(&["gap", "wide.csv", "--json"]);
    refused(&said, "gap::recording", "100000 columns `q_*`");
}

#[test]
fn robots_too_deep_or_too_large_are_refused_before_they_are_read() {
    let scratch = Scratch::new("cli-strangers-urdf");
    let (open, close) = ("<a>".repeat(30_000), "</a>".repeat(30_000));
    scratch.file("deep.urdf", format!("<robot name=\"r\">{open}{close}</robot>"));
    scratch.file(
        "large.urdf",
        format!("<robot name=\"r\">{}</robot>", "<link name=\"l\"/>".repeat(100_000)),
    );
    for (file, says) in [("deep.urdf", "64 deep"), ("large.urdf", "1000 links")] {
        let said = scratch.trueup(&["robot", "fk", "--q", "0", "--robot-file", file, "--json"]);
        refused(&said, "robot::input", says);
    }
}

#[test]
fn texts_nested_without_end_are_refused() {
    let scratch = Scratch::new("cli-strangers-nested");
    let mut chain = "1".to_owned();
    for _ in 0..60 {
        chain = format!("({chain}{})", "+1".repeat(60));
    }
    for text in [
        format!("check {}1{} > 0\n", "(".repeat(100_000), ")".repeat(100_000)),
        format!("check {}true\n", "not ".repeat(100_000)),
        format!("check {chain} > 0\n"),
        format!("model m {{ input u state x = 0 x' = {}2 output y = x }}\n", "x^".repeat(100_000)),
        "{".repeat(100_000),
    ] {
        scratch.file("n.task", text);
        let said = scratch.trueup(&["check", "n.task"]);
        assert!(said.code == 1 && said.out.contains("task::depth"), "{said:?}");
    }
    let deep = format!("{}{}", "[".repeat(200_000), "]".repeat(200_000));
    scratch.file("deep.json", &deep);
    refused(&scratch.trueup(&["graph", "deep.json", "--json"]), "graph::file", "recursion limit");
    scratch.file("deep.toml", format!("a = {deep}\n"));
    let said = scratch.trueup(&["-c", "pick(jar)", "--lab", "deep.toml", "--json"]);
    refused(&said, "lab::settings", "");
}

#[test]
fn thousands_of_tasks_that_call_the_next_are_checked_at_once() {
    let scratch = Scratch::new("cli-strangers-tasks");
    let chain = |last: &str| {
        let mut text = String::new();
        (0..2000).for_each(|i| _ = writeln!(text, "task t{i}() {{ t{}() }}", i + 1));
        format!("{text}task t2000() {{ {last} }}\nt0()\n")
    };
    scratch.file("chain.task", chain("pick(jar)"));
    assert_eq!(scratch.trueup(&["check", "chain.task"]).code, 0);
    let said = scratch.trueup(&["graph", "chain.task", "--json"]);
    refused(&said, "graph::too_large", "200 deep");
    scratch.file("ring.task", chain("t0()"));
    let said = scratch.trueup(&["check", "ring.task"]);
    assert!(said.code == 1 && said.out.contains("leads back to"), "{}", said.out);
    assert!(said.out.len() < SCREENS, "{} bytes", said.out.len());
}

/// A run's page, a table and a seal were written over a person's task and settings.
#[test]
fn a_person_s_file_is_not_written_over_by_what_is_another_kind() {
    let scratch = Scratch::new("cli-strangers-over");
    let task = "task mine(o: Graspable) {\n    pick(o)\n}\n";
    scratch.file("mine.task", task);
    scratch.file("mine.toml", "[sensor]\n");
    for args in [
        &["report", "1", "-o", "mine.task"][..],
        &["marks", "--pdf", "mine.task"],
        &["lab", "hide", "--out", "mine.toml"],
    ] {
        let said = scratch.trueup(&[args, &["--json"]].concat());
        assert_eq!((said.code, said.error("code").as_str()), (2, "new::there"), "{said:?}");
    }
    assert_eq!(std::fs::read_to_string(scratch.path("mine.task")).unwrap(), task);
    // What a command wrote it may write again.
    for _ in 0..2 {
        assert_eq!(scratch.trueup(&["marks", "--pdf", "dots.pdf"]).code, 0);
        assert_eq!(scratch.trueup(&["lab", "hide", "--out", "seal.toml"]).code, 0);
    }
}

/// The first call's run was lost with the second's failure, which said that nothing had been touched.
#[test]
fn a_script_that_fails_later_tells_what_was_done_before() {
    let scratch = Scratch::new("cli-strangers-later");
    scratch.file("two.task", "pick(jar)\npick(cup)\nplace(jar)\n");
    let said = scratch.trueup(&["run", "two.task", "--robot", "twin", "--json"]);
    let document = said.json();
    Schemas::read().holds("error", &document);
    let runs = document["runs"].as_array().unwrap();
    assert_eq!((runs.len(), runs[0]["task"].as_str()), (1, Some("pick(jar)")), "{document}");
    let help = said.error("help");
    assert!(help.starts_with("calls before it: 1, done; after it: 1, not run; "), "{help}");
    assert!(!help.contains("nothing has been touched"), "{help}");
}

/// `arm.wait(1)` was no function, and a misspelt word was told in the engine's terms.
#[test]
fn words_of_scripts_take_whole_numbers_and_are_told_as_they_are_written() {
    let scratch = Scratch::new("cli-strangers-words");
    let run = |line: &str| {
        std::fs::create_dir_all(scratch.path("lib/actions")).unwrap();
        scratch.file("lib/actions/mine.rhai", format!("{line}\n"));
        scratch.file("m.task", "action mine() {\n    run \"mine.rhai\"\n}\nmine()\n");
        let args = ["--robot", "twin", "--stdlib", "lib", "--without-regression", "3", "--json"];
        scratch.trueup(&[&["run", "m.task"][..], &args].concat())
    };
    let said = run("arm.wait(1);");
    assert_eq!(said.code, 0, "{said:?}");
    let told = |line: &str| run(line).error("message");
    let (misspelt, misused) = (told("arm.wiat(1.0);"), told("arm.wait([1]);"));
    assert!(misspelt.contains("there is no word `arm.wiat`"), "{misspelt}");
    assert!(misspelt.contains("`arm.wait(seconds)`"), "{misspelt}");
    assert!(misused.contains("`wait` takes a number as the time"), "{misused}");
}
/// What is no step was read as one: `.` cannot stand here.
#[test]
fn teach_says_which_run_or_file_is_not_there() {
    let scratch = Scratch::new("cli-strangers-teach");
    let asked = |what: &str| scratch.trueup(&["teach", what, "--json"]);
    for what in ["99", "20260101-090000-pour"] {
        refused(&asked(what), "run::unknown", &format!("there is no run `{what}`"));
    }
    for what in ["missing.task", "runs/99", "tasks/missing"] {
        refused(&asked(what), "io::missing", what);
    }
    let said = scratch.trueup(&["teach", "nothing"]);
    assert!(said.err.contains("write `nothing()`, with what it acts on"), "{said:?}");
}

/// With empty hands nothing can be placed, and nothing had to be seen to know it. What `--yes` cannot answer is not
/// answered with `--yes`.
#[test]
fn a_sentence_is_read_with_the_hands_that_are_empty_at_the_beginning() {
    let scratch = Scratch::new("cli-strangers-hands");
    for (sentence, call) in [
        ("put the jar left of the cup", "put(jar, at: left_of(cup))"),
        ("put the jar in the cup", "put(jar, at: cup)"),
    ] {
        let said = scratch.trueup(&["-c", sentence, "--robot", "twin"]);
        assert!(said.out.contains(&format!("= {call}\n")), "{said:?}");
        assert!(said.err.contains("the input ended before the question was answered"), "{said:?}");
        assert!(said.err.contains("give `--yes`"), "{said:?}");
    }
    let said = scratch.trueup(&["-c", "pick up the thing", "--yes"]);
    assert!(said.out.contains("  2  pick(cup)\n"), "{said:?}");
    let help = "answer with a number on the next line, or write the call itself";
    assert!(said.err.contains(help) && !said.err.contains("--yes"), "{said:?}");
    let said = scratch.trueup(&["-c", "clear the table", "--yes"]);
    assert!(said.out.contains("not possible: `at` of `clear` cannot be `table`"), "{said:?}");
}

/// `check` found nothing wrong, and `run` took the last scene.
#[test]
fn a_second_scene_is_refused_by_check_and_run_alike() {
    let scratch = Scratch::new("cli-strangers-scenes");
    let kitchen = include_str!("../../stdlib/scenes/kitchen.task");
    let second = kitchen.replace("scene kitchen", "scene pantry");
    scratch.file("two.task", format!("{kitchen}\n{second}\npick(jar)\n"));
    for args in [["check", "two.task"], ["run", "two.task"], ["graph", "two.task"]] {
        let said = scratch.trueup(&args);
        let words = said.out + said.err.as_str();
        assert!(words.contains("a file has one scene, and this is another"), "{args:?}: {words}");
    }
}
