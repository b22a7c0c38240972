//! Probabilities, the best parse, and learning.

use std::collections::BTreeMap;

use trueup::graph::infer::{Given, Policy, choices_that_differ};
use trueup::graph::outcome::{Outcome, Outcomes, Priors, outcomes_of};
use trueup::graph::{
    Error, Node, NodeKind, ParseGraph, after_failure, best, diverse, k_best, sample,
};
use trueup::language::ast::{Expr, If, Item, Program, Recovery, Step};

use super::tree::*;
use super::{Settings, built, kitchen};

/// Two choices in a row, one of them with a third inside: 3 × (2 + 1) parses.
fn crossroads() -> Program {
    let go = |name: &'static str| act(call(name, &[]));
    let first = either(vec![
        ("a", Some(0.5), None, vec![go("a")]),
        ("b", Some(0.3), None, vec![go("b")]),
        ("c", None, Some(f("clear", &[])), vec![go("c")]),
    ]);
    let inner =
        either(vec![("x", Some(0.9), None, vec![go("x")]), ("y", None, None, vec![go("y")])]);
    let second =
        either(vec![("in", Some(0.4), None, vec![inner]), ("out", Some(0.6), None, vec![go("z")])]);
    let mut items: Vec<Item> =
        ["a", "b", "c", "x", "y", "z"].iter().map(|n| action(n, vec![], vec![], vec![])).collect();
    items.push(Item::Task(task("go", vec![], vec![first, second])));
    program(items)
}

fn steps(pg: &ParseGraph) -> String {
    pg.steps.iter().map(|s| s.text.trim_end_matches("()")).collect()
}

fn anything(_: &Expr) -> Option<bool> {
    None
}

/// 5.7 (6): frequencies match the probabilities that the parses state.
#[test]
fn sampling_frequencies_match_the_stated_probabilities() {
    let program = crossroads();
    let graph = built(&program, &call("go", &[]));
    let settings = Settings::new(&program, &anything);
    let given = settings.given();
    let all = k_best(&graph, &given, 100).unwrap();
    assert_eq!(all.len(), 9);
    let total: f64 = all.iter().map(|pg| pg.log_p.exp()).sum();
    assert!((total - 1.0).abs() < 1e-12, "the probabilities of all parses add up to {total}");
    let n = 4000;
    let mut seen: BTreeMap<String, f64> = BTreeMap::new();
    for seed in 0..n {
        let pg = sample(&graph, &given, &Policy::Prior, seed).unwrap();
        *seen.entry(steps(&pg)).or_default() += 1.0;
    }
    let chi2: f64 = all
        .iter()
        .map(|pg| {
            let expected = pg.log_p.exp() * n as f64;
            let found = seen.get(&steps(pg)).copied().unwrap_or(0.0);
            (found - expected).powi(2) / expected
        })
        .sum();
    // 8 degrees of freedom: 26.1 is passed by chance once in a thousand; the seeds are fixed.
    assert!(chi2 < 26.1, "chi-square {chi2}");
}

#[test]
fn the_same_seed_draws_the_same_parse() {
    let program = crossroads();
    let graph = built(&program, &call("go", &[]));
    let settings = Settings::new(&program, &anything);
    for seed in 0..20 {
        let draw = || sample(&graph, &settings.given(), &Policy::Prior, seed).unwrap();
        assert_eq!(draw(), draw());
    }
}

#[test]
fn a_false_guard_takes_a_branch_out_and_the_others_share_its_probability() {
    let program = crossroads();
    let graph = built(&program, &call("go", &[]));
    let blocked = |_: &Expr| Some(false);
    let settings = Settings::new(&program, &blocked);
    let all = k_best(&graph, &settings.given(), 100).unwrap();
    assert_eq!(all.len(), 6);
    let total: f64 = all.iter().map(|pg| pg.log_p.exp()).sum();
    assert!((total - 1.0).abs() < 1e-12);
    let choice = &all[0].choices[0];
    assert_eq!(choice.possible, ["a", "b"]);
    assert!((choice.p - 0.5 / 0.8).abs() < 1e-12);
    for seed in 0..200 {
        let pg = sample(&graph, &settings.given(), &Policy::Prior, seed).unwrap();
        assert!(!steps(&pg).contains('c'));
    }
}

