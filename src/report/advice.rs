//! What to try next. The summary in the terminal and the page say the same.

use super::document::ResultDocument;
use super::meaning::{BEYOND_SIGMA, EXACT, POOR};
use super::measured::{ChannelSummary, PatternSummary};
use crate::dynamics::Method;
use crate::solvers::{Solver, Status};

/// Residuals with a lower probability under white noise have a pattern.
const PATTERN: f64 = 1e-3;
/// Half the step may change the model's readings by this share of the largest one.
const COARSE: f64 = 1e-3;
/// Name of the rung that starts from the model's start values.
const FROM_START_VALUES: &str = "start values";
/// So many things to try next are enough.
const MOST: usize = 3;

/// The worst fit of a channel, per cent.
pub fn worst_fit(document: &ResultDocument) -> Option<f64> {
    let channels = document.experiments.iter().flat_map(|e| &e.channels);
    channels
        .map(|c| c.fit_percent)
        .filter(|x| x.is_finite())
        .reduce(f64::min)
}

/// What to try next, the most urgent first; at most three.
pub fn next(document: &ResultDocument) -> Vec<String> {
    let mut steps = Vec::new();
    steps.extend(about_ending(document));
    steps.extend(about_steps(document));
    steps.extend(about_residuals(document));
    if wanders(document) {
        steps.rotate_left(1);
    }
    let known = &document.identifiability;
    let is_simulated = document.model.method != Solver::EquationError.name();
    if is_simulated && document.model.parameters > 0 {
        // Constraints may hold what the readings do not show.
        steps.push(match known.seen < known.of && !known.open.is_empty() {
            true => format!(
                "{} free values, {} of them visible at most: fewer (knots), or add `smooth`; `kmcfit study` tells \
                 which are seen",
                known.of, known.seen
            ),
            false => "`kmcfit study` tells how sure each function is, and with `study.candidates` which experiment would \
                      show most"
                .into(),
        });
    }
    steps.truncate(MOST);
    steps
}

/// Whether the iterations ran out on a model that is wrong: where it is right, steps of Gauss and Newton need few.
fn wanders(document: &ResultDocument) -> bool {
    document.outcome.status == Status::MaxIterations.name()
        && document.model.method == Solver::GaussNewton.name()
        && worst_fit(document).is_some_and(|worst| worst < POOR)
}

/// Steps that are too long, with as many nodes as would do by the order of the stepper.
fn about_steps(document: &ResultDocument) -> Option<String> {
    let change = document.half_step.as_ref()?.change_per_reading;
    if change <= COARSE {
        return None;
    }
    let stepper = match document.model.stepper == Method::Midpoint.name() {
        true => Method::Midpoint,
        false => Method::Rk4,
    };
    // By more than 16 it is not the order that rules any more.
    let finer = (change / COARSE)
        .powf(1.0 / f64::from(stepper.order()))
        .clamp(2.0, 16.0)
        .ceil();
    let nodes = (document.model.nodes - 1) as f64 * finer + 1.0;
    Some(format!("the steps are coarse: grid.nodes={nodes}"))
}

/// Whether a force or a motion of the base acts in a record.
fn is_driven(document: &ResultDocument) -> bool {
    document.experiments.iter().any(|e| e.driven)
}

/// Whether the initial state of every record is sought.
fn starts_are_sought(document: &ResultDocument) -> bool {
    let sought = |name: &str| {
        let scalar = format!("initial displacement of {name}");
        document.scalars.iter().any(|s| s.name == scalar)
    };
    document.experiments.iter().all(|e| sought(&e.name))
}

