//! The commands as a stranger uses them, over runs written by hand and a model that is a fixture.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::ast::Step;
use trueup::language::{Source, parse_line};
use trueup::motion::free::Means;
use trueup::trace::Nobody;
use trueup::vqa::{On, Said};
use trueup::workcell::{CANDIDATES, Ending, Error, Options, Stdlib, WorkCell};

use super::server::Server;
use super::{endpoint, endpoint_at, no_time};
use crate::program::Scratch;
use crate::repl::kept::lay_out;

/// Three runs, the last with a picture of each world after each step: red where the model `sees` says yes.
fn scratch(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    lay_out(&scratch);
    for (picture, colour) in [
        ("01-after-real", [200, 20, 20]),
        ("01-after-twin", [200, 20, 20]),
        ("02-after-real", [20, 20, 200]),
        ("02-after-twin", [200, 20, 20]),
    ] {
        let file = scratch.path(&format!("runs/20260102-110000-pour/frames/{picture}.png"));
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        image::RgbImage::from_pixel(64, 36, image::Rgb(colour)).save(file).unwrap();
    }
    scratch
}

/// An answer that does not fit on the disk is not there by half, and those that do are kept.
#[cfg(unix)]
#[test]
fn a_full_disk_keeps_the_answers_that_fitted() {
    let (scratch, server) = (scratch("vqa-full"), Server::start());
    let ask = ["vqa", "ask", "runs", "--endpoint", &server.base(), "--model", "sees"];
    for blocks in [0, 1] {
        let said = scratch.without_room(blocks, &ask);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains("no room left on the disk"), "{said:?}");
        for name in scratch.everything().into_iter().filter(|name| name.ends_with("vqa.jsonl")) {
            let text = std::fs::read_to_string(scratch.path(&name)).unwrap();
            assert!(text.is_empty() || text.ends_with('\n'), "{name}: {text}");
        }
    }
    assert_eq!(scratch.trueup(&ask).code, 0);
}

#[test]
fn a_model_is_asked_once_and_judged_by_geometry() {
    let (scratch, server) = (scratch("vqa-ask"), Server::start());
    let ask = ["vqa", "ask", "runs", "--endpoint", &server.base(), "--model", "sees", "--json"];
    let said = scratch.trueup(&ask);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let json = said.document("vqa-ask");
    // Two questions after the second step, one after the first, on two pictures each.
    assert_eq!((json["asked"].as_u64(), json["open"].as_u64()), (Some(6), Some(6)));
    assert_eq!((json["yes"].as_u64(), json["no"].as_u64()), (Some(4), Some(2)));
    assert_eq!(json["probe"]["sees"], true);
    let again = scratch.trueup(&ask).json();
    assert_eq!(again["asked"], 0, "what was answered is not asked again");

    let table = scratch.trueup(&["vqa", "eval", "runs", "--json"]);
    assert_eq!(table.code, 0, "{}", table.out);
    let table = table.document("vqa-eval");
    // Nine questions on two pictures; of one run alone the model was asked.
    assert_eq!((table["questions"].as_u64(), table["without_truth"].as_u64()), (Some(18), Some(0)));
    let groups = table["groups"].as_array().unwrap();
    let whole = &groups[0];
    assert_eq!((whole["by"].as_str(), whole["question"].as_str()), (Some("vlm:sees"), None));
    let real = &whole["rows"][0];
    // `holding` holds after both steps; after the second the picture is blue, so one yes is missed.
    assert_eq!((real["on"].as_str(), real["n"].as_u64()), (Some("real"), Some(3)));
    assert_eq!((real["precision"].as_f64(), real["recall"].as_f64()), (Some(1.0), Some(0.5)));
    assert_eq!(whole["rows"][1]["recall"], 1.0);
    // Equal truth: `holding` twice; `above` is true in the twin alone.
    assert_eq!(
        (whole["agreement"]["pairs"].as_u64(), whole["agreement"]["share"].as_f64()),
        (Some(2), Some(0.5))
    );
    assert!(groups.iter().all(|group| group["by"] == "vlm:sees"), "geometry is the truth here");
    assert_eq!(table["probes"][0]["blank"][0]["answer"], "unsure");

    let told = scratch.trueup(&["vqa", "eval", "runs"]).out;
    assert!(told.lines().next().unwrap().starts_with("answered by"), "{told}");
    assert!(told.contains("geometry is the truth here"), "{told}");
    assert!(told.ends_with("again: trueup vqa eval runs --seed 1\n"), "{told}");
    let markdown = scratch.trueup(&["vqa", "eval", "runs", "--md"]).out;
    assert!(markdown.starts_with("| answered by | real P |"), "{markdown}");
    let csv = scratch.trueup(&["vqa", "eval", "runs", "--csv", "--answerers", "vlm"]).out;
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    let holding = rows.records().map(Result::unwrap).find(|row| &row[0] == "holding").unwrap();
    assert_eq!((&holding[1], &holding[2], &holding[3]), ("vlm:sees", "real", "2"));
    let none = scratch.trueup(&["vqa", "eval", "runs", "--answerers", "person"]).out;
    assert!(none.starts_with("no answers to score yet"), "{none}");
    server.check();
}

