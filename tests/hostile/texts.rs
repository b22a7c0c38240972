//! Task texts: deep, long, broken, in the wrong bytes, or not files at all.

use std::process::Command;

use super::{Bench, ENDS, REFUSED, WRONG};

/// Deeper than any stack would like it.
const DEEP: usize = 100_000;

fn texts() -> Vec<(&'static str, Vec<u8>)> {
    let nested = |open: &str, inside: &str, close: &str, n: usize| {
        format!("task t() {{ check {}{inside}{} }}\n", open.repeat(n), close.repeat(n)).into_bytes()
    };
    let body = |line: String| format!("task t() {{\n{line}\n}}\n").into_bytes();
    let many = |line: &str, n: usize| line.repeat(n).into_bytes();
    vec![
        ("parentheses", nested("(", "true", ")", DEEP)),
        ("parentheses that never end", nested("(", "", "", DEEP)),
        ("closing parentheses", many(")", DEEP)),
        ("braces", many("task t() { ", DEEP)),
        ("closing braces", many("}", DEEP)),
        ("brackets", many("[", DEEP)),
        ("negations", nested("not ", "true", "", DEEP)),
        ("minus signs", nested("-", "1", "", DEEP)),
        ("calls in calls", nested("near(", "jar", ")", 20_000)),
        ("blocks in blocks", body("if true {\n".repeat(5000) + "}\n".repeat(5000).as_str())),
        ("choices in choices", body("choose {\n".repeat(3000) + "}\n".repeat(3000).as_str())),
        ("a long sum", body(format!("let x = {}1", "1 + ".repeat(50_000)))),
        ("a long chain of ands", body(format!("check {}true", "true and ".repeat(50_000)))),
        ("one line of mistakes", many("check jug ", 2600)),
        ("many lines of mistakes", many("check jug(\n", 3000)),
        ("many tasks of one name", many("task t() { }\n", 5000)),
        ("many unknown calls", body("frobnicate(jar)\n".repeat(5000))),
        ("one long name", format!("{}()\n", "a".repeat(1 << 20)).into_bytes()),
        ("one long string", body(format!("note \"{}\"", "x".repeat(1 << 20)))),
        ("a string that never ends", body("note \"never".to_owned())),
        ("a comment that never ends", b"/* never".to_vec()),
        ("comments in comments", many("/*", DEEP)),
        ("a megabyte of blanks", many(" ", 1 << 20)),
        ("a megabyte of line ends", many("\n", 1 << 20)),
        ("carriage returns", many("check jug\r", 1000)),
        ("a number beyond numbers", body(format!("let x = {} m", "9".repeat(5000)))),
        ("an exponent beyond numbers", body("let x = 1e999 m\nlet y = -1e999999999 kg".to_owned())),
        ("a unit beyond units", body(format!("let x = 1 {}", "m·".repeat(5000)))),
        ("powers of units", body("let x = 1 m^999999999999999999999".to_owned())),
        ("no UTF-8", b"task t() { check \xff\xfe\xfd }".to_vec()),
        ("UTF-16", "task t() { }".encode_utf16().flat_map(u16::to_le_bytes).collect()),
        ("zero bytes", many("\0", 10_000)),
        ("a byte order mark", "\u{feff}task t() { }\n".as_bytes().to_vec()),
        ("escape sequences", b"check \x1b[31mred\x1b]0;title\x07 \x9b2J\n".to_vec()),
        ("an escape sequence in a name", b"task t\x1b[2J() { }\n".to_vec()),
        (
            "an escape sequence in a string",
            b"task t() { note \"\x1b[2J\x1b]52;c;aGk=\x07\" }\n".to_vec(),
        ),
        ("turned writing", "task t() { check \u{202e}jug\u{2066}) }\n".as_bytes().to_vec()),
        ("marks on marks", format!("check {}\n", "a\u{0301}".repeat(20_000)).into_bytes()),
        ("pictures in words", body(format!("check {}", "🦀".repeat(10_000)))),
        ("an amount below nothing", b"pour(jar, cup, amount: -30 mL)\n".to_vec()),
        ("an amount beyond amounts", b"pour(jar, cup, amount: 1e300 mL)\n".to_vec()),
        ("an import of itself", b"import \"t.task\"\n".to_vec()),
        ("an import of nothing", b"import \"gone.task\"\n".to_vec()),
        ("an import of a device", b"import \"/dev/zero\"\n".to_vec()),
        ("an import of a folder", b"import \".\"\n".to_vec()),
        ("an import of a long name", format!("import \"{}\"\n", "a/".repeat(20_000)).into_bytes()),
        ("a scene of one thing a thousand times", {
            let thing = "object jar: Container { shape: box 6 cm 6 cm 10 cm }\n";
            format!("scene s {{\n{}}}\n", thing.repeat(1000)).into_bytes()
        }),
        (
            "a thing of no size",
            b"scene s { object a: Solid { shape: box 0 m -1 m nan m } }\n".to_vec(),
        ),
        ("equations in a circle", b"model m { state a: m\n d a = b\n b = c\n c = b }\n".to_vec()),
        ("an equation without end", {
            format!("model m {{ state a: m\n d a = {}a }}\n", "sin(".repeat(20_000)).into_bytes()
        }),
    ]
}

#[test]
fn texts_are_checked_laid_out_run_and_drawn() {
    let mut bench = Bench::new("texts");
    for (k, (_, text)) in texts().iter().enumerate() {
        let files: &[(&str, &[u8])] = &[("t.task", text)];
        bench.case(files, &["check", "t.task"], ENDS);
        let (command, exits): (&[&str], _) = match k % 4 {
            0 => (&["run", "t.task"], WRONG),
            1 => (&["fmt", "--check", "t.task"], ENDS),
            2 => (&["graph", "t.task"], WRONG),
            _ => (&["-c", "pick(jar)", "--scene", "t.task"], REFUSED),
        };
        bench.case(files, command, exits);
    }
    bench.end(100);
}

#[test]
fn what_is_no_file_is_not_read() {
    let mut bench = Bench::new("no-files");
    let pipe = bench.scratch.path("pipe.task");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for command in ["check", "fmt", "run", "graph"] {
        for file in ["pipe.task", "/dev/zero", "."] {
            // A folder of texts may be checked and laid out.
            let exits = if file == "." { ENDS } else { WRONG };
            bench.case(&[], &[command, file], exits);
        }
    }
    for (option, value) in
        [("--scene", "pipe.task"), ("--lab", "/dev/zero"), ("--stdlib", "pipe.task")]
    {
        bench.case(&[], &["-c", "pick(jar)", option, value], REFUSED);
    }
    bench.end(15);
}
