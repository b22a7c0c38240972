//! The graph as text, JSON, DOT and SVG.

use trueup::graph::draw::{Drawing, to_svg};
use trueup::graph::exchange::{self, dot::Sketch, from_json, to_dot, to_json};
use trueup::graph::outcome::{Outcomes, outcomes_of};
use trueup::graph::outline::{self, outline};
use trueup::graph::{Graph, best};

use super::tree::*;
use super::{Settings, built, kitchen};

fn pour() -> Graph {
    built(&pouring(), &call("pour", &["jar", "cup"]))
}

/// Nine of ten times the side worked.
fn ten_runs() -> Outcomes {
    let program = pouring();
    let graph = built(&program, &call("pick", &["jar"]));
    let pg = best(&graph, &Settings::new(&program, &kitchen).given()).unwrap();
    let mut outcomes = Outcomes::default();
    for i in 0..10 {
        for outcome in outcomes_of(&pg, "real", &i.to_string(), |_| Some(i != 4)) {
            outcomes.add(&outcome);
        }
    }
    outcomes
}

#[test]
fn the_outline_is_as_people_read_it() {
    let graph = built(&pouring(), &call("pick", &["jar"]));
    let outcomes = ten_runs();
    let learnt = outline::Learnt { outcomes: Some((&outcomes, "real")), ..Default::default() };
    let expected = "\
pick(jar)                                   And
├─ either                                   Or   (10 outcomes on the arm)
│  ├─ side   prior 0.70   worked 9 of 10   when tall(jar)
│  │  └─ approach(jar, side) ─meets─ grasp(jar, side)
│  └─ top   prior 0.30
│     └─ approach(jar, top) ─meets─ grasp(jar, top)
├─ lift(jar, by: 12 cm)   while holding(jar)
├─ on failure of grasp(jar)                 Or
│  └─ taken
│     ├─ open_gripper()
│     └─ retry other upto 2 times
├─ needs visible(jar) and not holding(any)
└─ gives holding(jar)
";
    assert_eq!(outline(&graph, &learnt), expected);
    let plain = outline(&graph, &outline::Learnt { is_plain: true, ..Default::default() });
    assert!(plain.is_ascii());
}

