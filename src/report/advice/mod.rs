//! Recommendations. The summary in the terminal and the page say the same.

mod wording;

use super::document::{ChannelSummary, ExperimentSummary, ResultDocument};
use kmcfit_core::internals::assessment::{BEYOND_SIGMA, EXACT, POOR, ResidualPattern};
use kmcfit_core::internals::diagnostics::SIGNIFICANCE;
use kmcfit_core::internals::solvers::{Solver, StartStrategy, Status};
use kmcfit_core::internals::system::Method;

/// Residuals with a lower probability under white noise have a pattern.
const PATTERN: f64 = 1e-3;
/// Half the step may change the model's readings by this share of the largest one.
const COARSE: f64 = 1e-3;
/// A free record that is matched to less, per cent, may be none.
const HARDLY: f64 = 50.0;
/// So many things to try next are enough.
const MOST: usize = 3;

/// A recommendation.
#[derive(Debug, Clone, PartialEq)]
pub enum Advice {
    /// A larger limit on iterations.
    MoreIterations(u64),
    /// A larger limit on time.
    MoreTime,
    /// To resume the fit.
    Resume,
    /// Gauss and Newton's method.
    AnotherMethod,
    /// Another starting point, softer constraints.
    AnotherStart,
    /// So many nodes.
    FinerSteps(f64),
    /// What the pattern of the residuals of a channel asks for.
    Pattern {
        /// Kind of the channel.
        kind: String,
        /// Whether its sigma is known.
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
    /// No other system: the residuals of a channel are noise.
    NoneBetter {
        /// Kind of the channel.
        kind: String,
        /// Its fit, per cent.
        fit: f64,
        /// Whether the residuals pass for white noise.
        is_white: bool,
    },
    /// Another model of a record that is not matched.
    Mismatch {
        /// Kind of the channel and name of the record, where there are several channels.
        channel: Option<(String, String)>,
        /// Fit, per cent.
        fit: f64,
        /// Whether the start from the readings was not tried.
        from_readings: bool,
        /// The first suspect.
        suspect: Suspect,
        /// Force terms that the model does not have.
        absent: Vec<&'static str>,
    },
    /// More freedom for residuals with a pattern that has no name.
    MoreFreedom {
        /// Force terms that the model does not have.
        absent: Vec<&'static str>,
    },
    /// A constant in place of a function.
    Constant {
        /// Name of the function.
        function: String,
        /// Probability that noise alone lets it vary as much.
        p_value: f64,
    },
    /// A study of a model whose parameters are not all identifiable.
    StudyOfHidden {
        /// Number of parameters, and the bound on those that are identifiable.
        parameters: [usize; 2],
        /// Whether fewer parameters or a penalty are left to try.
        can_be_simpler: bool,
    },
    /// A study.
    Study,
}

/// The first suspect where a record is hardly matched.
#[derive(Debug, Clone, PartialEq)]
pub enum Suspect {
    /// The force, or the motion of the base, and the initial state, unless that is estimated.
    Drive {
        /// Whether the base drives it.
        is_base: bool,
        /// Whether the initial state is given.
        start_is_given: bool,
    },
    /// An unknown force.
    UnknownForce,
    /// The functions alone.
    Functions,
}

/// Recommendations, the most urgent first; at most three.
pub fn next(document: &ResultDocument) -> Vec<Advice> {
    let mut steps = Vec::new();
    steps.extend(about_ending(document));
    steps.extend(about_steps(document));
    steps.extend(about_residuals(document));
    if wanders(document) {
        steps.rotate_left(1);
    }
    steps.extend(about_constants(document));
    let known = &document.identifiability;
    if document.is_simulated() && document.model.parameters > 0 {
        // Constraints may hold what the readings do not show.
        let is_open = known.seen < known.of && !known.open.is_empty();
        let is_smooth = document.cost.regularisation > 0.0;
        steps.push(match is_open {
            true => Advice::StudyOfHidden {
                parameters: [known.of, known.seen],
                can_be_simpler: !is_smooth && !changes_nothing(document),
            },
            false => Advice::Study,
        });
    }
    steps.truncate(MOST);
    steps
}

/// A function that varies no more than noise lets a constant vary.
fn about_constants(document: &ResultDocument) -> Option<Advice> {
    let functions = document.functions.iter();
    let probable = functions.filter_map(|(name, f)| Some((name, f.constant_p_value?)));
    let (name, p_value) = probable.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (p_value >= SIGNIFICANCE).then(|| Advice::Constant {
        function: name.clone(),
        p_value,
    })
}

/// Whether the iterations ran out on a model that is wrong: where it is right, steps of Gauss and Newton need few.
fn wanders(document: &ResultDocument) -> bool {
    document.outcome.status == Status::MaxIterations
        && document.model.method == Solver::GaussNewton.name()
        && document.worst_fit().is_some_and(|worst| worst < POOR)
}

/// Steps that are too long, with as many nodes as would do by the order of the stepper.
fn about_steps(document: &ResultDocument) -> Option<Advice> {
    let half = document.half_step.as_ref()?;
    let is_exact = document.worst_fit().is_some_and(|worst| worst > EXACT);
    let beside_residuals = match is_exact {
        true => 0.0,
        false => half.change_per_residual,
    };
    // A tenth of the residuals is hidden by them.
    let times = (half.change_per_sample / COARSE).max(10.0 * beside_residuals);
    if half.change_per_sample <= COARSE && beside_residuals <= 1.0 {
        return None;
    }
    let stepper = match document.model.stepper == Method::Midpoint.name() {
        true => Method::Midpoint,
        false => Method::Rk4,
    };
    // By more than 16 it is not the order that rules any more.
    let finer = times
        .powf(1.0 / f64::from(stepper.order()))
        .clamp(2.0, 16.0)
        .ceil();
    let nodes = (document.model.nodes - 1) as f64 * finer + 1.0;
    Some(Advice::FinerSteps(nodes))
}

/// The first suspect where a record is hardly matched: its drive, if it has one.
fn suspect(document: &ResultDocument, record: &ExperimentSummary) -> Suspect {
    let Some(drive) = record.driven_by.first() else {
        let worst = (record.channels.iter()).fold(100.0f64, |least, c| least.min(c.fit_percent));
        return match worst < HARDLY {
            true => Suspect::UnknownForce,
            false => Suspect::Functions,
        };
    };
    let start = format!("initial displacement of {}", record.name);
    Suspect::Drive {
        is_base: drive == "base",
        start_is_given: !document.scalars.iter().any(|s| s.name == start),
    }
}

/// Terms that the model does not have.
fn absent(document: &ResultDocument) -> Vec<&'static str> {
    let terms = ["cubic_stiffness", "quadratic_damping", "coulomb_friction"];
    let has = |term: &&str| document.model.terms.iter().any(|t| t == term);
    terms.into_iter().filter(|term| !has(term)).collect()
}

