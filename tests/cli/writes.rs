//! What is written is whole or not at all: on a full disk, and when the program is killed at any moment.
//!
//! A disk without room is played by a limit on the size of files, which fails writes with `EFBIG` where a full
//! one fails them with `ENOSPC`; the program tells neither from the other.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use trueup::trace::{Event, Observer};
use trueup::workcell::archive::{self, Standing, standing};
use trueup::workcell::record::Recorder;
use trueup::workcell::{Run, State};

use crate::absent::skipped;
use crate::program::{Said, Scratch, project};
use crate::repl::kept;

/// Whether a folder holds anything that was begun and not finished.
fn halves(scratch: &Scratch) -> Vec<String> {
    let all = scratch.everything().into_iter();
    all.filter(|name| name.contains(".part") || name.contains(".trueup-")).collect()
}

fn is_full(said: &Said, code: i32) {
    assert_eq!(said.code, code, "{said:?}");
    assert!(said.err.contains("no room left on the disk"), "{said:?}");
    assert!(said.err.contains("help: make room"), "{said:?}");
}

/// Every command that writes one file, on a disk without room: it says so, and what was there is as it was.
#[test]
fn a_full_disk_costs_no_file_that_was_there() {
    let scratch = Scratch::new("writes-full");
    kept::lay_out(&scratch);
    super::learn::folders(&scratch);
    scratch.file("messy.task", "pour(  jar,cup )\n");
    scratch.file("there.html", "as it was\n");
    assert_eq!(scratch.trueup(&["lab", "hide", "--out", "there.toml"]).code, 0);
    scratch.file("runs/priors.json", "{\"counts\":{}}\n");
    scratch.file("runs/outcomes-real.jsonl", "");
    fs::create_dir_all(scratch.path("pages")).unwrap();
    let before = scratch.everything();
    let texts = |scratch: &Scratch| {
        ["messy.task", "there.html", "there.toml", "runs/priors.json", "runs/outcomes-real.jsonl"]
            .map(|name| fs::read_to_string(scratch.path(name)).unwrap())
    };
    let contents = texts(&scratch);
    for args in [
        &["fmt", "messy.task"][..],
        &["lab", "hide", "--seed", "5", "--out", "there.toml"],
        &["report", "1", "-o", "there.html"],
        &["report", "1", "-o", "pages/new.html"],
        &["learn", "runs"],
        &["learn", "runs", "--demonstrations"],
    ] {
        let said = scratch.without_room(0, args);
        is_full(&said, 2);
        assert_eq!(
            scratch.without_room(0, &[args, &["--json"]].concat()).error("code"),
            "io::full"
        );
        assert_eq!(scratch.everything(), before, "{args:?}");
        assert_eq!(texts(&scratch), contents, "{args:?}");
    }
}

/// `gap --apply` changes the model file and keeps a copy, a page and the finding.
#[test]
fn a_full_disk_costs_no_model_file() {
    let scratch = Scratch::new("writes-gap");
    let model = "// Ours.\ntwin arm of kitchen {\n}\n";
    scratch.file("arm.task", model);
    let of = |name: &str| project(&format!("tests/discovery/recordings/{name}"));
    let (a, b) = (of("coulomb_a.csv"), of("coulomb_b.csv"));
    for more in [&["--apply"][..], &["--out", "found"]] {
        let args = [&["gap", &a, &b, "--model", "arm.task", "--quiet"][..], more].concat();
        is_full(&scratch.without_room(0, &args), 2);
        assert_eq!(fs::read_to_string(scratch.path("arm.task")).unwrap(), model);
        assert_eq!(halves(&scratch), [""; 0]);
    }
}

