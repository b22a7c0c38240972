//! The places of a task, an action or a fluent where an expression stands, in one order.

use crate::language::ast::{
    ActionItem, Call, Conditions, Expr, ExprKind, FluentItem, Hold, Recovery, Step, TaskItem,
};
use crate::language::text;

/// Something with expressions in it.
pub(super) trait Slots: Clone {
    /// Calls `each` with every expression, always in the same order.
    fn slots(&mut self, each: &mut dyn FnMut(&mut Expr));

    /// Returns it as a text.
    fn written(&self) -> String;

    /// Returns what is left without the expressions.
    fn frame(&self) -> String {
        let mut empty = self.clone();
        empty.slots(&mut |expr| expr.kind = ExprKind::Bad);
        empty.written()
    }

    /// Returns the expressions.
    fn contents(&self) -> Vec<Expr> {
        let mut all = Vec::new();
        self.clone().slots(&mut |expr| all.push(expr.clone()));
        all
    }
}

impl Slots for TaskItem {
    fn slots(&mut self, each: &mut dyn FnMut(&mut Expr)) {
        conditions(&mut self.conditions, each);
        steps(&mut self.steps, each);
        recoveries(&mut self.recoveries, each);
    }

    fn written(&self) -> String {
        text::task(self)
    }
}

impl Slots for ActionItem {
    fn slots(&mut self, each: &mut dyn FnMut(&mut Expr)) {
        conditions(&mut self.conditions, each);
    }

    fn written(&self) -> String {
        text::action(self)
    }
}

impl Slots for FluentItem {
    fn slots(&mut self, each: &mut dyn FnMut(&mut Expr)) {
        each(&mut self.body);
    }

    fn written(&self) -> String {
        text::fluent(self)
    }
}

fn conditions(conditions: &mut Conditions, each: &mut dyn FnMut(&mut Expr)) {
    let Conditions { needs, keeps, gives } = conditions;
    needs.iter_mut().chain(keeps).chain(gives).for_each(each);
}

fn recoveries(all: &mut [Recovery], each: &mut dyn FnMut(&mut Expr)) {
    for recovery in all {
        if let Some(of) = &mut recovery.of {
            call(of, each);
        }
        steps(&mut recovery.steps, each);
    }
}

fn call(call: &mut Call, each: &mut dyn FnMut(&mut Expr)) {
    call.args.iter_mut().flat_map(|arg| &mut arg.values).for_each(each);
}

fn holds(holds: &mut [Hold], each: &mut dyn FnMut(&mut Expr)) {
    for hold in holds {
        let (Hold::While(condition) | Hold::Until(condition)) = hold;
        each(condition);
    }
}

fn steps(all: &mut [Step], each: &mut dyn FnMut(&mut Expr)) {
    for step in all {
        match step {
            Step::Act(act) => {
                call(&mut act.call, each);
                holds(&mut act.holds, each);
            }
            Step::Sequence(inner, _) => steps(inner, each),
            Step::Block(block) => {
                steps(&mut block.steps, each);
                recoveries(&mut block.recoveries, each);
                holds(&mut block.holds, each);
            }
            Step::Either(either) => {
                for branch in &mut either.branches {
                    branch.when.iter_mut().for_each(&mut *each);
                    steps(&mut branch.block.steps, each);
                    recoveries(&mut branch.block.recoveries, each);
                }
            }
            Step::If(step) => {
                each(&mut step.condition);
                for block in std::iter::once(&mut step.then).chain(&mut step.otherwise) {
                    steps(&mut block.steps, each);
                    recoveries(&mut block.recoveries, each);
                }
            }
            Step::Repeat(repeat) => {
                steps(&mut repeat.block.steps, each);
                recoveries(&mut repeat.block.recoveries, each);
                repeat.until.iter_mut().for_each(&mut *each);
            }
            Step::Each(repeated) => {
                steps(&mut repeated.block.steps, each);
                recoveries(&mut repeated.block.recoveries, each);
                repeated.when.iter_mut().for_each(&mut *each);
            }
            Step::Together(together) => steps(&mut together.steps, each),
            Step::Check(condition, _) => each(condition),
            Step::Let(_, value, _) => each(value),
            Step::Break(stop) => stop.when.iter_mut().for_each(&mut *each),
            Step::Bad(_) => {}
        }
    }
}
