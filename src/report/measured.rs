//! How well the readings are matched: each channel, all together, held-out records, half the step.

use super::document::number_or_null;
use super::known::HeldOut;
use crate::config::ChannelNote;
use kmcfit_core::internals::diagnostics::{
    InformationCriteria, ResidualDiagnostics, ResidualRecord, far_off, offset_and_drift,
    with_estimated_sigma, with_known_sigma,
};
use kmcfit_core::internals::dynamics::Breakdown;
use kmcfit_core::internals::functions::{Basis, CoefficientFunction};
use kmcfit_core::internals::objective::{Channel, Evaluation, Loss, Refined, Weighting};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::signal::Spectrum;
use kmcfit_core::internals::signal::even_spacing;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Residuals below this share of the largest reading are rounding.
const ROUNDING: f64 = 1e-6;
/// Half of the energy of a tone lies within this share of its frequency, which is further than that other share from
/// that of the readings.
const NARROW: f64 = 0.15;
const APART: f64 = 0.25;
/// A multiple of a frequency is met to within this share.
const MULTIPLE: f64 = 0.1;
/// A pattern that holds more than this share of the squares is the first thing to mend.
const HALF: f64 = 0.5;

/// One channel of an experiment at the best point, in its own unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelSummary {
    /// `displacement`, `velocity` or `acceleration`.
    pub kind: String,
    /// Unit of the numbers here: that of the file.
    pub unit: String,
    /// Number of readings that are used.
    pub readings: usize,
    /// Readings that are not used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignored: Vec<IgnoredSummary>,
    /// Single readings far off ([`kmcfit_core::internals::diagnostics::far_off`]), under a robust loss: rms, fit and whiteness are those of
    /// the others.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub left_aside: usize,
    /// Root-mean-square residual.
    #[serde(deserialize_with = "number_or_null")]
    pub rms_residual: f64,
    /// `100 (1 - |residual| / |reading - mean|)`.
    #[serde(deserialize_with = "number_or_null")]
    pub fit_percent: f64,
    /// Standard deviation of a reading, where there is one for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// Whether that was estimated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub sigma_estimated: bool,
    /// Whether the loss is a robust one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub robust: bool,
    /// What the residuals have that is neither noise nor motion, if there is anything of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternSummary>,
    /// What the channel adds to J.
    #[serde(deserialize_with = "number_or_null")]
    pub cost: f64,
    /// Whether the residuals look white, in words.
    pub whiteness: String,
    /// p-value of the Ljung-Box test of whiteness; `null` where it could not be made.
    pub whiteness_p_value: Option<f64>,
    /// Autocorrelation of the residuals at lags 0, 1, ...
    pub autocorrelation: Vec<f64>,
    /// That of white noise lies below this in 95 of 100 lags.
    #[serde(deserialize_with = "number_or_null")]
    pub autocorrelation_band: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// What residuals have that is neither noise nor motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PatternSummary {
    /// Single readings far off ([`kmcfit_core::internals::diagnostics::far_off`]), under least squares.
    FarOff {
        /// How many.
        readings: usize,
        /// Time of the first, s.
        first: f64,
    },
    /// Their mean holds more than half of their squares.
    Offset,
    /// The straight line through what their mean leaves holds more than half of their squares.
    Drift,
    /// They swing at a frequency of their own, far from that of the readings.
    Tone {
        /// That frequency, Hz.
        frequency: f64,
        /// That of the readings, Hz.
        beside: f64,
    },
}

/// Readings that are not used, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IgnoredSummary {
    /// How many.
    pub readings: usize,
    /// Why.
    pub reason: String,
}

/// All readings together.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StatisticsSummary {
    /// Number of readings.
    pub readings: usize,
    /// Number of parameters of functions and scalars.
    pub parameters: usize,
    /// `J / (n - p)` for a chi-square of readings with known sigma; `null` where that means nothing.
    pub reduced_chi_square: Option<f64>,
    /// Akaike's criterion.
    pub aic: Option<f64>,
    /// The same corrected for small records.
    pub aicc: Option<f64>,
    /// Schwarz's criterion.
    pub bic: Option<f64>,
}

/// A number that was fitted beside the functions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScalarSummary {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Value found.
    #[serde(deserialize_with = "number_or_null")]
    pub value: f64,
    /// Standard error from the linearised fit, without constraints, penalties and priors; `null`
    /// where the readings do not determine all parameters.
    pub standard_error: Option<f64>,
}