/// What the residuals ask for.
fn about_residuals(document: &ResultDocument) -> Option<String> {
    let channels = || document.experiments.iter().flat_map(|e| &e.channels);
    let patterns = channels().filter_map(|c| Some((c, c.pattern.as_ref()?)));
    if let Some((channel, pattern)) = patterns.into_iter().next() {
        return Some(about_pattern(channel, pattern));
    }
    let squares = document.statistics.reduced_chi_square;
    let worst = worst_fit(document).unwrap_or(100.0);
    if let Some(squares) = squares.filter(|squares| squares.sqrt() > BEYOND_SIGMA && worst > POOR) {
        return Some(format!(
            "the residuals are {:.1} times sigma, and the readings are matched to {}: sigma is too small (sigma: estimate)",
            squares.sqrt(),
            percent(worst, 2)
        ));
    }
    let is_coloured = |c: &&ChannelSummary| {
        c.sigma.is_some()
            && c.fit_percent < EXACT
            && c.whiteness_p_value.is_some_and(|p| p < PATTERN)
    };
    let tried = document.rungs.iter().any(|r| r.start != FROM_START_VALUES);
    let is_simulated = document.model.method != Solver::EquationError.name();
    let elsewhere = match tried || !is_simulated {
        true => "",
        false => "start from the readings (fit.initial=data), or ",
    };
    // Outliers that a robust loss leaves aside are none of the fit's business.
    let poor = |c: &&ChannelSummary| c.fit_percent.is_finite() && c.fit_percent < POOR && !c.robust;
    let told = |c: &ChannelSummary| c.sigma.is_some() && c.whiteness_p_value.is_some();
    let named = document.experiments.iter();
    let mut named = named.flat_map(|e| e.channels.iter().map(move |c| (&e.name, c)));
    match named.find(|(_, channel)| poor(channel)) {
        Some((_, channel)) if told(channel) && !is_coloured(&channel) => Some(format!(
            "the {} is matched to {} only, but what is left looks like noise: no other device would do much better",
            channel.kind,
            percent(channel.fit_percent, 0)
        )),
        Some((name, channel)) => {
            let matched = percent(channel.fit_percent, 0);
            let what = match channels().count() {
                1 => "the readings are".to_owned(),
                _ => format!("the {} of {name} is", channel.kind),
            };
            let more = match (is_driven(document), starts_are_sought(document)) {
                (true, true) => {
                    "look whether the force has the right sign (`gain: -1` of a sensor turns it), unit and times"
                }
                (true, false) => {
                    "look whether the force has the right sign (`gain: -1` of a sensor turns it), unit and times, and \
                     the motion the right start (initial: estimate)"
                }
                _ => "let a function change more (basis: piecewise-linear, more knots), or add a term",
            };
            Some(format!(
                "{what} matched to {matched} only: {elsewhere}{more}"
            ))
        }
        None => channels().any(|c| is_coloured(&c)).then(|| {
            "the residuals have a pattern: let a function change more, or add a term (cubic_stiffness, \
             quadratic_damping, coulomb_friction with its width)"
                .into()
        }),
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

fn about_pattern(channel: &ChannelSummary, pattern: &PatternSummary) -> String {
    let kind = &channel.kind;
    match pattern {
        PatternSummary::FarOff { readings, first } => {
            let lie = match readings {
                1 => format!("one reading of the {kind} lies far off, at {first} s"),
                _ => {
                    format!("{readings} readings of the {kind} lie far off, the first at {first} s")
                }
            };
            let sigma = match channel.sigma {
                Some(_) => "",
                None => ", with `sigma`",
            };
            format!("{lie}: a robust loss (loss: {{{kind}: huber}}{sigma}) in the experiment")
        }
        PatternSummary::Offset => format!(
            "the residuals of the {kind} have an offset: sensors: {{{kind}: {{offset: estimate}}}} in the experiment"
        ),
        PatternSummary::Drift => format!(
            "the residuals of the {kind} drift: sensors: {{{kind}: {{offset: estimate, drift: estimate}}}} in the \
             experiment"
        ),
    }
}

fn about_ending(document: &ResultDocument) -> Option<String> {
    let status = document.outcome.status.as_str();
    let is = |s: Status| s.name() == status;
    let newton = Solver::GaussNewton.name();
    Some(match () {
        () if is(Status::MaxIterations) => format!(
            "the iterations ran out: fit.stop.iterations={}",
            10 * document.counts.iterations.max(1)
        ),
        () if is(Status::TimeLimit) => "the time ran out: a larger fit.stop.seconds".into(),
        () if is(Status::Interrupted) => "`kmcfit resume` goes on with this fit".into(),
        () if is(Status::Stalled) && document.model.method != newton => {
            format!("the search is stuck: fit.method={newton}")
        }
        () if is(Status::Stalled) || is(Status::Infeasible) || is(Status::Failed) => {
            "start elsewhere: fit.initial=data, or other start values; soften constraints (soft)"
                .into()
        }
        () => return None,
    })
}
