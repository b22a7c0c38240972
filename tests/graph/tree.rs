//! Syntax trees by hand, short enough to read: what a parser would give for the text beside them.

use trueup::language::ast::*;
use trueup::units::{Dimension, Quantity};

pub(crate) fn at() -> Span {
    Span::default()
}

pub(crate) fn name(text: &str) -> Name {
    Name { text: text.into(), span: at() }
}

pub(crate) fn expr(kind: ExprKind) -> Expr {
    Expr { kind, span: at() }
}

/// `jar`, or `gripper.open`.
pub(crate) fn n(text: &str) -> Expr {
    match text.split_once('.') {
        Some((of, member)) => expr(ExprKind::Member(Box::new(n(of)), name(member))),
        None => expr(ExprKind::Name(text.into())),
    }
}

pub(crate) fn quantity(value: f64, dimension: Dimension) -> Quantity {
    Quantity { value, dimension }
}

pub(crate) fn length(metres: f64) -> Quantity {
    quantity(metres, Dimension { length: 1, ..Dimension::default() })
}

pub(crate) fn m(metres: f64) -> Expr {
    expr(ExprKind::Literal(length(metres)))
}

pub(crate) fn ml(millilitres: f64) -> Expr {
    let dimension = Dimension { length: 3, ..Dimension::default() };
    expr(ExprKind::Literal(quantity(millilitres * 1e-6, dimension)))
}

pub(crate) fn deg(degrees: f64) -> Expr {
    let dimension = Dimension { angle: 1, ..Dimension::default() };
    expr(ExprKind::Literal(quantity(degrees.to_radians(), dimension)))
}

pub(crate) fn number(value: f64) -> Expr {
    expr(ExprKind::Literal(quantity(value, Dimension::default())))
}

/// `name(a, b)`; an argument `("by", x)` is `by: x`, and `("", x)` is bare.
pub(crate) fn call_with(text: &str, args: Vec<(&str, Vec<Expr>)>) -> Call {
    let args = args.into_iter().map(|(key, values)| Arg {
        name: (!key.is_empty()).then(|| name(key)),
        values,
        span: at(),
    });
    Call { name: name(text), args: args.collect(), span: at() }
}

pub(crate) fn call(text: &str, args: &[&str]) -> Call {
    call_with(text, args.iter().map(|a| ("", vec![n(a)])).collect())
}

pub(crate) fn f(text: &str, args: &[&str]) -> Expr {
    expr(ExprKind::Call(call(text, args)))
}

pub(crate) fn fe(text: &str, args: Vec<Expr>) -> Expr {
    let args = args.into_iter().map(|a| ("", vec![a])).collect();
    expr(ExprKind::Call(call_with(text, args)))
}

pub(crate) fn two(a: Expr, op: BinaryOp, b: Expr) -> Expr {
    expr(ExprKind::Binary(Box::new(a), op, Box::new(b)))
}

pub(crate) fn and(a: Expr, b: Expr) -> Expr {
    two(a, BinaryOp::And, b)
}

pub(crate) fn or(a: Expr, b: Expr) -> Expr {
    two(a, BinaryOp::Or, b)
}

pub(crate) fn not(a: Expr) -> Expr {
    expr(ExprKind::Not(Box::new(a)))
}

pub(crate) fn within(a: Expr, by: Expr) -> Expr {
    expr(ExprKind::Within(Box::new(a), Box::new(by)))
}

pub(crate) fn param(text: &str, ty: &str, default: Option<Expr>) -> Param {
    Param { name: name(text), ty: name(ty), default }
}

/// `o: Graspable, face: Face`.
pub(crate) fn params(text: &str) -> Vec<Param> {
    let each = text.split(',').map(str::trim).filter(|t| !t.is_empty());
    each.map(|t| t.split_once(": ").unwrap()).map(|(a, b)| param(a, b, None)).collect()
}

pub(crate) fn fluent(text: &str, params: Vec<Param>, body: Expr, ask: Option<&str>) -> Item {
    Item::Fluent(FluentItem {
        doc: Vec::new(),
        name: name(text),
        params,
        body,
        ask: ask.map(|ask| Text { text: ask.to_owned(), span: at() }),
        span: at(),
    })
}

pub(crate) fn action(text: &str, params: Vec<Param>, needs: Vec<Expr>, gives: Vec<Expr>) -> Item {
    Item::Action(ActionItem {
        doc: Vec::new(),
        was: Vec::new(),
        name: name(text),
        params,
        say: Vec::new(),
        conditions: Conditions { needs, keeps: Vec::new(), gives },
        script: Some((format!("{text}.rhai"), at())),
        limit: None,
        span: at(),
    })
}

