//! `check`, `fmt` and `graph`: texts without a robot.

use serde_json::Value;

use crate::program::{Scratch, project};

#[test]
fn what_the_project_ships_has_no_mistakes_and_is_laid_out() {
    let scratch = Scratch::new("cli-shipped");
    let (stdlib, scripts) = (project("stdlib"), project("scripts"));
    let said = scratch.trueup(&["check", &stdlib, &scripts]);
    assert_eq!(said.code, 0, "{}", said.err);
    let count = said.out.trim().strip_prefix("no mistakes found in ").unwrap_or_default();
    assert!(count.ends_with(" files"), "{}", said.out);
    let said = scratch.trueup(&["check", "--json", &stdlib, &scripts]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    assert_eq!(said.json(), serde_json::json!({ "diagnostics": [] }));
    let said = scratch.trueup(&["fmt", "--check", &scripts]);
    assert_eq!((said.code, said.out.as_str()), (0, ""), "{}", said.err);
}

/// The file with five planted mistakes of the language's design: all told in one pass, word by word as people
/// see them, by the program itself.
#[test]
fn five_planted_mistakes_are_told_as_designed() {
    let scratch = Scratch::new("cli-golden");
    scratch.file("bad.task", include_str!("golden/bad.task"));
    let said = scratch.trueup(&["check", "bad.task"]);
    assert_eq!((said.code, said.err.as_str()), (1, ""));
    assert_eq!(said.out, include_str!("golden/bad.txt"));
}

/// What cannot go on at the same time is refused before anything is opened, also in a script that is run.
#[test]
fn two_motions_at_a_time_are_refused_when_the_text_is_read() {
    let scratch = Scratch::new("cli-together");
    scratch.file("both.task", "together { home() lift(jar) }\n");
    for args in [&["check", "both.task", "--json"][..], &["run", "both.task", "--json"]] {
        let said = scratch.trueup(args);
        assert_ne!(said.code, 0);
        assert!(said.out.contains("task::together"), "{args:?}: {said:?}");
        assert!(said.out.contains("both need the arm"), "{args:?}: {said:?}");
    }
    assert_eq!(scratch.everything(), ["both.task"], "nothing was recorded");
}

/// A script that imports a file with a scene passed `check` and was refused by `run`: a run sets up the scene that is named, and
/// an import gives definitions.
#[test]
fn calls_are_judged_by_the_scene_of_a_run() {
    let scratch = Scratch::new("cli-imported-scene");
    let scene = include_str!("../../stdlib/scenes/kitchen.task");
    let scene = scene.replacen("scene kitchen ", "scene small ", 1).replace(" cup:", " bigcup:");
    scratch.file("small.task", &scene);
    scratch.file("two.task", "import \"small.task\"\npour(jar, bigcup)\n");
    for args in [&["check", "two.task"][..], &["graph", "two.task"], &["run", "two.task"]] {
        let said = scratch.trueup(args);
        assert_ne!(said.code, 0, "{args:?}");
        let told = format!("{}{}", said.out, said.err);
        assert!(told.contains("there is no object `bigcup`"), "{args:?}: {told}");
        assert!(told.contains("`--scene small.task`"), "{args:?}: {told}");
    }
    for verb in ["check", "graph"] {
        let said = scratch.trueup(&[verb, "two.task", "--scene", "small.task"]);
        assert_eq!((said.code, said.err.as_str()), (0, ""), "{verb}: {}", said.out);
    }
    let said = scratch.trueup(&["check", "small.task", "--scene", "two.task"]);
    assert_eq!(said.code, 2, "{}", said.out);
}

/// The JSON of `check`, key by key as the interface has it, for one wrong unit.
#[test]
fn a_diagnostic_in_json_has_every_key_of_the_interface() {
    let scratch = Scratch::new("cli-check-json");
    let text = "// Half of it.\npour(jar, cup, amount: 5 cm)\n";
    scratch.file("half.task", text);
    let said = scratch.trueup(&["check", "half.task", "--json"]);
    assert_eq!((said.code, said.err.as_str()), (1, ""));
    let document = said.json();
    let found = document["diagnostics"].as_array().unwrap();
    assert_eq!(found.len(), 1, "one mistake is told once: {}", said.out);
    let one = &found[0];
    assert_eq!(one["code"], "task::unit");
    assert_eq!(one["severity"], "error");
    assert_eq!(one["file"], "half.task");
    let from = text.find("5 cm").unwrap() as u64;
    assert_eq!(one["span"], serde_json::json!([from, from + 4]));
    assert_eq!((one["line"].as_u64(), one["column"].as_u64()), (Some(2), Some(24)));
    assert!(one["message"].as_str().unwrap().contains("volume"), "{one}");
    assert!(one["help"].as_str().unwrap().contains("mL"), "{one}");
    assert!(one["labels"].is_array());
}

#[test]
fn all_mistakes_of_all_files_are_told_at_once() {
    let scratch = Scratch::new("cli-check-many");
    scratch.file("many/a.task", "puor(jar, cup)\npour(jar, kup)\n");
    scratch.file("many/deep/b.task", "pour(jar\n");
    scratch.file("many/notes.txt", "pour(nothing\n");
    let said = scratch.trueup(&["check", "--json", "many"]);
    assert_eq!(said.code, 1);
    let document = said.json();
    let found: Vec<(&str, &str, u64)> = document["diagnostics"]
        .as_array()
        .unwrap()
        .iter()
        .map(|d| {
            let line = d["line"].as_u64().unwrap();
            (d["file"].as_str().unwrap(), d["code"].as_str().unwrap(), line)
        })
        .collect();
    assert_eq!(
        found,
        [
            ("many/a.task", "task::unknown_name", 1),
            ("many/a.task", "task::unknown_name", 2),
            ("many/deep/b.task", "task::unclosed", 1),
        ]
    );
    let plain = scratch.trueup(&["check", "many"]);
    assert_eq!(plain.code, 1);
    for (near, excerpt) in [("`pour`", "puor(jar, cup)"), ("`cup`", "pour(jar, kup)")] {
        assert!(plain.out.contains(&format!("did you mean {near}?")), "{}", plain.out);
        assert!(plain.out.contains(excerpt), "the line itself is shown: {}", plain.out);
    }
}

/// A condition is a line like any other; what nobody knows is no yes; an answer that goes nowhere is no answer.
#[test]
fn a_line_asks_and_an_answer_that_is_lost_is_told() {
    let scratch = Scratch::new("line-asks");
    let said = scratch.trueup(&["-c", "distance(jar, cup) < 5 cm"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.out.contains("unknown") && !said.err.contains("syntax"), "{said:?}");
    let said = scratch.trueup(&["-c", ":objects", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "usage"), "{said:?}");
    #[cfg(target_os = "linux")]
    {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = scratch.command(&["graph", "pour(jar, cup)"]);
        let lost = command.stdout(full).stderr(std::process::Stdio::piped()).spawn().unwrap();
        let lost = lost.wait_with_output().unwrap();
        let told = String::from_utf8_lossy(&lost.stderr);
        assert_eq!(lost.status.code(), Some(2), "{told}");
        assert!(told.contains("could not be written"), "{told}");
    }
}

#[test]
fn what_a_run_would_refuse_is_told_by_check() {
    let scratch = Scratch::new("check-refused");
    let either = "task t() { either a prior 0 { look() } or b prior 0 { look() } }\n";
    scratch.file("broken.rhai", "let x = ;\n");
    scratch.file(
        "wave.task",
        "import \"broken.rhai\"\naction wave() { run \"broken.rhai\" limit 5 s }\n",
    );
    let wave = scratch.trueup(&["check", "wave.task"]);
    assert!(wave.code != 0 && wave.out.contains("the script cannot run"), "{wave:?}");
    let kitchen = trueup::workcell::Stdlib::embedded();
    let kitchen = kitchen.file("scenes/kitchen.task").unwrap();
    scratch.file("arm.task", kitchen.replace("robot gen3_2f85", "robot gen3"));
    let arm = scratch.trueup(&["check", "arm.task"]);
    assert!(arm.code == 1 && arm.out.contains("there is no robot `gen3`"), "{arm:?}");
    assert!(arm.out.contains("did you mean `gen3_2f85`"), "{arm:?}");
    scratch.file("zero.task", either);
    let zero = scratch.trueup(&["check", "zero.task"]);
    assert!(zero.code != 0 && zero.out.contains("every prior here is 0"), "{zero:?}");
}

/// One file that was not UTF-8 withheld what was wrong with all others of its folder.
#[test]
fn a_file_that_cannot_be_read_withholds_nothing_of_the_others() {
    let scratch = Scratch::new("check-unread");
    scratch.file("d/a.task", "pour(jra, cup)\n");
    scratch.file("d/b.task", b"pour(jar, \xff)\n");
    let said = scratch.trueup(&["check", "d"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.out.contains("there is no object `jra`"), "{said:?}");
    assert!(said.out.contains("2 errors in 2 files"), "{said:?}");
    assert!(said.err.contains("b.task: it is not UTF-8 text"), "{said:?}");
    let told = scratch.trueup(&["check", "d", "--json"]).json();
    let codes: Vec<_> =
        told["diagnostics"].as_array().unwrap().iter().map(|each| &each["code"]).collect();
    assert_eq!(codes, ["task::unknown_name", "io::text"]);
    // Alone it is bad input.
    assert_eq!(scratch.trueup(&["check", "d/b.task", "--json"]).error("code"), "io::text");
}

#[test]
fn what_is_not_there_is_told_by_its_name() {
    let scratch = Scratch::new("check-names");
    let said = scratch.trueup(&["lab", "hide", "--out", "nodir/x.toml", "--json"]);
    assert_eq!(said.error("message"), "there is no folder `nodir`");
    let said = scratch.trueup(&["check", "gone.task", "--json"]);
    assert_eq!(said.error("message"), "there is no file `gone.task`");
    scratch.file("wave.task", "import \"wavee.rhai\"\n");
    let told = scratch.trueup(&["check", "wave.task", "--json"]).json();
    let message = told["diagnostics"][0]["message"].as_str().unwrap();
    assert!(message.ends_with("wavee.rhai`: there is no such file"), "{message}");
}

#[test]
fn too_few_dots_for_a_camera_are_told_before_a_run() {
    let scratch = Scratch::new("check-dots");
    let scene = |fifth: &str| {
        format!(
            "scene few {{\n    table: Surface = box(120 cm, 80 cm, 2 cm) at (0.50 m, 0 m)\n    \
             marks dots(radius 12 mm) {{ (0.25 m, -0.36 m) (0.25 m, 0.36 m) (0.80 m, -0.36 m) (0.80 m, 0.36 m) {fifth}}}\n    \
             camera overhead {{ image 1280 x 720  focal ~ 900 px  at (1.25 m, 0 m, 0.85 m) looking (0.60 m, 0 m, 0.05 m) }}\n    \
             robot gen3_2f85\n}}\n"
        )
    };
    scratch.file("four.task", scene(""));
    scratch.file("five.task", scene("(0.90 m, 0 m) "));
    let four = scratch.trueup(&["check", "four.task"]);
    assert!(
        four.out.contains("there are 4 dots") || four.err.contains("there are 4 dots"),
        "{four:?}"
    );
    let five = scratch.trueup(&["check", "five.task"]);
    assert!(five.code == 0 && !five.out.contains("dots or more"), "{five:?}");
}

#[test]
fn a_folder_without_task_files_is_not_called_faultless() {
    let scratch = Scratch::new("cli-check-empty");
    scratch.file("empty/readme.txt", "nothing here");
    for command in ["check", "fmt"] {
        let said = scratch.trueup(&[command, "empty", "--json"]);
        assert_eq!(said.code, 2, "{}", said.out);
        assert_eq!(said.error("where"), "empty");
    }
}

#[test]
fn fmt_says_first_and_changes_only_when_asked() {
    let scratch = Scratch::new("cli-fmt");
    let (good, loose) = ("pour(jar, cup)\n", "pour( jar,cup )\n");
    scratch.file("good.task", good);
    scratch.file("loose.task", loose);
    let read = |name: &str| std::fs::read_to_string(scratch.path(name)).unwrap();

    let said = scratch.trueup(&["fmt", "--check", "good.task", "loose.task", "--json"]);
    assert_eq!(said.code, 1);
    assert_eq!(said.json(), serde_json::json!({ "changed": ["loose.task"] }));
    assert_eq!(read("loose.task"), loose, "--check changes nothing");

    // A mistake in the last file: the first is left alone as well.
    scratch.file("zbad.task", "pour(jar\n");
    let said = scratch.trueup(&["fmt", "loose.task", "zbad.task"]);
    assert_eq!(said.code, 2, "{}", said.out);
    assert_eq!(read("loose.task"), loose, "nothing is half done");

    let said = scratch.trueup(&["fmt", "good.task", "loose.task"]);
    assert_eq!((said.code, said.out.trim()), (0, "formatted: loose.task"));
    assert_eq!((read("good.task").as_str(), read("loose.task").as_str()), (good, good));
    assert_eq!(scratch.trueup(&["fmt", "--check", "good.task", "loose.task"]).code, 0);
}

/// A call and the script that makes it are one graph, in all its forms.
#[test]
fn a_graph_is_drawn_for_people_programs_and_graphviz() {
    let scratch = Scratch::new("cli-graph");
    let script = project("scripts/pour.task");
    let draw = |what: &str, format: &str| {
        let said = scratch.trueup(&["graph", what, "--format", format]);
        assert_eq!((said.code, said.err.as_str()), (0, ""), "{format}");
        said
    };
    let svg = draw("pour(jar, cup)", "svg").out;
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg:.80}");
    for word in ["grasp(jar, side)", "level_side", "tilted_side", "0.60"] {
        assert!(svg.contains(word), "{word} is not drawn");
    }
    assert!(!svg.contains("http://") || svg.contains("www.w3.org"), "nothing is fetched");

    let dot = draw("pour(jar, cup)", "dot").out;
    assert!(dot.starts_with("digraph") && dot.trim_end().ends_with('}'), "{dot:.80}");
    assert_eq!(dot.matches('{').count(), dot.matches('}').count());

    let graph = draw("pour(jar, cup)", "json").json();
    assert_eq!(graph["root"], "pour");
    let nodes = graph["nodes"].as_array().unwrap();
    let ids: Vec<&str> = nodes.iter().map(|node| node["id"].as_str().unwrap()).collect();
    for edge in graph["edges"].as_array().unwrap() {
        for end in ["from", "to", "a", "b"].iter().filter_map(|key| edge[*key].as_str()) {
            assert!(ids.contains(&end), "{end} is an end of an edge and no node");
        }
    }
    let or: Vec<&Value> =
        nodes.iter().filter(|node| node["ao"] == "or" && node["decides"] == "choice").collect();
    assert_eq!(or.len(), 1, "pick has one choice: {or:?}");
    assert_eq!(scratch.trueup(&["graph", "pour(jar, cup)", "--json"]).json(), graph);

    let mut of_script = draw(&script, "json").json();
    let own = |graph: &mut Value| {
        for node in graph["nodes"].as_array_mut().unwrap() {
            // The root is where the call was read from.
            node.as_object_mut().unwrap().remove("span");
        }
        graph.clone()
    };
    assert_eq!(own(&mut of_script), own(&mut graph.clone()));

    let outline = draw("pick(jar)", "text").out;
    assert!(outline.contains("└─") && outline.contains("grasp(jar, side)"), "{outline}");
    assert_eq!(scratch.everything(), [""; 0], "drawing leaves nothing behind");
}

#[test]
fn a_graph_of_something_unknown_is_refused_with_the_nearest_name() {
    let scratch = Scratch::new("cli-graph-bad");
    for (call, near) in [("pour(jar, kup)", "`cup`"), ("puor(jar, cup)", "`pour`")] {
        let said = scratch.trueup(&["graph", call, "--json"]);
        assert_eq!(said.code, 2);
        assert_eq!(said.error("code"), "task::unknown_name");
        assert_eq!(said.error("help"), format!("did you mean {near}?"));
        let said = scratch.trueup(&["graph", call]);
        assert_eq!((said.code, said.out.as_str()), (2, ""));
        assert_eq!(said.err.matches("did you mean").count(), 1, "said once: {}", said.err);
    }
    let said = scratch.trueup(&["graph", "pour(jar, cup)", "--format", "png", "--json"]);
    assert_eq!(said.code, 2);
    assert!(said.error("message").contains("png"));
}
