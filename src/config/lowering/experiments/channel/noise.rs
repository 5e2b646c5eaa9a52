//! Standard deviation of the samples, loss of the residuals, and correlation of the noise.

use super::super::data_facts::{ADDED_TO_SIGMA, Action, LEAST_SIGMA, USED};
use super::Spec;
use crate::config::lowering::ModelKey;
use crate::error::InputError;
use kmcfit_core::model::{CorrelationName, LossName, ScalarOr, SigmaValue};
use kmcfit_core::number_format::significant;
use kmcfit_core::record::{Loss, NoiseModel, Weighting};

/// Threshold of Huber's loss: 95 % efficiency for Gaussian noise.
const HUBER: f64 = 1.345;
/// Degrees of freedom of Student's t.
const STUDENT: f64 = 4.0;
/// Start value of an estimated sigma relative to the size of the samples.
const FIRST_SIGMA: f64 = 0.05;

pub(super) fn weighting(
    at: &ModelKey<'_>,
    sigma: Option<&SigmaValue>,
    sigmas: Option<Vec<f64>>,
    values: &[f64],
) -> Result<Option<Weighting>, InputError> {
    match (sigma, sigmas) {
        (None, _) => Ok(None),
        (Some(SigmaValue::Number(sigma)), _) => Ok(Some(Weighting::Sigma(*sigma))),
        (Some(SigmaValue::Estimate(_)), _) => {
            let size = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
            let sigma = FIRST_SIGMA * if size > 0.0 { size } else { 1.0 };
            Ok(Some(Weighting::Estimated { sigma }))
        }
        (Some(SigmaValue::Column(name)), Some(sigmas)) => {
            match sigmas.iter().position(|s| !s.is_finite() || *s <= 0.0) {
                Some(row) => Err(at
                    .error("a standard deviation must be positive")
                    .found(match sigmas[row].is_nan() {
                        true => format!("an empty field in `{name}` for sample {}", row + 1),
                        false => format!(
                            "{} in `{name}` for sample {}",
                            significant(sigmas[row], 6),
                            row + 1
                        ),
                    })
                    .expected("a number greater than 0 for every sample")),
                None => Ok(Some(Weighting::Sigmas(sigmas))),
            }
        }
        (Some(SigmaValue::Column(_)), None) => Ok(None),
    }
}

/// Share of sigma below which the standard deviation of a quantisation error is negligible: half a per cent of sigma.
const NEGLIGIBLE: f64 = 0.1;

/// The weighting with the variance `step^2/12` of a quantisation error added to stated variances, and what was done.
pub(super) fn with_quantisation(
    weighting: Option<Weighting>,
    step: f64,
) -> (Option<Weighting>, Action) {
    let error = step / 12.0f64.sqrt();
    // An invalid sigma stays, for its message.
    let is_large = |sigma: &f64| *sigma > 0.0 && error > NEGLIGIBLE * sigma;
    match weighting {
        Some(Weighting::Sigma(sigma)) if is_large(&sigma) => {
            let weighting = Weighting::Sigma(sigma.hypot(error));
            (Some(weighting), ADDED_TO_SIGMA)
        }
        Some(Weighting::Sigmas(sigmas)) if sigmas.iter().any(is_large) => {
            let sigmas = sigmas.iter().map(|sigma| sigma.hypot(error));
            (Some(Weighting::Sigmas(sigmas.collect())), ADDED_TO_SIGMA)
        }
        Some(Weighting::Estimated { .. }) => (weighting, LEAST_SIGMA),
        _ => (weighting, USED),
    }
}

pub(super) fn loss(at: &ModelKey<'_>, of_kind: &Spec) -> Result<Loss, InputError> {
    let at = at.below(&format!("loss.{}", of_kind.kind.name()));
    let (name, threshold, degrees) = match of_kind.loss {
        None => return Ok(Loss::Squares),
        Some(ScalarOr::Scalar(name)) => (*name, None, None),
        Some(ScalarOr::Map(spec)) => (spec.name, spec.threshold, spec.degrees),
    };
    for (part, given, owner) in [
        ("threshold", threshold, LossName::Huber),
        ("degrees", degrees, LossName::StudentT),
    ] {
        match given {
            Some(_) if name != owner => {
                return Err(at
                    .error_in(part, format!("`{name}` has no `{part}`"))
                    .found(format!("`{part}`"))
                    .expected(format!("`{part}` for `{owner}` only")));
            }
            Some(number) if number <= 0.0 => {
                return Err(at
                    .error_in(part, format!("the `{part}` must be positive"))
                    .found(number)
                    .expected(match part {
                        "threshold" => "a number greater than 0, in standard deviations",
                        _ => "a number greater than 0",
                    }));
            }
            _ => {}
        }
    }
    Ok(match name {
        LossName::Squares => Loss::Squares,
        LossName::Huber => Loss::Huber {
            threshold: threshold.unwrap_or(HUBER),
        },
        LossName::StudentT => Loss::StudentT {
            degrees: degrees.unwrap_or(STUDENT),
        },
    })
}

/// Correlation of the noise of a channel; `auto` by default.
pub(super) fn noise_model(of_kind: &Spec) -> NoiseModel {
    match of_kind.noise {
        None | Some(ScalarOr::Scalar(CorrelationName::Auto)) => NoiseModel::Auto,
        Some(ScalarOr::Scalar(CorrelationName::White)) => NoiseModel::White,
        Some(ScalarOr::Map(spec)) => NoiseModel::Autoregressive { order: spec.ar },
    }
}
