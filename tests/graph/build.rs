//! From a call to the graph: nodes, paths, relations, and what cannot be built.

use trueup::graph::{Decides, Does, Form, NodeKind, Problem, Relation, Role};
use trueup::language::ast::{Allen, Block, If, Name, Repeat, Span, Step, Together};
use trueup::language::text;

use super::built;
use super::tree::*;

fn problems(steps: Vec<Step>) -> Vec<Problem> {
    let mut program = pouring();
    program.items.push(trueup::language::ast::Item::Task(task("wrong", vec![], steps)));
    trueup::graph::build(&program, &call("wrong", &[])).unwrap_err()
}

/// 5.7 (1): And and Or; Or over branches and over an argument's values; one inside another.
#[test]
fn and_or_and_terminals_are_all_there_and_nested() {
    let graph = built(&pouring(), &call("pour", &["jar", "cup"]));
    let kind = |path: &str| &graph.find(path).unwrap_or_else(|| panic!("no {path}")).kind;
    assert!(matches!(kind("pour"), NodeKind::And(and) if matches!(and.form, Form::Task(_))));
    let NodeKind::Or(either) = kind("pour/pick/either") else { panic!("not an Or") };
    assert_eq!(either.decides, Decides::Choice);
    let names: Vec<_> = either.branches.iter().map(|b| (b.name.as_str(), b.prior)).collect();
    assert_eq!(names, [("side", 0.7), ("top", 0.3)]);
    assert!(matches!(kind("pour/pick/either.side/grasp"), NodeKind::Terminal(_)));
    let NodeKind::Or(at) = kind("pour/place/at") else { panic!("not an Or") };
    assert_eq!(at.decides, Decides::Argument("at".into()));
    // Below each value the whole task stands with that value filled in.
    assert_eq!(graph.find("pour/place/at.tray/move_over").unwrap().label, "move_over(jar, tray)");
    assert_eq!(graph.find("pour/place/at.table").unwrap().label, "place(jar, at: table)");
    assert!(
        matches!(kind("pour/if"), NodeKind::Or(or) if matches!(or.decides, Decides::Condition(_)))
    );
    let NodeKind::Or(or) = kind("pour/pick/on_failure") else { panic!("not an Or") };
    assert_eq!(or.decides, Decides::Recovery);
    // Every node but the root lies below its parent, and every path is there once.
    let mut paths = std::collections::BTreeSet::new();
    for node in graph.nodes() {
        assert!(paths.insert(node.path.clone()), "{} twice", node.path);
        if let Some(parent) = node.parent {
            assert!(node.path.starts_with(&graph.node(parent).path));
            assert!(graph.below(graph.node(parent)).contains(&node.id), "{}", node.path);
        }
    }
}

#[test]
fn an_either_inside_an_either_keeps_both_names() {
    let inner = either(vec![
        ("left", None, None, vec![act(call("open_gripper", &[]))]),
        ("right", None, None, vec![act(call("open_gripper", &[]))]),
    ]);
    let mut program = pouring();
    let outer = either(vec![
        ("one", None, None, vec![inner]),
        ("two", None, None, vec![act(call("open_gripper", &[]))]),
    ]);
    program.items.push(trueup::language::ast::Item::Task(task("nest", vec![], vec![outer])));
    let graph = built(&program, &call("nest", &[]));
    assert!(graph.find("nest/either.one/either.right/open_gripper").is_some());
}

