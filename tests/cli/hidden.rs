//! An effect is hidden in the laboratory, named by `gap`, written into the twin, and the next run pours.

use std::fs;

use serde_json::Value;

use crate::program::Scratch;

const BENCH: &str = "/// What is known of this bench beyond its scene.\n\
                     twin bench of kitchen {\n}\n\npour(jar, cup)\n";

#[test]
fn a_seal_hides_an_effect_and_opens_to_it() {
    let scratch = Scratch::new("cli-seal");
    let said = scratch.trueup(&["lab", "hide", "--seed", "1", "--out", "hidden.toml"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let file = fs::read_to_string(scratch.path("hidden.toml")).unwrap();
    assert!(!file.contains("dribble") && !file.contains("jar"), "{file}");
    let shown = scratch.trueup(&["lab", "reveal", "hidden.toml", "--json"]).json();
    let (name, at) = (&shown["effects"][0]["name"], &shown["effects"][0]["at"]);
    let guess = format!("{}({})", name.as_str().unwrap(), at.as_str().unwrap());
    assert_eq!(scratch.trueup(&["lab", "reveal", "hidden.toml", "--guess", &guess]).code, 0);
    assert_eq!(
        scratch.trueup(&["lab", "reveal", "hidden.toml", "--guess", "payload(jar)"]).code,
        1
    );
    scratch.file("broken.toml", "sealed = \"00ff\"\n");
    let said = scratch.trueup(&["lab", "reveal", "broken.toml", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "lab::settings"));
}

#[test]
fn a_spill_is_explained_and_the_next_run_pours() {
    let scratch = Scratch::new("cli-hidden");
    scratch.file("bench.task", BENCH);
    // What `lab hide --seed 1` draws is of this kind; here it is open, to be compared with.
    scratch.file(
        "lab.toml",
        "[[effects]]\nname = \"lip_dribble\"\nat = \"jar\"\n\
         numbers = { volume = 20e-6, delay = 2.0 }\n",
    );
    let run = || {
        let said = scratch.trueup(&["run", "bench.task", "--lab", "lab.toml", "--json"]);
        (said.code, said.json())
    };
    let spilt = |run: &Value| run["water"]["spilt_ml"].as_f64().unwrap();
    let (code, first) = run();
    assert_eq!(code, 1, "{}", first["reason"]);
    assert!(spilt(&first) > 5.0, "{}", spilt(&first));

    let folder = first["run_dir"].as_str().unwrap().to_owned();
    let said = scratch.trueup(&["gap", &folder, "--model", "bench.task", "--apply", "--json"]);
    let finding = said.json();
    assert_eq!(finding["verdict"], "named", "{finding}");
    assert_eq!(finding["effects"][0]["name"], "lip_dribble");
    assert_eq!(finding["effects"][0]["at"], "jar");
    let number = |name: &str| finding["effects"][0]["parameters"][name]["value"].as_f64().unwrap();
    assert!((number("volume") - 20e-6).abs() < 2e-6, "{} m³", number("volume"));
    assert!((number("delay") - 2.0).abs() < 0.4, "{} s", number("delay"));
    // What the step with the spill gave and did not give is counted, one run here.
    let fluents = finding["fluents"].as_array().unwrap();
    assert!(
        fluents.iter().all(|change| change["measured"]["of"].as_u64() <= Some(1)),
        "{fluents:?}"
    );
    assert!(fluents.iter().any(|change| change["kind"] == "undeclared"), "{fluents:?}");
    let bench = fs::read_to_string(scratch.path("bench.task")).unwrap();
    assert!(bench.starts_with("/// What is known of this bench beyond its scene.\n"), "{bench}");
    assert!(bench.contains("    effect lip_dribble(jar) { "), "{bench}");

    let (code, second) = run();
    assert_eq!(code, 0, "{}", second["reason"]);
    assert!(spilt(&second) < 2.0, "{} mL spilt", spilt(&second));
    let folder = second["run_dir"].as_str().unwrap().to_owned();
    let again = scratch.trueup(&["gap", &folder, "--model", "bench.task", "--json"]).json();
    // What was found from one run leaves a gap below the noise, and nothing else is named for it.
    assert_ne!(again["verdict"], "named", "{again}");
    assert!(again["gap"]["before"]["heldout"].as_f64().unwrap() < 1.0, "{again}");
}
