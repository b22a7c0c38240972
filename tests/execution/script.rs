//! Scripts are kept in bounds: endless ones end, mistakes point at their line, a stop goes through.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use trueup::arm::Cancel;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::error::ActionError;
use trueup::execution::lint::readable;
use trueup::execution::refusal::Mistake;
use trueup::execution::script::{ScriptError, ScriptValue, Scripts};
use trueup::trace::{Event, Observer};
use trueup::trace::{NoWay, Why};

fn run(scripts: &mut Scripts, text: &str) -> Result<(), ScriptError> {
    scripts.run("test.rhai", text, &BTreeMap::new())
}

fn open() -> Scripts {
    super::scripts(&Cancel::default(), DecisionLog::recording())
}

/// The line and the words of a script that is wrong.
fn wrong(scripts: &mut Scripts, text: &str) -> (usize, String) {
    match run(scripts, text) {
        Err(ScriptError::Wrong { file, line, mistake }) => {
            assert_eq!(file, "test.rhai");
            (line, mistake.to_string())
        }
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn scripts_without_end_or_bounds_are_stopped() {
    let mut scripts = open();
    for (text, word) in [
        ("loop { }", "operations"),
        ("let n = 0; while true { n += 1; }", "operations"),
        ("fn again(n) { again(n + 1) } again(0);", "overflow"),
        ("let s = \"0123456789abcdef\"; loop { s += s; }", "string"),
        ("let a = []; loop { a.push(0); }", "size"),
        (&format!("let x = {}1{};", "(".repeat(200), ")".repeat(200)), "complex"),
    ] {
        let (_, message) = wrong(&mut scripts, text);
        assert!(message.to_lowercase().contains(word), "{text:.60}: {message}");
    }
    // A map that grows by `m[k] = v` is measured when a word is called on it, and not before: the engine's, not ours.
    let grown = "let m = #{}; for i in 0..300 { m[`k${i}`] = i; }";
    run(&mut scripts, grown).unwrap();
    let (_, message) = wrong(&mut scripts, &format!("{grown} m.len();"));
    assert!(message.to_lowercase().contains("size"), "{message}");
    // And the engine is as good as new afterwards.
    run(&mut scripts, "let a = [1.0 * cm, 2.0 * deg]; if a.len() != 2 { throw \"odd\"; }").unwrap();
}

/// A stranger's script reaches no file, holds no thread and has no clock.
#[test]
fn scripts_have_no_files_no_clock_and_no_other_scripts() {
    let mut scripts = open();
    for text in ["import \"stolen\" as s;", "eval(\"1 + 1\");", "export let x = 1;"] {
        let (line, message) = wrong(&mut scripts, text);
        assert_eq!(line, 1, "{text}: {message}");
        assert!(readable("test.rhai", text, []).is_err(), "{text}");
    }
    for (text, word) in
        [("\nsleep(1);", "arm.wait"), ("\nsleep(0.5);", "arm.wait"), ("\ntimestamp();", "clock")]
    {
        match run(&mut scripts, text).unwrap_err() {
            ScriptError::Action { error, line } => {
                assert_eq!(line, Some(2), "{text}");
                assert!(error.to_string().contains(word), "{text}: {error}");
            }
            other @ ScriptError::Wrong { .. } => panic!("{text}: {other}"),
        }
    }
}

/// What is misspelt shows before anything moves, also where a script seldom comes to.
#[test]
fn words_and_names_that_there_are_not_are_seen_without_running() {
    for (text, line, says) in [
        ("arm.openn();", 1, "there is no word `arm.openn`; did you mean `arm.open()`?"),
        ("if 1 > 2 {\n  arm.moveby([0, 0, 0.1], 0.5);\n}", 2, "`arm.move_by(by, speed)`"),
        ("fn f(x) { x + 1 }\nlet y = f(2);\nlet z = g(y);", 3, "there is no word `g`"),
        (
            "let ways = twin.grasps(cub, \"top\", 0.0);",
            1,
            "there is no word `cub`; did you mean `cube`?",
        ),
        ("arm.follow(twin.grasp(cube)[0].way_in, 0.5);", 1, "`twin.grasps(o, face, pitch)`"),
        ("arm.look();", 1, "there is no word `arm.look`; did you mean `camera.look()`?"),
        ("let p = arm.pose().movd([0, 0, 0.1]);", 1, "did you mean `pose.moved(by)`?"),
        ("arm.open(0.5, 1);", 1, "it is written `arm.open()`"),
    ] {
        let said = readable("test.rhai", text, ["cube"]).unwrap_err().to_string();
        assert!(said.starts_with(&format!("test.rhai:{line}: ")), "{text}: {said}");
        assert!(said.contains(says), "{text}: {said}");
    }
    for text in [
        "let w = choose(twin.grasps(cube, \"top\", 90 * deg)); arm.follow(w.way_in, 0.5);",
        "let w = twin.grasps(cube, \"side\", 0.0).choose(); print(w.clearance.type_of());",
        "fn twice(x) { x * 2 }\nlet m = #{ again: |x| x + 1 }; let y = twice(m.again.call(1)); y.twice();",
        "let list = [3, 1, 2]; list.sort(); list.push(list.len()); for x in list { note(`${x}`); }",
        "let p = pose([0.4, 0.0, 0.3], 0.0, 90 * deg).moved([0, 0, 0.1]); arm.line_to(p, 0.3);",
        "try { arm.wait(0.1); } catch (why) { throw why; }",
    ] {
        readable("test.rhai", text, ["cube"]).unwrap();
    }
}

/// Things that hold themselves, over and over, would be too deep to let go of again.
#[test]
fn scripts_that_fill_the_memory_end_with_a_message() {
    let mut scripts = open();
    for text in [
        "let s = \"x\"; loop { s += s; }",
        "let s = \"x\"; loop { s.pad(1000000000, 'y'); }",
        "let a = []; loop { a = [a]; }",
        "let a = []; loop { a += [1, 2, 3]; }",
        "let a = []; a.pad(1000000000, 0);",
        "let b = blob(2000000000, 1);",
        "let m = #{}; loop { m = #{a: m}; }",
        "let m = #{}; let i = 0; loop { m[`k${i}`] = i; i += 1; }",
        "let f = |x| x; loop { f = f.curry(f); }",
        "let f = |x| x; loop { let g = f; f = |x| g.call(x); }",
        "let i = 0; loop { remember(`name ${i}`, i); i += 1; }",
        "let a = []; for i in 0..1999 { a.push(i); } loop { let b = [a, a]; }",
        "fn f(n) { let a = [n]; f(a) } f(0);",
    ] {
        assert!(run(&mut scripts, text).is_err(), "{text}");
    }
    let error = run(&mut scripts, "for i in 0..1000 { remember(`n${i}`, i); }").unwrap_err();
    assert!(error.to_string().contains("things already"), "{error}");
}

/// What later actions recall is a value of its own, and never a handle of this arm.
#[test]
fn only_values_are_remembered() {
    let mut scripts = open();
    for (text, word) in [
        ("remember(\"arm\", arm);", "a handle"),
        ("remember(\"all\", [1, [twin]]);", "a handle"),
        ("remember(\"f\", |x| x);", "a function"),
        ("remember(\"\", 1);", "name"),
        ("let n = \"x\"; for i in 0..7 { n += n; } remember(n, 1);", "name"),
        ("let a = 1; for i in 0..12 { a = [a]; } remember(\"deep\", a);", "deep"),
    ] {
        let error = run(&mut scripts, text).unwrap_err().to_string();
        assert!(error.contains(word), "{text}: {error}");
    }
    let text = "let x = [1]; remember(\"x\", [x, #{y: x}]); x[0] = 2; \
                if recall(\"x\")[0][0] != 1 || recall(\"x\")[1].y[0] != 1 { throw \"changed\" }";
    run(&mut scripts, text).unwrap();
}

/// Every argument of a word has its range, told with the line that left it; nothing moves.
#[test]
fn arguments_out_of_range_are_told_with_the_range() {
    let mut scripts = open();
    let q = scripts.context().planned_q().unwrap().to_vec();
    for (text, word) in [
        ("arm.move_to([]);", "7 joints"),
        ("arm.move_to([0.0, 0.0]);", "was given 2"),
        ("let q = twin.pose_named(\"home\"); q[3] = 0.0 / 0.0; arm.move_to(q);", "joint 4"),
        ("let q = twin.pose_named(\"home\"); q[0] = 1e300; arm.move_to(q);", "-720 to 720 deg"),
        ("arm.carry_to(twin.pose_named(\"home\"), -1.0, 0.5);", "0 to 180 deg"),
        ("arm.carry_to(twin.pose_named(\"home\"), 0.1, 0.0 / 0.0);", "0.02 to 1 of full speed"),
        ("arm.move_by([], 0.5);", "[x, y, z]"),
        ("arm.move_by([0.0, 0.0, 0.0 / 0.0], 0.5);", "0 to 2 m"),
        ("arm.move_by([1e300, 0.0, 0.0], 0.5);", "0 to 2 m"),
        ("arm.move_by([1e9, 0.0, 0.0], 0.5);", "0 to 2 m"),
        ("arm.move_by([0.0, 0.0, 0.1], -1.0);", "full speed"),
        ("arm.wait(-1.0);", "0 to 600 s"),
        ("arm.wait(0.0 / 0.0);", "is NaN s"),
        ("arm.wait(1e18);", "0 to 600 s"),
        ("arm.heft(-1.0);", "0.02 to 60 s"),
        ("arm.heft(1.0 / 0.0);", "0.02 to 60 s"),
        ("arm.close(\"jar\", 0.0 / 0.0);", "117.500 N"),
        ("arm.close(\"jar\", 1e9);", "117.500 N"),
        ("arm.weighed(0.0 / 0.0);", "-5 to 50 kg"),
        ("arm.bears(1e9);", "-5 to 50 kg"),
        ("twin.grasps(\"jar\", \"side\", 0.0 / 0.0);", "-90 to 90 deg"),
        ("twin.pours(\"jar\", \"cup\", 1e9);", "-0.1 to 1 m"),
        ("twin.enough(\"jar\", 0.0 / 0.0);", "mL"),
    ] {
        let text = format!("\n{text}");
        match run(&mut scripts, &text).unwrap_err() {
            ScriptError::Action { error, line } => {
                assert_eq!(line, Some(2), "{text}");
                assert!(error.to_string().contains(word), "{text}: {error}");
            }
            other @ ScriptError::Wrong { .. } => panic!("{text}: {other}"),
        }
        assert_eq!(scripts.context().planned_q().unwrap(), q, "{text}");
    }
    // A script may act and plan often, and not without end.
    for (text, word) in [
        ("loop { arm.wait(0.0); }", "may act 1000 times"),
        (
            "loop { try { twin.placements(\"kettle\"); } catch (e) { if `${e}` == \"\" { } } }",
            "operations",
        ),
    ] {
        let error = run(&mut scripts, text).unwrap_err().to_string();
        assert!(error.contains(word), "{text}: {error}");
    }
}

/// What a script notes and prints.
#[derive(Default)]
struct Told(Vec<String>);

impl Observer for Told {
    fn event(&mut self, event: &Event) {
        if let Event::Note { text, .. } = event {
            self.0.push(text.clone());
        }
    }
}

/// Under `--json` stdout belongs to the answer, so what a script prints is told as its notes are.
#[test]
fn what_a_script_prints_goes_where_its_notes_go_and_has_an_end() {
    let told = Arc::new(Mutex::new(Told::default()));
    let mut scripts =
        super::scripts_watched(&Cancel::default(), DecisionLog::recording(), told.clone());
    run(&mut scripts, "print(\"one\"); debug(\"two\"); note(\"three\");").unwrap();
    let take = || std::mem::take(&mut told.lock().unwrap().0);
    let first = take();
    assert_eq!((first.len(), first[0].as_str(), first[2].as_str()), (3, "one", "three"));
    assert!(first[1].contains("two"));
    run(&mut scripts, "let s = \"x\"; for i in 0..12 { s += s; } for i in 0..5000 { note(s); }")
        .unwrap();
    let many = take();
    assert_eq!(many.len(), 101);
    assert!(many[0].chars().count() <= 401 && many[100].contains("no more"), "{}", many[100]);
}

#[test]
fn a_mistake_points_at_its_line() {
    let mut scripts = open();
    let (line, message) = wrong(&mut scripts, "let a = 1;\nlet b = ;\n");
    assert_eq!(line, 2, "{message}");
    let (line, message) = wrong(&mut scripts, "let a = 1;\n\narm.fly_to(a);\n");
    assert_eq!(line, 3);
    assert!(message.contains("fly_to"), "{message}");
    for (text, at, word) in [
        ("\narm.move_by([1.0, 2.0], 0.5);", 2, "[x, y, z]"),
        ("\n\narm.move_to([\"up\", 0.0]);", 3, "number"),
    ] {
        match run(&mut scripts, text).unwrap_err() {
            ScriptError::Action { error, line } => {
                assert_eq!(line, Some(at), "{text}");
                assert!(error.to_string().contains(word), "{text}: {error}");
            }
            other @ ScriptError::Wrong { .. } => panic!("{text}: {other}"),
        }
    }
    let (line, message) = wrong(&mut scripts, "arm.wait(jug);");
    assert_eq!(line, 1);
    assert!(message.contains("jug"), "{message}");
}

/// What a binding refuses is that very error, with the line that asked; a script may catch it.
#[test]
fn what_cannot_be_done_is_the_bindings_own_error() {
    let mut scripts = open();
    let far = "let q = twin.pose_named(\"home\");\nq[1] = 2.24;\nq[3] = 0.0;\narm.move_to(q);";
    match run(&mut scripts, far).unwrap_err() {
        ScriptError::Action { error: ActionError::NoWay(NoWay { .. }), line } => {
            assert_eq!(line, Some(4));
        }
        other => panic!("{other:?}"),
    }
    match run(&mut scripts, "\ntwin.grasps(\"kettle\", \"side\", 0.0);").unwrap_err() {
        ScriptError::Action { error: ActionError::NoWay(no), line } => {
            assert_eq!(line, Some(2));
            assert_eq!(no.why, Why::NotSeen("kettle".into()));
        }
        other => panic!("{other:?}"),
    }
    match run(&mut scripts, "recall(\"grasp\");").unwrap_err() {
        ScriptError::Action { error: ActionError::NotRemembered(name), line } => {
            assert_eq!((name.as_str(), line), ("grasp", Some(1)));
        }
        other => panic!("{other:?}"),
    }
    for (text, word) in [
        ("throw \"the lid is on\";", "the lid is on"),
        ("choose([]);", "nothing to choose"),
        ("twin.pose_named(\"yoga\");", "yoga"),
        ("twin.grasps(\"jar\", \"bottom\", 0.0);", "`bottom`"),
    ] {
        match run(&mut scripts, text).unwrap_err() {
            ScriptError::Action { error: ActionError::Refused(why), line } => {
                let words = why.to_string();
                assert!(words.contains(word), "{text}: {words}");
                assert_eq!(line, Some(1), "{text}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
    run(
        &mut scripts,
        "try { recall(\"grasp\"); } catch { remember(\"grasp\", 1); } recall(\"grasp\");",
    )
    .unwrap();
}

#[test]
fn arguments_come_in_si_and_by_name() {
    let mut scripts = open();
    let args = BTreeMap::from([
        ("o".to_owned(), ScriptValue::Name("jar".into())),
        ("by".to_owned(), ScriptValue::Number(0.12)),
        ("gently".to_owned(), ScriptValue::Truth(true)),
    ]);
    let text = "if o != \"jar\" || by < 11.0 * cm || by > 13.0 * cm || !gently { throw \"odd\" }
                let at = twin.position(o);
                if (at[0] - 60.0 * cm).abs() > 1.0 * mm { throw `${at}` }
                if twin.volume(o) > 0.1 * mL { throw \"wet\" }";
    scripts.run("test.rhai", text, &args).unwrap();
}

/// Ctrl-C comes from another thread while a script does nothing but count.
#[test]
fn a_stop_ends_a_loop_and_cannot_be_caught() {
    for text in
        ["loop { }", "try { loop { } } catch { loop { } }", "loop { try { loop { } } catch { } }"]
    {
        let cancel = Cancel::default();
        let mut scripts = super::scripts(&cancel, DecisionLog::recording());
        let stop = cancel.clone();
        let stopping = thread::spawn(move || {
            thread::sleep(Duration::from_millis(5));
            stop.cancel();
        });
        let error = run(&mut scripts, text).unwrap_err();
        stopping.join().unwrap();
        let stopped = matches!(error, ScriptError::Action { error: ActionError::Stopped, .. });
        // Two million operations may be over before the stop comes.
        let ended = matches!(error, ScriptError::Wrong { mistake: Mistake::Endless { .. }, .. });
        assert!(stopped || ended, "{text}: {error:?}");
    }
    // Asked to stop beforehand, a script does not begin.
    let cancel = Cancel::default();
    let mut scripts = super::scripts(&cancel, DecisionLog::recording());
    cancel.cancel();
    for text in ["loop { }", "try { arm.wait(1.0); } catch { arm.open(); }"] {
        let error = run(&mut scripts, text).unwrap_err();
        assert!(
            matches!(error, ScriptError::Action { error: ActionError::Stopped, .. }),
            "{text}: {error:?}"
        );
    }
    cancel.clear();
    run(&mut scripts, "arm.wait(0.02);").unwrap();
}

/// A rehearsal that would go on for ever is over once its time or its planning is used up.
#[test]
fn a_stage_with_an_allowance_ends_what_goes_beyond_it() {
    let mut scripts = super::scripts(&Cancel::default(), DecisionLog::recording());
    scripts.context().allow(0.5, 1_000_000_000).unwrap();
    run(&mut scripts, "arm.wait(0.2);").unwrap();
    let error = run(&mut scripts, "try { arm.wait(0.4); } catch { arm.wait(0.1); }").unwrap_err();
    assert!(error.to_string().contains("not over within 0.5 s of arm time"), "{error}");
    let mut scripts = super::scripts(&Cancel::default(), DecisionLog::recording());
    scripts.context().allow(60.0, 1_000).unwrap();
    let error = run(&mut scripts, r#"twin.grasps("jar", "side", 0.0);"#).unwrap_err();
    assert!(error.to_string().contains("within a budget"), "{error}");
}

/// What is too wide for the fingers is known before anything is searched.
#[test]
fn the_cup_is_too_wide_to_be_taken_and_that_is_said_without_a_search() {
    let mut scripts = super::scripts(&Cancel::default(), DecisionLog::recording());
    scripts.context().allow(60.0, 0).unwrap();
    let error = run(&mut scripts, r#"twin.grasps("cup", "side", 0.0);"#).unwrap_err();
    assert!(error.to_string().contains("160 mm wide"), "{error}");
}

/// A pose is reached, left straight and turned in; what is in the way is named and nothing moves.
#[test]
fn the_tool_goes_to_poses_and_keeps_clear() {
    let mut scripts = open();
    let text = "let at = pose([0.5, 0.15, 0.3], 0.3, 90.0 * deg);\n\
                let ways = twin.reach(at);\n\
                if ways.len() == 0 || ways[0].len() != arm.joints().len() { throw \"reach\" }\n\
                arm.move_to(at);\n\
                let here = arm.pose();\n\
                for k in 0..3 { if abs(here.at[k] - at.at[k]) > 0.001 { throw \"elsewhere\" } }\n\
                arm.line_to(at.moved([0.05, 0.0, -0.04]).turned([0.0, 0.0, 1.0], 20.0 * deg), 0.3);\n\
                if abs(arm.pose().at[0] - 0.55) > 0.001 { throw \"not there\" }\n\
                arm.turn_about([0.0, 0.0, 1.0], -20.0 * deg);\n\
                if abs(arm.pose().heading - 0.3) > 0.001 { throw `heading ${arm.pose().heading}` }\n\
                arm.open_to(3.0 * cm);\n\
                if abs(arm.opening() - 0.03) > 0.001 { throw \"opening\" }\n\
                if twin.size(\"jar\")[2] != 0.14 || abs(twin.turned(\"jar\")) > 0.01 { throw \"jar\" }\n\
                if arm.torques().len() != 7 { throw \"torques\" }\n\
                fn abs(x) { if x < 0.0 { -x } else { x } }";
    run(&mut scripts, text).unwrap();
    // The jar stands at (0.60, -0.10) m: a hand 6 cm above the table is in it.
    let text =
        "arm.move_to(pose([0.45, -0.10, 0.07], 0.0, 0.0));\narm.move_by([0.15, 0.0, 0.0], 0.3);";
    let error = run(&mut scripts, text).unwrap_err().to_string();
    assert!(error.contains("jar") && error.contains("touch"), "{error}");
    assert!(run(&mut scripts, "twin.reach(pose([0.6, -0.1, 0.07], 0.0, 0.0));").is_err());
    assert!(run(&mut scripts, "twin.reach(pose([2.0, 0.0, 0.1], 0.0, 0.0));").is_err());
}

/// The joints feel the table under the fingers, and say so when there is nothing.
#[test]
fn a_way_ends_where_something_is_felt() {
    let mut scripts = open();
    let text = "arm.open_to(0.0);\n\
                arm.move_to(pose([0.5, 0.15, 0.07], 0.3, 90.0 * deg));\n\
                remember(\"went\", arm.move_until([0.0, 0.0, -0.06], 5.0));";
    run(&mut scripts, text).unwrap();
    let went = scripts.context().recall("went").unwrap().as_float().unwrap();
    // The fingertips are 32.35 mm ahead of the tool; a servo gives way by some tenths of a millimetre.
    assert!((went - (0.07 - 0.03235)).abs() < 0.002, "{went}");
    let error =
        run(&mut scripts, "arm.move_until([0.0, 0.0, 0.03], 5.0);").unwrap_err().to_string();
    assert!(error.contains("nothing was felt"), "{error}");
}