/// 5.7 (2): temporal, causal and spatial relations are there to look at.
#[test]
fn temporal_causal_and_spatial_relations_are_present() {
    let graph = built(&pouring(), &call("pour", &["jar", "cup"]));
    let path = |id| graph.node(id).path.as_str();
    let temporal: Vec<_> = graph
        .relations
        .iter()
        .filter_map(|r| match r {
            Relation::Temporal { a, allen, b, by } => Some((path(*a), *allen, path(*b), *by)),
            _ => None,
        })
        .collect();
    let approach = "pour/pick/either.side/approach";
    assert!(temporal.contains(&(approach, Allen::Meets, "pour/pick/either.side/grasp", None)));
    let rising = ("pour/together/rising", Allen::Overlaps, "pour/together/moving", Some(0.3));
    assert!(temporal.contains(&rising));
    assert!(
        !temporal
            .iter()
            .any(|(a, allen, ..)| *a == "pour/together/rising" && *allen == Allen::Meets),
        "steps done together do not meet"
    );
    let causal: Vec<_> = graph
        .relations
        .iter()
        .filter_map(|r| match r {
            Relation::Causal { node, role, fluent, negated } => {
                Some((path(*node), *role, graph.fluents[*fluent].text.as_str(), *negated))
            }
            _ => None,
        })
        .collect();
    let grasp = "pour/pick/either.side/grasp";
    assert!(causal.contains(&(grasp, Role::Needs, "reachable(jar, side)", false)));
    assert!(causal.contains(&(grasp, Role::Needs, "gripper.open", false)));
    assert!(causal.contains(&(grasp, Role::Gives, "contact(gripper, jar)", false)));
    assert!(causal.contains(&("pour/pick", Role::Needs, "holding(any)", true)));
    assert!(causal.contains(&("pour/pick/lift", Role::Keeps, "holding(jar)", false)));
    assert!(causal.contains(&("pour/check_above", Role::Checks, "above(jar, cup)", false)));
    assert!(causal.contains(&("pour/pick/either.side", Role::Guard, "tall(jar)", false)));
    let spatial: Vec<_> = graph
        .relations
        .iter()
        .filter_map(|r| match r {
            Relation::Spatial { fluent, objects } => {
                Some((graph.fluents[*fluent].text.as_str(), objects.join(" ")))
            }
            _ => None,
        })
        .collect();
    assert!(spatial.contains(&("above(jar, cup)", "jar cup".into())));
    assert!(spatial.contains(&("contact(gripper, jar)", "gripper jar".into())));
}

/// 5.7 (3) and (4): a terminal is (fluents before, action, fluents after); fluents have values.
#[test]
fn terminals_carry_what_is_before_and_after_and_fluents_know_their_body() {
    let graph = built(&pouring(), &call("pour", &["jar", "cup"]));
    let NodeKind::Terminal(grasp) = &graph.find("pour/pick/either.side/grasp").unwrap().kind else {
        panic!("not a terminal")
    };
    let all = |e: &[_]| e.iter().map(text::expr).collect::<Vec<_>>();
    assert_eq!(all(&grasp.causes.needs), ["reachable(jar, side) and gripper.open"]);
    assert_eq!(all(&grasp.causes.gives), ["contact(gripper, jar)"]);
    assert_eq!(grasp.script.as_deref(), Some("grasp.rhai"));
    let Does::Action { name, args } = &grasp.does else { panic!("not an action") };
    let args: Vec<_> = args.iter().map(|a| (a.name.as_str(), a.text.as_str())).collect();
    assert_eq!((name.as_str(), args.as_slice()), ("grasp", &[("o", "jar"), ("face", "side")][..]));
    let above = graph.fluents.iter().find(|f| f.text == "above(jar, cup)").unwrap();
    assert!(above.is_real);
    assert_eq!(above.ask.as_deref(), Some("Is the jar above the cup?"));
    assert_eq!(
        above.body.as_deref(),
        Some("offset(lip(jar), center(cup)) <= rim(cup) - 5 mm and gap(jar, cup) >= 3 cm")
    );
    let lidded = graph.fluents.iter().find(|f| f.text == "lidded(jar)").unwrap();
    assert!(!lidded.is_real && lidded.body.is_none());
}

/// Defaults are filled in with what the caller gave, and stay to be worked out later.
#[test]
fn defaults_are_closed_expressions() {
    let graph = built(&pouring(), &call("pour", &["jar", "cup"]));
    assert_eq!(text::call(&graph.call), "pour(jar, cup, amount: 0.9 * filled(jar))");
    let explicit = call_with(
        "pour",
        vec![("target", vec![n("cup")]), ("source", vec![n("jar")]), ("amount", vec![ml(60.0)])],
    );
    let graph = built(&pouring(), &explicit);
    assert!(graph.fluents.iter().any(|f| f.text == "volume(cup) >= 60 mL"));
}

/// 5.7 (12): the same text, other things.
#[test]
fn the_same_text_serves_other_things() {
    let jar = built(&pouring(), &call("pour", &["jar", "cup"]));
    let bottle = built(&pouring(), &call("pour", &["bottle", "bowl"]));
    let paths = |g: &trueup::graph::Graph| -> Vec<_> {
        g.nodes().iter().map(|n| (n.path.clone(), n.key.clone())).collect()
    };
    assert_eq!(paths(&jar), paths(&bottle));
    assert_eq!(jar.relations.len(), bottle.relations.len());
    let renamed = |text: &str| text.replace("jar", "bottle").replace("cup", "bowl");
    for (a, b) in jar.nodes().iter().zip(bottle.nodes()) {
        assert_eq!(renamed(&a.label), b.label);
    }
}