#[test]
fn nothing_possible_says_which_guards_stand_in_the_way() {
    let go = |name: &'static str| act(call(name, &[]));
    let closed = either(vec![
        ("a", None, Some(f("clear", &[])), vec![go("a")]),
        ("b", None, Some(f("open", &[])), vec![go("b")]),
    ]);
    let mut program = crossroads();
    program.items.push(Item::Task(task("stuck", vec![], vec![closed])));
    let graph = built(&program, &call("stuck", &[]));
    let blocked = |_: &Expr| Some(false);
    let settings = Settings::new(&program, &blocked);
    let error = best(&graph, &settings.given()).unwrap_err();
    assert!(matches!(error, Error::NoBranch { .. }));
    let said = error.to_string();
    assert!(
        said.contains("`a` only when clear()") && said.contains("`b` only when open()"),
        "{said}"
    );
    assert_eq!(sample(&graph, &settings.given(), &Policy::Prior, 1).unwrap_err(), error);
}

#[test]
fn pins_fix_a_branch_and_a_pin_that_fits_nothing_is_told() {
    let program = crossroads();
    let graph = built(&program, &call("go", &[]));
    let settings = Settings::new(&program, &anything).pin("go/either", "c");
    let pg = best(&graph, &settings.given()).unwrap();
    assert_eq!(steps(&pg), "cz");
    let wrong = Settings::new(&program, &anything).pin("go/either", "d");
    let error = best(&graph, &wrong.given()).unwrap_err();
    assert_eq!(error.to_string(), "`go/either` has no branch `d`; it has a, b, c");
}

/// A cost per node, different for every one, that no order of branches gives away.
fn costly(node: &Node) -> f64 {
    match &node.kind {
        NodeKind::Terminal(_) => {
            let sum: u32 = node.path.bytes().map(u32::from).sum();
            f64::from(sum.wrapping_mul(2_654_435_761) % 997) / 250.0
        }
        _ => 0.0,
    }
}

/// 5.7 (7): dynamic programming against listing every parse, here by sampling each one's choices.
#[test]
fn the_best_parses_are_those_of_brute_force() {
    let pours = pouring();
    let roads = crossroads();
    let cases: [(&Program, trueup::language::ast::Call); 2] =
        [(&pours, call("pour", &["jar", "cup"])), (&roads, call("go", &[]))];
    for (program, call) in cases {
        let graph = built(program, &call);
        let nobody = BTreeMap::new();
        let given = Given {
            definitions: program,
            holds: &anything,
            pins: &nobody,
            priors: None,
            cost: &costly,
        };
        // Brute force: every combination of pins for every Or there is.
        let ors: Vec<_> = graph
            .nodes()
            .iter()
            .filter_map(|node| match &node.kind {
                NodeKind::Or(or) if !matches!(or.decides, trueup::graph::Decides::Recovery) => {
                    Some((node.path.clone(), or.branches.iter().map(|b| b.name.clone()).collect()))
                }
                _ => None,
            })
            .collect::<Vec<(String, Vec<String>)>>();
        let mut every: BTreeMap<String, f64> = BTreeMap::new();
        let count: usize = ors.iter().map(|(_, branches)| branches.len()).product();
        for mut code in 0..count {
            let mut pins = BTreeMap::new();
            for (path, branches) in &ors {
                pins.insert(path.clone(), branches[code % branches.len()].clone());
                code /= branches.len();
            }
            let pg = best(&graph, &Given { pins: &pins, ..given }).unwrap();
            // A pinned choice counts as certain; its true probability is read off the graph.
            let mut energy = 0.0;
            for choice in &pg.choices {
                let NodeKind::Or(or) = &graph.find(&choice.node).unwrap().kind else { panic!() };
                let branch = or.branches.iter().find(|b| b.name == choice.branch).unwrap();
                energy -= branch.prior.ln();
            }
            for step in &pg.steps {
                energy += costly(graph.find(&step.path).unwrap());
            }
            every.insert(
                format!(
                    "{:?}",
                    pg.choices.iter().map(|c| (&c.node, &c.branch)).collect::<Vec<_>>()
                ),
                energy,
            );
        }
        let mut energies: Vec<f64> = every.values().copied().collect();
        energies.sort_by(f64::total_cmp);
        let found = k_best(&graph, &given, 1000).unwrap();
        assert_eq!(found.len(), energies.len());
        for (k, expected) in [1, 3, energies.len()].into_iter().flat_map(|k| {
            let list = k_best(&graph, &given, k).unwrap();
            assert_eq!(list.len(), k.min(energies.len()));
            list.into_iter().zip(energies.clone()).collect::<Vec<_>>()
        }) {
            let energy = -k.log_p
                + k.steps.iter().map(|s| costly(graph.find(&s.path).unwrap())).sum::<f64>();
            assert!((energy - expected).abs() < 1e-9, "{energy} is not {expected}");
        }
    }
}

