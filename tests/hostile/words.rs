//! Arguments, lines and sentences.

use super::{Bench, ENDS, REFUSED, WRONG};

#[test]
fn arguments_are_taken_or_refused() {
    let mut bench = Bench::new("arguments");
    let call = "pick(jar)";
    for (option, value) in [
        ("--seed", "-1"),
        ("--seed", "1e3"),
        ("--seed", "99999999999999999999999"),
        ("--speed", "nan"),
        ("--speed", "-1"),
        ("--speed", "1e300"),
        ("--ask-timeout", "1e300"),
        ("--ask-timeout", "-1"),
        ("--ask-timeout", "nan"),
        ("--robot", "\u{1b}[2J"),
        ("--robot", "kortex://"),
        ("--robot", "kortex://[::1"),
        ("--robot", "kortex://host:99999"),
        ("--camera-at", "ftp://x"),
        ("--camera-at", "http://"),
        ("--without-regression", "0"),
        ("--without-regression", "1,2,3,4"),
        ("--scene", ""),
        ("--record", ""),
    ] {
        let exits = if option == "--speed" { ENDS } else { REFUSED };
        if option == "--speed" || (option, value) == ("--record", "") {
            // What only a run would look at is tried on a line that is refused anyway.
            bench.case(&[], &["-c", "pick(jug)", option, value], exits);
            continue;
        }
        let exits = if value == "ftp://x" || value.starts_with("kortex") { &[2, 4] } else { exits };
        let ask = ["--ask-endpoint", "http://127.0.0.1:9/v1"];
        let mut args = vec!["-c", call, option, value];
        if option == "--ask-timeout" {
            args.extend(ask);
        }
        bench.case(&[], &args, exits);
    }
    for n in ["-1", "x", "1e18", "99999999999999999999999"] {
        bench.case(&[], &["trials", "--task", call, "--n", n], REFUSED);
    }
    for shard in ["0/0", "2/1", "/", "1/99999999999999999999", "\u{1b}[2J"] {
        bench.case(&[], &["trials", "--task", call, "--shard", shard], REFUSED);
    }
    bench.case(&[], &["robot", "fk", "--robot-file", ""], REFUSED);
    bench.end(28);
}

#[test]
fn lines_and_sentences_are_understood_or_refused() {
    let mut bench = Bench::new("lines");
    let deep = "(".repeat(50_000);
    let nots = "not ".repeat(20_000) + "holding(jar)";
    let long = "x".repeat(100_000);
    let many = "jug, ".repeat(20_000);
    let call = format!("pour({many})");
    for line in [
        "",
        " ",
        "\u{1b}[2J",
        "\u{202e}",
        ":",
        "?",
        "::::",
        ")",
        "\"",
        "pour(",
        "pour(,)",
        "pour(jar, cup,,)",
        "pour(jar, cup, amount: -30 mL)",
        "pour(jar, cup, amount: 0 mL)",
        "pour(jar, cup, amount: 1e300 mL)",
        "pour(jar, cup, amount: nan mL)",
        "pour(jar; cup)",
        "pour(jar, cup, amount: 1e9 km)",
        &deep,
        &nots,
        &long,
        &call,
    ] {
        bench.case(&[], &["-c", line], WRONG);
        bench.case(&[], &["say", line], ENDS);
        bench.case(&[], &["graph", line], WRONG);
        bench.case(&[], &["explain", line], ENDS);
        bench.case(&[], &["doc", line], ENDS);
    }
    bench.end(110);
}
