//! Plausibility of a fit: conditions under which its optimum identifies no system, and warnings about its intervals.

use super::doubt::{Doubt, Unidentified};
use super::input_correlation::coherent_residuals;
use super::input_disturbance::input_warnings;
use super::median_frequency::median_frequency;
use super::step_check::{StepCheckOutcome, step_check};
use crate::alternatives::POOR;
use crate::diagnostics::{ResidualDiagnostics, rms};
use crate::functions::CoefficientKind;
use crate::noise::CorrelationLaw;
use crate::objective::{Evaluation, all_diagnostics, channel_fit_percent};
use crate::problem::Problem;
use crate::record::{Channel, Loss, ScoreCovariance, Weighting};
use crate::signal::{median, median_spacing};
use crate::system::Excitation;
use nalgebra::Complex;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{PI, TAU};

/// Largest change of the predictions by halving the step, as a share of the largest sample; beyond it the step-size error
/// dominates the fit.
const STEPPER: f64 = 0.1;
/// NRMSE fit, per cent, below which a channel is unrelated to the model: residuals more than twice the variation of the samples.
const UNRELATED: f64 = -100.0;
/// Residuals of a channel over its stated sigma above which the two are inconsistent.
pub const BEYOND_SIGMA: f64 = 3.0;
/// Median of the size of a standard normal variable.
const MEDIAN_SIZE: f64 = 0.674_489_750_196_081_7;
/// p-value of the residuals under white noise below which they are certainly coloured.
const CERTAIN: f64 = 1e-6;
/// NRMSE fit, per cent, above which the residuals are rounding errors of the samples.
pub const EXACT: f64 = 99.99;
/// Fit, in per cent, from which residuals are rounding errors.
const ROUNDED: f64 = 100.0 - 1e-7;
/// Likelihood ratio above which white noise would be matched equally well.
const CHANCE: f64 = 1e-3;
/// Share of its natural scale below which a negative function counts as zero.
const NEGATIVE: f64 = 1e-3;
/// Share of mass times acceleration below which a force is negligible.
const IGNORED: f64 = 1e-3;
/// Periods per sample from which on the frequency is close to that of its first alias: two and a half samples per period.
const PERIODS_PER_SAMPLE: f64 = 0.4;
/// Largest deviation of equally spaced samples from their grid, as a share of the spacing.
const EVEN: f64 = 0.01;

/// Frequency of a pole, relative to the natural frequency, below which it is no resonance, and its bandwidth relative to its frequency.
const LOW: f64 = 0.15;
const NARROW: f64 = 0.25;
/// Order from which a process describes more than noise.
const MANY: usize = 8;

/// Plausibility of a fit.
#[derive(Debug, Clone)]
pub struct Plausibility {
    /// Reason for which the optimum identifies no system, if any.
    pub unidentified: Option<Unidentified>,
    /// Warnings.
    pub warnings: Vec<Doubt>,
    /// True if the standard errors of the linearised fit are meaningful.
    pub errors_hold: bool,
    /// True if the residuals of a channel are certainly not white, so that standard errors are too small.
    pub is_coloured: bool,
    /// True if the residuals are those of errors of a measured input or of a missing term, which the intervals exclude.
    pub is_disturbed: bool,
    /// Diagnostics of the residuals of each channel of each experiment.
    pub residuals: Vec<Vec<ResidualDiagnostics>>,
}