#[test]
fn json_holds_every_node_and_relation_and_refers_to_nothing_else() {
    let graph = pour();
    let outcomes = ten_runs();
    let learnt = exchange::Learnt { outcomes: Some(&outcomes), priors: None };
    let json = to_json(&graph, &learnt);
    assert_eq!((json["format"].as_str(), json["version"].as_u64()), (Some("stc-aog"), Some(1)));
    let nodes = json["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), graph.nodes().len() + graph.fluents.len());
    let ids: std::collections::BTreeSet<&str> =
        nodes.iter().map(|node| node["id"].as_str().unwrap()).collect();
    assert_eq!(ids.len(), nodes.len(), "ids are unique");
    let edges = json["edges"].as_array().unwrap();
    for edge in edges {
        for end in ["from", "to", "a", "b"] {
            if let Some(id) = edge[end].as_str() {
                assert!(ids.contains(id), "{edge} refers to nothing");
            }
        }
    }
    for part in ["T", "C", "S"] {
        assert!(edges.iter().any(|edge| edge["stc"] == part), "no {part} relation");
    }
    let find = |id: &str| nodes.iter().find(|node| node["id"] == id).unwrap();
    let side = find("pour/pick/either.side");
    assert_eq!(side["success"]["real"], serde_json::json!([9, 1]));
    assert_eq!(side["success"]["twin"], serde_json::json!([0, 0]));
    assert_eq!(side["guard"], "tall(jar)");
    assert_eq!(side["prior"], serde_json::json!({"count": 7, "of": 10}));
    let grasp = find("pour/pick/either.side/grasp");
    assert_eq!((&grasp["ao"], &grasp["action"]), (&"leaf".into(), &"grasp".into()));
    assert_eq!(grasp["args"], serde_json::json!({"o": "jar", "face": "side"}));
    assert_eq!(find("f:above(jar, cup)")["ask"], "Is the jar above the cup?");
}

#[test]
fn dot_balances_and_names_what_the_authors_name() {
    let dot = to_dot(&pour());
    assert_eq!(dot.matches('{').count(), dot.matches('}').count());
    for wanted in ["STC=\"T\"", "STC=\"C\"", "STC=\"F\"", "AO=\"and\"", "AO=\"or\"", "weight=0.7"] {
        assert!(dot.contains(wanted), "no {wanted}");
    }
}

/// Reads the picture back: every element closed in order, every `<` and `&` a mark-up character.
fn is_well_formed(svg: &str) -> Result<usize, String> {
    let (mut open, mut count, mut rest) = (Vec::new(), 0, svg);
    while let Some(at) = rest.find('<') {
        let end = rest[at..].find('>').ok_or("an element never ends")? + at;
        let tag = &rest[at + 1..end];
        let name = |t: &str| t.split([' ', '/', '\n']).next().unwrap_or_default().to_owned();
        if let Some(closing) = tag.strip_prefix('/') {
            let opened = open.pop().ok_or("closes what was not open")?;
            if opened != closing {
                return Err(format!("<{opened}> closed by </{closing}>"));
            }
        } else if !tag.ends_with('/') {
            open.push(name(tag));
        }
        count += 1;
        rest = &rest[end + 1..];
    }
    if open.is_empty() { Ok(count) } else { Err(format!("{open:?} never closed")) }
}

#[test]
fn the_picture_is_well_formed_and_shows_every_node() {
    let graph = pour();
    let svg = to_svg(&graph, &Drawing::default());
    is_well_formed(&svg).unwrap();
    for node in graph.nodes().iter().filter(|n| !n.path.ends_with("nominal")) {
        if node.path != "pour/if.else" {
            assert!(svg.contains(&format!("<title>{}", node.path)), "{} is missing", node.path);
        }
    }
    for fluent in &graph.fluents {
        let text = fluent.text.replace('>', "&gt;").replace('<', "&lt;");
        assert!(svg.contains(&text), "{text} is missing");
    }
    if let Ok(folder) = std::env::var("TRUEUP_PICTURES") {
        let program = pouring();
        let pg = best(&graph, &Settings::new(&program, &kitchen).given()).unwrap();
        let outcomes = ten_runs();
        let drawing =
            Drawing { parse: Some(&pg), outcomes: Some((&outcomes, "real")), priors: None };
        std::fs::write(format!("{folder}/graph.svg"), &svg).unwrap();
        std::fs::write(format!("{folder}/parse.svg"), to_svg(&graph, &drawing)).unwrap();
    }
}

#[test]
fn nothing_overlaps_in_the_picture() {
    let svg = to_svg(&pour(), &Drawing::default());
    let number = |tag: &str, key: &str| -> Option<f64> {
        let from = tag.find(&format!(" {key}=\""))? + key.len() + 3;
        tag[from..].split('"').next()?.parse().ok()
    };
    let boxes: Vec<[f64; 4]> = svg
        .split("<rect")
        .skip(1)
        .filter_map(|tag| {
            let tag = format!(" {}", tag.split('>').next()?);
            let all = [
                number(&tag, "x")?,
                number(&tag, "y")?,
                number(&tag, "width")?,
                number(&tag, "height")?,
            ];
            Some(all)
        })
        .collect();
    assert!(boxes.len() > 30);
    for (i, a) in boxes.iter().enumerate() {
        for b in &boxes[..i] {
            let apart = a[0] + a[2] <= b[0]
                || b[0] + b[2] <= a[0]
                || a[1] + a[3] <= b[1]
                || b[1] + b[3] <= a[1];
            assert!(apart, "{a:?} and {b:?}");
        }
    }
}

#[test]
fn what_a_parse_graph_leaves_out_fades() {
    let program = pouring();
    let graph = pour();
    let pg = best(&graph, &Settings::new(&program, &kitchen).given()).unwrap();
    let svg = to_svg(&graph, &Drawing { parse: Some(&pg), ..Default::default() });
    let at = |path: &str| {
        let title = svg.find(&format!("<title>{path}\n")).unwrap();
        svg[..title].rsplit("<g").next().unwrap().contains("opacity")
    };
    assert!(!at("pour/pick/either.side/grasp"));
    assert!(at("pour/pick/either.top/grasp"));
    assert!(at("pour/on_failure.taken/untilt"));
}

#[test]
fn names_that_would_be_mark_up_are_escaped() {
    let mut program = pouring();
    let step = act(call_with("grasp", vec![("", vec![n("<&\">")]), ("", vec![n("side")])]));
    program.items.push(trueup::language::ast::Item::Task(task("odd", vec![], vec![step])));
    let graph = built(&program, &call("odd", &[]));
    let svg = to_svg(&graph, &Drawing::default());
    is_well_formed(&svg).unwrap();
    assert!(svg.contains("grasp(&lt;&amp;&quot;&gt;, side)"));
    assert!(to_dot(&graph).contains("\\\""));
}

/// Every graph of the standard library and of the tests, written and read again.
#[test]
fn json_read_back_is_the_same_graph() {
    let library = trueup::language::Library::standard();
    let mut graphs = vec![pour(), built(&pouring(), &call("pick", &["jar"]))];
    for line in ["pour(jar, cup)", "pick(jar) via from_above", "place(jar, at: table | cup)"] {
        let (step, _) = trueup::language::parse_line(line);
        let mut library = library.clone();
        let source = trueup::language::Source::new("line", line);
        let call = library.define(&source, &[step.unwrap()]);
        graphs.push(trueup::graph::build(&library, &call).unwrap());
    }
    for graph in &graphs {
        let json = to_json(graph, &exchange::Learnt::default());
        let text = serde_json::to_string(&json).unwrap();
        let read = from_json(&serde_json::from_str(&text).unwrap()).unwrap();
        assert_eq!(to_json(&read, &exchange::Learnt::default()), json);
        assert_eq!(to_dot(&read), to_dot(graph));
        assert_eq!(
            outline(&read, &outline::Learnt::default()),
            outline(graph, &outline::Learnt::default())
        );
        // What is inferred from it is the same, too.
        let program = pouring();
        let (a, b) = (Settings::new(&program, &kitchen), Settings::new(&program, &kitchen));
        let (a, b) = (best(graph, &a.given()).unwrap(), best(&read, &b.given()).unwrap());
        let steps = |pg: &trueup::graph::ParseGraph| -> Vec<String> {
            pg.steps.iter().map(|step| step.text.clone()).collect()
        };
        assert_eq!((steps(&a), a.pins()), (steps(&b), b.pins()));
    }
}

#[test]
fn json_of_something_else_is_refused_with_what_is_wrong() {
    let json = to_json(&pour(), &exchange::Learnt::default());
    let spoil = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut spoilt = json.clone();
        change(&mut spoilt);
        from_json(&spoilt).unwrap_err().to_string()
    };
    assert!(spoil(&|j| j["version"] = 2.into()).contains("version 1"));
    assert!(spoil(&|j| j["root"] = "nowhere".into()).contains("root"));
    assert!(spoil(&|j| j["nodes"][1]["ao"] = "maybe".into()).contains("maybe"));
    assert!(
        spoil(&|j| j["nodes"][0]["needs"] = serde_json::json!(["visible("])).contains("visible(")
    );
    assert!(spoil(&|j| j["edges"][0]["to"] = "gone".into()).contains("gone"));
    assert!(spoil(&|j| j["nodes"] = 3.into()).contains("nodes"));
}

#[test]
fn dot_read_back_has_the_same_shape() {
    for graph in [pour(), built(&pouring(), &call("pick", &["jar"]))] {
        assert_eq!(Sketch::from_dot(&to_dot(&graph)).unwrap(), Sketch::of(&graph));
    }
    // A file of the authors' program: no ids, no weights.
    let theirs = "digraph G {\n0 [STC=\"S\", AO=\"and\", name=\"arm\"];\n1 [STC=\"F\", AO=\"or\", name=\"open\"];\n0->1 [STC=\"C\"];\n}\n";
    let sketch = Sketch::from_dot(theirs).unwrap();
    assert_eq!(sketch.nodes["0"], ["S".to_owned(), "and".into(), "arm".into()]);
    assert_eq!((sketch.edges[0].to.as_str(), sketch.edges[0].weight), ("1", None));
    assert!(Sketch::from_dot("digraph { a -> b [STC=\"T\"]; }\n").is_err());
}
