//! The forms a step can take, each as nodes.

use super::error::{BadPriors, Obstacle};
use super::{Builder, Place, Request, holding};
use crate::graph::{
    And, Branch, Decides, Does, Form, Holding, NodeId, NodeKind, Or, Pause, Relation, Role,
    Terminal,
};
use crate::language::ast::{
    self, Act, Allen, Block, Each, Either, Expr, ExprKind, If, Param, Recovery, Repeat, Span, Step,
    Together,
};
use crate::language::bind::{self, Scope};
use crate::language::text;

/// The orders in which a `for` goes through its things, and how likely people take them. Chosen: the order of the scene
/// is what a person expects; backwards is another way where that one is blocked.
const ORDERS: [(&str, f64); 2] = [("in_order", 0.7), ("backwards", 0.3)];

impl Builder<'_> {
    /// Expands steps that follow one another, and notes that each meets the next.
    pub(super) fn sequence(
        &mut self,
        steps: &[Step],
        scope: &mut Scope,
        place: &Place,
    ) -> Vec<NodeId> {
        let mut children: Vec<NodeId> = Vec::new();
        let mut pause = None;
        for step in steps {
            if let Step::Break(stop) = step {
                let when = stop.when.as_ref().map(|when| bind::fill(when, scope));
                pause = Some(Pause { when });
                continue;
            }
            let made = children.len();
            self.step(step, scope, place, &mut children);
            if let Some(next) = children.get(made) {
                self.nodes[next.idx()].pause = pause.take();
            }
        }
        for pair in children.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            self.relations.push(Relation::Temporal { a, allen: Allen::Meets, b, by: None });
        }
        children
    }

    fn step(&mut self, step: &Step, scope: &mut Scope, place: &Place, into: &mut Vec<NodeId>) {
        match step {
            Step::Act(act) => into.extend(self.act(act, scope, place)),
            // One after the other is what a body is anyway.
            Step::Sequence(steps, _) => {
                for inner in steps {
                    self.step(inner, scope, place, into);
                }
            }
            Step::Block(block) => into.push(self.block(block, scope, place, "/block")),
            Step::Either(either) => into.extend(self.either(either, scope, place)),
            Step::If(branch) => into.push(self.decided(branch, scope, place)),
            Step::Repeat(repeat) => into.extend(self.repeat(repeat, scope, place)),
            Step::Each(each) => into.extend(self.each(each, scope, place)),
            Step::Together(together) => into.push(self.together(together, scope, place)),
            Step::Check(what, span) => into.push(self.check(what, *span, scope, place)),
            Step::Let(name, value, span) => {
                let mut unique = name.text.clone();
                for n in 2.. {
                    if self.lets.insert(unique.clone()) {
                        break;
                    }
                    unique = format!("{}_{n}", name.text);
                }
                let value = bind::fill(value, scope);
                let label = format!("let {unique} = {}", text::expr(&value));
                let (id, _) = self.open(place, &format!("let_{}", name.text), label, *span);
                let does = Does::Let { name: unique.clone(), value };
                self.set(id, NodeKind::Terminal(Terminal::of(does)));
                let stands_for = Expr { kind: ExprKind::Name(unique), span: name.span };
                scope.insert(name.text.clone(), stands_for);
                into.push(id);
            }
            // A breakpoint marks the step that follows it: see `sequence`.
            Step::Break(_) => {}
            Step::Bad(span) => self.problem(&Obstacle::Unreadable, *span, &place.within),
        }
    }

    fn act(&mut self, act: &Act, scope: &Scope, place: &Place) -> Option<NodeId> {
        let holding = holding(&act.holds, scope);
        let segment = act.label.as_ref().unwrap_or(&act.call.name).text.clone();
        let request =
            Request { call: &act.call, via: &act.via, label: act.label.as_ref(), holding };
        self.invoke(&request, scope, place, &segment)
    }

    /// Expands `{ … }`; `tail` is how its path goes on: `/block`, `.side`.
    fn block(&mut self, block: &Block, scope: &Scope, place: &Place, tail: &str) -> NodeId {
        let named = block.label.as_ref().map(|label| format!("/{}", label.text));
        let tail = named.as_deref().unwrap_or(tail);
        let label = tail.trim_start_matches(['/', '.']).to_owned();
        let (id, inside) = self.open_as(place, tail, label, block.span);
        let mut scope = scope.clone();
        let children = self.sequence(&block.steps, &mut scope, &inside);
        let recoveries = self.recoveries(&block.recoveries, &scope, &inside);
        let holding = holding(&block.holds, &scope);
        self.note_holding(id, &holding);
        let and = And { children, holding, recoveries, ..And::empty(Form::Sequence) };
        self.set(id, NodeKind::And(and));
        id
    }

    fn either(&mut self, either: &Either, scope: &Scope, place: &Place) -> Option<NodeId> {
        let written: Vec<Option<f64>> = either.branches.iter().map(|b| b.prior).collect();
        let priors = match priors(&written) {
            Ok(priors) => priors,
            Err(why) => {
                self.problem(&why.into(), either.span, &place.within);
                return None;
            }
        };
        let (id, inside) = self.open(place, "either", "either".into(), either.span);
        let mut branches = Vec::new();
        for (branch, prior) in either.branches.iter().zip(priors) {
            let tail = format!(".{}", branch.name.text);
            let node = self.block(&branch.block, scope, &inside, &tail);
            let guard = branch.when.as_ref().map(|when| bind::fill(when, scope));
            if let Some(guard) = &guard {
                self.conditions.push((node, Role::Guard, guard.clone()));
            }
            let key = self.nodes[node.idx()].key.clone();
            branches.push(Branch {
                name: branch.name.text.clone(),
                prior,
                guard,
                was: self.old_keys(&key, branch, place),
                key,
                text: self.fingerprint_block(&branch.block),
                node,
            });
        }
        self.set(id, NodeKind::Or(Or { decides: Decides::Choice, via: None, branches }));
        Some(id)
    }

    /// `if φ {…} else {…}`: an Or that φ decides.
    fn decided(&mut self, branch: &If, scope: &Scope, place: &Place) -> NodeId {
        let condition = bind::fill(&branch.condition, scope);
        let label = format!("if {}", text::expr(&condition));
        let (id, inside) = self.open(place, "if", label, branch.span);
        let then = self.block(&branch.then, scope, &inside, ".then");
        let otherwise = match &branch.otherwise {
            Some(block) => self.block(block, scope, &inside, ".else"),
            None => self.skip(&inside, ".else", branch.span),
        };
        self.conditions.push((then, Role::Guard, condition.clone()));
        let decides = Decides::Condition(condition);
        let branches = vec![self.branch("then", 0.5, then), self.branch("else", 0.5, otherwise)];
        self.set(id, NodeKind::Or(Or { decides, via: None, branches }));
        id
    }

    /// The keys a branch had under the old names of its own and of the task it is written in.
    fn old_keys(&self, key: &str, branch: &ast::Branch, place: &Place) -> Vec<String> {
        let task = self.definitions.task(&place.within);
        let tasks = task.into_iter().flat_map(|task| &task.was).map(|was| was.text.as_str());
        let names = branch.was.iter().map(|was| was.text.as_str());
        let names: Vec<&str> = names.chain([branch.name.text.as_str()]).collect();
        let own = place.within.as_str();
        let stem = key.strip_suffix(branch.name.text.as_str()).unwrap_or(key);
        let below = stem.strip_prefix(own).unwrap_or(stem);
        let all = tasks.chain([own]);
        let all = all.flat_map(|task| names.iter().map(move |name| format!("{task}{below}{name}")));
        all.filter(|old| old != key).collect()
    }

    fn repeat(&mut self, repeat: &Repeat, scope: &Scope, place: &Place) -> Option<NodeId> {
        if repeat.times == 0 {
            self.problem(&Obstacle::NoRound, repeat.span, &place.within);
            return None;
        }
        let until = repeat.until.as_ref().map(|until| bind::fill(until, scope));
        let label = format!("repeat upto {} times", repeat.times);
        let (id, inside) = self.open(place, "repeat", label, repeat.span);
        let mut children = Vec::new();
        let Some(until) = until else {
            for round in 1..=repeat.times {
                if self.is_full(repeat.span, &place.within) {
                    break;
                }
                children.push(self.block(&repeat.block, scope, &inside, &format!("/{round}")));
            }
            self.meets(&children);
            self.set(id, NodeKind::And(And { children, ..And::empty(Form::Repeat) }));
            return Some(id);
        };
        children.push(self.block(&repeat.block, scope, &inside, "/1"));
        if repeat.times > 1 {
            children.extend(self.rounds(2, repeat, &until, scope, &inside));
        }
        // The loop is for something: when the rounds are used up and φ is still false, that is a failure.
        children.push(self.check(&until, repeat.span, &Scope::new(), &inside));
        self.meets(&children);
        self.set(id, NodeKind::And(And { children, ..And::empty(Form::Repeat) }));
        Some(id)
    }

    /// `for o in Type when φ {…}`: once for each thing of the type that stands in the scene, in its order or backwards,
    /// since one may be in the way of another. Which of them φ leaves out is decided as by an `if`, when the plan is made.
    /// The nodes are those of the `either`, `if` and blocks that say the same.
    fn each(&mut self, each: &Each, scope: &Scope, place: &Place) -> Option<NodeId> {
        let mut things = self.definitions.things(&each.kind.text);
        if things.len() < 2 {
            let (id, inside) = self.open(place, "for", "for".into(), each.span);
            let children = self.pass(each, &things, scope, &inside)?;
            self.set(id, NodeKind::And(And { children, ..And::empty(Form::Sequence) }));
            return Some(id);
        }
        let (id, inside) = self.open(place, "either", "either".into(), each.span);
        let mut branches = Vec::new();
        for (order, prior) in ORDERS {
            let (node, below) =
                self.open_as(&inside, &format!(".{order}"), order.into(), each.span);
            let children = self.pass(each, &things, scope, &below)?;
            self.set(node, NodeKind::And(And { children, ..And::empty(Form::Sequence) }));
            let text = self.fingerprint_block(&each.block);
            branches.push(Branch { text, ..self.branch(order, prior, node) });
            things.reverse();
        }
        self.set(id, NodeKind::Or(Or { decides: Decides::Choice, via: None, branches }));
        Some(id)
    }

    /// The body of a `for` once for each of these things; `None` when there is no room for more nodes.
    fn pass(
        &mut self,
        each: &Each,
        things: &[String],
        scope: &Scope,
        place: &Place,
    ) -> Option<Vec<NodeId>> {
        let mut children = Vec::new();
        for thing in things {
            if self.is_full(each.span, &place.within) {
                return None;
            }
            let stands_for = Expr { kind: ExprKind::Name(thing.clone()), span: each.name.span };
            let mut scope = scope.clone();
            scope.insert(each.name.text.clone(), stands_for);
            let (one, below) = self.open(place, thing, thing.clone(), each.span);
            let made = match &each.when {
                None => self.block(&each.block, &scope, &below, "/block"),
                Some(when) => {
                    let branch = If {
                        condition: when.clone(),
                        then: each.block.clone(),
                        otherwise: None,
                        span: each.span,
                    };
                    self.decided(&branch, &scope, &below)
                }
            };
            let and = And { children: vec![made], ..And::empty(Form::Sequence) };
            self.set(one, NodeKind::And(and));
            children.push(one);
        }
        self.meets(&children);
        Some(children)
    }

    /// The rounds from `round` on: an Or between being done and going round again.
    fn rounds(
        &mut self,
        round: u32,
        repeat: &Repeat,
        until: &Expr,
        scope: &Scope,
        place: &Place,
    ) -> Option<NodeId> {
        if self.is_full(repeat.span, &place.within) {
            return None;
        }
        let label = format!("until {}", text::expr(until));
        let (id, inside) = self.open(place, &format!("until_{round}"), label, repeat.span);
        let done = self.skip(&inside, ".done", repeat.span);
        let (again, below) = self.open_as(&inside, ".again", "again".into(), repeat.span);
        let mut children = vec![self.block(&repeat.block, scope, &below, &format!("/{round}"))];
        if round < repeat.times {
            children.extend(self.rounds(round + 1, repeat, until, scope, &below));
        }
        self.meets(&children);
        self.set(again, NodeKind::And(And { children, ..And::empty(Form::Sequence) }));
        self.conditions.push((id, Role::Until, until.clone()));
        let decides = Decides::Repetition(until.clone());
        let branches = vec![self.branch("done", 0.0, done), self.branch("again", 1.0, again)];
        self.set(id, NodeKind::Or(Or { decides, via: None, branches }));
        Some(id)
    }

    fn together(&mut self, together: &Together, scope: &Scope, place: &Place) -> NodeId {
        let (id, inside) = self.open(place, "together", "together".into(), together.span);
        let mut children = Vec::new();
        let mut labels: Vec<(String, NodeId)> = Vec::new();
        let mut scope = scope.clone();
        for step in &together.steps {
            let mut made = Vec::new();
            match step {
                // Steps in a row are one strand of what goes on together.
                Step::Sequence(steps, span) => {
                    let (strand, below) = self.open(&inside, "then", "then".into(), *span);
                    let children = self.sequence(steps, &mut scope, &below);
                    let and = And { children, ..And::empty(Form::Sequence) };
                    self.set(strand, NodeKind::And(and));
                    made.push(strand);
                }
                step => self.step(step, &mut scope, &inside, &mut made),
            }
            let label = match step {
                Step::Act(act) => act.label.as_ref(),
                Step::Block(block) => block.label.as_ref(),
                _ => None,
            };
            if let (Some(label), Some(node)) = (label, made.first()) {
                labels.push((label.text.clone(), *node));
            }
            children.extend(made);
        }
        for timing in &together.timings {
            let mut find = |name: &ast::Name| {
                let found = labels.iter().find(|(label, _)| *label == name.text).map(|(_, id)| *id);
                if found.is_none() {
                    let known = labels.iter().map(|(label, _)| label.clone()).collect();
                    let missing = Obstacle::NoLabel { label: name.text.clone(), known };
                    self.problem(&missing, name.span, &place.within);
                }
                found
            };
            if let (Some(a), Some(b)) = (find(&timing.a), find(&timing.b)) {
                let by = timing.by.map(|by| by.quantity.value);
                self.relations.push(Relation::Temporal { a, allen: timing.relation, b, by });
            }
        }
        self.set(id, NodeKind::And(And { children, ..And::empty(Form::Together) }));
        id
    }

    fn check(&mut self, what: &Expr, span: Span, scope: &Scope, place: &Place) -> NodeId {
        let what = bind::fill(what, scope);
        let segment = match &what.kind {
            ExprKind::Call(call) => format!("check_{}", call.name.text),
            _ => "check".into(),
        };
        let (id, _) = self.open(place, &segment, format!("check {}", text::expr(&what)), span);
        self.conditions.push((id, Role::Checks, what.clone()));
        self.set(id, NodeKind::Terminal(Terminal::of(Does::Check(what))));
        id
    }

    /// Each `on failure` clause is an Or between going on as planned and what the clause says.
    pub(super) fn recoveries(
        &mut self,
        recoveries: &[Recovery],
        scope: &Scope,
        place: &Place,
    ) -> Vec<NodeId> {
        let mut made = Vec::new();
        for recovery in recoveries {
            let of = recovery.of.as_ref().map(|of| bind::fill_call(of, scope));
            let label = text::on_failure(of.as_ref());
            let (id, inside) = self.open(place, "on_failure", label, recovery.span);
            let nominal = self.skip(&inside, ".nominal", recovery.span);
            let (taken, below) = self.open_as(&inside, ".taken", "recover".into(), recovery.span);
            let children = self.sequence(&recovery.steps, &mut scope.clone(), &below);
            let form = Form::Recovery { of, remedy: recovery.remedy.clone() };
            self.set(taken, NodeKind::And(And { children, ..And::empty(form) }));
            let branches =
                vec![self.branch("nominal", 1.0, nominal), self.branch("taken", 0.0, taken)];
            self.set(id, NodeKind::Or(Or { decides: Decides::Recovery, via: None, branches }));
            made.push(id);
        }
        made
    }

    /// An Or over the values of one argument; below each, the call goes on with that value.
    pub(super) fn argument_or(
        &mut self,
        request: &Request<'_>,
        params: &[Param],
        (bound, at): (&[bind::Bound], usize),
        chosen: &Scope,
        place: &Place,
        tail: &str,
    ) -> Option<NodeId> {
        let param = &bound[at].name;
        // The Or stands where the call would: `pour/place` becomes `pour/place/at.tray`.
        let tail = format!("{tail}/{param}");
        let label = match request.label {
            Some(label) => format!("{}: {param}", label.text),
            None => format!("{}: {param}", request.call.name.text),
        };
        let (id, inside) = self.open_as(place, &tail, label, request.call.span);
        let values = &bound[at].values;
        let prior = 1.0 / values.len() as f64;
        let mut branches = Vec::new();
        for value in values {
            let name = text::expr(value);
            let mut scope = chosen.clone();
            scope.insert(param.clone(), value.clone());
            // With one value left, this parameter no longer branches.
            let mut rest = bound.to_vec();
            rest[at].values = vec![value.clone()];
            let tail = format!(".{}", name.replace(' ', "_"));
            let node = self.choose(request, params, &rest, &scope, &inside, &tail)?;
            branches.push(Branch {
                key: format!("{}{tail}", inside.key),
                text: self.fingerprint_call(request.call, &name),
                name,
                prior,
                guard: None,
                was: Vec::new(),
                node,
            });
        }
        let decides = Decides::Argument(param.clone());
        self.set(id, NodeKind::Or(Or { decides, via: None, branches }));
        Some(id)
    }

    fn skip(&mut self, place: &Place, tail: &str, span: Span) -> NodeId {
        let (id, _) = self.open_as(place, tail, tail.trim_start_matches('.').into(), span);
        id
    }

    fn branch(&self, name: &str, prior: f64, node: NodeId) -> Branch {
        let key = self.nodes[node.idx()].key.clone();
        Branch { name: name.into(), prior, guard: None, key, was: Vec::new(), text: 0, node }
    }

    fn meets(&mut self, children: &[NodeId]) {
        for pair in children.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            self.relations.push(Relation::Temporal { a, allen: Allen::Meets, b, by: None });
        }
    }
}

