//! The fingerprint of a branch: what its learnt counts are about.
//!
//! It covers the text of the branch and of every task, action and script that it reaches, so an edit
//! anywhere below starts new counts, and a change of layout or of a comment does not.

use std::collections::BTreeSet;

use super::Builder;
use crate::language::ast::{
    Act, Block, Branch, Call, Each, Either, If, Name, Recovery, Repeat, Step, Together,
};
use crate::language::text;

impl Builder<'_> {
    /// Returns the fingerprint of a branch that is a block.
    pub(super) fn fingerprint_block(&self, block: &Block) -> u64 {
        let mut hash = fnv(FNV_START, &text::block(&self.canonical_block(block)));
        let mut seen = BTreeSet::new();
        for step in &block.steps {
            hash = self.below(step, hash, &mut seen);
        }
        hash
    }

    /// Returns the fingerprint of a call with one of the values its argument may take.
    pub(super) fn fingerprint_call(&self, call: &Call, value: &str) -> u64 {
        let hash = fnv(fnv(FNV_START, &text::call(&self.canonical_call(call))), value);
        self.called(call, hash, &mut BTreeSet::new())
    }

    fn below(&self, step: &Step, hash: u64, seen: &mut BTreeSet<String>) -> u64 {
        let mut hash = hash;
        let mut blocks: Vec<&[Step]> = Vec::new();
        match step {
            Step::Act(act) => return self.called(&act.call, hash, seen),
            Step::Sequence(steps, _) => blocks.push(steps),
            Step::Block(block) => blocks.push(&block.steps),
            Step::Either(either) => {
                blocks.extend(either.branches.iter().map(|b| b.block.steps.as_slice()));
            }
            Step::If(branch) => {
                blocks.push(&branch.then.steps);
                blocks.extend(branch.otherwise.iter().map(|b| b.steps.as_slice()));
            }
            Step::Repeat(repeat) => blocks.push(&repeat.block.steps),
            Step::Each(each) => blocks.push(&each.block.steps),
            Step::Together(together) => blocks.push(&together.steps),
            Step::Check(..) | Step::Let(..) | Step::Break(_) | Step::Bad(_) => {}
        }
        for inner in blocks.into_iter().flatten() {
            hash = self.below(inner, hash, seen);
        }
        hash
    }

    fn called(&self, call: &Call, hash: u64, seen: &mut BTreeSet<String>) -> u64 {
        let name = &call.name.text;
        if !seen.insert(name.clone()) {
            return hash;
        }
        let mut hash = fnv(hash, &self.first_name(name));
        if let Some(task) = self.definitions.task(name) {
            hash = fnv(hash, &text::conditions(&task.conditions));
            for step in &task.steps {
                if let Some(step) = self.canonical(step) {
                    hash = fnv(hash, &text::step(&step));
                }
                hash = self.below(step, hash, seen);
            }
        } else if let Some(action) = self.definitions.action(name) {
            hash = fnv(hash, &text::conditions(&action.conditions));
            if let Some((script, _)) = &action.script {
                hash = fnv(hash, script);
                hash = fnv(hash, self.definitions.script(script).unwrap_or_default());
            }
        }
        hash
    }
}

impl Builder<'_> {
    /// The name a task or an action had first: renaming it is no edit.
    fn first_name(&self, name: &str) -> String {
        let task = self.definitions.task(name).and_then(|task| task.was.first());
        let was = task.or_else(|| self.definitions.action(name)?.was.first());
        was.map_or_else(|| name.to_owned(), |was| was.text.clone())
    }

    fn canonical_call(&self, call: &Call) -> Call {
        let text = self.first_name(&call.name.text);
        Call { name: Name { text, span: call.name.span }, ..call.clone() }
    }

    fn canonical_block(&self, block: &Block) -> Block {
        let steps = block.steps.iter().filter_map(|step| self.canonical(step)).collect();
        let recoveries = block.recoveries.iter().map(|recovery| Recovery {
            of: recovery.of.as_ref().map(|of| self.canonical_call(of)),
            steps: recovery.steps.iter().filter_map(|step| self.canonical(step)).collect(),
            ..recovery.clone()
        });
        Block { steps, recoveries: recoveries.collect(), ..block.clone() }
    }

    /// A step as its counts know it: calls by their first names, breakpoints left out.
    fn canonical(&self, step: &Step) -> Option<Step> {
        let all = |steps: &[Step]| steps.iter().filter_map(|step| self.canonical(step)).collect();
        Some(match step {
            Step::Break(_) => return None,
            Step::Act(act) => {
                Step::Act(Act { call: self.canonical_call(&act.call), ..act.clone() })
            }
            Step::Sequence(steps, span) => Step::Sequence(all(steps), *span),
            Step::Block(block) => Step::Block(self.canonical_block(block)),
            Step::Either(either) => {
                let branches = either.branches.iter().map(|branch| Branch {
                    block: self.canonical_block(&branch.block),
                    ..branch.clone()
                });
                Step::Either(Either { branches: branches.collect(), span: either.span })
            }
            Step::If(branch) => Step::If(If {
                then: self.canonical_block(&branch.then),
                otherwise: branch.otherwise.as_ref().map(|block| self.canonical_block(block)),
                ..branch.clone()
            }),
            Step::Repeat(repeat) => {
                let block = self.canonical_block(&repeat.block);
                Step::Repeat(Repeat { block, ..repeat.clone() })
            }
            Step::Each(each) => {
                let block = self.canonical_block(&each.block);
                Step::Each(Each { block, ..each.clone() })
            }
            Step::Together(together) => {
                Step::Together(Together { steps: all(&together.steps), ..together.clone() })
            }
            step @ (Step::Check(..) | Step::Let(..) | Step::Bad(_)) => step.clone(),
        })
    }
}

/// The offset basis of 64 bits (Fowler, Noll and Vo).
const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Adds `text` to an FNV-1a hash: the standard library's hasher may differ from one release to the next,
/// and these numbers are written to files. Each text ends in a byte of its own, so "ab", "c" ≠ "a", "bc".
fn fnv(hash: u64, text: &str) -> u64 {
    let bytes = text.bytes().chain(std::iter::once(0xff));
    bytes.fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}
