//! Inputs that nobody sends in good faith, more than two hundred of them, made by the code here: each is met
//! with one message and a documented exit code, in a gigabyte and ten seconds of processor time.
//!
//! What the message says is tested where its sort is at home (`cli/bad_input.rs`); here it is that there is
//! one, that nothing panics, aborts, hangs or fills the memory, and that nothing foreign reaches a terminal.

mod folders;
mod pictures;
mod robots;
mod tables;
mod texts;
mod words;

use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::program::Scratch;

/// Bad input, and nothing else.
const REFUSED: &[i32] = &[2];
/// Bad input, or read and found wrong.
const WRONG: &[i32] = &[1, 2];
/// Harmless after all, or one of the above: what matters is that it ends.
const ENDS: &[i32] = &[0, 1, 2];

/// The address space of one run, KiB, and its processor time, s.
const LIMITS: (u64, u64) = (1 << 20, 20);
/// Nobody waits for input that never comes longer than this, in twentieths of a second: a minute and a half,
/// many times what twenty seconds of processor time take on a busy machine.
const PATIENCE: u32 = 1800;
/// What one refusal may print, bytes, and how wide its widest line may be, characters.
const SCREEN: (usize, usize) = (32 << 10, 1000);

/// Where cases are tried, and what was wrong with them.
pub(super) struct Bench {
    scratch: Scratch,
    tried: usize,
    faults: Vec<String>,
}

impl Bench {
    pub(super) fn new(name: &str) -> Self {
        Self { scratch: Scratch::new(&format!("hostile-{name}")), tried: 0, faults: Vec::new() }
    }

    /// Tries one case: files on an empty scratch, arguments, the exit codes that are an answer to it. Every
    /// other case is asked for JSON.
    pub(super) fn case(&mut self, files: &[(&str, &[u8])], args: &[&str], exits: &[i32]) {
        for (name, content) in files {
            self.scratch.file(name, content);
        }
        let as_json = self.tried % 2 == 1 && takes_json(args);
        self.tried += 1;
        let mut args = args.to_vec();
        if as_json {
            args.push("--json");
        }
        let sizes: Vec<String> = files
            .iter()
            .map(|(name, content)| format!("{name}, {} bytes", content.len()))
            .collect();
        let shown: Vec<String> = args.iter().map(|arg| arg.chars().take(60).collect()).collect();
        if let Err(fault) = self.run(&args, exits, as_json) {
            self.faults.push(format!("{shown:?} on {sizes:?}: {fault}"));
        }
        for (name, _) in files {
            let _ = fs::remove_file(self.scratch.path(name));
        }
    }

    fn run(&self, args: &[&str], exits: &[i32], as_json: bool) -> Result<(), String> {
        let (out, err) = (self.scratch.path("stdout"), self.scratch.path("stderr"));
        let (space, time) = LIMITS;
        let limited = format!("ulimit -v {space}; ulimit -t {time}; exec \"$@\"");
        let program = self.scratch.command(&[]);
        let mut command = Command::new("sh");
        command.args(["-c", &limited, "sh"]).arg(program.get_program()).args(args);
        for (name, value) in program.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        let mut child = command
            .current_dir(self.scratch.path("."))
            .stdin(Stdio::null())
            .stdout(File::create(&out).unwrap())
            .stderr(File::create(&err).unwrap())
            .spawn()
            .unwrap();
        let mut waited = 0;
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if waited == PATIENCE {
                child.kill().unwrap();
                child.wait().unwrap();
                return Err("it waits for ever".to_owned());
            }
            waited += 1;
            std::thread::sleep(Duration::from_millis(50));
        };
        let (out, err) = (fs::read(&out).unwrap(), fs::read(&err).unwrap());
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (out, err) = (text(&out), text(&err));
        let told = || format!("{} {}", head(&out), head(&err));
        let Some(code) = status.code() else {
            return Err(format!("ended by signal {:?}: {}", status.signal(), told()));
        };
        if !exits.contains(&code) {
            return Err(format!("exit code {code}: {}", told()));
        }
        judge(code, &out, &err, as_json).map_err(|fault| format!("{fault}: {}", told()))
    }

    /// Fails with everything that was wrong.
    pub(super) fn end(self, at_least: usize) {
        let Self { tried, faults, .. } = self;
        assert!(faults.is_empty(), "{} of {tried}:\n{}", faults.len(), faults.join("\n"));
        assert!(tried >= at_least, "only {tried} cases were tried");
    }
}

/// Says what is wrong with what was printed.
fn judge(code: i32, out: &str, err: &str, as_json: bool) -> Result<(), String> {
    for word in ["panicked", "RUST_BACKTRACE", "internal error"] {
        if out.contains(word) || err.contains(word) {
            return Err(format!("it says `{word}`"));
        }
    }
    let foreign = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if let Some(c) = out.chars().chain(err.chars()).find(|c| foreign(*c)) {
        return Err(format!("{c:?} is printed"));
    }
    if as_json {
        let document: Value =
            serde_json::from_str(out).map_err(|error| format!("no JSON document: {error}"))?;
        let is_told =
            document["error"]["message"].is_string() || !document["diagnostics"].is_null();
        if code == 2 && !is_told {
            return Err("no error in the document".to_owned());
        }
        return Ok(());
    }
    if code == 0 {
        return Ok(());
    }
    if out.trim().is_empty() && err.trim().is_empty() {
        return Err("it says nothing".to_owned());
    }
    let (bytes, wide) = SCREEN;
    if out.len() + err.len() > bytes {
        return Err(format!("{} bytes are printed", out.len() + err.len()));
    }
    let widest = out.lines().chain(err.lines()).map(|line| line.chars().count()).max().unwrap_or(0);
    if widest > wide { Err(format!("a line of {widest} characters")) } else { Ok(()) }
}

/// Layouts and graphs that are written for a file are no documents.
fn takes_json(args: &[&str]) -> bool {
    !matches!(args.first(), Some(&("completions" | "lsp")))
}

fn head(text: &str) -> String {
    text.chars().take(300).flat_map(char::escape_default).collect()
}
