//! The monitor on planted readings: rows, scores and answers that were worked out by hand.

mod changes;

use trueup::execution::done::FluentReading;
use trueup::fluent::{Error, Reading};
use trueup::graph;
use trueup::graph::energy::{PAPER_ERROR_RATE, energy};
use trueup::language::ast::{Expr, Span, Step};
use trueup::language::{Library, parse_line};
use trueup::monitor::evidence::evidence;
use trueup::monitor::questionnaire::by_geometry;
use trueup::monitor::{Comparison, compare, measure};
use trueup::trace::{FluentRow, Measure, Outcome, StepRecord};
use trueup::units::Quantity;
use trueup::world::{Pose, WorldState};

/// A fluent that somebody read: `margin` in m.
fn read(text: &str, truth: Option<bool>, margin: Option<f64>) -> FluentReading {
    let margin = margin.map(Quantity::metres);
    FluentReading {
        text: text.into(),
        expected: None,
        ask: None,
        reading: Reading {
            truth,
            value: None,
            limit: None,
            margin,
            sigma: 0.0,
            rank: 0.0,
            term: text.into(),
            span: Span::default(),
            fluent: None,
            direction: None,
            unknown: truth.is_none().then(|| "nobody looked".to_owned()),
            error: None,
            terms: Vec::new(),
        },
    }
}

fn row<'a>(comparison: &'a Comparison, name: &str) -> &'a FluentRow {
    comparison.rows.iter().find(|row| row.name == name).unwrap()
}

#[test]
fn rows_stand_side_by_side_in_the_order_measured() {
    let measured = [
        read("holding(jar)", Some(true), Some(0.012)),
        read("above(jar, cup)", Some(false), Some(-0.031)),
        read("dry()", None, None),
    ];
    // The twin's own order does not matter, and it knows one thing fewer.
    let twin = [
        read("above(jar, cup)", Some(true), Some(0.020)),
        read("holding(jar)", Some(true), Some(0.013)),
    ];
    let comparison = compare(&twin, &measured);
    let names: Vec<&str> = comparison.rows.iter().map(|row| row.name.as_str()).collect();
    assert_eq!(names, ["holding(jar)", "above(jar, cup)", "dry()"]);
    let above = row(&comparison, "above(jar, cup)");
    assert_eq!((above.twin, above.measured), (Some(true), Some(false)));
    let (real, twin) = (above.margin.as_ref().unwrap(), above.twin_margin.as_ref().unwrap());
    assert!((real.value + 0.031).abs() < 1e-15 && (twin.value - 0.020).abs() < 1e-15);
    assert_eq!((real.unit.as_str(), twin.unit.as_str()), ("m", "m"));
    let dry = row(&comparison, "dry()");
    assert_eq!((dry.twin, dry.measured, &dry.margin), (None, None, &None));
    assert_eq!(dry.why.as_deref(), Some("nobody looked"));
}

/// Eq. 8 with one mismatch, one agreement and every kind of not knowing.
#[test]
fn what_is_unknown_is_neither_agreement_nor_mismatch() {
    let measured = [
        read("a", Some(true), None),
        read("b", Some(false), None),
        read("c", None, None),
        read("d", Some(true), None),
        read("e", None, None),
    ];
    let twin = [
        read("a", Some(true), None),
        read("b", Some(true), None),
        read("c", Some(true), None),
        read("e", None, None),
    ];
    let score = compare(&twin, &measured).score;
    assert_eq!((score.hamming, score.known, score.unknown), (1, 2, 3));
    assert!((score.p - (-1.0_f64).exp()).abs() < 1e-15);
}

#[test]
fn a_step_nobody_rehearsed_has_nothing_to_disagree_with() {
    let measured = [read("a", Some(false), None), read("b", Some(true), None)];
    let comparison = compare(&[], &measured);
    assert!(comparison.rows.iter().all(|row| row.twin.is_none() && row.twin_margin.is_none()));
    let score = comparison.score;
    assert_eq!((score.hamming, score.known, score.unknown), (0, 0, 2));
    assert!((score.p - 1.0).abs() < 1e-15);
}

/// Each further mismatch costs the same factor: three of them leave `exp(-3)`.
#[test]
fn the_score_falls_by_one_factor_a_mismatch() {
    let names = ["a", "b", "c", "d"];
    for wrong in 0..=names.len() {
        let twin: Vec<_> = names.map(|name| read(name, Some(true), None)).into();
        let measured: Vec<_> =
            names.iter().enumerate().map(|(i, name)| read(name, Some(i >= wrong), None)).collect();
        let score = compare(&twin, &measured).score;
        assert_eq!((score.hamming, score.unknown), (wrong, 0));
        assert!((score.p - (-(wrong as f64)).exp()).abs() < 1e-15);
    }
}

