//! Experiment design: information gained by an additional record.
//!
//! Each candidate is simulated at the present parameters, and its Jacobian is appended to that of the existing records.
//! **New directions** are the increase of the rank. For directions that are determined already, standard errors
//! decrease: with singular values `s` before and `t` after, restricted to the directions determined before,
//!
//! ```text
//! volume  (D) = exp(mean(ln s - ln t))
//! ```
//!
//! is a ratio of standard errors, after to before; 1 is no gain (Pukelsheim, *Optimal Design of Experiments*).

use super::columns::stacked;
use super::covariance::Information;
use super::factorisation::Factorisation;
use super::quantities::Quantities;
use super::scaling_ambiguity::ScalingAmbiguity;
use super::sensitivity::Sensitivity;
use crate::diagnostics::{NORMAL_975, rms};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Experiment, Weighting};
use nalgebra::{DMatrix, DVector};

/// Share of the slope of a mean in undetermined combinations from which the mean is undetermined.
const HIDDEN: f64 = 1e-6;
/// Ratio of half-widths, after to before, above which no gain is named.
const GAINED: f64 = 0.99;

/// Root-mean-square residual of the first channel, used as noise level of candidates without sigma.
fn residual_spread(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let pairs = problem
        .channels()
        .zip(evaluation.predictions.iter().flatten());
    let mut spreads = pairs.map(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        rms(&residuals)
    });
    spreads.next().unwrap_or(1.0).max(f64::MIN_POSITIVE.sqrt())
}

/// Information gained by a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Number of additional directions determined.
    pub new_directions: usize,
    /// True if the candidate determines the common scale of the functions, at least at some times, which requires a force;
    /// `None` where the scale is determined already.
    pub sees_scale: Option<bool>,
    /// D: ratio of the geometric mean of the standard errors, after to before.
    pub volume: f64,
    /// The function whose mean over the record gains most, where all samples have a sigma.
    pub narrowed: Option<Narrowed>,
}

/// Half-width of the 95 % interval of the mean of a function, relative to the mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Narrowed {
    /// Name of the function.
    pub function: String,
    /// With the existing records.
    pub before: f64,
    /// With the candidate.
    pub after: f64,
}

/// A candidate with its gain, or the reason for a failed simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranked {
    /// Name.
    pub name: String,
    /// Gain.
    pub gain: Result<Gain, String>,
}

impl Ranked {
    /// Gain as a sentence.
    pub fn sentence(&self) -> String {
        match &self.gain {
            Err(reason) => format!("`{}` cannot be simulated: {reason}", self.name),
            Ok(gain) => {
                let scale = match gain.sees_scale {
                    Some(true) => ", including the common scale",
                    Some(false) => ", excluding the common scale",
                    None => "",
                };
                let more = match gain.new_directions {
                    0 => "no additional parameter combination".to_owned(),
                    1 => format!("1 additional parameter combination{scale}"),
                    many => format!("{many} additional parameter combinations{scale}"),
                };
                let factor = format!("{:.3}", gain.volume);
                let narrowed = gain.narrowed.as_ref().map(|of| {
                    let [before, after] = [of.before, of.after].map(|share| {
                        let percent = 100.0 * share;
                        let digits = (1.0 - percent.log10().floor()).clamp(0.0, 6.0) as usize;
                        format!("{percent:.digits$}")
                    });
                    format!(
                        "; the 95 % half-width of the mean {} falls from {before} to {after} %",
                        of.function
                    )
                });
                let narrowed = narrowed.unwrap_or_default();
                let gained = match (gain.new_directions, factor == "1.000") {
                    (0, true) => format!(
                        "`{}`: {more}; standard errors unchanged (factor {factor})",
                        self.name
                    ),
                    (0, false) => format!(
                        "`{}`: {more}; standard errors change by a factor {factor}",
                        self.name
                    ),
                    _ => format!(
                        "`{}`: {more}; standard errors of the others change by a factor {factor}",
                        self.name
                    ),
                };
                gained + &narrowed
            }
        }
    }
}

