//! Suggestions: up to three actions that the result document recommends to the user, the most urgent first.

mod text;

use super::cost::CostKind;
use super::document::{ChannelSummary, ExperimentSummary, ResultDocument};
use crate::finding::Finding;
use kmcfit_core::internals::assessment::{BEYOND_SIGMA, EXACT, POOR, ResidualPattern};
use kmcfit_core::internals::diagnostics::SIGNIFICANCE;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::solvers::FEW_PARAMETERS;
use kmcfit_core::internals::solvers::{Solver, StartStrategy, Status};
use serde::{Deserialize, Serialize};

/// Residuals with a lower probability under white noise have a pattern.
const PATTERN: f64 = 1e-3;
/// Largest change of the response by halving the step, relative to its peak.
const COARSE: f64 = 1e-3;
/// Fit of a free record, per cent, below which an unknown force may act.
const HARDLY: f64 = 50.0;
/// Most suggestions.
const MOST: usize = 3;

/// A suggestion; in documents its kind and quantities.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Suggestion {
    /// A larger iteration limit.
    MoreIterations,
    /// A larger time limit.
    MoreTime,
    /// Resuming the fit.
    Resume,
    /// The Gauss-Newton method.
    AnotherMethod,
    /// Another starting point, softer constraints.
    AnotherStart,
    /// A finer grid.
    FinerSteps {
        /// True if the number of nodes can be automatic, and is not.
        automatic: bool,
    },
    /// A loss or a sensor model for a pattern in the residuals of a channel.
    Pattern {
        /// Kind of the channel.
        channel: String,
        /// True if its sigma is given.
        #[serde(skip)]
        has_sigma: bool,
        /// The pattern.
        pattern: ResidualPattern,
    },
    /// A larger sigma.
    LargerSigma {
        /// Root-mean-square residual over sigma.
        times: f64,
        /// Fit of the worst channel, per cent.
        fit: f64,
    },
    /// No change of the model: the residuals of a channel are noise.
    NoiseLimited {
        /// Kind of the channel.
        channel: String,
        /// Its fit, per cent.
        fit: f64,
    },
    /// No change of the model: outliers lower the fit of a channel with a robust loss.
    OutliersLimited {
        /// Kind of the channel.
        channel: String,
        /// Its fit, per cent.
        fit: f64,
    },
    /// A change of the input, the start or the functions for a record that is not fitted.
    Mismatch {
        /// Kind of the channel and name of the record, where there are several channels.
        channel: Option<(String, String)>,
        /// Fit, per cent.
        fit: f64,
        /// True if the start from the record was not tried.
        start_from_data: bool,
        /// The likeliest cause.
        #[serde(skip)]
        suspect: Suspect,
        /// Force terms that the model lacks.
        absent: Vec<&'static str>,
        /// True if automatic knots need a sigma.
        #[serde(skip)]
        without_sigma: bool,
    },
    /// The sigma of a measured input whose errors explain the residuals.
    StateInputSigma {
        /// The input, as its column in the model file.
        input: String,
        /// Likely sigma, in its SI unit.
        sigma: f64,
    },
    /// A term that the residuals of the equation of motion show.
    AddTerm {
        /// Key of its function.
        term: CoefficientKind,
        /// Start value, in its SI unit.
        start: f64,
    },
    /// A record at a second amplitude, which separates a dependence on time from one on the amplitude.
    SecondAmplitude,
    /// The offset of a sensor whose residuals have a mean.
    EstimateOffset {
        /// Kind of the channel.
        channel: String,
        /// Name of the experiment.
        experiment: String,
        /// True if a static force has the same effect.
        or_static_force: bool,
    },
    /// Correction of the unit or the scale of a channel.
    ScaleChannel {
        /// Kind of the channel.
        channel: String,
        /// Samples over the response.
        factor: f64,
    },
    /// Correction of the sign of an input.
    ReverseInput {
        /// Name of the experiment.
        experiment: String,
        /// Kinds of its channels.
        channels: Vec<String>,
    },
    /// Estimation of a delay.
    EstimateDelay {
        /// Name of the experiment.
        experiment: String,
        /// The channel or input whose samples are late: its only channel, or its input.
        channel: String,
        /// Its delay, s.
        delay: f64,
        /// True for a response that lags by half a sample, as under an input that is held between its samples; false for one that leads by
        /// half a sample; `None` for other delays.
        held: Option<bool>,
    },
    /// Correction of the times of the response for a clock at another rate.
    ScaleTimes {
        /// Name of the experiment.
        experiment: String,
        /// Excess of the time in the system over that on the clock of the response, per cent.
        percent: f64,
    },
    /// A smaller width of Coulomb friction, on which the estimates depend.
    NarrowFriction,
    /// A finer basis for a function whose basis is too coarse.
    FinerBasis {
        /// Name of the function.
        function: String,
        /// True if automatic knots need a sigma.
        #[serde(skip)]
        without_sigma: bool,
    },
    /// A constant in place of a function.
    Constant {
        /// Name of the function.
        function: String,
        /// p-value of Wald's test of a constant.
        p_value: f64,
    },
    /// Fewer parameters or a penalty, and a study of a model whose parameters are not all identifiable.
    StudyUnidentifiable {
        /// Number of parameters.
        parameters: usize,
        /// Upper bound of the number of identifiable parameter combinations.
        rank_bound: usize,
        /// True if fewer parameters or a penalty are an option.
        can_be_simpler: bool,
    },
}