impl Plausibility {
    /// Plausibility of the optimum `evaluation`, given its step-size check; `reports_errors` is true if standard errors
    /// are reported also for samples without sigma, `lacks` if a candidate is preferred to the model.
    pub fn of(
        problem: &Problem,
        evaluation: &Evaluation,
        step_check: &StepCheckOutcome,
        reports_errors: bool,
        lacks: bool,
    ) -> Self {
        let unidentified = unidentified(problem, evaluation, step_check).or_else(|| {
            (reports_errors && noise_fits_equally(problem, evaluation))
                .then_some(Unidentified::Noise)
        });
        let residuals = all_diagnostics(problem, evaluation);
        let (coloured, poor) =
            coloured_and_poor(problem, evaluation, &residuals, reports_errors, lacks);
        let unexplained = unexplained(problem, evaluation)
            .or_else(|| coarse(problem, evaluation, step_check))
            .or_else(|| {
                let fits = residuals.iter().flatten().map(|found| found.fit_percent);
                let fit_percent = fits.fold(100.0, f64::min);
                poor.then_some(Doubt::PoorFit { fit_percent })
            });
        let aliased = aliased(problem, evaluation);
        let errors_hold = unidentified.is_none() && unexplained.is_none() && aliased.is_none();
        let inputs = match errors_hold && reports_errors {
            true => input_warnings(problem, evaluation),
            false => Vec::new(),
        };
        let is_disturbed = (inputs.iter()).any(|w| matches!(w, Doubt::DisturbedInput { .. }));
        // Stated errors of an input, and those that the residuals show, explain the correlation.
        let is_estimated =
            |c: &Channel| c.correlation().is_some_and(|c| c.input_errors().is_none());
        let is_correlated = !is_disturbed && problem.channels().any(is_estimated);
        let optimistic = match (errors_hold, coloured, is_correlated) {
            (true, true, _) => Some(Doubt::Coloured {
                covariance: score_covariance(problem),
            }),
            (true, false, true) => Some(Doubt::Correlated),
            _ => None,
        };
        // Coloured residuals, and errors of the input itself, have their own warnings.
        let coherent = match errors_hold && reports_errors && !coloured && !is_disturbed {
            true => coherent_residuals(problem, evaluation),
            false => None,
        };
        let warnings = unexplained
            .into_iter()
            .chain(inputs)
            .chain(coherent)
            .chain(optimistic)
            .chain(aliased);
        Self {
            warnings: warnings.chain(implausible(problem, evaluation)).collect(),
            unidentified,
            errors_hold,
            is_coloured: coloured,
            is_disturbed,
            residuals,
        }
    }

    /// Plausibility of the optimum `evaluation`, with standard errors reported for all samples.
    pub fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let step_check = step_check(problem, evaluation);
        Self::of(problem, evaluation, &step_check, true, true)
    }

    /// Marks a failed fit.
    pub fn fail(&mut self) {
        self.unidentified = Some(Unidentified::Failed);
        self.errors_hold = false;
    }
}

/// Covariance of the scores: a kernel where some channel has one.
fn score_covariance(problem: &Problem) -> ScoreCovariance {
    let mut all = problem.channels().map(|c| c.noise().scores);
    all.find(|scores| *scores == ScoreCovariance::Kernel)
        .unwrap_or_default()
}

/// True if the residuals of a channel are certainly coloured; and if such a channel is also fitted poorly. Large residuals that a process of low
/// order without a resonance makes white are noise, where the model lacks nothing.
fn coloured_and_poor(
    problem: &Problem,
    evaluation: &Evaluation,
    residuals: &[Vec<ResidualDiagnostics>],
    reports_errors: bool,
    lacks: bool,
) -> (bool, bool) {
    let frequency = median_frequency(problem, evaluation);
    let (mut coloured, mut poor) = (false, false);
    for (channel, found) in problem.channels().zip(residuals.iter().flatten()) {
        let is_judged = reports_errors || channel.weighting().sigma(0).is_some();
        let is_coloured = found.whiteness.p_value < CERTAIN && found.fit_percent < ROUNDED;
        if is_judged && (is_coloured || channel.correlation().is_some()) {
            coloured |= is_coloured;
            let is_noise = !lacks && !is_coloured && is_broad(channel, frequency);
            poor |= found.fit_percent < POOR && !is_noise;
        }
    }
    (coloured, poor)
}

