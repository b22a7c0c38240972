//! What is known now: conditions and quantities read at the prompt, and needs before anything moves.

use crate::execution::reader::Reader;
use crate::fluent::Reading;
use crate::graph::{Graph, Node, NodeKind};
use crate::language::ast::{Arg, BinaryOp, Call, Expr, ExprKind};
use crate::language::text;
use crate::trace::{OffTable, Why};
use crate::units::Quantity;

use super::error::Short;
use super::{Error, WorkCell};

/// A vessel with less in it is empty, m³: a drop and a half, which is what stays on its walls.
const DRY: f64 = 0.1e-6;
/// Fluents that say what is in the hand.
const IN_HAND: [&str; 3] = ["held", "holding", "grasped"];
/// Up to so much a vessel in the hand is tilted while it is carried, rad. Chosen: 20 deg; what is carried keeps within 8 deg of
/// upright, and what pours is tilted further than this.
pub const TILTED: f64 = 0.35;

impl WorkCell {
    /// Returns what a condition is worth now.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn read(&mut self, condition: &Expr) -> Result<Reading, Error> {
        let state = self.state()?;
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, &state);
        Ok(reader.read(condition, &state))
    }

    /// Returns what a quantity is worth now; `None` when nobody knows, or it is none.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn quantity(&mut self, expr: &Expr) -> Result<Option<Quantity>, Error> {
        let state = self.state()?;
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, &state);
        Ok(reader.quantity(expr, &state))
    }

    /// Returns the vessel in the hand that is tilted further than one is carried, if there is one.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn tilted_vessel(&mut self) -> Result<Option<String>, Error> {
        let state = self.state()?;
        let Some(held) = state.held.clone().filter(|held| self.is_vessel(held)) else {
            return Ok(None);
        };
        let pose = state.object(&held).and_then(|object| object.world_from_object);
        Ok(pose.is_some_and(|pose| pose.tilt() > TILTED).then_some(held))
    }

    /// Returns why a call cannot be done as far as is known now: which of its needs is false. What only a picture tells
    /// stands in the way of nothing before the first look at the table; what is in the hand is known without one. What
    /// would help stands behind it.
    pub fn hindrance(&mut self, call: &Call) -> Option<String> {
        let checked = self.graph(call).and_then(|graph| {
            self.check_places(&graph)?;
            self.check_needs(&graph)
        });
        let error = checked.err()?;
        Some(error.first().map_or_else(|| error.to_string(), |first| format!("{error}; {first}")))
    }

    /// Refuses a call that has something stand at a point far off the table, whichever way it is done: that needs neither a
    /// look nor a simulated plan. How near to the edge a thing may stand is left to those.
    pub(super) fn check_places(&self, graph: &Graph) -> Result<(), Error> {
        let scene = self.scene();
        // What stands on the table and reaches over its edge may bear another.
        let widest = scene.objects.iter().map(|object| object.shape.outer_radius());
        let over = widest.fold(0.0, f64::max);
        for part in promised(graph, graph.root()).into_iter().flat_map(parts) {
            let (Some(("rests_on", object)), Some(place)) = (about(part), argument(part, 1)) else {
                continue;
            };
            let (Some(x), Some(y)) = (coordinate(place, "x", 0), coordinate(place, "y", 1)) else {
                continue;
            };
            if !scene.table.holds(x, y, -over) {
                let [low, _, high, _] = scene.table.corners();
                let off = OffTable { at: Some([x, y]), table: [low, high], edge: 0.0 };
                return Err(Error::OffTable { object, off });
            }
        }
        Ok(())
    }

    /// Says which of the call's own needs is false now; what nobody knows does not stand in the way.
    pub(super) fn check_needs(&mut self, graph: &Graph) -> Result<(), Error> {
        let state = self.state()?;
        let likeliest = self.parses(graph, &state, 1)?;
        let Some(first) = likeliest.first().and_then(|pg| pg.steps.first()) else {
            return Ok(());
        };
        let has_looked = self.experience.has_looked;
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, &state);
        let root = &graph.root().path;
        let own = first.needs.iter().filter(|need| need.owner == *root);
        let mut all: Vec<&Expr> = own.flat_map(|need| parts(&need.expr)).collect();
        // What is in the hand is known without a look, and is why a thing in it is out of reach.
        all.sort_by_key(|part| !asks_for_empty_hand(part));
        for &part in &all {
            let reading = reader.read(part, &state);
            // A thing that is still nowhere once the camera has looked is not there.
            let is_unseen = has_looked
                && reading.truth.is_none()
                && matches!(about(part), Some(("visible", _)));
            if reading.truth != Some(false) && !is_unseen {
                continue;
            }
            if let Some(held) = state.held.clone().filter(|_| asks_for_empty_hand(part)) {
                let is_drawer = scene.drawer(&held).is_some();
                return Err(Error::HandFull { held, is_drawer });
            }
            if let Some((_, object)) = about(part).filter(|(name, o)| {
                IN_HAND.contains(name) && o != "any" && state.held.as_ref() != Some(o)
            }) {
                let (other, is_drawer) = (state.held.clone(), scene.drawer(&object).is_some());
                return Err(Error::NotInHand { object, other, is_drawer });
            }
            let by = reading.margin.map_or(0.0, |margin| margin.value.abs());
            let amount_at = |place| {
                let amount = argument(part, place);
                amount.and_then(|amount| reader.quantity(amount, &state)).map(|known| known.value)
            };
            return Err(match about(part) {
                Some(("reachable", object)) => {
                    let mut needs = all.iter().filter_map(|part| about(part));
                    let is_filled = needs.any(|(name, o)| name == "room" && o == object);
                    let face = argument(part, 1).and_then(name_of);
                    let short = match reader.why_unreachable(&object, face) {
                        Some(Why::AtEnd { joint }) => Short::AtEnd(joint),
                        Some(Why::NotTurned) => Short::NotTurned,
                        _ => Short::By(by),
                    };
                    Error::OutOfReach { object, is_filled, short }
                }
                Some(("room", target)) => {
                    let amount = amount_at(1).unwrap_or(by);
                    Error::NoRoom { target, room: (amount - by).max(0.0), amount }
                }
                Some(("has", source_name)) => {
                    let amount = amount_at(1).unwrap_or(by);
                    Error::NotSoMuch { source_name, there: (amount - by).max(0.0), amount }
                }
                Some(("visible", object)) => Error::NotSeen(object),
                None if is_call(part, "weighable") => {
                    let amount = amount_at(0).unwrap_or(0.0);
                    let source = all.iter().filter_map(|part| about(part));
                    let source = source.filter(|(name, _)| *name == "has").map(|(_, o)| o).next();
                    let there = source.as_ref().and_then(|source| state.object(source)?.water);
                    too_little(source, there, amount, amount + by)
                }
                _ => Error::Needs {
                    call: graph.root().label.clone(),
                    what: text::expr(part),
                    by: reading.margin.map_or_else(String::new, |mut margin| {
                        margin.value = margin.value.abs();
                        format!(" by {margin}")
                    }),
                },
            });
        }
        Ok(())
    }
}