/// What is typed at the prompt and kept: phrases, and the list of changes that can be undone.
#[test]
fn a_full_disk_is_told_at_the_prompt_which_goes_on() {
    let scratch = Scratch::new("writes-prompt");
    let said =
        scratch.without_room_typed(0, &[], ":phrase \"empty the {o}\" = pour(o, cup)\n!6 * 7\n");
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains("cannot be kept: no room left on the disk"), "{said:?}");
    assert!(said.out.contains("42"), "{said:?}");
    assert_eq!(halves(&scratch), [""; 0]);
}

/// `:save` of calls that were made while there was room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_costs_no_file_of_calls() {
    if Command::new("prlimit").arg("--version").output().is_err() {
        return skipped("prlimit is not here");
    }
    let scratch = Scratch::new("writes-save");
    scratch.file("there.task", "home()\n");
    let args = ["--robot", "twin", "--quiet", "--without-regression", "3"];
    let mut child = scratch.limited("trap '' XFSZ", &args).stdin(Stdio::piped()).spawn().unwrap();
    let mut keys = child.stdin.take().unwrap();
    keys.write_all(b"home()\n").unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut said = String::new();
    while !said.contains("run folder") {
        assert!(out.read_line(&mut said).unwrap() > 0, "it ended with {said}");
    }
    let pid = child.id().to_string();
    assert!(Command::new("prlimit").args(["--pid", &pid, "--fsize=0"]).status().unwrap().success());
    keys.write_all(b":save calls.task\n:save there.task\n!6 * 7\n").unwrap();
    drop(keys);
    out.read_to_string(&mut said).unwrap();
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(err.contains("calls.task") && err.contains("no room left on the disk"), "{err}");
    assert!(said.contains("42"), "{said}");
    assert!(!scratch.path("calls.task").exists() && halves(&scratch).is_empty());
    assert_eq!(fs::read_to_string(scratch.path("there.task")).unwrap(), "home()\n");
}