impl Terminal {
    fn of(does: Does) -> Self {
        let (causes, holding) = (crate::graph::Causes::default(), Holding::default());
        Self { does, causes, holding, script: None, limit: None }
    }
}

/// Makes probabilities of the priors as written: what is missing shares the rest, then all add up to 1.
fn priors(written: &[Option<f64>]) -> Result<Vec<f64>, BadPriors> {
    if let Some(bad) = written.iter().flatten().find(|p| !(p.is_finite() && **p >= 0.0)) {
        return Err(BadPriors::NoShare(*bad));
    }
    let given: f64 = written.iter().flatten().sum();
    let open = written.iter().filter(|p| p.is_none()).count();
    if open > 0 && given >= 1.0 {
        return Err(BadPriors::NothingLeft(given));
    }
    if open == 0 && given <= 0.0 {
        return Err(BadPriors::AllZero);
    }
    let rest = (1.0 - given).max(0.0);
    let total = if open > 0 { 1.0 } else { given };
    Ok(written.iter().map(|p| p.unwrap_or(rest / open as f64) / total).collect())
}

#[cfg(test)]
mod tests {
    use super::priors;

    #[test]
    fn priors_add_up_to_one() {
        assert_eq!(priors(&[None, None]), Ok(vec![0.5, 0.5]));
        assert_eq!(priors(&[Some(0.5), None, None]), Ok(vec![0.5, 0.25, 0.25]));
        assert_eq!(priors(&[Some(1.0), Some(3.0)]), Ok(vec![0.25, 0.75]));
        assert!(priors(&[Some(1.0), None]).is_err());
        assert!(priors(&[Some(0.0), Some(0.0)]).is_err());
        assert!(priors(&[Some(f64::NAN), None]).is_err());
    }
}