/// Whether no function changes with time.
fn changes_nothing(document: &ResultDocument) -> bool {
    document.functions.values().all(|f| f.min == f.max)
}

/// What the residuals ask for.
fn about_residuals(document: &ResultDocument) -> Option<Advice> {
    let channels = || document.channels();
    let mut patterns = channels().filter_map(|c| Some((c, c.pattern.clone()?)));
    if let Some((channel, pattern)) = patterns.next() {
        return Some(Advice::Pattern {
            kind: channel.kind.clone(),
            has_sigma: channel.sigma.is_some(),
            pattern,
        });
    }
    let fit = document.worst_fit().unwrap_or(100.0);
    let times = document.statistics.reduced_chi_square.map(f64::sqrt);
    if let Some(times) = times.filter(|times| *times > BEYOND_SIGMA && fit > POOR) {
        return Some(Advice::LargerSigma { times, fit });
    }
    let is_coloured = |c: &ChannelSummary| {
        c.sigma.is_some()
            && c.fit_percent < EXACT
            && c.whiteness_p_value.is_some_and(|p| p < PATTERN)
    };
    let named = document.experiments.iter();
    let mut named = named.flat_map(|e| e.channels.iter().map(move |c| (e, c)));
    let poor = |c: &ChannelSummary| c.fit_percent.is_finite() && c.fit_percent < POOR;
    let Some((record, channel)) = named.find(|(_, channel)| poor(channel)) else {
        let absent = absent(document);
        return channels()
            .any(is_coloured)
            .then_some(Advice::MoreFreedom { absent });
    };
    let fit = channel.fit_percent;
    let kind = channel.kind.clone();
    if let (Some(_), Some(p), false) = (
        channel.sigma,
        channel.whiteness_p_value,
        is_coloured(channel),
    ) {
        let is_white = p >= SIGNIFICANCE;
        return Some(Advice::NoneBetter {
            kind,
            fit,
            is_white,
        });
    }
    let start = StartStrategy::StartValues.name();
    let tried = document.rungs.iter().any(|r| r.start != start);
    Some(Advice::Mismatch {
        channel: (channels().count() > 1).then(|| (kind, record.name.clone())),
        fit,
        from_readings: !tried && document.is_simulated(),
        suspect: suspect(document, record),
        absent: absent(document),
    })
}

fn about_ending(document: &ResultDocument) -> Option<Advice> {
    let is_newton = document.model.method == Solver::GaussNewton.name();
    match document.outcome.status {
        Status::MaxIterations => Some(Advice::MoreIterations(
            10 * document.counts.iterations.max(1),
        )),
        Status::TimeLimit => Some(Advice::MoreTime),
        Status::Interrupted => Some(Advice::Resume),
        Status::Stalled if !is_newton => Some(Advice::AnotherMethod),
        Status::Stalled | Status::Infeasible | Status::Failed => Some(Advice::AnotherStart),
        Status::Converged | Status::Completed => None,
    }
}

/// A share in per cent; one far below zero in powers of ten.
pub(super) fn percent(share: f64, digits: usize) -> String {
    match share > -1000.0 {
        // Nothing is matched to less than nothing by rounding.
        true if share.abs() < 0.5 * 0.1f64.powi(digits as i32) => format!("{:.digits$} %", 0.0),
        true => format!("{share:.digits$} %"),
        false => format!("{share:.0e} %"),
    }
}