/// Lines typed at a terminal, which are kept one by one.
#[test]
fn a_full_disk_is_told_once_where_typed_lines_are_kept() {
    if Command::new("script").arg("--version").output().is_err() {
        return skipped("script, which plays a terminal, is not here");
    }
    let scratch = Scratch::new("writes-history");
    let mut child = Command::new("script")
        .args([
            "-qec",
            &format!(
                "trap '' XFSZ; ulimit -f 0; exec timeout --foreground 120 {}",
                env!("CARGO_BIN_EXE_trueup")
            ),
        ])
        .arg("/dev/null")
        .current_dir(scratch.path(""))
        .env("XDG_STATE_HOME", scratch.path(""))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // Kept open to the end: at the end of its input `script` would ask for it over and over.
    let (mut keys, mut out) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    let (mut screen, mut seen) = (Vec::new(), 0);
    let mut until = |words: &str| {
        // What comes in one piece may hold the answer and the next prompt.
        while !String::from_utf8_lossy(&screen[seen..]).contains(words) {
            let mut more = [0; 1024];
            let count = out.read(&mut more).unwrap();
            assert!(count > 0, "it ended with {}", String::from_utf8_lossy(&screen));
            screen.extend(&more[..count]);
        }
        let at = screen[seen..].windows(words.len()).position(|part| part == words.as_bytes());
        seen += at.unwrap_or(0) + words.len();
    };
    // What is typed before the prompt is there is lost, as at any terminal.
    until("lab> ");
    for (line, answer) in [(b"!6 * 7\r", "42\r\n"), (b"!7 * 7\r", "49\r\n")] {
        keys.write_all(line).unwrap();
        until(answer);
        until("lab> ");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let screen = String::from_utf8_lossy(&screen);
    assert_eq!(screen.matches("what is typed is not kept").count(), 1, "{screen}");
    assert!(screen.contains("no room left on the disk"), "{screen}");
    assert!(screen.contains("42") && screen.contains("49"), "{screen}");
    assert_eq!(halves(&scratch), [""; 0]);
}

/// `:undo-edit` of a file that had another text before.
#[test]
fn a_full_disk_is_told_where_a_change_is_taken_back() {
    let scratch = Scratch::new("writes-undo");
    let phrases =
        ":phrase \"empty the {o}\" = pour(o, cup)\n:phrase \"tip the {o}\" = pour(o, cup)\n";
    let said = scratch.typed(&[], phrases);
    assert_eq!(said.code, 0, "{said:?}");
    let said = scratch.without_room_typed(0, &[], ":undo-edit\n:phrase\n!6 * 7\n");
    assert!(said.err.contains("no room left on the disk"), "{said:?}");
    assert!(said.out.contains("tip the {o}") && said.out.contains("42"), "{said:?}");
    let said = scratch.typed(&[], ":undo-edit\n:phrase\n");
    assert!(said.out.contains("empty the {o}") && !said.out.contains("tip the {o}"), "{said:?}");
    assert_eq!(halves(&scratch), [""; 0]);
}

/// The picture of what was seen.
#[test]
fn a_full_disk_leaves_no_half_of_a_picture() {
    let scratch = Scratch::new("writes-picture");
    let blank = image::RgbImage::from_pixel(1280, 720, image::Rgb([120, 120, 120]));
    blank.save(scratch.path("blank.png")).unwrap();
    let see = ["camera", "see", "blank.png", "--out", "seen"];
    is_full(&scratch.without_room(0, &see), 2);
    assert_eq!(fs::read_dir(scratch.path("seen")).unwrap().count(), 0);
    assert_eq!(scratch.trueup(&see).code, 1);
    assert!(image::open(scratch.path("seen/seen.png")).is_ok());
}

/// Files that only grow: what does not fit is not there by half.
#[test]
fn a_line_that_does_not_fit_leaves_the_file_as_it_was() {
    let scratch = Scratch::new("writes-lines");
    kept::lay_out(&scratch);
    let picture = image::RgbImage::from_pixel(8, 6, image::Rgb([200, 30, 30]));
    fs::create_dir_all(scratch.path("runs/20260101-090000-pour/frames")).unwrap();
    for (number, whose) in [(1, "real"), (1, "twin"), (2, "real"), (2, "twin")] {
        let name = format!("runs/20260101-090000-pour/frames/{number:02}-after-{whose}.png");
        picture.save(scratch.path(&name)).unwrap();
    }
    // 512 bytes are one block: the second answer does not fit.
    let file = scratch.path("labels.jsonl");
    let label = |blocks| {
        let args = ["vqa", "label", "runs/20260101-090000-pour", "--answers", "labels.jsonl"];
        scratch.without_room_typed(blocks, &args, "y\ny\ny\n")
    };
    let said = label(0);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains("no room left on the disk"), "{said:?}");
    assert_eq!(fs::read_to_string(&file).unwrap_or_default(), "");
    let said = label(1);
    assert_eq!(said.code, 2, "{said:?}");
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.lines().all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()));
    assert!(text.is_empty() || text.ends_with('\n'), "{text}");
}

/// Where not even the run's first document fits, nothing moves; where a picture does not, the arm is stopped.
#[test]
fn a_disk_that_fills_up_during_a_run_stops_the_arm() {
    let scratch = Scratch::new("writes-run");
    let said = scratch.without_room(0, &["-c", "home()", "--quiet"]);
    is_full(&said, 2);
    assert_eq!(halves(&scratch), [""; 0]);

    // 512 blocks are 256 kB: documents fit, the first photograph does not.
    let said = scratch.without_room(512, &["-c", "home()", "--record", "short", "--quiet"]);
    assert_eq!(said.code, 3, "{said:?}");
    assert!(said.err.contains("no room left on the disk; the arm was stopped"), "{said:?}");
    let folder = scratch.run_folder("short");
    assert!(said.err.contains(folder.file_name().unwrap().to_str().unwrap()), "{said:?}");
    let run = archive::load(&folder).unwrap();
    assert_eq!(standing(&folder, &run), Standing::Ended(trueup::workcell::Ending::Stopped));
    assert!(run.reason.unwrap().contains("could not be recorded"));
    for (file, is_whole) in [("events.jsonl", "}"), ("arm.csv", "")] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        assert!(text.is_empty() || text.ends_with(&format!("{is_whole}\n")), "{file}");
    }
    assert_eq!(halves(&scratch), [""; 0]);
    assert_eq!(scratch.trueup(&["replay", "1", "--record", "short"]).code, 0);
}

