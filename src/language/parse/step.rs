//! The grammar's pairs → steps, blocks and recoveries.

use super::super::ast::{
    Act, Allen, Block, Branch, Break, Call, Each, Either, Hold, If, Name, Recovery, Remedy, Repeat,
    Span, Step, Timing, Together,
};
use super::super::diagnostic::Diagnostic;
use super::build::{Body, Builder, find, number, tight_end};
use super::grammar::{Pair, Rule};

impl Builder<'_> {
    /// Reads a step; a `timing` goes to the body instead, where `together` looks for it.
    pub(super) fn step(&mut self, pair: &Pair, body: &mut Body) -> Option<Step> {
        let inner = pair.clone().into_inner().next()?;
        let span = self.span(&inner);
        Some(match inner.as_rule() {
            Rule::either => Step::Either(self.either(&inner, span)),
            Rule::branch => self.branch(&inner, span),
            Rule::repeat => {
                let times = find(&inner, Rule::num).map_or(1, |p| self.count(&p));
                let block = find(&inner, Rule::block)?;
                Step::Repeat(Repeat {
                    times,
                    block: self.block(&block),
                    until: find(&inner, Rule::expr).map(|p| self.expr(&p)),
                    span,
                })
            }
            Rule::each => {
                let mut names = inner.clone().into_inner().filter(|p| p.as_rule() == Rule::id);
                let (name, kind) = (names.next()?, names.next()?);
                let when = find(&inner, Rule::guard).and_then(|guard| find(&guard, Rule::expr));
                Step::Each(Each {
                    name: self.name(&name),
                    kind: self.name(&kind),
                    when: when.map(|when| self.expr(&when)),
                    block: self.block(&find(&inner, Rule::block)?),
                    span,
                })
            }
            Rule::together => {
                let block = find(&inner, Rule::block)?;
                let mut inside = Body::default();
                for part in block.into_inner() {
                    self.part(&part, &mut inside);
                }
                if let Some(recovery) = inside.recoveries.first() {
                    self.diagnostics.push(
                        Diagnostic::error(
                            "task::recovery",
                            recovery.span,
                            "steps that run together fail together",
                            "no recovery can stand here",
                        )
                        .help("put `on failure` after the `together { … }`"),
                    );
                }
                Step::Together(Together { steps: inside.steps, timings: inside.timings, span })
            }
            Rule::check => Step::Check(find(&inner, Rule::expr).map(|p| self.expr(&p))?, span),
            Rule::bind => {
                let name = find(&inner, Rule::id).map(|p| self.name(&p))?;
                Step::Let(name, find(&inner, Rule::expr).map(|p| self.expr(&p))?, span)
            }
            Rule::pause => {
                let when = find(&inner, Rule::guard).and_then(|p| find(&p, Rule::expr));
                Step::Break(Break { when: when.map(|p| self.expr(&p)), span })
            }
            Rule::timing => {
                let ids: Vec<Name> = inner
                    .clone()
                    .into_inner()
                    .filter(|p| p.as_rule() == Rule::id)
                    .map(|p| self.name(&p))
                    .collect();
                let [a, b] = <[Name; 2]>::try_from(ids).ok()?;
                let relation = find(&inner, Rule::allen).map(|p| allen(p.as_str()))?;
                let by = find(&inner, Rule::quant).map(|p| self.literal(&p));
                body.timings.push(Timing { a, relation, b, by, span });
                return None;
            }
            _ => {
                let mut ones: Vec<Step> = inner
                    .into_inner()
                    .filter(|p| p.as_rule() == Rule::one)
                    .filter_map(|p| self.one(&p))
                    .collect();
                if ones.len() == 1 { ones.pop()? } else { Step::Sequence(ones, span) }
            }
        })
    }

    /// Reads a call or a block with its holds and label.
    pub(super) fn one(&mut self, pair: &Pair) -> Option<Step> {
        let span = self.span(pair);
        let mut holds = Vec::new();
        let mut label = None;
        let mut via = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::hold => {
                    let Some(expr) = find(&part, Rule::expr) else { continue };
                    let expr = self.expr(&expr);
                    let is_while = find(&part, Rule::K_while).is_some();
                    holds.push(if is_while { Hold::While(expr) } else { Hold::Until(expr) });
                }
                Rule::via => {
                    let ids = part.clone().into_inner().filter(|p| p.as_rule() == Rule::id);
                    via.extend(ids.map(|p| self.name(&p)));
                }
                Rule::id => label = Some(self.name(&part)),
                _ => {}
            }
        }
        if label.is_none() {
            self.loop_of_a_hold(pair);
        }
        if let Some(call) = find(pair, Rule::call) {
            let call = self.call(&call)?;
            return Some(Step::Act(Act { call, via, holds, label, span }));
        }
        let block = self.block(&find(pair, Rule::block)?);
        Some(Step::Block(Block { holds, label, span, ..block }))
    }

    /// Complains of `while φ { … }` behind a step, which would be a step held to φ, and then a block. A block that begins
    /// on a line of its own is one, unless `while` does too.
    fn loop_of_a_hold(&mut self, pair: &Pair) {
        let holds = pair.clone().into_inner().filter(|part| part.as_rule() == Rule::hold);
        let Some(keyword) = holds.last().and_then(|hold| hold.into_inner().next()) else { return };
        let behind = &self.balanced.text[tight_end(pair)..];
        let block = behind.trim_start();
        let between = &behind[..behind.len() - block.len()];
        if !block.starts_with('{') || between.contains('\n') && !self.begins_line(&keyword) {
            return;
        }
        self.diagnostics.push(
            Diagnostic::error(
                "task::loop",
                self.span(&keyword),
                format!("there is no `{}` loop: every loop has an end", keyword.as_str()),
                "read as part of the step before it",
            )
            .help("write `repeat upto 10 times { … } until …`; a block that follows the step begins a line"),
        );
    }

    pub(super) fn block(&mut self, pair: &Pair) -> Block {
        let span = self.span(pair);
        let mut body = Body::default();
        for part in pair.clone().into_inner() {
            self.part(&part, &mut body);
        }
        if let Some(Timing { span, .. }) = body.timings.first() {
            self.timing_outside(*span);
        }
        Block {
            steps: body.steps,
            recoveries: body.recoveries,
            holds: Vec::new(),
            label: None,
            span,
        }
    }

    pub(super) fn either(&mut self, pair: &Pair, span: Span) -> Either {
        let mut branches: Vec<Branch> = Vec::new();
        for part in pair.clone().into_inner().filter(|p| p.as_rule() == Rule::alternative) {
            let (Some(name), Some(block)) = (find(&part, Rule::id), find(&part, Rule::block))
            else {
                continue;
            };
            let prior = find(&part, Rule::prior).and_then(|p| find(&p, Rule::num));
            let when = find(&part, Rule::guard).and_then(|p| find(&p, Rule::expr));
            branches.push(Branch {
                name: self.name(&name),
                was: self.was(&part),
                prior: prior.map(|p| number(p.as_str())),
                when: when.map(|p| self.expr(&p)),
                block: self.block(&block),
            });
        }
        Either { branches, span }
    }

    /// `if … else if … else …`: each further `if` stands alone in the block of the `else` before it.
    pub(super) fn branch(&mut self, pair: &Pair, span: Span) -> Step {
        let mut conditions = Vec::new();
        let mut blocks = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::expr => conditions.push(self.expr(&part)),
                Rule::block => blocks.push(self.block(&part)),
                _ => {}
            }
        }
        if conditions.len() > 64 {
            self.diagnostics.push(
                Diagnostic::error("task::depth", span, "more than 64 `else if` in a row", "here")
                    .help("split it into tasks of its own"),
            );
            return Step::Bad(span);
        }
        let mut otherwise = if blocks.len() > conditions.len() { blocks.pop() } else { None };
        let mut out = Step::Bad(span);
        while let (Some(condition), Some(then)) = (conditions.pop(), blocks.pop()) {
            let from = if conditions.is_empty() { span.from } else { condition.span.from };
            let span = Span { from, to: span.to };
            let step = Step::If(If { condition, then, otherwise: otherwise.take(), span });
            if conditions.is_empty() {
                out = step;
            } else {
                otherwise = Some(Block {
                    steps: vec![step],
                    recoveries: Vec::new(),
                    holds: Vec::new(),
                    label: None,
                    span,
                });
            }
        }
        out
    }

    pub(super) fn recovery(&mut self, pair: &Pair) -> Recovery {
        let span = self.span(pair);
        let mut of = None;
        let mut body = Body::default();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::call => of = self.call(&part),
                Rule::id => {
                    // `on failure of grasp`: any call of it.
                    let name = self.name(&part);
                    of = Some(Call { span: name.span, name, args: Vec::new() });
                }
                _ => self.part(&part, &mut body),
            }
        }
        Recovery { of, steps: body.steps, remedy: body.remedy, span }
    }

    pub(super) fn remedy(&mut self, pair: &Pair) -> Remedy {
        if find(pair, Rule::K_abort).is_some() {
            return Remedy::Abort(self.text_in(pair).map(|why| why.text));
        }
        Remedy::Retry {
            other: find(pair, Rule::K_other).is_some(),
            times: find(pair, Rule::num).map_or(1, |p| self.count(&p)),
        }
    }

    /// A whole number of repetitions, at least 1.
    pub(super) fn count(&mut self, pair: &Pair) -> u32 {
        let value = number(pair.as_str());
        if value.fract() == 0.0 && (1.0..=1000.0).contains(&value) {
            return value as u32;
        }
        self.diagnostics.push(
            Diagnostic::error(
                "task::count",
                self.span(pair),
                format!("`{}` is not a number of times", pair.as_str()),
                "a whole number from 1 to 1000 stands here",
            )
            .help("write how often at most, such as `3 times`"),
        );
        1
    }
}

fn allen(text: &str) -> Allen {
    match text {
        "before" => Allen::Before,
        "meets" => Allen::Meets,
        "overlaps" => Allen::Overlaps,
        "starts" => Allen::Starts,
        "during" => Allen::During,
        "finishes" => Allen::Finishes,
        _ => Allen::Equals,
    }
}