/// The optimum on a grid of half the step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefinedSummary {
    /// Half the step, s.
    pub step: f64,
    /// Misfit there; that of the fit's own grid is `cost.misfit`.
    #[serde(deserialize_with = "number_or_null")]
    pub misfit: f64,
    /// Largest change of a prediction as a share of the root-mean-square residual, over the channels.
    #[serde(deserialize_with = "number_or_null")]
    pub change_per_residual: f64,
    /// Largest change of a prediction as a share of the largest reading, over the channels.
    #[serde(deserialize_with = "number_or_null")]
    pub change_per_reading: f64,
}

/// An experiment that took no part in the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HoldOutSummary {
    /// Name.
    pub name: String,
    /// How well each channel is predicted.
    pub channels: Vec<ChannelSummary>,
    /// What was found from its own readings: its initial state, its sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scalars: Vec<ScalarSummary>,
    /// Why there is no prediction, if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// One channel with its note and predictions.
pub fn channel(channel: &Channel, note: Option<&ChannelNote>, predicted: &[f64]) -> ChannelSummary {
    let factor = note.map_or(1.0, |n| n.unit.factor());
    let diagnostics = diagnostics(channel, predicted);
    let sigma = match channel.weighting() {
        Weighting::Sigma(sigma) | Weighting::Estimated { sigma } => Some(sigma / factor),
        Weighting::Sigmas(_) | Weighting::Integral { .. } | Weighting::Trapezoid(_) => None,
    };
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    ChannelSummary {
        kind: channel.kind().name().into(),
        unit: unit(channel, note).into(),
        readings: channel.len(),
        ignored: note.map_or(Vec::new(), |n| {
            let ignored = n.ignored.iter().map(|(readings, reason)| IgnoredSummary {
                readings: *readings,
                reason: reason.clone(),
            });
            ignored.collect()
        }),
        left_aside: left_aside(channel, &residuals).len(),
        rms_residual: diagnostics.rms / factor,
        fit_percent: diagnostics.fit_percent,
        sigma,
        sigma_estimated: matches!(channel.weighting(), Weighting::Estimated { .. }),
        robust: channel.loss() != Loss::Squares,
        pattern: pattern(channel, predicted),
        cost: channel.cost(predicted),
        whiteness: diagnostics.whiteness.to_string(),
        whiteness_p_value: (diagnostics.whiteness.p_value.is_finite())
            .then_some(diagnostics.whiteness.p_value),
        autocorrelation_band: diagnostics.band,
        autocorrelation: diagnostics.autocorrelation,
    }
}

/// What the residuals of a channel have that a robust loss or a sensor's offset or drift may explain.
fn pattern(channel: &Channel, predicted: &[f64]) -> Option<PatternSummary> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let largest =
        |values: &mut dyn Iterator<Item = &f64>| values.fold(0.0f64, |m, v| m.max(v.abs()));
    // Rounding may have any pattern.
    let missed = channel.observed().iter().zip(predicted).map(|(o, p)| o - p);
    let missed: Vec<f64> = missed.collect();
    if largest(&mut missed.iter()) <= ROUNDING * largest(&mut channel.observed().iter()) {
        return None;
    }
    let far = far_off(&residuals);
    if let (Some(first), Loss::Squares) = (far.first(), channel.loss()) {
        return Some(PatternSummary::FarOff {
            readings: far.len(),
            first: channel.times()[*first],
        });
    }
    let [offset, drift] = offset_and_drift(channel.times(), &residuals);
    match () {
        () if offset > HALF => Some(PatternSummary::Offset),
        () if drift > HALF => Some(PatternSummary::Drift),
        () => tone(channel, &residuals),
    }
}