/// True for noise of a channel by a process of low order without a resonance, which a term missing from the model leaves: no pair of poles at a
/// frequency `f > 0.15 f_n` has a bandwidth `-ln |z| / (pi dt) < f / 4`.
fn is_broad(channel: &Channel, natural_frequency: Option<f64>) -> bool {
    let Some(CorrelationLaw::Autoregressive(process)) = channel.correlation().map(|c| c.law())
    else {
        return false;
    };
    let spacing = median_spacing(channel.times());
    let least = LOW * natural_frequency.unwrap_or(0.0);
    let is_narrow = |pole: &Complex<f64>| {
        let frequency = pole.arg().abs() / (TAU * spacing);
        let bandwidth = -pole.norm().ln() / (PI * spacing);
        frequency > least && bandwidth < NARROW * frequency
    };
    process.order() < MANY && !process.poles().iter().any(is_narrow)
}

/// Reason for which no statement on the functions is meaningful, if any.
fn unidentified(
    problem: &Problem,
    evaluation: &Evaluation,
    step_check: &StepCheckOutcome,
) -> Option<Unidentified> {
    match step_check {
        Err(error) => return Some(Unidentified::NoResponseOnHalfStep { error: *error }),
        Ok(Some(half)) if half.change_per_sample > STEPPER => {
            return Some(Unidentified::StepDependent);
        }
        Ok(_) => {}
    }
    let predictions = evaluation.predictions.iter().flatten();
    let mut fits = (problem.channels().zip(predictions))
        .map(|(channel, predicted)| channel_fit_percent(channel, predicted))
        .peekable();
    let unrelated = fits.peek().is_some() && fits.all(|fit| fit < UNRELATED);
    unrelated.then_some(Unidentified::Unrelated)
}

/// True if a fit with as many parameters would match white noise as well, by the likelihood ratio of the system and of a constant
/// for each channel; a search among many frequencies has as many chances. Outliers are excluded.
fn noise_fits_equally(problem: &Problem, evaluation: &Evaluation) -> bool {
    let predictions = evaluation.predictions.iter().flatten();
    let (mut gain, mut samples) = (0.0, 0);
    for (channel, predicted) in problem.channels().zip(predictions) {
        let n = channel.len() as f64;
        let mean = channel.observed().iter().sum::<f64>() / n;
        let about = |y: &f64| (y - mean) * (y - mean);
        let constant: f64 = channel.observed().iter().map(about).sum();
        let left: f64 = channel.residuals(predicted).map(|r| r * r).sum();
        if channel.loss() != Loss::Squares || !(constant > 0.0 && left > 0.0) {
            return false;
        }
        gain += n * (constant / left).ln();
        samples += channel.len();
    }
    // With as many parameters as samples every record is matched, and the ratio carries no information.
    let Ok(law) = ChiSquared::new(problem.parameters() as f64) else {
        return false;
    };
    if problem.parameters() >= samples {
        return false;
    }
    let frequencies = samples as f64 / 2.0;
    gain.is_finite() && frequencies * law.sf(gain.max(0.0)) > CHANCE
}

/// Warning where halving the step changes the predictions by more than the residuals: the step-size error then dominates the
/// estimates.
fn coarse(
    problem: &Problem,
    evaluation: &Evaluation,
    step_check: &StepCheckOutcome,
) -> Option<Doubt> {
    let half = step_check.as_ref().ok()?.as_ref()?;
    let predictions = evaluation.predictions.iter().flatten();
    let mut fits = (problem.channels().zip(predictions))
        .map(|(channel, predicted)| channel_fit_percent(channel, predicted));
    // Samples simulated with these steps are matched to machine precision.
    let is_exact = fits.all(|fit| fit > EXACT);
    let times = half.change_per_residual;
    (times > 1.0 && !is_exact).then_some(Doubt::CoarseSteps { times })
}

