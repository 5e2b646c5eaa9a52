//! Identifiability: the parameters and functions that records determine, before a fit and at its optimum.
//!
//! * [`structural_rank()`]: upper bound of the number of identifiable parameter combinations, without a simulation;
//! * [`Sensitivity`] and [`SingularSpectrum`]: singular values of the weighted Jacobian;
//! * [`ScalingAmbiguity`]: scaling ambiguity, directions that leave the response unchanged;
//! * [`Quantity`]: a number that follows from the parameters, with its standard error and interval;
//! * [`Bands`]: confidence bands of functions and ratios; [`classify_functions`]: their classification;
//! * [`rank_experiments`]: experiment design.

mod active;
mod band;
mod band_notes;
mod bands;
mod basis_error;
mod change;
mod classification;
mod columns;
mod components;
mod covariance;
mod covariance_kind;
mod curve;
mod degrees;
mod directions;
mod equation_rows;
mod experiments;
mod factorisation;
mod misspecified;
mod quantities;
mod quantity;
mod scale_source;
mod scaling_ambiguity;
mod sensitivity;
mod step_error;
mod step_shift;
mod structural_rank;
mod target;
mod width_shift;
pub(crate) use classification::is_negligible;

use crate::problem::Problem;

/// True if the covariance of the estimates is that of their errors: no constraint is active, and the cost has no terms besides the
/// misfit and penalties whose rule gives coverage
/// ([`WeightRule::gives_coverage`](crate::functions::WeightRule::gives_coverage)).
pub(crate) fn is_unhindered(problem: &Problem, theta: &[f64]) -> bool {
    let mut unpenalised = problem.clone();
    let penalties = &mut unpenalised.parts_mut().penalties;
    penalties.retain(|penalty| !penalty.rule.is_some_and(|rule| rule.gives_coverage()));
    !unpenalised.is_regularised() && !has_active_rows(problem, theta)
}

/// True if some constraint holds with equality at a point.
pub(crate) fn has_active_rows(problem: &Problem, theta: &[f64]) -> bool {
    !active::active_rows(problem, theta).is_empty()
}

pub use band::Band;
pub use bands::Bands;
pub use classification::{
    Classification, ClassificationKind, Condition, FunctionClassification, classify_functions,
};
pub(crate) use classification::{
    condition_on_bases, condition_on_inputs, condition_on_negligible_noise, condition_on_time,
};
pub(crate) use columns::stacked;
pub(crate) use covariance::is_bayesian;
pub use covariance_kind::CovarianceKind;
pub use curve::Curve;
pub(crate) use equation_rows::EquationRows;
pub use experiments::{Ranked, rank_experiments};
pub(crate) use factorisation::Factorisation;
pub use quantities::Quantities;
pub use quantity::{Quantity, Side};
pub use scale_source::{ScaleSource, scale_source};
pub use scaling_ambiguity::ScalingAmbiguity;
pub use sensitivity::{Sensitivity, SingularSpectrum};
pub(crate) use step_error::step_error;
pub use structural_rank::{RankFinding, ScaleFreedom, structural_rank};
pub use target::Target;