/// The tone of residuals at equal distances, most of whose energy is near one frequency that is not the readings', nor
/// a multiple of it, which is the nonlinearity's. Without a sigma nothing says that residuals are more than what a descent
/// has left.
fn tone(channel: &Channel, residuals: &[f64]) -> Option<PatternSummary> {
    channel.weighting().sigma(0)?;
    let spacing = even_spacing(channel.times())?;
    let [own, readings] = [residuals, channel.observed()].map(|x| Spectrum::of(x, spacing));
    let (own, beside) = (own?, readings?.dominant());
    let [low, high] = own.band(HALF);
    let frequency = own.dominant();
    let is_narrow = high - low <= NARROW * frequency.max(own.resolution());
    let is_other = (frequency - beside).abs() > APART * beside;
    let is_multiple = [2.0, 3.0]
        .iter()
        .any(|n| (frequency - n * beside).abs() <= MULTIPLE * frequency);
    (is_narrow && is_other && !is_multiple && beside > 0.0 && frequency > 0.0)
        .then_some(PatternSummary::Tone { frequency, beside })
}

/// Unit in which reports speak of a channel.
pub fn unit<'a>(channel: &Channel, note: Option<&'a ChannelNote>) -> &'a str {
    note.map_or(channel.kind().unit(), |n| n.unit.symbol())
}

/// The residuals of a channel, examined; those that are left aside are missing.
pub fn diagnostics(channel: &Channel, predicted: &[f64]) -> ResidualDiagnostics {
    let mut residuals: Vec<f64> = channel.residuals(predicted).collect();
    let mut observed = channel.observed().to_vec();
    for i in left_aside(channel, &residuals) {
        residuals[i] = f64::NAN;
        observed[i] = f64::NAN;
    }
    ResidualDiagnostics::new(&ResidualRecord {
        times: channel.times(),
        residuals: &residuals,
        observed: &observed,
        model: predicted,
    })
}

/// Single readings far off ([`far_off`]) that are left aside under a robust loss: their squares say nothing of how well the
/// others are matched. A part of the motion that is missed is none of them.
fn left_aside(channel: &Channel, residuals: &[f64]) -> Vec<usize> {
    match channel.loss() {
        Loss::Squares => Vec::new(),
        _ => far_off(residuals),
    }
}

/// All readings together.
pub fn statistics(problem: &Problem, evaluation: &Evaluation) -> StatisticsSummary {
    let readings = problem.reading_count();
    let parameters = problem.parameters();
    let mut summary = StatisticsSummary {
        readings,
        parameters,
        ..StatisticsSummary::default()
    };
    // Penalties take away degrees of freedom that nobody has counted here.
    let plain = problem.penalties.is_empty() && problem.variations.is_empty();
    let squares = problem.channels().all(|c| c.loss() == Loss::Squares);
    if !(plain && squares) || readings <= parameters {
        return summary;
    }
    let p = parameters as f64;
    let sigma = |known: bool| {
        problem
            .channels()
            .all(|c| matches!(c.weighting(), Weighting::Sigma(_) | Weighting::Sigmas(_)) == known)
    };
    let criteria: Option<InformationCriteria> = if sigma(true) {
        summary.reduced_chi_square = Some(evaluation.misfit / (readings as f64 - p));
        with_known_sigma(evaluation.misfit, readings, p)
    } else if sigma(false) && problem.channels().count() == 1 {
        let squares = problem
            .channels()
            .zip(evaluation.predictions.iter().flatten());
        let sum: f64 = squares
            .flat_map(|(c, predicted)| c.residuals(predicted).map(|r| r * r).collect::<Vec<f64>>())
            .sum();
        with_estimated_sigma(sum, readings, p)
    } else {
        None
    };
    summary.aic = criteria.map(|c| c.aic);
    summary.aicc = criteria.and_then(|c| c.aicc);
    summary.bic = criteria.map(|c| c.bic);
    summary
}

/// The scalars of a problem at a point, whose parameters have this covariance where it is known.
pub fn scalars(
    problem: &Problem,
    evaluation: &Evaluation,
    covariance: Option<&DMatrix<f64>>,
) -> Vec<ScalarSummary> {
    let range = problem.functions.scalar_range();
    let list = problem.functions.scalars().iter().zip(range);
    list.zip(&evaluation.scalars)
        .map(|((scalar, index), value)| ScalarSummary {
            name: scalar.name.clone(),
            unit: scalar.unit.clone(),
            value: *value,
            standard_error: covariance.map(|c| c[(index, index)].sqrt()),
        })
        .collect()
}

/// The optimum on half the step: `None` where the readings do not lie on that grid, an error where there is no
/// motion on it.
pub type HalfStep = Result<Option<RefinedSummary>, Breakdown>;

