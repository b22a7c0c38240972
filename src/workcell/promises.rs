//! What a call and the tasks that it is made of promise, and what is made of that when all is done.
//!
//! The call's own promises are read at the end. Those of its parts were read when the part was over, and may have been undone
//! since, as they should. What nobody knew then, or nobody knows any more, is read again at the end, one part of an `and` by
//! itself: a photograph may have settled it. Where a later step acted on the things it speaks of, the end tells
//! nothing of what was: what was unknown stays so unless it is true, and never makes a run fail.

use std::collections::BTreeSet;

use crate::graph::Condition;
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::text;
use crate::trace::{Deed, StepRecord};
use crate::world::{Scene, WorldState, support};

use super::Run;

/// Something promised.
pub(super) struct Promise<'r> {
    /// What.
    pub(super) condition: Condition,
    /// The world after the step that gave it.
    pub(super) after: &'r WorldState,
    /// Whether the call itself promises it, not a part of it.
    is_of_call: bool,
    /// Whether a later step acted on what it speaks of.
    pub(super) is_past: bool,
}

/// What became of what was promised.
pub(super) enum Verdict<'p, 'r> {
    /// All that matters at the end is true.
    Kept,
    /// This is false.
    Broken(&'p Condition),
    /// Nobody knows of this.
    Unknown(&'p Promise<'r>),
}

/// Returns what the call at `root` and the tasks that it is made of promise, in the order of the steps that gave it.
pub(super) fn promises<'r>(run: &'r Run, root: &str, scene: &Scene) -> Vec<Promise<'r>> {
    let steps = run.parse_graphs.last().map_or(&[][..], |pg| &pg.steps);
    let mut found = Vec::new();
    for step in steps {
        let Some(at) = run.steps.iter().rposition(|done| done.path == step.path) else { continue };
        let (after, later) = (&run.steps[at].measured, &run.steps[at + 1..]);
        for given in &step.gives {
            if given.owner == root {
                let condition = given.clone();
                found.push(Promise { condition, after, is_of_call: true, is_past: false });
            } else if given.owner.rsplit_once('/').is_some_and(|(above, _)| above == root) {
                found.extend(parts(given, after, later, scene));
            }
        }
    }
    found
}

/// Judges what was promised by the world at the end; `truth` reads a closed expression in a world.
pub(super) fn judge<'p, 'r>(
    promises: &'p [Promise<'r>],
    end: &WorldState,
    truth: &dyn Fn(&Expr, &WorldState) -> Option<bool>,
) -> Verdict<'p, 'r> {
    let mut unknown = None;
    for promise in promises {
        let expr = &promise.condition.expr;
        let now = truth(expr, end);
        let matters = promise.is_of_call
            || (now.is_none() && !promise.is_past)
            || truth(expr, promise.after).is_none();
        if !matters || now == Some(true) {
            continue;
        }
        if now == Some(false) && !promise.is_past {
            return Verdict::Broken(&promise.condition);
        }
        unknown = unknown.or(Some(promise));
    }
    unknown.map_or(Verdict::Kept, Verdict::Unknown)
}

/// Takes apart what a part of the call gave; `later` are the steps after the one that gave it.
fn parts<'r>(
    given: &Condition,
    after: &'r WorldState,
    later: &[StepRecord],
    scene: &Scene,
) -> Vec<Promise<'r>> {
    let acted_on = acted_on(after, later);
    let is_acted_on = |thing: &str| {
        // What stands on a thing, or in it, goes with it.
        let pile = support::pile(scene, &after.objects, thing);
        pile.iter().any(|on| acted_on.contains(on.as_str()))
            || (thing == "any" && !acted_on.is_empty())
    };
    let promised = |part: &Expr| {
        let condition = Condition { text: text::expr(part), expr: part.clone(), ..given.clone() };
        let mut is_past = false;
        things(part, &mut |thing| is_past |= is_acted_on(thing));
        Promise { condition, after, is_of_call: false, is_past }
    };
    conjuncts(&given.expr).into_iter().map(promised).collect()
}

/// Returns what must all be true for `expr` to be.
fn conjuncts(expr: &Expr) -> Vec<&Expr> {
    match &expr.kind {
        ExprKind::Binary(a, BinaryOp::And, b) => [conjuncts(a), conjuncts(b)].concat(),
        _ => vec![expr],
    }
}

/// Tells every name whose thing an expression speaks of as it is now.
fn things(expr: &Expr, tell: &mut dyn FnMut(&str)) {
    match &expr.kind {
        ExprKind::Name(name) => tell(name),
        // Where a thing stood when the run began does not change with it.
        ExprKind::Call(call) if call.name.text == "start_of" => {}
        ExprKind::Call(call) => {
            for value in call.args.iter().flat_map(|arg| &arg.values) {
                things(value, tell);
            }
        }
        ExprKind::Member(inner, _) | ExprKind::Not(inner) | ExprKind::Negate(inner) => {
            things(inner, tell);
        }
        ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => {
            things(a, tell);
            things(b, tell);
        }
        ExprKind::Literal(_) | ExprKind::Text(_) | ExprKind::Bool(_) | ExprKind::Bad => {}
    }
}

