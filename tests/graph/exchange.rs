//! A graph as a text and as a grammar, and JSON of other programs.

use std::fmt::Write as _;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::json;
use trueup::graph::exchange::{Learnt, from_json, to_json, to_pcfg, to_task};
use trueup::graph::{self, Graph, NodeKind};
use trueup::language::ast::{Item, Step};
use trueup::language::{Library, Source, parse, parse_line};

use super::built;
use super::tree::*;

/// The graph of a line over the standard library.
fn of_line(line: &str) -> Graph {
    let mut library = Library::standard();
    let (step, wrong) = parse_line(line);
    assert!(wrong.is_empty(), "{line}: {wrong:?}");
    let call = library.define(&Source::new("line", line), &[step.unwrap()]);
    graph::build(&library, &call).unwrap()
}

/// The graph of a text by itself.
fn of_text(text: &str) -> Graph {
    let (program, wrong) = parse(text);
    assert!(wrong.is_empty(), "{text}\n{wrong:?}");
    let Some(Item::Run(Step::Act(act))) = program.items.last() else { panic!("no call: {text}") };
    let call = act.call.clone();
    graph::build(&program, &call).unwrap_or_else(|wrong| panic!("{text}\n{wrong:#?}"))
}

/// Everything that a graph says, without where it was read and what learnt counts hang on.
fn said(graph: &Graph) -> serde_json::Value {
    let mut json = to_json(graph, &Learnt::default());
    for node in json["nodes"].as_array_mut().unwrap() {
        for place in ["span", "text"] {
            node.as_object_mut().unwrap().remove(place);
        }
    }
    json
}

/// Text → graph → text → graph, and the same by way of JSON.
fn comes_back(graph: &Graph) -> String {
    let text = to_task(graph).unwrap_or_else(|wrong| panic!("{wrong}"));
    let again = of_text(&text);
    let (a, b) = (said(graph), said(&again));
    for key in ["root", "call", "nodes", "edges", "takes", "fluents_take"] {
        assert_eq!(a[key], b[key], "{key} of\n{text}");
    }
    let read = from_json(&to_json(graph, &Learnt::default())).unwrap();
    assert_eq!(to_task(&read).unwrap(), text, "by way of JSON");
    assert_eq!(to_task(&again).unwrap(), text, "written twice");
    assert_eq!(trueup::language::format(&text), text, "laid out");
    text
}

#[test]
fn every_task_and_action_of_the_library_comes_back_from_its_graph() {
    let library = Library::standard();
    let tasks = library.tasks().map(|(task, _)| (&task.name.text, &task.params));
    let actions = library.actions().map(|(action, _)| (&action.name.text, &action.params));
    let mut seen = 0;
    for (name, params) in tasks.chain(actions) {
        // The kitchen has no drawer.
        if params.iter().any(|param| param.ty.text == "Drawer") {
            continue;
        }
        let mut things = ["jar", "cup"].into_iter();
        let required = params.iter().filter(|param| param.default.is_none());
        let args: Vec<&str> = required
            .map(|param| match param.ty.text.as_str() {
                "Face" => "side",
                "Volume" => "40 mL",
                "Length" => "7 cm",
                _ => things.next().unwrap_or("table"),
            })
            .collect();
        let text = comes_back(&of_line(&format!(
            "{name}({}) then {name}({})",
            args.join(", "),
            args.join(", ")
        )));
        let mut over = Library::standard();
        let file = over.add(Source::new("again.task", text.as_str()));
        let wrong = over.check_file(file, &over.scope("kitchen"));
        assert!(wrong.is_empty(), "{text}\n{wrong:?}");
        seen += 1;
    }
    assert!(seen > 15, "{seen} tasks and actions");
}

