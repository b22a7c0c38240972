//! The verbs that need no arm: `doc`, `runs`, `doctor`, `completions`, `test`, and a graph as a text.

use serde_json::json;

use crate::program::{Scratch, project};
use crate::repl::kept;

#[test]
fn a_name_is_told_as_at_the_prompt() {
    let scratch = Scratch::new("cli-doc");
    let said = scratch.trueup(&["doc", "pour"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let at_prompt = scratch.typed(&["--robot", "twin"], "?pour\n");
    assert!(at_prompt.out.contains(said.out.trim()), "{} beside {}", at_prompt.out, said.out);
    for (name, wanted) in
        [("above", "offset(lip(a), center(b))"), ("jar", "Container"), ("lip", "Place")]
    {
        let said = scratch.trueup(&["doc", name, "--json"]);
        assert_eq!(said.json()["name"], name);
        assert!(said.json()["said"].as_str().unwrap().contains(wanted), "{}", said.out);
    }
    let all = scratch.trueup(&["doc", "--json"]).json();
    let names = all["names"].as_array().unwrap();
    assert!(names.iter().any(|name| name["name"] == "grasp" && name["kind"] == "action"));
    let wrong = scratch.trueup(&["doc", "puor", "--json"]);
    assert_eq!((wrong.code, wrong.error("help").as_str()), (2, "did you mean `pour`?"));
    scratch.file("mine.task", "/// Wave.\ntask wave() { home() }\n");
    let said = scratch.trueup(&["doc", "wave", "--file", "mine.task"]);
    assert!(said.out.contains("Wave.") && said.out.contains("mine.task:2"), "{}", said.out);
}

#[test]
fn runs_are_listed_shown_compared_and_written_as_a_page() {
    let scratch = Scratch::new("cli-runs");
    let none = scratch.trueup(&["runs"]);
    assert_eq!((none.code, none.out.trim()), (0, "no run is kept in runs yet"));
    kept::lay_out(&scratch);
    let list = scratch.trueup(&["runs", "ls"]);
    let at_prompt = scratch.typed(&["--robot", "twin"], ":runs\n");
    assert!(at_prompt.out.contains(list.out.trim()), "{} beside {}", at_prompt.out, list.out);
    let runs = scratch.trueup(&["runs", "--json"]).json();
    let runs = runs["runs"].as_array().unwrap();
    assert_eq!(runs.len() + 1, list.out.lines().count());
    assert_eq!(runs[2]["number"], 3);
    let shown = scratch.trueup(&["runs", "show", "3"]);
    assert_eq!(shown.out, scratch.trueup(&["replay", "3"]).out);
    let diff = scratch.trueup(&["runs", "diff", "1", "3"]);
    let at_prompt = scratch.typed(&["--robot", "twin"], ":diff 1 3\n");
    assert!(at_prompt.out.contains(diff.out.trim()), "{} beside {}", at_prompt.out, diff.out);
    let diff = scratch.trueup(&["runs", "diff", "1", "3", "--json"]).json();
    assert_eq!(diff["runs"], json!([1, 3]));
    assert!(!diff["differences"].as_array().unwrap().is_empty());
    let page = scratch.trueup(&["runs", "export", "3", "-o", "page.html"]);
    assert_eq!(page.code, 0, "{}", page.err);
    assert!(
        std::fs::read_to_string(scratch.path("page.html")).unwrap().contains("above(jar, cup)")
    );
    let wrong = scratch.trueup(&["runs", "diff", "1", "99", "--json"]);
    assert_eq!((wrong.code, wrong.error("code").as_str()), (2, "run::unknown"));
}

#[test]
fn energy_is_told_term_by_term_and_adds_up() {
    let scratch = Scratch::new("cli-energy");
    kept::lay_out(&scratch);
    let said = scratch.typed(&["--robot", "twin"], ":graph --energy 3\n:graph --energy 99\n").out;
    let value = |term: &str| -> f64 {
        let line = said.lines().find(|line| line.trim_start().starts_with(term));
        let line = line.unwrap_or_else(|| panic!("no {term} in {said}"));
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    let all = ["choice", "temporal", "spatial", "causal", "data"];
    let sum: f64 = all.iter().map(|term| value(term)).sum();
    assert!((sum - value("sum")).abs() < 0.03, "{said}");
    // The twin had the jar above the cup, and it was not.
    assert!(value("data") > 1.0, "{said}");
    assert!(said.contains("there is no run `99`"), "{said}");
}

#[test]
fn a_doctor_looks_at_everything_and_leaves_nothing() {
    let scratch = Scratch::new("cli-doctor");
    let well = scratch.trueup(&["doctor", "--json"]);
    assert_eq!(well.code, 0, "{}", well.out);
    let found = well.json();
    let state = |what: &str| {
        let all = found["findings"].as_array().unwrap();
        let one = all.iter().find(|one| one["what"] == what);
        one.unwrap_or_else(|| panic!("no {what}"))["state"].as_str().unwrap().to_owned()
    };
    for what in ["texts", "scripts", "scene", "runs", "arm", "camera"] {
        assert_eq!(state(what), "ok", "{what}");
    }
    assert_eq!((state("scales"), state("model")), ("none".into(), "none".into()));
    assert_eq!(scratch.everything(), [""; 0]);
    // A camera that is asked for and away; a script that cannot be read.
    let closed = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let camera = format!("http://{closed}/photo");
    let away = scratch.trueup(&["doctor", "--camera-at", &camera]);
    assert_eq!(away.code, 4, "{}", away.out);
    assert!(away.out.lines().any(|line| line.starts_with("camera    away")), "{}", away.out);
    scratch.file("mine/actions/home.rhai", "let x = ;\n");
    let wrong = scratch.trueup(&["doctor", "--stdlib", "mine"]);
    assert_eq!(wrong.code, 1, "{}", wrong.out);
    assert!(wrong.out.contains("home.rhai:1"), "{}", wrong.out);
}

#[test]
fn shells_complete_every_command() {
    let scratch = Scratch::new("cli-completions");
    for shell in ["bash", "zsh", "fish"] {
        let said = scratch.trueup(&["completions", shell]);
        assert_eq!(said.code, 0, "{}", said.err);
        for command in ["graph", "doctor", "runs", "kortex"] {
            assert!(said.out.contains(command), "no {command} for {shell}");
        }
    }
    let said = scratch.trueup(&["completions", "fish", "--json"]).json();
    assert!(said["script"].as_str().unwrap().contains("trueup"));
    assert_eq!(scratch.trueup(&["completions", "tcsh"]).code, 2);
}

/// The library's own examples are found; a wrong one is told with its place, without an arm in the way.
#[test]
fn examples_in_documentation_are_carried_out() {
    let scratch = Scratch::new("cli-test");
    let listed = scratch.trueup(&["test", "--list", &project("stdlib/tasks/std.task")]);
    assert!(
        listed.out.contains("pour(jar, cup)") && listed.out.contains(".task:"),
        "{}",
        listed.out
    );
    scratch.file(
        "mine.task",
        "/// Look twice, as `twice()` does. It is `visible(jar)` then.\n\
         task twice() { look() look() gives visible(jar) }\n\n\
         /// Never works: `thrice(jug)`.\n#[was(\"often\")]\ntask thrice(o: Graspable) { look() }\n",
    );
    let said = scratch.trueup(&["test", "mine.task", "--json"]);
    assert_eq!(said.code, 1, "{}", said.err);
    let document = said.json();
    let all = document["examples"].as_array().unwrap();
    let told: Vec<_> = all.iter().map(|one| (&one["where"], &one["done"])).collect();
    let (first, second) = (json!("mine.task:1"), json!("mine.task:4"));
    assert_eq!(told, [(&first, &json!(true)), (&second, &json!(false))], "{}", said.out);
    assert!(all[1]["why"].as_str().unwrap().contains("jug"), "{}", said.out);
    assert_eq!(scratch.everything(), ["mine.task"], "no run is kept");
}

/// Call → text → the same graph; JSON → text; a file with things of its own → a file that checks.
#[test]
fn a_graph_becomes_a_text_that_has_it() {
    let scratch = Scratch::new("cli-graph-text");
    let text = scratch.trueup(&["graph", "pour(jar, cup)", "--format", "task"]);
    assert_eq!((text.code, text.err.as_str()), (0, ""));
    scratch.file("again.task", &text.out);
    let checked = scratch.trueup(&["check", "again.task"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert_eq!(scratch.trueup(&["fmt", "--check", "again.task"]).code, 0);
    let outline = |what: &str| scratch.trueup(&["graph", what]).out;
    assert_eq!(outline("again.task"), outline("pour(jar, cup)"));
    let json = scratch.trueup(&["graph", "pour(jar, cup)", "--json"]);
    scratch.file("pour.json", &json.out);
    assert_eq!(scratch.trueup(&["graph", "pour.json", "--format", "task"]).out, text.out);
    assert_eq!(outline("pour.json"), outline("pour(jar, cup)"));

    scratch.file(
        "mine.task",
        "type Mug: Container\n\
         scene scratch {\n\
         table: Surface = box(120 cm, 80 cm, 2 cm) at (0.50 m, 0 m)\n\
         mug: Mug = cylinder(radius 40 mm, height 90 mm) { wall 3 mm }\n\
         marks dots(radius 12 mm) { (0.25 m, -0.36 m) (0.25 m, 0.36 m) (0.80 m, -0.36 m) (0.80 m, 0.36 m) (0.90 m, 0 m) }\n\
         camera overhead { image 1280 x 720 focal ~ 900 px at (1.25 m, 0 m, 0.85 m) looking (0.60 m, 0 m, 0.05 m) }\n\
         robot gen3_2f85 at (0 m, 0 m, 0 m)\n}\n\
         fluent warm(m: Mug) = height(m) <= 1 cm\nfluent good(m: Mug) = warm(m) and visible(m)\n\
         task sip(m: Mug) { needs good(m) pick(m) via from_above }\nsip(mug)\n",
    );
    let mine = scratch.trueup(&["graph", "mine.task", "--format", "task"]);
    assert_eq!(mine.code, 0, "{}", mine.err);
    scratch.file("mine2.task", &mine.out);
    let checked = scratch.trueup(&["check", "mine2.task"]);
    assert_eq!(checked.code, 0, "{}\n{}", checked.out, mine.out);
    assert_eq!(outline("mine2.task"), outline("mine.task"));

    let grammar = scratch.trueup(&["graph", "pick(jar)", "--format", "pcfg"]).out;
    assert!(grammar.contains("[0.6]") && grammar.contains("'grasp(jar, side)'"), "{grammar}");
    scratch.file("bad.json", "{}");
    let bad = scratch.trueup(&["graph", "bad.json", "--json"]);
    assert_eq!((bad.code, bad.error("code").as_str()), (2, "graph::file"));
}

#[test]
fn two_motions_at_once_are_refused_where_they_are_typed() {
    let scratch = Scratch::new("cli-together");
    let line = "together { home() lift(jar) }";
    for args in [vec!["graph", line], vec!["-c", line, "--robot", "twin"]] {
        let said = scratch.trueup(&args);
        assert_eq!(said.code, 2, "{}", said.out);
        assert!(said.err.contains("both need the arm"), "{}", said.err);
    }
    let typed = scratch.typed(&["--robot", "twin"], &format!("{line}\n")).out;
    assert!(typed.contains("both need the arm") && !typed.contains("step 1"), "{typed}");
}