/// A limit on the size of files comes with a signal that ended the program without a word, and left the arm on its way.
#[test]
fn a_limit_on_the_size_of_files_is_an_error_and_no_end() {
    let scratch = Scratch::new("writes-limit");
    scratch.file("messy.task", "pour(  jar,cup )\n");
    let limited = |blocks: usize, args: &[&str]| {
        let output = scratch.limited(&format!("ulimit -f {blocks}"), args).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, err) = limited(0, &["fmt", "messy.task"]);
    assert_eq!(code, Some(2), "{err}");
    assert!(err.contains(": a limit on the size of files is reached"), "{err}");
    assert!(err.contains("help: make room, or raise the limit (`ulimit -f`),"), "{err}");
    let (code, err) = limited(512, &["-c", "home()", "--quiet"]);
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains("the arm was stopped and holds"), "{err}");
    assert!(err.contains("a limit on the size of files is reached"), "{err}");
}

/// A trial that could not be kept is told as that, and is none.
#[test]
fn a_full_disk_ends_trials() {
    let scratch = Scratch::new("writes-trials");
    let said = scratch.without_room(0, &["trials", "--task", "home()", "-n", "1", "--quiet"]);
    is_full(&said, 2);
    let kept = fs::read_to_string(scratch.path("trials/home/trials.jsonl")).unwrap_or_default();
    assert_eq!(kept, "");
}

fn copy(from: &Path, to: &Path, events: &str) {
    fs::create_dir_all(to).unwrap();
    fs::copy(from.join("run.json"), to.join("run.json")).unwrap();
    fs::write(to.join("events.jsonl"), events).unwrap();
}

/// A run is killed at each of its events, also in the middle of a line: what is left is listed and told again
/// with every step whose end was told.
#[test]
fn a_run_that_is_killed_at_any_step_is_listed_and_told_again() {
    let scratch = Scratch::new("writes-killed");
    let whole = kept::pour("level_side", 0.1, 0.064, 0.001);
    let mut recorder = Recorder::create(&scratch.path("made"), "20260101-000000", "pour").unwrap();
    let dir = recorder.dir().to_path_buf();
    let mut run =
        Run { state: State::Running, steps: Vec::new(), questions: Vec::new(), ..whole.clone() };
    // What is on the disk after each thing that is written, and how many steps it tells of.
    let mut moments = Vec::new();
    let mut moment = |run: &Run, told: usize| {
        let events = fs::read_to_string(dir.join("events.jsonl")).unwrap();
        let to = scratch.path(&format!(
            "cut/2026010{}-00000{}-pour",
            run.steps.len() + 1,
            moments.len()
        ));
        copy(&dir, &to, &events);
        moments.push((to, told, events));
    };
    recorder.save(&run).unwrap();
    moment(&run, 0);
    for step in &whole.steps {
        let (number, action) = (step.number, step.action.clone());
        recorder.event(&Event::StepStart { number, of: 2, action, path: step.path.clone() });
        moment(&run, run.steps.len());
        recorder.event(&Event::StepEnd { record: Box::new(step.clone()) });
        moment(&run, run.steps.len() + 1);
        run.questions.push(whole.questions[run.steps.len()].clone());
        run.steps.push(step.clone());
        recorder.save(&run).unwrap();
        moment(&run, run.steps.len());
    }
    // While it is written it goes on; once its recorder is gone it was cut off.
    assert_eq!(standing(&dir, &run), Standing::Running);
    drop(recorder);
    assert_eq!(standing(&dir, &run), Standing::CutOff);
    let listed = scratch.trueup(&["runs", "--record", "cut", "--json"]).json();
    assert_eq!(listed["runs"].as_array().unwrap().len(), moments.len());
    for (at, (to, told, events)) in moments.iter().enumerate() {
        let entry = listed["runs"].as_array().unwrap().iter();
        let name = to.file_name().unwrap().to_str().unwrap();
        let entry = entry.clone().find(|e| e["folder"].as_str().unwrap().ends_with(name)).unwrap();
        assert_eq!(
            (&entry["ended"], &entry["steps"]),
            (&"cut off".into(), &(*told).into()),
            "{at}"
        );
        // A line cut in its middle tells nothing, and spoils nothing.
        for end in [events.len(), events.len().saturating_sub(20)] {
            fs::write(to.join("events.jsonl"), &events[..end]).unwrap();
            let run = archive::load(to).unwrap();
            assert!(run.steps.len() + 1 >= *told && run.steps.len() <= *told);
            assert_eq!(run.questions.len(), run.steps.len());
        }
    }
    let (last, ..) = moments.last().unwrap();
    let again = scratch.trueup(&["replay", last.to_str().unwrap()]);
    assert_eq!(again.code, 0, "{again:?}");
    assert!(again.out.contains("it was cut off") && again.out.contains("move_over(jar, cup"));
    let first = scratch.trueup(&["replay", moments[0].0.to_str().unwrap()]);
    assert!(first.code == 0 && first.out.contains("0 steps"), "{first:?}");
}