/// The optimum on half the step.
pub fn refined(problem: &Problem, evaluation: &Evaluation) -> HalfStep {
    let Some(Refined {
        step,
        misfit,
        changes,
    }) = problem.on_half_step(evaluation)?
    else {
        return Ok(None);
    };
    let mut summary = RefinedSummary {
        step,
        misfit,
        change_per_residual: 0.0,
        change_per_reading: 0.0,
    };
    let channels = problem
        .channels()
        .zip(evaluation.predictions.iter().flatten());
    for ((channel, predicted), change) in channels.zip(changes.into_iter().flatten()) {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        let rms = kmcfit_core::internals::diagnostics::rms(&residuals);
        let largest = channel
            .observed()
            .iter()
            .fold(0.0f64, |m, y| m.max(y.abs()));
        let share = |of: f64| if change == 0.0 { 0.0 } else { change / of };
        summary.change_per_residual = summary.change_per_residual.max(share(rms));
        summary.change_per_reading = summary.change_per_reading.max(share(largest));
    }
    Ok(Some(summary))
}

/// A record that took no part in the fit.
pub(super) fn held_out(held: &HeldOut) -> HoldOutSummary {
    let channels = held.channels();
    let summaries = channels
        .iter()
        .map(|seen| channel(seen.channel, seen.note, seen.predicted));
    let mut summary = HoldOutSummary {
        name: held.out.experiment.name.clone(),
        channels: summaries.collect(),
        scalars: Vec::new(),
        failure: None,
    };
    match &held.found {
        Ok((problem, evaluation)) => {
            let covariance = problem.covariance(evaluation);
            summary.scalars = scalars(problem, evaluation, covariance.as_ref());
        }
        Err(breakdown) => summary.failure = Some(breakdown.to_string()),
    }
    summary
}

/// Standard error of a function that is one number.
pub fn standard_error(
    function: &CoefficientFunction,
    index: usize,
    covariance: Option<&DMatrix<f64>>,
) -> Option<f64> {
    let constant = matches!(function.basis, Some(Basis::Constant));
    let covariance = covariance.filter(|_| constant)?;
    Some(covariance[(index, index)].sqrt())
}

/// The probability that noise alone lets function `f` vary as much as it was found to, where the truth is constant: Wald's
/// test of its values `p` in the parameters `theta`. With their `covariance` `C` and the values `e` of the constant 1,
/// `min_a (p - a e)' C^-1 (p - a e)` has the chi-square law with one degree of freedom less than there are values; divided
/// by that number the F law, where the noise is known by the residuals only. `None` for a function that is no constant plus
/// something free, or constant by its basis, and under a robust loss, which leaves another covariance.
pub fn constant_probability(
    problem: &Problem,
    f: usize,
    theta: &[f64],
    covariance: &DMatrix<f64>,
) -> Option<f64> {
    let function = problem.functions.get(f);
    let range = problem.functions.ranges()[f].clone();
    let n = range.len();
    let one = match function.basis.as_ref()? {
        Basis::Constant => return None,
        Basis::Polynomial { .. } => DVector::from_fn(n, |i, _| f64::from(i == 0)),
        Basis::Nodal
        | Basis::PiecewiseConstant { .. }
        | Basis::PiecewiseLinear { .. }
        | Basis::BSpline { .. } => DVector::from_element(n, 1.0),
    };
    let is_robust = problem.channels().any(|c| c.loss() != Loss::Squares);
    if is_robust || function.offset.iter().any(|x| *x != 0.0) {
        return None;
    }
    let block = covariance.view((range.start, range.start), (n, n));
    let root = block.into_owned().cholesky()?.l();
    let values = root.solve_lower_triangular(&DVector::from_column_slice(&theta[range]))?;
    let one = root.solve_lower_triangular(&one)?;
    let along = values.dot(&one) / one.norm_squared();
    let distance = (values - one * along).norm_squared();
    let degrees = n.checked_sub(1)? as f64;
    let is_given =
        |c: &Channel| matches!(c.weighting(), Weighting::Sigma(_) | Weighting::Sigmas(_));
    let p = match problem.channels().all(is_given) {
        true => ChiSquared::new(degrees).ok()?.sf(distance),
        false => {
            let left = problem.reading_count().checked_sub(problem.parameters())?;
            let law = FisherSnedecor::new(degrees, left as f64).ok()?;
            law.sf(distance / degrees)
        }
    };
    p.is_finite().then_some(p)
}