#[test]
fn what_is_learnt_hangs_on_the_task_it_is_written_in() {
    let graph = built(&pouring(), &call("pour", &["jar", "cup"]));
    let alone = built(&pouring(), &call("pick", &["jar"]));
    let side = |g: &trueup::graph::Graph, path: &str| match &g.find(path).unwrap().kind {
        NodeKind::Or(or) => (or.branches[0].key.clone(), or.branches[0].text),
        _ => panic!("not an Or"),
    };
    assert_eq!(side(&graph, "pour/pick/either"), side(&alone, "pick/either"));
    assert_eq!(side(&alone, "pick/either").0, "pick/either.side");
}

/// Editing what a branch reaches starts new counts; editing something else does not.
#[test]
fn a_branch_is_known_by_its_text_and_all_it_reaches() {
    let text_of =
        |program: &trueup::language::ast::Program| match &built(program, &call("pick", &["jar"]))
            .find("pick/either")
            .unwrap()
            .kind
        {
            NodeKind::Or(or) => or.branches.iter().map(|b| b.text).collect::<Vec<_>>(),
            _ => panic!("not an Or"),
        };
    let before = text_of(&pouring());
    assert_ne!(before[0], before[1]);
    let mut edited = pouring();
    edited.items.push(action("lift", params("o: Graspable, by: Length"), vec![], vec![]));
    assert_eq!(text_of(&edited), before, "lift is outside the branches");
    edited.items.push(action("grasp", params("o: Graspable, face: Face"), vec![], vec![]));
    let after = text_of(&edited);
    assert!(after[0] != before[0] && after[1] != before[1]);
}

#[test]
fn a_loop_is_unrolled_to_its_bound() {
    let until = Some(f("holding", &["jar"]));
    let repeat = |until| {
        let block = Block { ..block(vec![act(call("open_gripper", &[]))]) };
        Step::Repeat(Repeat { times: 3, block, until, span: at() })
    };
    for until in [None, until] {
        let mut program = pouring();
        let again = task("again", vec![], vec![repeat(until.clone())]);
        program.items.push(trueup::language::ast::Item::Task(again));
        let graph = built(&program, &call("again", &[]));
        let opens = graph.nodes().iter().filter(|n| n.label == "open_gripper()").count();
        assert_eq!(opens, 3);
        let check = graph.find("again/repeat/check_holding");
        assert_eq!(check.is_some(), until.is_some(), "a loop for something asks for it at the end");
    }
}

#[test]
fn a_task_that_calls_itself_is_refused_with_the_ring() {
    let mut program = pouring();
    let ring = |a: &str, b: &str| {
        trueup::language::ast::Item::Task(task(a, vec![], vec![act(call(b, &[]))]))
    };
    program.items.extend([ring("ping", "pong"), ring("pong", "ping")]);
    let found = trueup::graph::build(&program, &call("ping", &[])).unwrap_err();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].code, "graph::recursion");
    assert!(found[0].message.contains("ping → pong → ping"), "{}", found[0].message);
    assert_eq!(found[0].within, "pong");
}

#[test]
fn every_problem_is_told_at_once() {
    let found = problems(vec![
        act(call("fly", &[])),
        act(call("grasp", &["jar"])),
        act(call("grasp", &["jar", "side", "top"])),
        act(call_with("lift", vec![("", vec![n("jar")]), ("bi", vec![m(0.1)])])),
        act(call_with(
            "lift",
            vec![("", vec![n("jar")]), ("o", vec![n("cup")]), ("by", vec![m(0.1)])],
        )),
        either(vec![("a", Some(1.0), None, vec![]), ("b", None, None, vec![])]),
        Step::Bad(Span { from: 3, to: 9 }),
        Step::Repeat(Repeat { times: 0, block: block(vec![]), until: None, span: at() }),
        Step::Together(Together {
            steps: vec![act_as(call("open_gripper", &[]), vec![], Some("opening"))],
            timings: vec![timing("opening", Allen::Before, "closing", None)],
            span: at(),
        }),
    ]);
    let said: Vec<_> = found.iter().map(|p| p.message.as_str()).collect();
    for (message, expected) in said.iter().zip([
        "nothing called `fly` can be done",
        "action `grasp` needs `face`",
        "action `grasp` takes 2 arguments, not more",
        "action `lift` has no parameter `bi`",
        "`o` of action `lift` is given twice",
        "add up to 1",
        "could not be read",
        "repeated 0 times",
        "no step here is labelled `closing`",
    ]) {
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    }
    assert_eq!(said.len(), 9);
    assert!(found[8].help.as_deref().unwrap().contains("opening"));
}