/// Says why less than `least` is not poured: there is no more in what it is to come from, as far as is known, or so little was
/// asked for. Volumes in m³.
fn too_little(source: Option<String>, there: Option<f64>, amount: f64, least: f64) -> Error {
    match (source, there) {
        (Some(source_name), Some(there)) if there < DRY => Error::Empty { source_name },
        (Some(source_name), None) if amount < DRY => Error::Empty { source_name },
        (Some(source_name), Some(there)) if there < least => {
            Error::NearlyEmpty { source_name, there, least }
        }
        _ => Error::NotWeighable { amount, least },
    }
}

/// Whether a condition is that something, or anything, is not in the hand.
fn asks_for_empty_hand(condition: &Expr) -> bool {
    let ExprKind::Not(inner) = &condition.kind else { return false };
    IN_HAND.iter().any(|name| is_call(inner, name))
}

/// Returns what must all hold for a condition to hold.
fn parts(condition: &Expr) -> Vec<&Expr> {
    match &condition.kind {
        ExprKind::Binary(a, BinaryOp::And, b) => parts(a).into_iter().chain(parts(b)).collect(),
        _ => vec![condition],
    }
}

/// Returns an argument of a fluent by its place, from 0.
fn argument(fluent: &Expr, place: usize) -> Option<&Expr> {
    let ExprKind::Call(call) = &fluent.kind else { return None };
    call.args.get(place)?.values.first()
}

/// Returns what a node promises whichever branches are taken below it.
fn promised<'g>(graph: &'g Graph, node: &'g Node) -> Vec<&'g Expr> {
    match &node.kind {
        NodeKind::And(and) => {
            let below = and.children.iter().flat_map(|child| promised(graph, graph.node(*child)));
            and.causes.gives.iter().chain(below).collect()
        }
        NodeKind::Terminal(terminal) => terminal.causes.gives.iter().collect(),
        NodeKind::Or(_) => Vec::new(),
    }
}

/// Returns a coordinate of a place that is `point(x, y)` with numbers, m, by its name or its place, from 0.
fn coordinate(place: &Expr, name: &str, at: usize) -> Option<f64> {
    let ExprKind::Call(call) = &place.kind else { return None };
    if call.name.text != "point" {
        return None;
    }
    let is_named = |arg: &&Arg| arg.name.as_ref().is_some_and(|own| own.text == name);
    let by_place = || call.args.get(at).filter(|arg| arg.name.is_none());
    number(call.args.iter().find(is_named).or_else(by_place)?.values.first()?)
}

fn number(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Literal(quantity) => Some(quantity.value),
        ExprKind::Negate(inner) => number(inner).map(|value| -value),
        _ => None,
    }
}

fn is_call(fluent: &Expr, name: &str) -> bool {
    matches!(&fluent.kind, ExprKind::Call(call) if call.name.text == name)
}

/// Returns the name and the first argument of a fluent: `reachable` and `cup` of `reachable(cup)`.
fn about(fluent: &Expr) -> Option<(&str, String)> {
    let ExprKind::Call(call) = &fluent.kind else { return None };
    let object = name_of(call.args.first()?.values.first()?)?;
    Some((&call.name.text, object.to_owned()))
}

/// Returns what is a name: `jar`, `side`.
fn name_of(expr: &Expr) -> Option<&str> {
    match &expr.kind {
        ExprKind::Name(name) => Some(name),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::too_little;

    /// "0.6 mL cannot be measured by weighing in the hand" was said of a jar that had been poured empty.
    #[test]
    fn what_is_nearly_empty_is_said_to_be_so_and_what_is_not_is_not() {
        let said = |there, amount| too_little(Some("jar".into()), there, amount, 3e-6).to_string();
        assert!(said(Some(0.577e-6), 0.577e-6).starts_with("`jar` is nearly empty, with 0.6 mL"));
        assert_eq!(said(Some(0.05e-6), 0.05e-6), "`jar` is empty");
        assert_eq!(said(None, 0.0), "`jar` is empty");
        // Of a full jar so little was asked for.
        for there in [Some(150e-6), None] {
            assert!(said(there, 1e-6).starts_with("1.0 mL cannot be measured"));
        }
        assert!(said(Some(150e-6), 0.0).starts_with("0.0 mL cannot be measured"));
    }
}