#[test]
fn diverse_parses_differ_in_what_people_choose() {
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    let settings = Settings::new(&program, &kitchen);
    let some = diverse(&graph, &settings.given(), 4).unwrap();
    assert_eq!(some.len(), 4);
    assert_eq!(some[0], best(&graph, &settings.given()).unwrap());
    assert_eq!(choices_that_differ(&some[0], &some[1]), 2, "the second differs in all it can");
    for (i, a) in some.iter().enumerate() {
        for b in &some[..i] {
            assert!(choices_that_differ(a, b) > 0);
        }
    }
}

/// What is done about a failure depends on what holds then, not on what could be foreseen.
#[test]
fn a_recovery_asks_its_conditions_when_something_has_failed() {
    let go = |name: &'static str| act(call(name, &[]));
    let mut job = task("job", vec![], vec![go("work")]);
    let (held, save) = (f("held", &[]), block(vec![go("save")]));
    job.recoveries = vec![Recovery {
        of: None,
        steps: vec![Step::If(If { condition: held, then: save, otherwise: None, span: at() })],
        remedy: None,
        span: at(),
    }];
    let action = |name| action(name, vec![], vec![], vec![]);
    let program = program(vec![action("work"), action("save"), Item::Task(job)]);
    let graph = built(&program, &call("job", &[]));
    let foreseen = best(&graph, &Settings::new(&program, &|_: &Expr| None).given()).unwrap();
    for (held, steps) in [(true, 1), (false, 0)] {
        let holds = move |_: &Expr| Some(held);
        let now = after_failure(&graph, &Settings::new(&program, &holds).given(), &foreseen);
        assert_eq!((&now.steps, now.log_p), (&foreseen.steps, foreseen.log_p));
        assert_eq!(now.recoveries.len(), 1);
        assert_eq!(now.recoveries[0].steps.len(), steps, "held: {held}");
    }
}

fn count(outcomes: &mut Outcomes, pg: &ParseGraph, worked: bool) {
    for outcome in outcomes_of(pg, "real", "run", |_| Some(worked)) {
        outcomes.add(&outcome);
    }
}