/// An expert's word is the truth, and then geometry is judged as well.
#[test]
fn an_expert_labels_blind_and_geometry_has_a_judge() {
    let scratch = scratch("vqa-label");
    let run = "runs/20260102-110000-pour";
    // After step 1, then after step 2: real, then twin. What cannot be read is asked again.
    let typed = "y\ny\nperhaps\ny\ny\n\nn\nq\n";
    let said = scratch.typed(&["vqa", "label", run], typed);
    assert_eq!(said.code, 0, "{}", said.out);
    assert!(said.out.contains("Is the transparent jar above the blue cup?"), "{}", said.out);
    assert!(!said.out.contains("mm") && !said.out.contains("geometry"), "blind: {}", said.out);
    assert!(said.out.contains("`perhaps` is not y, n, u, q or Enter"), "{}", said.out);
    assert!(said.out.contains("5 labels added"), "{}", said.out);
    let again = scratch.typed(&["vqa", "label", run, "--json"], "");
    assert!(
        again.out.contains("\"labelled\": 0") && again.out.contains("\"open\": 1"),
        "{}",
        again.out
    );

    let table =
        scratch.trueup(&["vqa", "eval", "runs", "--answerers", "geometry", "--json"]).json();
    assert_eq!(table["truth_by"], serde_json::json!({"geometry": 13, "person:expert": 5}));
    let above = &table["groups"]
        .as_array()
        .unwrap()
        .iter()
        .find(|g| g["question"] == "above")
        .unwrap()["rows"];
    // Geometry says no of the photograph where the expert says yes, and yes of the twin's where she says no.
    let counts: Vec<_> = above.as_array().unwrap().iter().map(|row| &row["counts"]).collect();
    assert_eq!(
        (counts[0]["false_no"].as_u64(), counts[1]["false_yes"].as_u64()),
        (Some(1), Some(1))
    );
}

#[test]
fn whoever_is_not_there_or_cannot_see_is_told_so() {
    let (scratch, server) = (scratch("vqa-wrong"), Server::start());
    let base = server.base();
    let probe =
        |model: &str| scratch.trueup(&["vqa", "probe", "--endpoint", &base, "--model", model]);
    let good = probe("sees");
    assert_eq!(good.code, 0, "{}", good.out);
    assert!(
        good.out.contains("it sees the picture") && good.out.contains("is enforced"),
        "{}",
        good.out
    );
    let blind = probe("yes");
    assert_eq!(blind.code, 1);
    assert!(
        blind.out.contains("does not tell red from blue") && blind.out.contains("it guesses"),
        "{}",
        blind.out
    );
    let many = scratch.trueup(&["vqa", "probe", "--endpoint", &base, "--json"]);
    assert_eq!((many.code, many.error("code")), (2, "vqa::model".to_owned()));
    assert!(many.error("help").contains("sees, essay"));
    let none = scratch.trueup(&["vqa", "probe", "--json"]);
    assert_eq!((none.code, none.error("code")), (2, "vqa::endpoint".to_owned()));
    let gone = scratch.trueup(&[
        "vqa",
        "probe",
        "--endpoint",
        "http://127.0.0.1:9/v1",
        "--model",
        "m",
        "--json",
    ]);
    assert_eq!((gone.code, gone.error("code")), (4, "vqa::unavailable".to_owned()));
    let no_runs = scratch.trueup(&["vqa", "eval", "runs/not-a-run", "--json"]);
    assert_eq!((no_runs.code, no_runs.error("code")), (2, "vqa::none".to_owned()));
    let typo = scratch.trueup(&["vqa", "eval", "rnus", "--json"]);
    assert_eq!((typo.code, typo.error("help")), (2, "did you mean `runs`?".to_owned()));
}

