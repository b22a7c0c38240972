//! Which branches are taken: inference over a graph with what holds in a state of the world, and with what
//! earlier runs have taught.

use std::collections::BTreeMap;

use crate::execution::reader::Reader;
use crate::graph::{self, Graph, ParseGraph, RecoveryPlan, infer};
use crate::language::ast::Expr;
use crate::world::WorldState;

use super::{Error, Learnt, WorkCell};

impl WorkCell {
    /// Returns up to `k` parse graphs that differ in what people choose, the likeliest first.
    pub(super) fn parses(
        &mut self,
        graph: &Graph,
        start: &WorldState,
        k: usize,
    ) -> Result<Vec<ParseGraph>, Error> {
        Ok(self.inferring(graph, start, |given| graph::diverse(graph, given, k))?)
    }

    /// Returns what is to be done about a failure, chosen by what holds now.
    pub(super) fn recovery_now(
        &mut self,
        graph: &Graph,
        failed: &ParseGraph,
        plan: usize,
    ) -> Result<RecoveryPlan, Error> {
        let state = self.state()?;
        let foreseen = &failed.recoveries[plan];
        let now = self.inferring(graph, &state, |given| graph::after_failure(graph, given, failed));
        let now = now.recoveries.into_iter().find(|plan| plan.path == foreseen.path);
        Ok(now.unwrap_or_else(|| foreseen.clone()))
    }

    /// After a failed step: the same choices but for the nearest branch not yet tried, and where to go on.
    pub(super) fn other_branch(
        &mut self,
        graph: &Graph,
        failed: &ParseGraph,
        index: usize,
        tried: &mut BTreeMap<String, Vec<String>>,
    ) -> Result<Option<(ParseGraph, usize)>, Error> {
        let state = self.state()?;
        let retry = |given: &infer::Given<'_>| graph::retry(graph, given, failed, index, tried);
        Ok(self.inferring(graph, &state, retry)?)
    }

    /// Infers with what holds in a state of the world, and with what earlier runs have taught.
    fn inferring<T>(
        &mut self,
        graph: &Graph,
        state: &WorldState,
        infer: impl FnOnce(&infer::Given<'_>) -> T,
    ) -> T {
        let Learnt { outcomes, priors, domain, explore } = &self.experience.learnt;
        let explore = explore.then_some(self.setup.seed);
        let costs = graph::outcome::costs(graph, outcomes, domain, priors.as_ref(), explore);
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, state);
        infer(&infer::Given {
            definitions: &self.setup.library,
            holds: &|expr: &Expr| reader.read(expr, state).truth,
            pins: &BTreeMap::new(),
            priors: priors.as_ref(),
            cost: &|node| costs.get(&node.id).copied().unwrap_or(0.0),
        })
    }
}