/// Likeliest cause of a poor fit of a record.
#[derive(Debug, Clone, PartialEq)]
pub enum Suspect {
    /// The input (force or base motion), and the initial state unless it is estimated.
    Input {
        /// True for a base motion.
        is_base: bool,
        /// True if the initial state is given.
        start_is_given: bool,
    },
    /// An unknown force.
    UnknownForce,
    /// The coefficient functions.
    Functions,
}

/// The suggestions of a document, most urgent first; at most three.
pub fn suggestions(document: &ResultDocument) -> Vec<Finding> {
    let list = typed(document);
    list.iter().map(Finding::stated).collect()
}

fn typed(document: &ResultDocument) -> Vec<Suggestion> {
    let mut steps = Vec::new();
    steps.extend(about_ending(document));
    steps.extend(about_steps(document));
    let of_record = about_records(document);
    let is_explained = of_record.is_some();
    steps.extend(of_record);
    steps.extend(about_means(document));
    steps.extend(about_terms(document));
    let has_rival = document.fit_warning("time_or_amplitude").is_some();
    steps.extend(has_rival.then_some(Suggestion::SecondAmplitude));
    steps.extend(about_inputs(document));
    steps.extend(about_friction(document));
    // An error of the record explains the residuals.
    if !is_explained {
        steps.extend(about_bases(document).or_else(|| about_residuals(document)));
    }
    if wanders(document) {
        steps.rotate_left(1);
    }
    steps.extend(about_constants(document));
    let known = &document.identifiability;
    if document.is_simulated() && document.model.parameters > 0 {
        // Constraints may determine what the records do not.
        let is_open =
            known.rank_bound < known.parameters && document.fit_warnings().next().is_some();
        let is_smooth = document.cost.regularisation > 0.0;
        steps.extend(is_open.then(|| Suggestion::StudyUnidentifiable {
            parameters: known.parameters,
            rank_bound: known.rank_bound,
            can_be_simpler: !is_smooth && !changes_nothing(document),
        }));
    }
    steps.truncate(MOST);
    steps
}

/// Delays, in samples, like that of an input held between its samples.
const HALF_SAMPLE: std::ops::RangeInclusive<f64> = 0.4..=0.6;

/// Correction of an error of a record.
fn about_records(document: &ResultDocument) -> Option<Suggestion> {
    document.fit_warnings().find_map(|warning| {
        let text = |key: &str| Some(warning.quantities.get(key)?.as_str()?.to_owned());
        let number = |key: &str| warning.quantities.get(key)?.as_f64();
        let experiment = text("experiment");
        Some(match warning.kind.as_str() {
            "channel_factor" => Suggestion::ScaleChannel {
                channel: text("channel")?,
                factor: number("factor")?,
            },
            "input_sign" => Suggestion::ReverseInput {
                channels: (document.experiments.iter())
                    .filter(|e| Some(&e.name) == experiment.as_ref())
                    .flat_map(|e| e.channels.iter().map(|c| c.kind.clone()))
                    .collect(),
                experiment: experiment?,
            },
            "delay" => {
                let (experiment, delay, samples) =
                    (experiment?, number("delay")?, number("samples")?);
                let of_record = document.experiments.iter().find(|e| e.name == experiment)?;
                let (channel, delay) = match of_record.channels.as_slice() {
                    [only] => (only.kind.clone(), delay),
                    _ if of_record.driven_by.iter().any(|d| d == "force") => {
                        ("force".to_owned(), -delay)
                    }
                    _ => ("base_acceleration".to_owned(), -delay),
                };
                let is_half = HALF_SAMPLE.contains(&samples.abs());
                Suggestion::EstimateDelay {
                    experiment,
                    channel,
                    delay,
                    held: is_half.then_some(samples > 0.0),
                }
            }
            "clock_difference" => Suggestion::ScaleTimes {
                experiment: experiment?,
                percent: number("percent")?,
            },
            _ => return None,
        })
    })
}