/// Returns what steps took, carried, pushed, poured from or into, or let go, in a world that was `before`.
fn acted_on<'a>(before: &'a WorldState, steps: &'a [StepRecord]) -> BTreeSet<&'a str> {
    let mut held = before.held.as_deref();
    let mut found = BTreeSet::new();
    for step in steps {
        for deed in step.deeds() {
            match deed {
                Deed::Took { object } | Deed::Pushed { object } | Deed::SetDown { object } => {
                    found.insert(object.as_str());
                }
                Deed::Turned { source, target } => {
                    found.extend([source.as_str(), target.as_str()]);
                }
                Deed::Released | Deed::TurnedBack => found.extend(held),
            }
        }
        held = step.measured.held.as_deref();
        found.extend(held);
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::graph::Role;
    use crate::language::ast::Item;
    use crate::language::parse;
    use crate::trace::{Line, Outcome};
    use crate::world::object::vessel;
    use crate::world::{Object, ObjectState, Pose, Shape, scene};

    fn table() -> Scene {
        let cube = |name: &str| {
            let shape = Shape::Cuboid { size: Vector3::repeat(0.05) };
            Object { name: name.into(), cavity: None, ..vessel(shape, 1e-3) }
        };
        scene::bare(vec![cube("red"), cube("rider"), cube("can")])
    }

    /// A world at a time, s: `rider` stands on `red`, `can` beside them.
    fn standing(time: f64) -> WorldState {
        let things = [("red", 0.4, 0.0), ("rider", 0.4, 0.05), ("can", 0.6, 0.0)];
        let objects = things.map(|(name, x, z)| ObjectState {
            name: name.into(),
            world_from_object: Some(Pose::upright(x, 0.0, z, 0.0)),
            std: 3e-4,
            water: None,
        });
        WorldState {
            time,
            q: vec![0.0; 7],
            opening: 0.08,
            world_from_tool: Pose::upright(0.4, 0.0, 0.3, 0.0),
            held: None,
            objects: objects.to_vec(),
            spilt: None,
            unknown: Vec::new(),
        }
    }

    /// A step that did this, after which nothing is held.
    fn step(deed: Deed) -> StepRecord {
        let line = Line {
            script: "act.rhai".into(),
            line: 7,
            text: "arm.act();".into(),
            does: "act".into(),
            at_s: 0.0,
            deed: Some(deed),
        };
        StepRecord {
            number: 1,
            path: "call/act".into(),
            action: "act()".into(),
            call: None,
            outcome: Outcome::Success,
            not_needed: None,
            reason: None,
            failure: None,
            interval_s: [0.0, 1.0],
            fluents: Vec::new(),
            during: Vec::new(),
            lines: vec![line],
            planned_q: Vec::new(),
            hamming: 0,
            score: 1.0,
            measured: standing(5.0),
            twin: None,
        }
    }

    fn push() -> StepRecord {
        step(Deed::Pushed { object: "red".into() })
    }

    fn given(promised: &str) -> Condition {
        let (program, _) = parse(&format!("task t() {{\n    gives {promised}\n    look()\n}}\n"));
        let Item::Task(task) = &program.items[0] else { panic!("{promised}") };
        let expr = task.conditions.gives[0].clone();
        let text = text::expr(&expr);
        Condition { text, expr, owner: "call/put".into(), role: Role::Gives, asks: Vec::new() }
    }

    /// What is told of the promise of a first `put` of `red`, whose parts are worth these, then and at the end.
    fn told(later: &[StepRecord], worth: [[Option<bool>; 2]; 2]) -> String {
        let [after, end] = [standing(0.0), standing(9.0)];
        let promised = given("upright(red) and rests_on(red, left_of(can))");
        let promises = parts(&promised, &after, later, &table());
        let truth = |expr: &Expr, state: &WorldState| {
            let part = usize::from(text::expr(expr).starts_with("rests_on"));
            worth[part][usize::from(state.time > 1.0)]
        };
        match judge(&promises, &end, &truth) {
            Verdict::Kept => "kept".into(),
            Verdict::Broken(condition) => format!("broken: {}", condition.text),
            Verdict::Unknown(promise) => format!("unknown: {}", promise.condition.text),
        }
    }

    /// `swap` failed: nobody knew whether the die was upright when it was put aside, so at the end, when it stood where it should,
    /// it had to stand where it was put aside as well.
    #[test]
    fn what_a_later_step_moved_does_not_fail_for_where_it_stood_between() {
        let later = [push()];
        let (yes, no) = (Some(true), Some(false));
        assert_eq!(told(&later, [[None, yes], [yes, no]]), "kept");
        assert_eq!(told(&later, [[None, None], [yes, no]]), "unknown: upright(red)");
        assert_eq!(told(&later, [[yes, yes], [None, no]]), "unknown: rests_on(red, left_of(can))");
        assert_eq!(told(&later, [[yes, None], [yes, None]]), "kept");
    }

    #[test]
    fn what_nothing_moved_is_judged_by_the_end_where_it_was_unknown() {
        let (yes, no) = (Some(true), Some(false));
        assert_eq!(told(&[], [[None, yes], [None, yes]]), "kept");
        assert_eq!(told(&[], [[yes, yes], [None, no]]), "broken: rests_on(red, left_of(can))");
        assert_eq!(told(&[], [[yes, None], [yes, yes]]), "unknown: upright(red)");
        // A part that was true may have been undone, as it should; the one beside it is not in doubt with it.
        assert_eq!(told(&[], [[None, yes], [yes, no]]), "kept");
    }

    #[test]
    fn a_step_acts_on_what_it_lets_go_and_on_what_goes_with_a_thing() {
        let mut after = standing(0.0);
        let is_past = |promised: &str, after: &WorldState, step: StepRecord| {
            parts(&given(promised), after, &[step], &table())[0].is_past
        };
        assert!(is_past("upright(rider)", &after, push()));
        assert!(is_past("not rests_on(any, table)", &after, push()));
        assert!(is_past("rests_on(can, next_to(red))", &after, push()));
        assert!(!is_past("rests_on(can, start_of(red))", &after, push()));
        assert!(!is_past("gripper.open", &after, push()));
        assert!(!is_past("upright(can)", &after, step(Deed::Released)));
        after.held = Some("can".into());
        assert!(is_past("upright(can)", &after, step(Deed::Released)));
    }
}
