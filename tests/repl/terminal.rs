//! The prompt at a terminal, which `script` plays.

use std::io::{Read, Write};
use std::process::{Command, Stdio};

use crate::absent::skipped;
use crate::program::Scratch;

/// A bare line and no word was all there was until Ctrl-C.
#[test]
fn an_open_parenthesis_is_asked_on_and_ended_by_an_empty_line() {
    if Command::new("script").arg("--version").output().is_err() {
        return skipped("script, which plays a terminal, is not here");
    }
    let scratch = Scratch::new("repl-terminal");
    let program = env!("CARGO_BIN_EXE_trueup");
    let mut child = Command::new("script")
        .args(["-qec", &format!("exec timeout --foreground 120 {program} --robot twin")])
        .arg("/dev/null")
        .current_dir(scratch.path(""))
        .env("XDG_STATE_HOME", scratch.path(""))
        .env("NO_COLOR", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut keys, mut out) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    let mut screen = Vec::new();
    let mut until = |words: &str| loop {
        let seen = String::from_utf8_lossy(&screen).into_owned();
        if let Some(at) = seen.find(words) {
            screen = seen.as_bytes()[at + words.len()..].to_vec();
            return;
        }
        let mut more = [0; 1024];
        let count = out.read(&mut more).unwrap();
        assert!(count > 0, "it ended with {seen}");
        screen.extend(&more[..count]);
    };
    until("twin> ");
    let typed: [(&str, &[&str]); 5] = [
        ("pour(jar, cup\r", &["end it with an empty line", " ... "]),
        ("\r", &["never closed", "twin> "]),
        ("pour(jar,\r", &[" ... "]),
        (":seed\r", &["never closed", "twin> "]),
        ("!6 * 7\r", &["42\r\n", "twin> "]),
    ];
    for (line, answers) in typed {
        keys.write_all(line.as_bytes()).unwrap();
        for answer in answers {
            until(answer);
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
}