pub(crate) fn task(text: &str, params: Vec<Param>, steps: Vec<Step>) -> TaskItem {
    TaskItem {
        doc: Vec::new(),
        was: Vec::new(),
        name: name(text),
        params,
        say: Vec::new(),
        conditions: Conditions::default(),
        limit: None,
        steps,
        recoveries: Vec::new(),
        span: at(),
    }
}

pub(crate) fn block(steps: Vec<Step>) -> Block {
    Block { steps, recoveries: Vec::new(), holds: Vec::new(), label: None, span: at() }
}

pub(crate) fn act(call: Call) -> Step {
    act_as(call, Vec::new(), None)
}

pub(crate) fn act_as(call: Call, holds: Vec<Hold>, label: Option<&str>) -> Step {
    let via = Vec::new();
    Step::Act(Act { call, via, holds, label: label.map(name), span: at() })
}

/// A branch: its name, prior, guard and steps.
pub(crate) type Way<'a> = (&'a str, Option<f64>, Option<Expr>, Vec<Step>);

pub(crate) fn either(branches: Vec<Way<'_>>) -> Step {
    let branches = branches.into_iter().map(|(branch, prior, when, steps)| Branch {
        name: name(branch),
        was: Vec::new(),
        prior,
        when,
        block: block(steps),
    });
    Step::Either(Either { branches: branches.collect(), span: at() })
}

pub(crate) fn timing(a: &str, relation: Allen, b: &str, by: Option<f64>) -> Timing {
    let time = Dimension { time: 1, ..Dimension::default() };
    let by = by.map(|s| Literal { quantity: quantity(s, time), span: at() });
    Timing { a: name(a), relation, b: name(b), by, span: at() }
}

pub(crate) fn program(items: Vec<Item>) -> Program {
    Program { items }
}

/// The stdlib of LANGUAGE 2.1: pick, place and pour, with their fluents and actions.
pub(crate) fn pouring() -> Program {
    let tasks = [pick(), place(), pour()].map(Item::Task);
    program(fluents().into_iter().chain(actions()).chain(tasks).collect())
}

fn graspable() -> Vec<Param> {
    params("o: Graspable")
}

fn pick() -> TaskItem {
    let mut pick = task(
        "pick",
        graspable(),
        vec![
            either(vec![
                (
                    "side",
                    Some(0.7),
                    Some(f("tall", &["o"])),
                    vec![act(call("approach", &["o", "side"])), act(call("grasp", &["o", "side"]))],
                ),
                (
                    "top",
                    Some(0.3),
                    None,
                    vec![act(call("approach", &["o", "top"])), act(call("grasp", &["o", "top"]))],
                ),
            ]),
            act_as(
                call_with("lift", vec![("", vec![n("o")]), ("by", vec![m(0.12)])]),
                vec![Hold::While(f("holding", &["o"]))],
                None,
            ),
        ],
    );
    pick.conditions.needs = vec![and(f("visible", &["o"]), not(f("holding", &["any"])))];
    pick.conditions.gives = vec![f("holding", &["o"])];
    pick.recoveries = vec![Recovery {
        of: Some(call("grasp", &["o"])),
        steps: vec![act(call("open_gripper", &[]))],
        remedy: Some(Remedy::Retry { other: true, times: 2 }),
        span: at(),
    }];
    pick
}

fn place() -> TaskItem {
    let mut place = task(
        "place",
        params("o: Graspable, at: Place"),
        vec![
            act_as(call("move_over", &["o", "at"]), vec![Hold::While(f("level", &["o"]))], None),
            act_as(
                call("lower", &["o"]),
                vec![Hold::Until(two(f("height", &["o"]), BinaryOp::Le, m(0.002)))],
                None,
            ),
            Step::Sequence(
                vec![
                    act(call("open_gripper", &[])),
                    act(call_with("retreat", vec![("up", vec![m(0.1)])])),
                ],
                at(),
            ),
        ],
    );
    place.conditions.needs = vec![f("holding", &["o"])];
    place.conditions.gives = vec![not(f("holding", &["o"]))];
    place
}