#[test]
fn loops_inside_loops_stop_at_a_size_that_helps_nobody() {
    let mut step = act(call("open_gripper", &[]));
    for _ in 0..6 {
        step =
            Step::Repeat(Repeat { times: 10, block: block(vec![step]), until: None, span: at() });
    }
    let found = problems(vec![step]);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].code, "graph::too_large");
}

#[test]
fn a_let_is_a_step_and_its_name_is_unique() {
    let name = |text: &str| Name { text: text.into(), span: at() };
    let inner = task(
        "inner",
        params("o: Graspable"),
        vec![
            Step::Let(name("start"), f("volume", &["o"]), at()),
            Step::Check(
                two(f("volume", &["o"]), trueup::language::ast::BinaryOp::Gt, n("start")),
                at(),
            ),
        ],
    );
    let outer =
        task("outer", vec![], vec![act(call("inner", &["jar"])), act(call("inner", &["cup"]))]);
    let mut program = pouring();
    program.items.extend([inner, outer].map(trueup::language::ast::Item::Task));
    let graph = built(&program, &call("outer", &[]));
    let labels: Vec<_> = graph.nodes().iter().map(|n| n.label.as_str()).collect();
    assert!(labels.contains(&"let start = volume(jar)"));
    assert!(labels.contains(&"let start_2 = volume(cup)"));
    assert!(labels.contains(&"check volume(cup) > start_2"));
}

#[test]
fn an_if_with_an_else_has_two_branches() {
    let step = Step::If(If {
        condition: f("tall", &["jar"]),
        then: block(vec![act(call("open_gripper", &[]))]),
        otherwise: Some(block(vec![act(call("untilt", &["jar"]))])),
        span: at(),
    });
    let mut program = pouring();
    program.items.push(trueup::language::ast::Item::Task(task("maybe", vec![], vec![step])));
    let graph = built(&program, &call("maybe", &[]));
    assert!(graph.find("maybe/if.then/open_gripper").is_some());
    assert!(graph.find("maybe/if.else/untilt").is_some());
}

/// `for` goes through the things of a type in the scene's order, and backwards as another way.
#[test]
fn for_is_once_for_each_thing_of_a_type() {
    use trueup::graph::{InScene, build};
    use trueup::language::{Library, Source, parse_line};
    let mut library = Library::standard();
    let scene = "scene three {
        table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)
        z: Graspable = cuboid(5 cm, 5 cm, 5 cm)
        tray: Surface = cuboid(20 cm, 16 cm, 2 cm)
        a: Container = cylinder(radius 4 cm, height 9 cm)
    }
    task all() { for o in Graspable when tall(o) { pick(o) place(o) } }";
    library.add(Source::new("three.task", scene));
    let (step, _) = parse_line("all()");
    let Some(Step::Act(act)) = step else { panic!() };
    let graph = build(&InScene { library: &library, scene: "three" }, &act.call).unwrap();
    let NodeKind::Or(order) = &graph.find("all/either").unwrap().kind else { panic!("not an Or") };
    let names: Vec<_> = order.branches.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["in_order", "backwards"]);
    let below = |path: &str| -> Vec<String> {
        graph
            .below(graph.find(path).unwrap())
            .iter()
            .map(|id| graph.node(*id).label.clone())
            .collect()
    };
    // A cup is something to grasp, a tray is not.
    assert_eq!(below("all/either.in_order"), ["z", "a"]);
    assert_eq!(below("all/either.backwards"), ["a", "z"]);
    let NodeKind::Or(when) = &graph.find("all/either.in_order/z/if").unwrap().kind else {
        panic!()
    };
    assert!(matches!(when.decides, Decides::Condition(_)));
    assert!(graph.find("all/either.in_order/z/if.then/pick").is_some());
    // Without a scene there is nothing to go through.
    let graph = build(&library, &act.call).unwrap();
    assert!(below_none(&graph));
}

fn below_none(graph: &trueup::graph::Graph) -> bool {
    graph.below(graph.find("all/for").unwrap()).is_empty()
}
