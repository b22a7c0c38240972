//! The prompt at a terminal, which `script` plays.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use crate::absent::skipped;
use crate::program::Scratch;

/// A prompt over the twin, at a terminal of its own.
struct Terminal {
    child: Child,
    keys: ChildStdin,
    out: ChildStdout,
    /// What was shown and not asked for yet.
    screen: String,
}

impl Terminal {
    /// Opens it; `None`, told, where nothing plays a terminal.
    fn open(scratch: &Scratch) -> Option<Self> {
        if Command::new("script").arg("--version").output().is_err() {
            skipped("script, which plays a terminal, is not here");
            return None;
        }
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
        let (keys, out) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        Some(Self { child, keys, out, screen: String::new() })
    }

    /// Waits for words, and forgets what was shown up to their end.
    fn until(&mut self, words: &str) {
        loop {
            if let Some(at) = self.screen.find(words) {
                self.screen.drain(..at + words.len());
                return;
            }
            let mut more = [0; 1024];
            let count = self.out.read(&mut more).unwrap();
            assert!(count > 0, "{words} was not shown; it ended with {}", self.screen);
            self.screen += &String::from_utf8_lossy(&more[..count]);
        }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A bare line and no word was all there was until Ctrl-C.
#[test]
fn an_open_parenthesis_is_asked_on_and_ended_by_an_empty_line() {
    let scratch = Scratch::new("repl-terminal");
    let Some(mut terminal) = Terminal::open(&scratch) else { return };
    terminal.until("twin> ");
    let typed: [(&str, &[&str]); 5] = [
        ("pour(jar, cup\r", &["end it with an empty line", " ... "]),
        ("\r", &["never closed", "twin> "]),
        // It was said at the first of a session only.
        ("pour(jar,\r", &["end it with an empty line", " ... "]),
        (":seed\r", &["never closed", "twin> "]),
        ("!6 * 7\r", &["42\r\n", "twin> "]),
    ];
    for (line, answers) in typed {
        terminal.press(line);
        for answer in answers {
            terminal.until(answer);
        }
    }
}

/// A `y` that was typed with the sentence carried it out, and nobody had read what it was taken to mean.
#[test]
fn what_was_typed_before_a_question_does_not_answer_it() {
    let scratch = Scratch::new("repl-typed-ahead");
    let Some(mut terminal) = Terminal::open(&scratch) else { return };
    terminal.until("twin> ");
    terminal.press("pick up the jar\ry\r");
    terminal.until("y or n");
    terminal.until("y/n> ");
    terminal.press("n\r");
    terminal.until("left undone");
}

/// Several Enters at once carried out as many steps; so did what was typed while the first was planned.
#[test]
fn enters_pressed_before_a_pause_carry_out_no_step() {
    let scratch = Scratch::new("repl-step-ahead");
    let Some(mut terminal) = Terminal::open(&scratch) else { return };
    terminal.until("twin> ");
    terminal.press(":step look()\r\r\rnext\r");
    terminal.until("look 1/1> ");
    terminal.press("quit\r");
    terminal.until("stopped: ");
}
