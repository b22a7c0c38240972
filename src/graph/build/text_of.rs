//! The fingerprint of a branch: what its learnt counts are about.
//!
//! It covers the text of the branch and of every task, action and script that it reaches, so an edit
//! anywhere below starts new counts, and a change of layout or of a comment does not.

use std::collections::BTreeSet;

use super::Builder;
use crate::language::ast::{Block, Call, Step};
use crate::language::text;

impl Builder<'_> {
    /// Returns the fingerprint of a branch that is a block.
    pub(super) fn fingerprint_block(&self, block: &Block) -> u64 {
        let mut hash = fnv(FNV_START, &text::block(block));
        let mut seen = BTreeSet::new();
        for step in &block.steps {
            hash = self.below(step, hash, &mut seen);
        }
        hash
    }

    /// Returns the fingerprint of a call with one of the values its argument may take.
    pub(super) fn fingerprint_call(&self, call: &Call, value: &str) -> u64 {
        let hash = fnv(fnv(FNV_START, &text::call(call)), value);
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
            Step::Together(together) => blocks.push(&together.steps),
            Step::Check(..) | Step::Let(..) | Step::Bad(_) => {}
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
        let mut hash = fnv(hash, name);
        if let Some(task) = self.definitions.task(name) {
            hash = fnv(hash, &text::conditions(&task.conditions));
            for step in &task.steps {
                hash = fnv(hash, &text::step(step));
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

const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Adds `text` to an FNV-1a hash: the standard library's hasher may differ from one release to the next,
/// and these numbers are written to files. Each text ends in a byte of its own, so "ab", "c" ≠ "a", "bc".
fn fnv(hash: u64, text: &str) -> u64 {
    let bytes = text.bytes().chain(std::iter::once(0xff));
    bytes.fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}