/// A mistake in the fluent itself is worth more to the reader than "unknown".
#[test]
fn a_mistake_in_a_fluent_is_told_before_what_is_unknown() {
    let mut wrong = read("rim(kup)", None, None);
    wrong.reading.error =
        Some(Error::UnknownName { name: "kup".into(), suggestion: Some("cup".into()) });
    let comparison = compare(&[], &[wrong]);
    let why = comparison.rows[0].why.as_deref().unwrap();
    assert!(why.contains("`kup`") && why.contains("`cup`"), "{why}");
}

#[test]
fn questions_are_answered_as_their_fluents_are() {
    let mut asked = read("pouring(jar, cup)", Some(true), Some(0.1));
    asked.ask = Some("Is the robot pouring water into the blue cup?".into());
    let mut open = read("holding(jar)", None, None);
    open.ask = Some("Has the robot already picked up the transparent jar?".into());
    let silent = read("level(jar)", Some(true), None);
    let mut twin = read("pouring(jar, cup)", Some(false), Some(-0.1));
    twin.ask.clone_from(&asked.ask);
    let comparison = compare(&[twin], &[asked, open, silent]);
    let answers = by_geometry(&comparison.rows);
    let said: Vec<_> = answers.iter().map(|a| (a.fluent.as_str(), a.twin, a.measured)).collect();
    assert_eq!(
        said,
        [("pouring(jar, cup)", Some(false), Some(true)), ("holding(jar)", None, None)]
    );
    assert!(answers[0].question.starts_with("Is the robot pouring"));
}

#[test]
fn measures_are_in_si_with_the_units_name() {
    for (quantity, value, unit) in [
        (Quantity::metres(0.012), 0.012, "m"),
        (Quantity::radians(0.5), 0.5, "rad"),
        (Quantity::cubic_metres(3e-5), 3e-5, "m^3"),
        (Quantity::seconds(2.0), 2.0, "s"),
    ] {
        let measure = measure(quantity);
        assert_eq!(measure.unit, unit);
        assert!((measure.value - value).abs() < 1e-18);
    }
}

/// What a run shows, condition by condition: planted margins come out as the energies they must have.
#[test]
fn the_evidence_of_a_run_weighs_as_it_was_planted() {
    let library = Library::standard();
    let (step, _) = parse_line("pick(jar)");
    let Some(Step::Act(act)) = step else { panic!() };
    let graph = graph::build(&library, &act.call).unwrap();
    let given = graph::infer::Given {
        definitions: &library,
        holds: &|_: &Expr| None,
        pins: &std::collections::BTreeMap::new(),
        priors: None,
        cost: &|_| 0.0,
    };
    let pg = graph::best(&graph, &given).unwrap();
    let lift = pg.steps.iter().find(|step| step.text.starts_with("lift")).unwrap();
    let metres = |value| Measure { value, unit: "m".into() };
    let mut comparison = compare(
        &[read("holding(jar)", Some(true), Some(0.1))],
        &[read("holding(jar)", Some(false), Some(-0.006))],
    );
    comparison.rows[0].std = Some(metres(0.002));
    let record = StepRecord {
        number: 1,
        path: lift.path.clone(),
        action: lift.text.clone(),
        outcome: Outcome::Failure,
        not_needed: None,
        reason: None,
        failure: None,
        call: None,
        interval_s: [1.0, 2.5],
        fluents: comparison.rows,
        during: Vec::new(),
        lines: Vec::new(),
        planned_q: Vec::new(),
        hamming: 1,
        score: (-1.0_f64).exp(),
        measured: WorldState {
            time: 2.5,
            q: vec![0.0; 7],
            opening: 0.0,
            world_from_tool: Pose::upright(0.5, 0.0, 0.3, 0.0),
            held: None,
            objects: Vec::new(),
            spilt: None,
            unknown: Vec::new(),
        },
        twin: None,
    };
    let evidence = evidence(&pg, std::slice::from_ref(&record));
    let found = energy(&pg, &evidence);
    // `lift` gives `holding(jar) and height(jar) >= 9 cm`, `pick` gives `holding(jar)`: three deviations each.
    assert!((found.causal - 6.0).abs() < 1e-9, "{found:?} from {evidence:?}");
    assert!((found.choice + pg.log_p).abs() < 1e-12 && found.spatial.abs() < 1e-12);
    assert!((found.data + PAPER_ERROR_RATE.ln()).abs() < 1e-12);
    let interval = evidence.interval(&lift.path).unwrap();
    assert!((interval.to - interval.from - 1.5).abs() < 1e-12);
}