#[test]
fn every_form_comes_back_from_its_graph() {
    for line in [
        "pour(jar, cup)",
        "pick(jar) via tilted_side",
        "place(jar, at: table | cup)",
        "pick(jar | cup)",
        "if tall(jar) { home() } else if tall(cup) { look() } else { }",
        "repeat upto 3 times { look() home() } until visible(jar)",
        "repeat upto 2 times { let x = height(jar) lift(jar, by: x) }",
        "together { home() then look() open_gripper() as opening home() as homing timing opening overlaps homing by 300 ms }",
        "{ home() on failure of home { look() retry upto 2 times } } while visible(jar) as trip",
        "pick(jar) then pick(cup) via from_above",
    ] {
        comes_back(&of_line(line));
    }
    let own = "\
        #[was(\"fetch\")] task get(o: Graspable, by: Length = 3 cm) {\n\
        let high = by + 1 cm\n\
        either #[was(\"low\")] near prior 0.25 { lift(o, by: high) as first break lift(o, by: by) as second }\n\
        or far when tall(o) { let high = 2 cm lift(o, by: high) }\n\
        limit 20 s on failure { abort \"no \\\"luck\\\"\" } }\n\
        action lift(o: Graspable, by: Length) { gives height(o) >= by - 1 cm run \"lift.rhai\" limit 2 s }\n\
        task both(a: Graspable, b: Graspable) { get(a, by: 5 cm) break when tall(b) get(b) via far }\n\
        both(jar, cup)";
    let text = comes_back(&of_text(own));
    for wanted in [
        "#[was(\"fetch\")]",
        "#[was(\"low\")]",
        "prior 0.25",
        "as second",
        "via far",
        "height(o) >= by - 1 cm",
    ] {
        assert!(text.contains(wanted), "no {wanted} in\n{text}");
    }
}

#[test]
fn what_differs_from_place_to_place_is_the_parameter_it_came_from() {
    let text = comes_back(&built(&pouring(), &call("pour", &["jar", "cup"])));
    assert!(text.contains("task place(o: Graspable, at: Place) {\n    needs holding(o)"), "{text}");
    assert!(text.contains("place(source, at: tray | table)"), "{text}");
    assert!(
        text.contains("distance(a, b) <= by"),
        "a number that only the parameter can be: {text}"
    );
    assert!(text.contains("ask \"Is the {a} above the {b}?\""), "{text}");
}

#[test]
fn a_branch_that_is_asked_for_is_seen_in_the_outline_and_the_drawing() {
    let graph = of_line("pick(jar) via from_above");
    let told = graph::outline::outline(&graph, &graph::outline::Learnt::default());
    assert!(
        told.contains("either via from_above ") && told.contains("on failure of grasp "),
        "{told}"
    );
    let drawn = graph::draw::to_svg(&graph, &graph::draw::Drawing::default());
    assert!(drawn.contains(">via from_above<"));
}

#[test]
fn a_graph_that_no_text_says_is_refused_with_what_is_in_the_way() {
    let json = to_json(&of_line("pick(jar) then pick(cup)"), &Learnt::default());
    let spoilt = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut json = json.clone();
        change(&mut json);
        to_task(&from_json(&json).unwrap()).unwrap_err().to_string()
    };
    let nodes = json["nodes"].as_array().unwrap();
    let at = |id: &str| nodes.iter().position(|node| node["id"] == id).unwrap();
    let (first, lift) = (at("steps/pick"), at("steps/pick/lift"));
    // One pick needs what the other does not.
    let said = spoilt(&|j| j["nodes"][first]["needs"] = json!(["visible(table)"]));
    assert!(said.contains("`pick`"), "{said}");
    let said = spoilt(&|j| j["nodes"][lift]["gives"] = json!([]));
    assert!(said.contains("`lift`"), "{said}");
    // A relation that a sequence does not have.
    let said = spoilt(&|j| {
        let edge = json!({"rel": "during", "a": "steps/pick", "b": "steps/pick/lift"});
        j["edges"].as_array_mut().unwrap().push(edge);
    });
    assert!(said.contains("during"), "{said}");
}

/// A text of every form, drawn by chance.
struct Writer {
    chance: StdRng,
    text: String,
    labels: usize,
}

