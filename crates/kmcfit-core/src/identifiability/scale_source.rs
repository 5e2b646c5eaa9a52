//! What determines the common scale of mass, damping and stiffness.

use super::components::components;
use crate::problem::Problem;

/// Source of the scale of the coefficients `(m, c, k)` of the shared coefficient set, which without a force all samples leave open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScaleSource {
    /// A measured force.
    Force,
    /// A known part, or a known value with its standard deviation.
    KnownValue,
    /// Fixed functions of these names: an assumption of the model.
    Fixed(Vec<String>),
    /// Constraints, penalties or nothing.
    Model,
}

/// The source of the scale.
pub fn scale_source(problem: &Problem) -> ScaleSource {
    let Some(component) = components(problem).into_iter().next() else {
        return ScaleSource::Model;
    };
    if component.forced(problem).contains(&true) {
        return ScaleSource::Force;
    }
    let given: Vec<_> = component.given(problem).collect();
    let is_known =
        |f: &&crate::functions::CoefficientFunction| f.is_known_part || f.prior.is_some();
    match given.iter().find(|f| is_known(f)) {
        Some(_) => ScaleSource::KnownValue,
        None if given.is_empty() => ScaleSource::Model,
        None => ScaleSource::Fixed(given.iter().map(|f| f.name()).collect()),
    }
}
