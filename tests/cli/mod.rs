//! The command line as a stranger uses it: the built program, its answers, its exit codes.

mod align;
mod answer;
mod bad_input;
mod calibrate;
mod explain;
mod export;
mod export_rrd;
mod gap;
mod hand_eye;
mod help;
mod hidden;
mod kortex;
mod kortex_faults;
mod learn;
mod live;
mod masks;
#[cfg(feature = "onnx")]
mod onnx;
mod panics;
mod paper;
mod records;
mod robot;
mod robot_check;
mod run;
mod say;
mod scene;
mod schema;
mod segment;
mod strangers;
mod text;
mod words;
mod writes;

use crate::program::Scratch;

#[test]
fn help_and_version_are_answers() {
    let scratch = Scratch::new("cli-help");
    let help = scratch.trueup(&["--help"]);
    assert_eq!((help.code, help.err.as_str()), (0, ""));
    for command in ["run", "check", "fmt", "graph", "robot", "camera", "align", "gap", "emulate"] {
        let line = help.out.lines().find(|line| line.trim_start().starts_with(command));
        let words = line.unwrap_or_else(|| panic!("no {command} in {}", help.out));
        assert!(words.split_whitespace().count() > 2, "{command} says what it does");
        let own = scratch.trueup(&[command, "--help"]);
        assert_eq!(own.code, 0, "{command}");
        assert!(own.out.contains("Usage: trueup"), "{}", own.out);
    }
    for option in ["--json", "--quiet", "--seed", "--robot", "--scene", "--lab", "--record"] {
        assert!(help.out.contains(option), "{option}");
    }
    let version = scratch.trueup(&["--version"]);
    assert_eq!(version.code, 0);
    assert_eq!(version.out.trim(), format!("trueup {}", env!("CARGO_PKG_VERSION")));
    assert_eq!(scratch.everything(), [""; 0], "asking leaves nothing behind");
}

/// `trueup graph ... | head -1` closes the pipe while there is more to write.
#[test]
fn a_closed_pipe_is_no_mistake() {
    let scratch = Scratch::new("cli-pipe");
    for args in [&["graph", "pour(jar, cup)", "--json"][..], &["check", "gone.task"], &["--help"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let (mut errors, end) = std::io::pipe().unwrap();
        let mut child = scratch.command(args).stdout(writer).stderr(end).spawn().unwrap();
        let mut err = String::new();
        std::io::Read::read_to_string(&mut errors, &mut err).unwrap();
        let code = child.wait().unwrap().code();
        assert!(!err.contains("panicked"), "{args:?}: {err}");
        assert_eq!(code, Some(if args[0] == "check" { 2 } else { 0 }), "{args:?}: {err}");
    }
}

/// Neither stdout nor stderr is readable any more: there is nobody to tell, and still an exit code.
#[test]
fn both_pipes_closed_still_end_with_the_right_code() {
    let scratch = Scratch::new("cli-pipes");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let end = writer.try_clone().unwrap();
    let status =
        scratch.command(&["check", "gone.task"]).stdout(writer).stderr(end).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

/// A terminal that asks for no colour gets none; the variable with an empty value does not ask.
#[test]
fn no_colour_is_respected() {
    let scratch = Scratch::new("cli-colour");
    scratch.file("bad.task", "puor(jar, cup)\n");
    for value in ["1", "true", ""] {
        let output =
            scratch.command(&["check", "bad.task"]).env("NO_COLOR", value).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert!(!text.contains('\x1b'), "NO_COLOR={value:?}: {text}");
    }
}