impl Writer {
    fn pick<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.chance.random_range(0..of.len())]
    }

    fn condition(&mut self) -> String {
        let o = self.pick(&["o", "jar", "cup"]).to_owned();
        let all =
            [format!("tall({o})"), format!("near({o}, cup)"), format!("height({o}) <= by + 2 cm")];
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        let one = self.pick(&all).to_owned();
        match self.chance.random_range(0..5) {
            0 => format!("not ({one} or tall(cup))"),
            1 => format!("{one} and near(jar, o, by: 4 cm)"),
            _ => one,
        }
    }

    fn call(&mut self, depth: usize) -> String {
        let o = self.pick(&["o", "jar", "cup", "o | cup", "jar | o | cup"]);
        let by = self.pick(&["by", "3 cm", "by: 2 * by", "by: 1 cm | 2 cm"]);
        match depth {
            0 => format!("go({o}, {by})"),
            n => {
                let n = self.chance.random_range(0..n);
                format!("t{n}({o}, {by})")
            }
        }
    }

    fn act(&mut self, depth: usize) -> String {
        let mut said = self.call(depth);
        if self.chance.random_bool(0.3) {
            let word = self.pick(&["while", "until"]);
            said = format!("{said} {word} {}", self.condition());
        }
        if self.chance.random_bool(0.3) {
            self.labels += 1;
            said = format!("{said} as l{}", self.labels);
        }
        said
    }

    /// Steps of a task that may call those before it, `left` blocks deep.
    fn steps(&mut self, depth: usize, left: usize) -> String {
        let mut said = String::new();
        for _ in 0..self.chance.random_range(1..3) {
            let one = match self.chance.random_range(0..if left == 0 { 4 } else { 10 }) {
                0 => format!("check {}", self.condition()),
                1 => format!("let x = height(o) + {}\nlift(o, by: x)", self.pick(&["1 cm", "by"])),
                2 => format!("break when {}\n{}", self.condition(), self.act(depth)),
                3 => self.act(depth),
                4 => format!(
                    "either a prior 0.2 {}\nor b when {} {}",
                    self.block(depth, left),
                    self.condition(),
                    self.block(depth, left)
                ),
                5 => format!(
                    "if {} {} else {}",
                    self.condition(),
                    self.block(depth, left),
                    self.block(depth, left)
                ),
                6 => format!(
                    "repeat upto 3 times {} until {}",
                    self.block(depth, left),
                    self.condition()
                ),
                7 => format!("repeat upto 2 times {}", self.block(depth, left)),
                8 => {
                    self.labels += 1;
                    let n = self.labels;
                    let (a, b) = (self.call(0), self.call(0));
                    format!(
                        "together {{ {a} as s{n}\n{b} then go(o, by) \n go(jar, 1 cm) as e{n}\ntiming s{n} overlaps e{n} by 20 ms }}"
                    )
                }
                _ => format!("{} while {}", self.block(depth, left), self.condition()),
            };
            let _ = writeln!(said, "{one}");
        }
        said
    }

    fn block(&mut self, depth: usize, left: usize) -> String {
        let steps = self.steps(depth, left - 1);
        let recovery = if self.chance.random_bool(0.2) {
            "on failure of go { retry other upto 2 times }"
        } else {
            ""
        };
        format!("{{ {steps} {recovery} }}")
    }
}

#[test]
fn random_texts_come_back_from_their_graphs() {
    let mut nodes = 0;
    for seed in 0..40 {
        let mut writer =
            Writer { chance: StdRng::seed_from_u64(seed), text: String::new(), labels: 0 };
        for depth in 0..3 {
            let steps = writer.steps(depth, 2);
            let needs = writer.condition();
            let _ = writeln!(
                writer.text,
                "task t{depth}(o: Graspable, by: Length) {{\n needs {needs}\n{steps}\non failure {{ abort }}\n}}"
            );
        }
        writer.text += "fluent near(a: Graspable, b: Graspable, by: Length = 5 cm) = distance(a, b) <= by ask \"Is the {a} near the {b}?\"\n\
            action go(o: Graspable, by: Length) { needs near(o, cup, by: by) run \"go.rhai\" }\n\
            action lift(o: Graspable, by: Length) { gives height(o) >= by run \"lift.rhai\" }\n\
            t2(jar, 6 cm)\n";
        let (program, wrong) = parse(&writer.text);
        assert!(wrong.is_empty(), "{}\n{wrong:?}", writer.text);
        let Some(Item::Run(Step::Act(act))) = program.items.last() else { panic!() };
        // Loops in loops may be too much for any graph.
        let Ok(graph) = graph::build(&program, &act.call.clone()) else { continue };
        if graph.nodes().len() > 1500 {
            continue;
        }
        nodes += graph.nodes().len();
        comes_back(&graph);
    }
    assert!(nodes > 2000, "{nodes} nodes");
}

