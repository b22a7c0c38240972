//! What a twin and a model say.

use super::{Expr, Literal, Name, Span};
use crate::units::Unit;

/// `twin kitchen_twin of kitchen { effect … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// The scene it is of.
    pub of: Name,
    /// The effects already known.
    pub effects: Vec<EffectItem>,
    /// Where.
    pub span: Span,
}

/// `effect coulomb_friction(joint_4) { torque = 1.83 N*m +- 0.04 N*m }`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectItem {
    /// Its name from the vocabulary of effects.
    pub name: Name,
    /// Joint, link, camera, object, state or output.
    pub at: Name,
    /// `torque = 1.83 N*m +- 0.04 N*m`.
    pub parameters: Vec<EffectParameter>,
    /// Where.
    pub span: Span,
}

/// One parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Its name.
    pub name: Name,
    /// Its value.
    pub value: Literal,
    /// One standard deviation.
    pub std: Option<Literal>,
}

/// `model tanks { … }`: inputs, parameters, states, equations and outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// `input u: V`.
    pub inputs: Vec<ModelSignal>,
    /// `param k = 0.05, c = free`.
    pub params: Vec<ModelStart>,
    /// `state h = free`: the value at the first instant.
    pub states: Vec<ModelStart>,
    /// `let flow = k*sqrt(h)`.
    pub lets: Vec<ModelFormula>,
    /// `h' = u - flow`: the rates of the states.
    pub equations: Vec<ModelFormula>,
    /// `output y: V = h`.
    pub outputs: Vec<ModelFormula>,
    /// The bytes between the braces.
    pub body: Span,
    /// Where.
    pub span: Span,
}

/// A unit as a model names it: `: V`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelUnit {
    /// The unit.
    pub unit: Unit,
    /// Where.
    pub span: Span,
}

/// `u: V`, measured and given to the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSignal {
    /// Its name.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
}

/// A parameter, or a state with its value at the first instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStart {
    /// Its name.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
    /// Its value, or that the data give it.
    pub value: StartValue,
    /// `in 0 to 1`: what a free value may be.
    pub range: Option<[Literal; 2]>,
    /// Where.
    pub span: Span,
}

/// What a parameter or an initial state is.
#[derive(Debug, Clone, PartialEq)]
pub enum StartValue {
    /// `= 9.81 m/s^2`, `= 2*pi*f`.
    Fixed(Expr),
    /// `= free`, `= free ~ 0.05`, `~ 0.05`, or nothing at all.
    Free(Option<Literal>),
}

/// `h' = …`, `let flow = …` or `output y: V = …`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFormula {
    /// The name on its left; for a rate the state's.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
    /// What it is equal to. Powers are calls of `pow`.
    pub formula: Expr,
    /// Where.
    pub span: Span,
}
