//! Equivalent systems of a fit: different coefficients with the same response, each confirmed by a simulation.

use super::equivalent_coefficients::{EquivalentOptions, TargetResponse, equivalent_coefficients};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::system::{NodalCoefficients, State};

/// Lower bound of the stiffness of an equivalent system, as a share of the fit's maximum.
const LEAST_STIFFNESS: f64 = 1e-3;
/// Largest accepted difference between the responses of an equivalent system and the fit, as a share of the peak displacement.
const SAME_MOTION: f64 = 0.1;

/// The mass, and possibly the damping, of an equivalent system at the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Name.
    pub name: String,
    /// Mass, kg.
    pub mass: Vec<f64>,
    /// Damping, N s/m; `None` for that of the fit.
    pub damping: Option<Vec<f64>>,
}

/// An equivalent system.
#[derive(Debug, Clone, PartialEq)]
pub struct EquivalentSystem {
    /// Name of the choice, or `the fit`.
    pub name: String,
    /// Its coefficients.
    pub nodal: NodalCoefficients,
    /// Largest difference from the response of the fit, as a share of the peak displacement.
    pub response_error: f64,
}

/// The fit and its equivalent systems for the given choices, or for default masses (the fit's mass times a factor over time)
/// where `choices` is empty. Empty for nonlinear systems, for records shorter than the grid, and where no system is found.
pub fn equivalent_systems(
    problem: &Problem,
    evaluation: &Evaluation,
    choices: &[Choice],
) -> Vec<EquivalentSystem> {
    let Some(experiment) = problem.experiments.first() else {
        return Vec::new();
    };
    let is_linear = problem.system.laws().iter().all(|t| t.is_linear());
    if !is_linear || experiment.nodes != problem.system.grid.nodes() {
        return Vec::new();
    }
    let response = TargetResponse::of(problem, evaluation, 0);
    let nodal = evaluation.nodal_of(experiment.coefficient_set);
    let initial = State::one(response.displacement[0], response.velocity[0]);
    let least = LEAST_STIFFNESS * nodal.coefficients[1].iter().copied().fold(0.0, f64::max);
    let find = |choice: Choice| {
        let damping = choice.damping;
        let damping = damping.unwrap_or_else(|| nodal.coefficients[0].clone());
        let found = equivalent_coefficients(
            &choice.mass,
            &response,
            &EquivalentOptions::near(damping, least),
        )
        .ok()?;
        let excitation = experiment.excitation.as_ref();
        let moved = problem.system.forward(&found, &initial, excitation).ok()?;
        let largest = (response.displacement.iter()).fold(0.0f64, |m, y| m.max(y.abs()));
        let pairs = moved.displacement(0).iter().zip(&response.displacement);
        let off = pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        // A step too long for the system changes its response.
        let response_error = if off == 0.0 { 0.0 } else { off / largest };
        (response_error <= SAME_MOTION).then_some(EquivalentSystem {
            name: choice.name,
            nodal: found,
            response_error,
        })
    };
    let choices = match choices {
        [] => factors(&nodal.inertias[0]),
        choices => choices.to_vec(),
    };
    let found: Vec<EquivalentSystem> = choices.into_iter().filter_map(find).collect();
    if found.is_empty() {
        return found;
    }
    let fit = EquivalentSystem {
        name: "the fit".into(),
        nodal: nodal.clone(),
        response_error: 0.0,
    };
    std::iter::once(fit).chain(found).collect()
}

/// Default masses: increasing, decreasing and oscillating about that of the fit.
fn factors(mass: &[f64]) -> Vec<Choice> {
    let last = (mass.len() - 1) as f64;
    type Factor = fn(f64) -> f64;
    let choices: [(&str, Factor); 3] = [
        ("mass increasing by 50 %", |x| 1.0 + 0.5 * x),
        ("mass decreasing by 33 %", |x| 1.0 - x / 3.0),
        ("mass oscillating by ±20 %", |x| {
            1.0 + 0.2 * (12.0 * x).sin()
        }),
    ];
    let choice = |(name, factor): (&str, Factor)| Choice {
        name: name.into(),
        mass: (mass.iter().enumerate())
            .map(|(i, m)| m * factor(i as f64 / last))
            .collect(),
        damping: None,
    };
    choices.map(choice).into()
}