/// The first function whose basis is too coarse.
fn about_bases(document: &ResultDocument) -> Option<Suggestion> {
    let coarse = document.fit_warning("coarse_basis")?;
    let function = coarse.quantities.get("function")?.as_str()?;
    Some(Suggestion::FinerBasis {
        function: function.to_owned(),
        without_sigma: without_sigma(document),
    })
}

/// The sensor with the most significant mean of its residuals, unless the mean is their dominant pattern
/// ([`about_residuals`]).
fn about_means(document: &ResultDocument) -> Option<Suggestion> {
    let means = document
        .fit_warnings()
        .filter(|w| w.kind == "residual_mean");
    let t = |w: &Finding| w.quantities.get("t").and_then(serde_json::Value::as_f64);
    let size = |w: &Finding| t(w).unwrap_or_default().abs();
    let worst = means.max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let text = |key: &str| Some(worst.quantities.get(key)?.as_str()?.to_owned());
    let channel = text("channel")?;
    let is_pattern = |c: &ChannelSummary| c.pattern == Some(ResidualPattern::Offset);
    if about_bases(document).is_none() && document.channels().any(is_pattern) {
        return None;
    }
    Some(Suggestion::EstimateOffset {
        channel,
        experiment: text("experiment")?,
        or_static_force: worst.quantities.get("or_static_force")?.as_bool()?,
    })
}

/// The most significant missing term of an equation of motion.
fn about_terms(document: &ResultDocument) -> Option<Suggestion> {
    let missing = document.fit_warning("missing_term")?;
    let term = missing.quantities.get("term")?;
    Some(Suggestion::AddTerm {
        term: CoefficientKind::deserialize(term).ok()?,
        start: missing.quantities.get("value")?.as_f64()?,
    })
}

/// A smaller width of Coulomb friction, unless an automatic one is the smallest that the grid permits.
fn about_friction(document: &ResultDocument) -> Option<Suggestion> {
    let depends = document.fit_warning("friction_width").is_some();
    let is_limited = document.warnings.iter().any(|w| w.kind == "width_limited");
    (depends && !is_limited).then_some(Suggestion::NarrowFriction)
}

fn about_inputs(document: &ResultDocument) -> Option<Suggestion> {
    let disturbed = document.fit_warning("disturbed_input")?;
    Some(Suggestion::StateInputSigma {
        input: disturbed.quantities.get("input")?.as_str()?.to_owned(),
        sigma: disturbed.quantities.get("sigma")?.as_f64()?,
    })
}

/// The function whose constancy is not rejected at the level [`SIGNIFICANCE`], with the largest p-value.
fn about_constants(document: &ResultDocument) -> Option<Suggestion> {
    let functions = document.functions.iter();
    let probable = functions.filter_map(|(name, f)| Some((name, f.constant_p_value?)));
    let (name, p_value) = probable.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (p_value >= SIGNIFICANCE).then(|| Suggestion::Constant {
        function: name.clone(),
        p_value,
    })
}

/// True if the Gauss-Newton method reached the iteration limit with a poor fit, which suggests a wrong model rather
/// than too few iterations.
fn wanders(document: &ResultDocument) -> bool {
    document.outcome.status == Status::MaxIterations
        && document.model.method == Solver::GaussNewton.name()
        && document.worst_fit().is_some_and(|worst| worst < POOR)
}

/// A finer grid where the step-size check fails; an automatic number of nodes where a fit refines it.
fn about_steps(document: &ResultDocument) -> Option<Suggestion> {
    let half = document.step_check.as_ref()?;
    let is_exact = document.worst_fit().is_some_and(|worst| worst > EXACT);
    let beside_residuals = match is_exact {
        true => 0.0,
        false => half.change_per_residual,
    };
    if half.change_per_sample <= COARSE && beside_residuals <= 1.0 {
        return None;
    }
    let model = &document.model;
    let refines = [Solver::GaussNewton, Solver::ProjectedGradient];
    let is_refined = refines.iter().any(|solver| model.method == solver.name());
    let is_automatic = |f: &Finding| f.kind.starts_with("nodes_from");
    let automatic = is_refined
        && model.parameters <= FEW_PARAMETERS
        && !document.automatic.iter().any(is_automatic);
    Some(Suggestion::FinerSteps { automatic })
}

/// Likeliest cause of a poor fit of a record: its input, if it has one.
fn suspect(document: &ResultDocument, record: &ExperimentSummary) -> Suspect {
    let Some(drive) = record.driven_by.first() else {
        let worst = (record.channels.iter()).fold(100.0f64, |least, c| least.min(c.fit_percent));
        return match worst < HARDLY {
            true => Suspect::UnknownForce,
            false => Suspect::Functions,
        };
    };
    let start = format!("initial displacement of {}", record.name);
    Suspect::Input {
        is_base: drive == "base",
        start_is_given: !document.nuisance_parameters.iter().any(|s| s.name == start),
    }
}

