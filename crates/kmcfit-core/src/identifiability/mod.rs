//! Identifiability: the parameters and functions that records determine, before a fit and at its optimum.
//!
//! * [`structural_rank()`]: upper bound of the number of identifiable parameter combinations, without a simulation;
//! * [`Sensitivity`] and [`SingularSpectrum`]: singular values of the weighted Jacobian;
//! * [`ScalingAmbiguity`]: scaling ambiguity, directions that leave the response unchanged;
//! * [`Bands`]: confidence bands of functions and ratios; [`classify_functions`]: their classification;
//! * [`anchors()`]: instants at which a response determines one ratio;
//! * [`rank_experiments`]: experiment design.

mod active;
mod anchors;
mod band;
mod band_curves;
mod bands;
mod classification;
mod components;
mod covariance;
mod degrees;
mod directions;
mod experiments;
mod factorisation;
mod ratios;
mod scaling_ambiguity;
mod sensitivity;
mod spans;
mod structural_rank;
pub use classification::is_negligible;

use crate::problem::Problem;

/// True if the samples alone determine a point: the cost has no penalties, and no constraint is active.
pub fn is_unhindered(problem: &Problem, theta: &[f64]) -> bool {
    !problem.is_regularised() && active::active_rows(problem, theta).is_empty()
}

pub use anchors::anchors;
pub use band::{Band, BandSide};
pub use bands::{BandSettings, Bands};
pub use classification::{
    Classification, ClassificationKind, FunctionClassification, classify_functions,
};
pub(crate) use covariance::stacked;
pub use experiments::{
    CandidateChannel, CandidateExperiment, Gain, Ranked, rank_experiments, residual_spread,
};
pub(crate) use factorisation::Factorisation;
pub use scaling_ambiguity::ScalingAmbiguity;
pub use sensitivity::{ResolvedDirection, Sensitivity, SingularSpectrum};
pub use structural_rank::{RankFinding, RankFindingKind, ScaleFreedom, structural_rank};
