//! Whether what stands at a place is the thing, or something else that looks like it.
//!
//! A score says how well a picture agrees with a thing at a place. Here it is asked how well the same picture agrees with
//! what is not that: the same outline at the other places of the picture that look most like it, and solids of other
//! sizes and kinds at the same place. Nothing here decides; the numbers are weighed in [`super::probability`].

use nalgebra::Vector3;

use crate::alignment::evidence::Evidence;
use crate::alignment::placement::Candidate;
use crate::world::{Object, Shape};

/// What a picture says for and against a thing being what stands at a place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Identity {
    /// Score of the thing less the best score of another solid at the same place.
    pub shape: f64,
    /// How far that other solid's place is from the thing's, m.
    pub shape_apart: f64,
    /// Score of the thing less the mean of the places that look most like it elsewhere.
    pub elsewhere: f64,
    /// How far behind the best of those places is, as a share of the thing's score; 1 when there is none.
    pub ahead: f64,
}

/// Other solids: wider and higher by these factors. Chosen: a quarter off is what a person sees without a rule; with half
/// of it a thing is its own rival where its size is known to some per cent, with twice as much no rival is near it.
const OTHERS: [[f64; 2]; 8] = [
    [0.75, 1.0],
    [1.33, 1.0],
    [1.0, 0.75],
    [1.0, 1.33],
    [0.75, 0.75],
    [1.33, 1.33],
    [0.75, 1.33],
    [1.33, 0.75],
];

/// The solids that a thing may be mistaken for.
fn others(object: &Object) -> Vec<Object> {
    let as_shape = |shape: Shape| Object { shape, ..object.clone() };
    let mut all: Vec<Object> =
        OTHERS.iter().map(|[wide, high]| as_shape(object.shape.scaled(*wide, *high))).collect();
    let mean = 0.5 * (object.shape.inner_radius() + object.shape.body().outer_radius());
    let height = object.shape.height();
    all.push(as_shape(if object.shape.faces().is_some() {
        Shape::Cylinder { radius: mean, height }
    } else {
        let side = 1.8 * object.shape.body().outer_radius();
        Shape::Cuboid { size: Vector3::new(side, side, height) }
    }));
    all
}

/// Asks who else may be at a place; `alike` are the scores of the places that look most like the thing elsewhere.
pub(super) fn ask(evidence: &Evidence, at: &Candidate, alike: &[f64]) -> Identity {
    let own = evidence.nearby(at);
    let (mut best, mut place) = (0.0_f64, own);
    for other in &others(evidence.object) {
        let there = evidence.of(other).nearby(at);
        if there.score.total > best {
            (best, place) = (there.score.total, there);
        }
    }
    let mean = alike.iter().sum::<f64>() / alike.len().max(1) as f64;
    Identity {
        shape: own.score.total - best,
        shape_apart: own.distance(&place),
        elsewhere: own.score.total - mean,
        ahead: 1.0 - alike.iter().copied().fold(0.0, f64::max) / own.score.total.max(1e-9),
    }
}