fn pour() -> TaskItem {
    let amount = two(number(0.9), BinaryOp::Mul, f("filled", &["source"]));
    let mut pour = task(
        "pour",
        vec![
            param("source", "Container", None),
            param("target", "Container", None),
            param("amount", "Volume", Some(amount)),
        ],
        vec![
            Step::If(If {
                condition: f("lidded", &["source"]),
                then: block(vec![act(call("unlid", &["source"]))]),
                otherwise: None,
                span: at(),
            }),
            act(call("pick", &["source"])),
            raise_while_moving(),
            Step::Check(f("above", &["source", "target"]), at()),
            act_as(
                call_with("pour_out", vec![("", vec![n("source")]), ("to", vec![deg(100.0)])]),
                vec![
                    Hold::While(f("above", &["source", "target"])),
                    Hold::Until(two(f("volume", &["target"]), BinaryOp::Ge, n("amount"))),
                ],
                None,
            ),
            act(call("untilt", &["source"])),
            act(call_with(
                "place",
                vec![("", vec![n("source")]), ("at", vec![n("tray"), n("table")])],
            )),
        ],
    );
    pour.conditions.needs = vec![f("near", &["source", "target"])];
    pour.conditions.gives = vec![
        two(f("volume", &["target"]), BinaryOp::Ge, n("amount")),
        two(f("spilt", &[]), BinaryOp::Le, ml(5.0)),
    ];
    pour.recoveries = vec![Recovery {
        of: None,
        steps: vec![act(call("untilt", &["source"]))],
        remedy: Some(Remedy::Abort(Some("stopped with the jar upright".into()))),
        span: at(),
    }];
    pour
}

/// Up and over the target at once.
fn raise_while_moving() -> Step {
    Step::Together(Together {
        steps: vec![
            act_as(
                call_with("raise", vec![("", vec![n("source")]), ("by", vec![m(0.15)])]),
                Vec::new(),
                Some("rising"),
            ),
            act_as(
                call("move_over", &["source", "target"]),
                vec![Hold::While(f("level", &["source"]))],
                Some("moving"),
            ),
        ],
        timings: vec![timing("rising", Allen::Overlaps, "moving", Some(0.3))],
        span: at(),
    })
}

fn fluents() -> Vec<Item> {
    let lip_to_centre = fe("offset", vec![f("lip", &["a"]), f("center", &["b"])]);
    let inside = two(f("rim", &["b"]), BinaryOp::Sub, m(0.005));
    vec![
        fluent(
            "holding",
            graspable(),
            and(f("contact", &["gripper", "o"]), two(f("height", &["o"]), BinaryOp::Gt, m(0.01))),
            Some("Has the robot already picked up the {o}?"),
        ),
        fluent(
            "above",
            params("a: Container, b: Container"),
            and(
                two(lip_to_centre, BinaryOp::Le, inside),
                two(f("gap", &["a", "b"]), BinaryOp::Ge, m(0.03)),
            ),
            Some("Is the {a} above the {b}?"),
        ),
        fluent(
            "near",
            vec![
                param("a", "Graspable", None),
                param("b", "Graspable", None),
                param("by", "Length", Some(m(0.6))),
            ],
            two(f("distance", &["a", "b"]), BinaryOp::Le, n("by")),
            None,
        ),
        fluent(
            "level",
            params("o: Container"),
            within(two(f("tilt", &["o"]), BinaryOp::Eq, deg(0.0)), deg(10.0)),
            None,
        ),
    ]
}

fn actions() -> Vec<Item> {
    vec![
        action("approach", params("o: Graspable, face: Face"), vec![n("gripper.open")], vec![]),
        action(
            "grasp",
            params("o: Graspable, face: Face"),
            vec![and(f("reachable", &["o", "face"]), n("gripper.open"))],
            vec![f("contact", &["gripper", "o"])],
        ),
        action("lift", params("o: Graspable, by: Length"), vec![], vec![f("holding", &["o"])]),
        action("raise", params("o: Graspable, by: Length"), vec![f("holding", &["o"])], vec![]),
        action(
            "move_over",
            params("o: Graspable, at: Place"),
            vec![f("holding", &["o"])],
            vec![f("above", &["o", "at"])],
        ),
        action("pour_out", params("o: Container, to: Angle"), vec![f("holding", &["o"])], vec![]),
        action("untilt", graspable(), vec![], vec![f("level", &["o"])]),
        action("lower", graspable(), vec![f("holding", &["o"])], vec![]),
        action("open_gripper", vec![], vec![], vec![n("gripper.open")]),
        action("retreat", params("up: Length"), vec![], vec![]),
        action("unlid", graspable(), vec![], vec![not(f("lidded", &["o"]))]),
    ]
}
