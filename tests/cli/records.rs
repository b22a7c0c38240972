//! `trueup replay` and `trueup report` on a run that is kept: no arm, no file from outside.

use crate::program::Scratch;
use crate::repl::kept;

#[test]
fn a_run_is_told_again_by_its_folder_its_name_or_its_number() {
    let scratch = Scratch::new("cli-replay");
    kept::lay_out(&scratch);
    let whole = scratch.trueup(&["replay", "runs/20260102-110000-pour"]);
    assert_eq!(whole.code, 0, "{}", whole.err);
    assert!(whole.out.contains("move_over(jar, cup") && whole.out.contains("does not move"));
    let step = scratch.trueup(&["replay", "3", "--step", "2", "--json"]);
    assert_eq!(step.code, 0, "{}", step.out);
    assert_eq!(step.json()["number"], 2);
    let named = scratch.trueup(&["replay", "20260102-110000-pour", "--json"]);
    assert_eq!(named.json()["steps"][1]["outcome"], "failure");
    for wrong in [["replay", "9"], ["replay", "no/such/run"]] {
        let said = scratch.trueup(&wrong);
        assert_eq!(said.code, 2, "{}", said.err);
        assert!(said.err.contains("there is no run"), "{}", said.err);
    }
    let late = scratch.trueup(&["replay", "3", "--step", "5", "--json"]);
    assert_eq!((late.code, late.error("code").as_str()), (2, "replay::step"));
}

#[test]
fn what_a_run_moved_and_was_not_to_is_told() {
    let scratch = Scratch::new("cli-displaced");
    kept::lay_out(&scratch);
    let file = scratch.path("runs/20260102-110000-pour/run.json");
    let text = std::fs::read_to_string(&file).unwrap();
    let mut run: serde_json::Value = serde_json::from_str(&text).unwrap();
    run["displaced"] = serde_json::json!([{"object": "cup", "by_m": 0.0234, "std_m": 0.0006}]);
    std::fs::write(&file, run.to_string()).unwrap();
    let said = scratch.trueup(&["replay", "3"]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("`cup` stands 23 mm (± 0.6 mm) from where it was seen"), "{said:?}");
    assert_eq!(scratch.trueup(&["replay", "3", "--json"]).json()["displaced"][0]["by_m"], 0.0234);
}

#[test]
fn a_page_holds_all_of_a_run_and_needs_nothing_else() {
    let scratch = Scratch::new("cli-report");
    kept::lay_out(&scratch);
    let picture = image::RgbImage::from_pixel(8, 6, image::Rgb([200, 30, 30]));
    std::fs::create_dir_all(scratch.path("runs/20260102-110000-pour/frames")).unwrap();
    for whose in ["real", "twin"] {
        let name = format!("runs/20260102-110000-pour/frames/02-after-{whose}.png");
        picture.save(scratch.path(&name)).unwrap();
    }
    scratch.file(
        "runs/20260102-110000-pour/graph.svg",
        "<?xml version=\"1.0\"?><svg id=\"drawn\"></svg>",
    );
    let rows = "t[s],q_cmd_1[rad],q_cmd_2[rad],q_1[rad],q_2[rad],tau_1[N*m],tau_2[N*m]\n";
    let row = |t: f64| format!("{t},0.1,0.2,0.1,0.19,1.5,-20.0\n");
    let arm: String = (0..60).map(|k| row(0.1 * f64::from(k))).collect();
    scratch.file("runs/20260102-110000-pour/arm.csv", format!("{rows}{arm}"));
    scratch.file(
        "runs/20260102-110000-pour/film/film.csv",
        "number,t[s],step,jar[mL],cup[mL],spilt[mL]\n1,0.5,1,150.00,0.00,0.00\n2,2.5,2,20.00,130.00,0.00\n",
    );
    let said = scratch.trueup(&["report", "runs/20260102-110000-pour", "-o", "page.html"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let page = std::fs::read_to_string(scratch.path("page.html")).unwrap();
    assert_eq!(page.matches("data:image/jpeg;base64,").count(), 2);
    assert_eq!(page.matches("<section class=\"step card\"").count(), 2);
    // The second step is a column of each drawing over time, its torques among them.
    assert_eq!(page.matches("<rect data-step=\"2\"").count(), 4);
    for part in ["Fluents over time", "Water in the twin", "Torques of the joints", "joint 2"] {
        assert!(page.contains(part), "{part} is missing");
    }
    for part in ["above(jar, cup)", "-31 mm ± 1 mm", "&lt;= rim(cup) - 5 mm", "id=\"drawn\""] {
        assert!(page.contains(part), "{part} is missing");
    }
    for outside in ["://", "src=\"/", "href", "<?xml", "hidden>"] {
        assert!(!page.contains(outside), "the page mentions {outside}");
    }
    let nothing = scratch.trueup(&["report", "runs/not-a-run"]);
    assert_eq!(nothing.code, 2);
}