/// The example of the exchange format, with its other branch and its step before `grasp` filled in.
#[test]
fn a_short_file_of_another_program_is_read() {
    let theirs = json!({"format": "stc-aog", "version": 1, "root": "pick",
        "nodes": [{"id": "pick", "ao": "and", "stc": "T", "span": ["std.task", 736, 1172]},
            {"id": "pick/either", "ao": "or", "stc": "T"},
            {"id": "pick/either.side", "ao": "and", "prior": {"count": 7, "of": 10},
                "success": {"real": [9, 1], "twin": [41, 3]}, "guard": "tall(o)"},
            {"id": "pick/either.top", "ao": "and"},
            {"id": "pick/either.side/approach", "ao": "leaf", "stc": "T", "action": "approach", "args": {"o": "$o"}},
            {"id": "pick/either.side/grasp", "ao": "leaf", "stc": "T", "action": "grasp",
                "args": {"o": "$o", "face": "side"}, "script": "grasp.rhai"},
            {"id": "f:holding", "stc": "F", "expr": "contact(gripper,o) and height(o) > 1 cm",
                "ask": "Has the robot picked up the {o}?"}],
        "edges": [{"from": "pick", "to": "pick/either", "order": 0},
            {"from": "pick/either", "to": "pick/either.side", "order": 0},
            {"from": "pick/either", "to": "pick/either.top", "order": 1},
            {"from": "pick/either.side", "to": "pick/either.side/approach", "order": 0},
            {"from": "pick/either.side", "to": "pick/either.side/grasp", "order": 1},
            {"rel": "meets", "a": "pick/either.side/approach", "b": "pick/either.side/grasp"},
            {"rel": "gives", "a": "pick/either.side/grasp", "b": "f:holding"}]});
    let graph = from_json(&theirs).unwrap();
    let NodeKind::Or(or) = &graph.find("pick/either").unwrap().kind else { panic!() };
    let priors: Vec<String> =
        or.branches.iter().map(|b| format!("{} {:.1}", b.name, b.prior)).collect();
    assert_eq!(priors, ["side 0.7", "top 0.3"]);
    assert_eq!(graph.find("pick/either.side/grasp").unwrap().key, "pick/either.side/grasp");
    assert_eq!(graph.relations.len(), 2);
    // Every field of theirs is one of ours, with the same meaning.
    let ours = to_json(&graph, &Learnt::default());
    for node in theirs["nodes"].as_array().unwrap() {
        let all = ours["nodes"].as_array().unwrap();
        let mine = all.iter().find(|mine| mine["id"] == node["id"]).unwrap();
        for key in node.as_object().unwrap().keys().filter(|key| *key != "success") {
            assert!(mine.get(key).is_some(), "no {key} in {mine}");
        }
    }
}

/// A grammar that adds up, without a name that leads nowhere.
#[test]
fn the_grammar_has_a_rule_for_every_name_and_shares_that_add_up() {
    let grammar = to_pcfg(&of_line("pour(jar, cup)"));
    let rules: Vec<(&str, &str)> = grammar
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(" -> ").or(line.split_once(" ->")).unwrap())
        .collect();
    assert_eq!(rules[0].0, "pour");
    let mut words = 0;
    for (name, right) in &rules {
        let mut total = 0.0;
        for way in right.split(" | ") {
            let (symbols, share) = way.rsplit_once('[').unwrap();
            total += share.trim_end_matches(']').parse::<f64>().unwrap();
            let quoted = symbols.split('\'');
            for (i, part) in quoted.enumerate() {
                if i % 2 == 1 {
                    words += 1;
                    continue;
                }
                for symbol in part.split_whitespace() {
                    assert!(rules.iter().any(|(known, _)| *known == symbol), "{symbol} of {name}");
                }
            }
        }
        assert!((total - 1.0).abs() < 1e-9, "{name}: {total}");
    }
    assert!(words > 10 && grammar.contains("pour_pick_either_level_side [0.6]"), "{grammar}");
}