/// A model proposes only what parses and checks, and only where no template fits.
#[test]
fn a_sentence_may_be_proposed_a_call() {
    let (scratch, server) = (Scratch::new("vqa-say"), Server::start());
    let base = server.base();
    let say = |sentence: &str| {
        scratch.trueup(&["say", sentence, "--endpoint", &base, "--model", "sees", "--json"])
    };
    let proposed = say("what I want is call pick( jar )");
    assert_eq!(proposed.code, 1, "somebody has to say yes first: {}", proposed.out);
    let json = proposed.json();
    assert_eq!(
        (json["meaning"].as_str(), json["call"].as_str()),
        (Some("proposed"), Some("pick(jar)"))
    );
    assert_eq!(json["by"], "vlm:sees");
    let system = server.seen()[0].body.clone();
    assert!(
        system.contains("pick(o: Graspable): ") && system.contains("transparent jar"),
        "{system}"
    );
    assert_eq!(say("juggle, or call juggle(jar)").error("code"), "vqa::proposal");
    assert_eq!(say("juggle the cups").json()["meaning"], "unknown", "the model knows none either");
    let asked = server.seen().len();
    assert_eq!(say("pick the jar").json()["meaning"], "clear");
    assert_eq!(server.seen().len(), asked, "nobody is asked where a template fits");
    server.check();
}

#[test]
fn at_the_prompt_a_proposal_waits_for_a_yes() {
    let (scratch, server) = (Scratch::new("vqa-prompt"), Server::start());
    let base = server.base();
    let args = ["--ask-endpoint", base.as_str(), "--ask-model", "sees"];
    let said = scratch.typed(&args, ":confirm none\nwhat I want is call home\nn\n");
    assert!(said.out.contains("= home()\n  proposed by the model"), "{}", said.out);
    assert!(said.out.contains("carry it out with the lab? y or n"), "{}", said.out);
    assert!(said.out.contains("left undone"), "{}", said.out);
}

/// A laboratory that is as assumed, so that regression 3 can be spared, with places that do.
fn options() -> Options {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    let script = "task glance() { gives ready_to_pick(jar)  look() }\n";
    Options {
        robot: "lab".into(),
        scene: None,
        script: Some(Source::new("glance.task", script)),
        lab,
        stdlib: Stdlib::embedded(),
        seed: 1,
        switches: Switches { offset: false, ..Switches::default() },
        candidates: CANDIDATES,
        means: Means::default(),
        is_real_time: false,
        clock: no_time,
    }
}

/// During a run the model answers beside geometry; what the run does rests on measurements alone.
#[test]
fn a_run_keeps_what_a_model_answers_and_does_not_heed_it() {
    let server = Server::start();
    let Some(Step::Act(act)) = parse_line("glance()").0 else { panic!("no call") };
    let mut cell = WorkCell::open(options()).unwrap();
    cell.answered_by(endpoint(&server, "no"));
    let run = cell.run(&act.call, None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let probe = run.probe.as_ref().unwrap();
    assert!(!probe.sees && probe.keeps_form);
    assert_eq!(probe.blank[0].question, "Is the robot ready to pick up the transparent jar?");
    let answer = run.questions[0].iter().find(|a| a.fluent == "ready_to_pick(jar)").unwrap();
    assert_eq!((answer.measured, answer.twin), (Some(true), Some(true)));
    let said: Vec<_> = answer.by.iter().map(|reply| (reply.on.name(), reply.answer)).collect();
    assert_eq!(said, [("real", Said::No), ("twin", Said::No)]);
    assert_eq!(answer.by[0].picture.sent_px, [1024, 576]);
    let settled = answer.settled(On::Real);
    assert_eq!(settled, Some((false, "vlm:no")), "the model first");
    server.check();

    // Nobody at the address: said before anything moves.
    let mut cell = WorkCell::open(options()).unwrap();
    cell.answered_by(endpoint_at("http://127.0.0.1:9/v1", "no"));
    let error = cell.run(&act.call, None, Box::new(Nobody)).unwrap_err();
    assert!(matches!(error, Error::Model { .. }), "{error}");
}