/// Ranks the candidates: by new directions, then by `volume`; candidates that cannot be simulated come last. Penalties are no
/// information.
pub fn rank_experiments(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    candidates: &[Experiment],
) -> Vec<Ranked> {
    let sensitivity = Sensitivity::of(problem, evaluation);
    let information = Information::new(problem, theta, sensitivity);
    let now = &information.sensitivity().jacobian;
    let known = Factorisation::of(now);
    let determined = known.rank;
    let ambiguity = ScalingAmbiguity::at(problem, theta);
    let spread = residual_spread(problem, evaluation);
    let gain = |candidate: &Experiment| -> Result<Gain, String> {
        let experiment = with_sigmas(candidate, spread);
        let added = jacobian(problem, theta, experiment.clone(), &information)?;
        let rank = Factorisation::of(&stacked(now, &added)).rank;
        let before = &known.singular_values[..determined];
        let old = DMatrix::from_diagonal(&DVector::from_column_slice(before));
        let both = stacked(&old, &(&added * known.determined()));
        let with_candidate = Factorisation::of(&both);
        let narrowed = narrowed(problem, theta, &information, [&known, &with_candidate]);
        let after = with_candidate.singular_values;
        let logs = before.iter().zip(&after).map(|(s, t)| s.ln() - t.ln());
        Ok(Gain {
            new_directions: rank.saturating_sub(determined),
            sees_scale: (!ambiguity.is_empty())
                .then(|| fixes_scale(problem, theta, experiment, &ambiguity)),
            volume: (logs.sum::<f64>() / determined.max(1) as f64).exp(),
            narrowed,
        })
    };
    let each = candidates.iter().map(|candidate| Ranked {
        name: candidate.name.clone(),
        gain: gain(candidate),
    });
    let mut ranked: Vec<Ranked> = each.collect();
    let key = |r: &Ranked| match &r.gain {
        Ok(gain) => (false, usize::MAX - gain.new_directions, gain.volume),
        Err(_) => (true, 0, 0.0),
    };
    ranked.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
    });
    ranked
}

/// The estimated function whose mean is determined by the existing records (their rows factorised first) and gains most by a candidate
/// (second, in the combinations that the first determines).
fn narrowed(
    problem: &Problem,
    theta: &[f64],
    information: &Information,
    [known, with_candidate]: [&Factorisation; 2],
) -> Option<Narrowed> {
    let has_sigmas = problem.channels().all(|c| c.weighting().is_sigma());
    has_sigmas.then_some(())?;
    let directions = &information.sensitivity().directions;
    let means = Quantities::at(problem, theta).functions;
    let each = means.into_iter().filter_map(|mean| {
        let along = DVector::from_vec(directions.row(mean.gradient));
        let inside = known.determined().tr_mul(&along);
        let hidden = (along.norm_squared() - inside.norm_squared())
            .max(0.0)
            .sqrt();
        (inside.norm() > 0.0 && hidden <= HIDDEN * along.norm()).then_some(())?;
        let before = known.inverse_root().tr_mul(&along).norm();
        let after = with_candidate.inverse_root().tr_mul(&inside).norm();
        let half = |error: f64| NORMAL_975 * error / mean.value.abs();
        Some(Narrowed {
            function: mean.name,
            before: half(before),
            after: half(after),
        })
    });
    let ratio = |of: &Narrowed| of.after / of.before;
    let best = each.filter(|of| ratio(of).is_finite());
    let best = best.min_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
    (ratio(&best) < GAINED).then_some(best)
}

/// True if one more record reduces the scaling ambiguity.
fn fixes_scale(
    problem: &Problem,
    theta: &[f64],
    record: Experiment,
    ambiguity: &ScalingAmbiguity,
) -> bool {
    let mut with = problem.clone();
    with.parts_mut().experiments.push(record);
    ScalingAmbiguity::at(&with, theta).directions.len() < ambiguity.directions.len()
}

/// The candidate with a stated sigma in each channel: its own, or `spread`.
fn with_sigmas(candidate: &Experiment, spread: f64) -> Experiment {
    let mut experiment = candidate.clone();
    for channel in &mut experiment.channels {
        let sigma = channel.weighting().sigma(0).unwrap_or(spread);
        *channel = channel.clone().with_weighting(Weighting::Sigma(sigma));
    }
    experiment
}

/// Jacobian of the record along the directions of the existing records.
fn jacobian(
    problem: &Problem,
    theta: &[f64],
    record: Experiment,
    information: &Information,
) -> Result<DMatrix<f64>, String> {
    let mut trial = problem.clone();
    trial.parts_mut().experiments = vec![record];
    let evaluation = trial.evaluate(theta).map_err(|b| b.to_string())?;
    let directions = information.sensitivity().directions.clone();
    let jacobian = Sensitivity::along(&trial, &evaluation, directions).jacobian;
    match jacobian.iter().all(|x| x.is_finite()) {
        true => Ok(jacobian),
        false => Err("its derivatives overflow".into()),
    }
}