/// The table of LANGUAGE 5.4: prior 0.7 and 0.3, true success 0.6 and 0.9, 100 trials. Thompson
/// sampling finds the better branch; choosing by the prior does not.
#[test]
fn thompson_sampling_finds_the_branch_that_works() {
    let program = pouring();
    let graph = built(&program, &call("pick", &["jar"]));
    let settings = Settings::new(&program, &kitchen);
    let given = settings.given();
    let (mut better, mut by_prior) = (0, 0);
    let repeats = 40;
    for repeat in 0..repeats {
        let mut outcomes = Outcomes::default();
        for trial in 0..100_u64 {
            let seed = repeat * 1000 + trial;
            let policy = Policy::Thompson { outcomes: &outcomes, domain: "real" };
            let pg = sample(&graph, &given, &policy, seed).unwrap();
            let is_top = pg.branch("pick/either") == Some("top");
            better += u32::from(is_top);
            // A coin of its own, fixed by the seed.
            let coin = (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / f64::from(1 << 24);
            count(&mut outcomes, &pg, coin < if is_top { 0.9 } else { 0.6 });
            let pg = sample(&graph, &given, &Policy::Prior, seed).unwrap();
            by_prior += u32::from(pg.branch("pick/either") == Some("top"));
        }
    }
    let share = f64::from(better) / (100.0 * repeats as f64);
    let prior = f64::from(by_prior) / (100.0 * repeats as f64);
    // Published there: 91 % and 30 %; binomial spread over 40 runs is a few per cent.
    assert!(share > 0.80, "the better branch was used {share}");
    assert!((prior - 0.3).abs() < 0.03, "by prior it was used {prior}");
}

#[test]
fn greedy_takes_what_worked_and_the_prior_when_nothing_is_known() {
    let program = pouring();
    let graph = built(&program, &call("pick", &["jar"]));
    let settings = Settings::new(&program, &kitchen);
    let mut outcomes = Outcomes::default();
    let choose = |outcomes: &Outcomes, domain: &str, seed| {
        let policy = Policy::Greedy { outcomes, domain };
        sample(&graph, &settings.given(), &policy, seed).unwrap()
    };
    assert_eq!(choose(&outcomes, "real", 1).branch("pick/either"), Some("side"));
    let failed = choose(&outcomes, "real", 1);
    count(&mut outcomes, &failed, false);
    assert_eq!(choose(&outcomes, "real", 1).branch("pick/either"), Some("top"));
    assert_eq!(choose(&outcomes, "twin", 1).branch("pick/either"), Some("side"), "counted apart");
}

/// 5.7 (10): the numbers move with what is stored, the same way each time.
#[test]
fn learning_moves_the_numbers_and_is_reproducible() {
    let program = pouring();
    let graph = built(&program, &call("pick", &["jar"]));
    let mut top =
        best(&graph, &Settings::new(&program, &kitchen).pin("pick/either", "top").given()).unwrap();
    top.choices.iter_mut().for_each(|choice| choice.is_asked = true);
    let mut priors = Priors::default();
    for _ in 0..10 {
        priors.learn(&top);
    }
    let NodeKind::Or(or) = &graph.find("pick/either").unwrap().kind else { panic!("not an Or") };
    let learnt = priors.of(or);
    // 10 pseudo-counts at 0.7/0.3 and ten demonstrations of the second: 7/20 and 13/20.
    assert!((learnt[0] - 0.35).abs() < 1e-12 && (learnt[1] - 0.65).abs() < 1e-12);
    let mut settings = Settings::new(&program, &kitchen);
    settings.priors = Some(priors.clone());
    assert_eq!(best(&graph, &settings.given()).unwrap().branch("pick/either"), Some("top"));
    let text = serde_json::to_string(&priors).unwrap();
    assert_eq!(serde_json::from_str::<Priors>(&text).unwrap(), priors);

    let lines: String = [true, true, false]
        .iter()
        .flat_map(|worked| outcomes_of(&top, "real", "21", |_| Some(*worked)))
        .map(|outcome| serde_json::to_string(&outcome).unwrap() + "\n")
        .collect();
    let read = Outcomes::read(&lines).unwrap();
    let counts = read.of(&or.branches[1], "real");
    assert_eq!((counts.worked, counts.failed, counts.tries()), (2, 1, 3));
    assert!((counts.mean() - 0.6).abs() < 1e-12);
    assert_eq!(Outcomes::read(&lines).unwrap(), read);
    assert_eq!(read.of(&or.branches[0], "real").tries(), 0);
}

#[test]
fn a_robots_own_runs_never_change_the_priors() {
    let program = pouring();
    let graph = built(&program, &call("pick", &["jar"]));
    let settings = Settings::new(&program, &kitchen);
    let mut outcomes = Outcomes::default();
    let pg = best(&graph, &settings.given()).unwrap();
    for _ in 0..50 {
        count(&mut outcomes, &pg, false);
    }
    let mut priors = Priors::default();
    assert_eq!(priors.learn(&pg), 0);
    assert_eq!(priors, Priors::default());
    let policy = Policy::Greedy { outcomes: &outcomes, domain: "real" };
    let after = sample(&graph, &settings.given(), &policy, 3).unwrap();
    assert_eq!(after.branch("pick/either"), Some("top"));
    let p = after.choices[0].p;
    assert!((p - 0.3).abs() < 1e-12, "still 0.3 under the prior: {p}");
}

#[test]
fn an_outcomes_file_cut_short_loses_its_last_line_and_a_spoilt_one_is_told() {
    let good = Outcome {
        branch: "pick/either.top".into(),
        text: "0".into(),
        domain: "real".into(),
        worked: true,
        run: "1".into(),
    };
    let line = serde_json::to_string(&good).unwrap();
    assert!(Outcomes::read(&format!("{line}\n{}", &line[..20])).is_ok());
    let error = Outcomes::read(&format!("{line}\nnonsense\n{line}\n")).unwrap_err();
    assert!(matches!(error, Error::Outcomes { line: 2, .. }));
}