/// Waits until a run on the scratch has told so many events of a kind.
fn wait_for(scratch: &Scratch, root: &str, kind: &str, count: usize) {
    // Much longer than it takes, for machines that are busy.
    for _ in 0..60_000 {
        let folders = fs::read_dir(scratch.path(root)).into_iter().flatten().flatten();
        let told = folders
            .filter_map(|entry| fs::read_to_string(entry.path().join("events.jsonl")).ok())
            .any(|text| text.matches(&format!("\"event\":\"{kind}\"")).count() >= count);
        if told {
            return;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    panic!("no {count} {kind} in {root}");
}

/// The program itself, killed: from the first moment on, and at the beginning and the end of every step.
#[test]
fn a_program_that_is_killed_leaves_a_run_that_can_be_told() {
    let scratch = Scratch::new("writes-kill");
    // More steps than are waited for: the twin takes each in milliseconds, and the end must not come before the kill.
    let steps = "home() open_gripper() ".repeat(20);
    scratch.file("tour.task", format!("task tour() {{ {steps} }}\ntour()\n"));
    for (at, (kind, count)) in [
        ("phase", 1),
        ("step_start", 1),
        ("step_end", 1),
        ("step_start", 2),
        ("step_end", 2),
        ("step_start", 3),
    ]
    .into_iter()
    .enumerate()
    {
        let root = &format!("{at}-{kind}");
        let mut child = scratch
            .command(&["run", "tour.task", "--quiet", "--robot", "twin", "--record", root])
            .args(["--without-regression", "3"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_for(&scratch, root, kind, count);
        child.kill().unwrap();
        child.wait().unwrap();
        let folder = scratch.run_folder(root);
        let events = fs::read_to_string(folder.join("events.jsonl")).unwrap();
        let told = events.matches("\"event\":\"step_end\"").count();
        let cut = scratch.trueup(&["runs", "--record", root, "--json"]).json();
        assert_eq!(cut["runs"][0]["ended"], "cut off", "{root}: {cut}");
        assert_eq!(cut["runs"][0]["steps"], told, "{root}: {cut}");
        let again = scratch.trueup(&["replay", "1", "--record", root]);
        assert_eq!(again.code, 0, "{again:?}");
        assert!(again.out.contains("it was cut off"), "{again:?}");
        assert_eq!(again.out.contains("home()"), told > 0, "{again:?}");
        assert_eq!(again.out.contains("open_gripper()"), told > 1, "{again:?}");
        // The kernel ends a write where it is, so a last row may be there by half: nobody takes it for a whole one.
        let arm = folder.join("arm.csv");
        let rows = fs::read_to_string(&arm).unwrap();
        let whole = rows.matches('\n').count();
        if whole > 2 {
            let end = rows.rfind('\n').unwrap();
            fs::write(&arm, &rows[..end - 9]).unwrap();
            let exported = scratch.trueup(&["export", "1", "--record", root, "--csv", "rows.csv"]);
            assert_eq!(exported.code, 0, "{exported:?}");
            let kept = fs::read_to_string(scratch.path("rows.csv")).unwrap();
            assert_eq!(kept.lines().count(), whole - 1, "{root}");
            fs::remove_file(scratch.path("rows.csv")).unwrap();
        }
        for frame in fs::read_dir(folder.join("frames")).unwrap() {
            let path = frame.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "jpg") {
                assert!(image::open(&path).is_ok(), "{} is there by half", path.display());
            }
        }
    }
}

/// A run that goes on is listed as that.
#[test]
fn a_run_that_goes_on_is_listed_as_running() {
    let scratch = Scratch::new("writes-running");
    let mut child = scratch
        .command(&["-c", "home()", "--quiet", "--robot", "twin"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_for(&scratch, "runs", "phase", 1);
    let running = scratch.trueup(&["runs", "--json"]).json();
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(running["runs"][0]["ended"], "running", "{running}");
}

/// A system that ends programs, and a terminal that is closed: the arm is stopped as by Ctrl-C.
#[test]
fn what_asks_the_program_to_end_stops_the_arm_first() {
    let scratch = Scratch::new("writes-signals");
    // Under `nohup` a closed terminal means nothing, to the tests as to the program.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    for signal in ["TERM", "HUP", "INT"].into_iter().filter(|s| *s != "HUP" || ignored & 1 == 0) {
        let mut child = scratch
            .command(&["-c", "home()", "--json", "--record", signal])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_for(&scratch, signal, "phase", 1);
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &pid]).status().unwrap().success());
        let mut out = String::new();
        std::io::Read::read_to_string(&mut child.stdout.take().unwrap(), &mut out).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(3), "{signal}: {out}");
        let folder = scratch.run_folder(signal);
        let run = archive::load(&folder).unwrap();
        let stopped = Standing::Ended(trueup::workcell::Ending::Stopped);
        assert_eq!(standing(&folder, &run), stopped, "{signal}");
        let answer: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(answer["outcome"], "stopped", "{signal}");
    }
}

/// A prompt at which nothing is under way ends when it is asked to; `nohup` keeps it from minding a terminal.
#[test]
fn an_idle_prompt_ends_when_it_is_asked_to() {
    let scratch = Scratch::new("writes-idle");
    for (shell, signal, ends) in
        [("exec \"$@\"", "TERM", true), ("trap '' HUP; exec \"$@\"", "HUP", false)]
    {
        let mut child = Command::new("sh")
            .args(["-c", shell, "sh", env!("CARGO_BIN_EXE_trueup")])
            .current_dir(scratch.path(""))
            .env("XDG_STATE_HOME", scratch.path(""))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut keys = child.stdin.take().unwrap();
        std::io::Write::write_all(&mut keys, b"!6 * 7\n").unwrap();
        let mut said = [0; 2];
        std::io::Read::read_exact(child.stdout.as_mut().unwrap(), &mut said).unwrap();
        assert_eq!(&said, b"42");
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &pid]).status().unwrap().success());
        if !ends {
            std::thread::sleep(Duration::from_millis(100));
            drop(keys);
        }
        let code = child.wait().unwrap().code();
        assert_eq!(code, Some(if ends { 3 } else { 0 }), "{signal}");
    }
}