/// Warnings about implausible optima.
fn implausible(problem: &Problem, evaluation: &Evaluation) -> Vec<Doubt> {
    let mut warnings = Vec::new();
    let sizes = problem.natural_scales(evaluation);
    let passive = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
    ];
    let values = problem
        .functions
        .coefficient_set(0)
        .iter()
        .zip(evaluation.nodal.functions());
    for (&f, values) in values {
        let function = problem.functions.get(f);
        let is_negative = median(values) < -NEGATIVE * sizes[f];
        if is_negative && function.parameters() > 0 && passive.contains(&function.quantity) {
            warnings.push(Doubt::Negative {
                function: function.name(),
            });
        }
    }
    let step = problem.system.grid.step();
    for (experiment, response) in problem.experiments.iter().zip(&evaluation.trajectories) {
        let excitation = experiment.excitation.as_ref();
        let force = excitation.and_then(|e| e.force(0));
        let force = force.filter(|_| problem.system.structure.is_one());
        let Some(force) = force.filter(|force| !force.is_zero()) else {
            continue;
        };
        let mass = &evaluation.nodal_of(experiment.coefficient_set).inertias[0];
        let inertia = response.velocity(0).windows(2).zip(mass);
        let inertia: Vec<f64> = inertia.map(|(v, m)| m * (v[1] - v[0]) / step).collect();
        if rms(&force.at_nodes()) < IGNORED * rms(&inertia) {
            warnings.push(Doubt::NegligibleForce {
                experiment: experiment.name.clone(),
            });
        }
    }
    warnings
}

/// Warning where the residuals of a channel exceed its stated sigma, so that standard errors are too small. Each channel is judged by itself,
/// whatever penalties, bounds and other channels do to the degrees of freedom: by the root mean square of its innovations over sigma, and
/// with a robust loss, which outliers may exceed, by the median of their sizes over that of a normal distribution.
fn unexplained(problem: &Problem, evaluation: &Evaluation) -> Option<Doubt> {
    let times_sigma = |(channel, predicted): (&Channel, &Vec<f64>)| match channel.weighting() {
        Weighting::Sigma(_) | Weighting::Sigmas(_) if channel.loss() == Loss::Squares => {
            (channel.cost(predicted) / channel.len() as f64).sqrt()
        }
        Weighting::Sigma(_) | Weighting::Sigmas(_) => {
            let sizes = channel.residuals(predicted).enumerate();
            let sizes = sizes.filter_map(|(i, r)| Some(r.abs() / channel.weighting().sigma(i)?));
            median(sizes.collect::<Vec<_>>()) / MEDIAN_SIZE
        }
        _ => 0.0,
    };
    let times = problem.predicted(evaluation).map(times_sigma);
    let times = times.fold(0.0, f64::max);
    (times > BEYOND_SIGMA).then_some(Doubt::BeyondSigma { times })
}

/// Warning for a system whose frequency is too high for the sampling: equally spaced samples of one kind of a free response of
/// frequency `f` equal those of a frequency `1/spacing - f`. Unequal spacing, a force, or a second kind of samples remove the
/// ambiguity; then `None`.
fn aliased(problem: &Problem, evaluation: &Evaluation) -> Option<Doubt> {
    let mut channels = problem.channels();
    let first = channels.next()?;
    let spacing = raster(first)?;
    let alike = |c: &Channel| {
        let same = raster(c).is_some_and(|s| (s - spacing).abs() <= EVEN * spacing);
        c.kind() == first.kind() && same
    };
    let driven =
        |excitation: &Option<Excitation>| excitation.as_ref().is_some_and(|e| !e.is_zero());
    let mut experiments = problem.experiments.iter();
    if !channels.all(alike) || experiments.any(|e| driven(&e.excitation)) {
        return None;
    }
    // Median over time, because k/m may be arbitrary at the ends of a record.
    let frequency = median_frequency(problem, evaluation)?;
    (frequency * spacing > PERIODS_PER_SAMPLE).then(|| Doubt::Aliased {
        per_period: 1.0 / (frequency * spacing),
        frequency,
    })
}

/// Smallest distance of samples, if all distances are multiples of it, s.
fn raster(channel: &Channel) -> Option<f64> {
    let times = channel.times();
    let distances = times.windows(2).map(|pair| pair[1] - pair[0]);
    let spacing = distances.reduce(f64::min).filter(|s| *s > 0.0)?;
    let on_raster = |t: &f64| {
        let position = (t - times[0]) / spacing;
        (position - position.round()).abs() <= EVEN
    };
    times.iter().all(on_raster).then_some(spacing)
}
