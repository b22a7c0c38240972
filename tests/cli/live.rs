//! `--live`: a page beside a run, which goes as it would without.

use serde_json::Value;

use crate::program::Scratch;

/// A run's document without times of the wall's clock and its folder.
fn numbers(mut run: Value) -> Value {
    let fields = run.as_object_mut().unwrap();
    for aside in ["timing_s", "run_dir"] {
        assert!(fields.remove(aside).is_some(), "{aside}");
    }
    run
}

#[test]
fn a_run_that_is_looked_at_has_the_same_numbers() {
    let scratch = Scratch::new("live");
    let plain = scratch.trueup(&["-c", "pick(jar)", "--json", "--record", "plain"]);
    let live = scratch.trueup(&["-c", "pick(jar)", "--json", "--record", "live", "--live"]);
    assert_eq!((plain.code, live.code), (0, 0), "{plain:?} {live:?}");
    assert!(plain.json()["steps"].as_array().unwrap().len() > 2);
    assert_eq!(numbers(plain.json()), numbers(live.json()));
    let rows = |root: &str| std::fs::read(scratch.run_folder(root).join("arm.csv")).unwrap();
    assert_eq!(rows("plain"), rows("live"), "the arm moved alike");
    // The address is told beside the document, and nothing but with --live.
    assert!(live.err.contains("http://127.0.0.1:") && live.err.contains("/watch"), "{live:?}");
    assert!(!plain.err.contains("http://"), "{plain:?}");
    let report = scratch.run_folder("live").join("report.html");
    assert!(std::fs::read_to_string(report).unwrap().contains("pick(jar)"));
    assert!(!scratch.run_folder("plain").join("report.html").exists());
}

#[test]
fn a_page_needs_runs_to_show() {
    let said = Scratch::new("live-usage").trueup(&["--live", "doc", "pour"]);
    assert_eq!(said.code, 2, "{said:?}");
}