/// Force terms that the model lacks.
fn absent(document: &ResultDocument) -> Vec<&'static str> {
    let terms = ["cubic_stiffness", "quadratic_damping", "coulomb_friction"];
    let has = |term: &&str| document.model.terms.iter().any(|t| t == term);
    terms.into_iter().filter(|term| !has(term)).collect()
}

/// True if every function is constant.
fn changes_nothing(document: &ResultDocument) -> bool {
    document.functions.values().all(|f| f.min == f.max)
}

/// The suggestion from patterns, size and whiteness of the residuals.
fn about_residuals(document: &ResultDocument) -> Option<Suggestion> {
    let channels = || document.channels();
    // The equation error supports robust losses and bands, but estimates no sensor.
    let is_possible = |pattern: &ResidualPattern| {
        let is_of_sensor = matches!(pattern, ResidualPattern::Offset | ResidualPattern::Drift);
        document.is_simulated() || !is_of_sensor
    };
    let pattern = |c: &ChannelSummary| c.pattern.clone().filter(is_possible);
    let mut patterns = channels().filter_map(|c| Some((c, pattern(c)?)));
    if let Some((channel, pattern)) = patterns.next() {
        return Some(Suggestion::Pattern {
            channel: channel.kind.clone(),
            has_sigma: channel.sigma.is_some(),
            pattern,
        });
    }
    let fit = document.worst_fit().unwrap_or(100.0);
    let times = document.statistics.reduced_chi_square.map(f64::sqrt);
    if let Some(times) = times.filter(|times| *times > BEYOND_SIGMA && fit > POOR) {
        return Some(Suggestion::LargerSigma { times, fit });
    }
    let is_coloured = |c: &ChannelSummary| {
        c.sigma.is_some()
            && c.fit_percent < EXACT
            && (c.noise.as_ref().is_some_and(|noise| !noise.input_errors)
                || c.whiteness_p_value.is_some_and(|p| p < PATTERN))
    };
    let named = document.experiments.iter();
    let mut named = named.flat_map(|e| e.channels.iter().map(move |c| (e, c)));
    let poor = |c: &ChannelSummary| c.fit_percent.is_finite() && c.fit_percent < POOR;
    let (record, channel) = named.find(|(_, channel)| poor(channel))?;
    let fit = channel.fit_percent;
    let kind = channel.kind.clone();
    let has_outliers = |sigma: f64| channel.rms_residual > BEYOND_SIGMA * sigma;
    if channel.robust && channel.sigma.is_some_and(has_outliers) {
        return Some(Suggestion::OutliersLimited { channel: kind, fit });
    }
    let is_white = channel.whiteness_p_value.is_some_and(|p| p >= SIGNIFICANCE);
    if channel.sigma.is_some() && is_white && !is_coloured(channel) {
        return Some(Suggestion::NoiseLimited { channel: kind, fit });
    }
    let start = StartStrategy::StartValues.name();
    let tried = document.attempts.iter().any(|r| r.start != start);
    Some(Suggestion::Mismatch {
        channel: (channels().count() > 1).then(|| (kind, record.name.clone())),
        fit,
        start_from_data: !tried && document.is_simulated(),
        suspect: suspect(document, record),
        absent: absent(document),
        without_sigma: without_sigma(document),
    })
}

/// True if automatic knots need a sigma: for a fit of the response without one in some channel.
fn without_sigma(document: &ResultDocument) -> bool {
    matches!(
        document.model.cost_kind,
        CostKind::Integral | CostKind::Mixed
    )
}

fn about_ending(document: &ResultDocument) -> Option<Suggestion> {
    let is_newton = document.model.method == Solver::GaussNewton.name();
    match document.outcome.status {
        Status::MaxIterations => Some(Suggestion::MoreIterations),
        Status::TimeLimit => Some(Suggestion::MoreTime),
        Status::Interrupted => Some(Suggestion::Resume),
        Status::Stalled if !is_newton => Some(Suggestion::AnotherMethod),
        // The minimum of an equation error does not depend on the start.
        Status::Infeasible if !document.is_simulated() => None,
        Status::Stalled | Status::Infeasible | Status::Failed => Some(Suggestion::AnotherStart),
        Status::Converged | Status::Completed => None,
    }
}

/// A percentage; one far below zero in powers of ten.
pub(super) fn percent(share: f64, digits: usize) -> String {
    match share > -1000.0 {
        // Zero has no sign.
        true if share.abs() < 0.5 * 0.1f64.powi(digits as i32) => format!("{:.digits$} %", 0.0),
        true => format!("{share:.digits$} %"),
        false => format!("{share:.0e} %"),
    }
}
