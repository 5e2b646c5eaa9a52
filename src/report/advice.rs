//! What to try next. The summary in the terminal and the page say the same.

use super::document::{ChannelSummary, ExperimentSummary, PatternSummary, ResultDocument};
use crate::digits::significant;
use kmcfit_core::internals::assessment::{BEYOND_SIGMA, EXACT, POOR};
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
    steps.extend(about_constants(document));
    let known = &document.identifiability;
    let is_simulated = document.model.method != Solver::EquationError.name();
    if is_simulated && document.model.parameters > 0 {
        // Constraints may hold what the readings do not show.
        let is_open = known.seen < known.of && !known.open.is_empty();
        let is_smooth = document.cost.regularisation > 0.0;
        let visible = format!(
            "{} free values, {} of them visible at most",
            known.of, known.seen
        );
        steps.push(match (is_open, is_smooth || changes_nothing(document)) {
            (true, false) => format!(
                "{visible}: fewer (knots), or add `smooth`; `kmcfit study` tells which are seen"
            ),
            (true, true) => format!("{visible}: `kmcfit study` tells which are seen"),
            (false, _) => "`kmcfit study` tells how sure each function is, and with `study.candidates` which experiment would \
                      show most"
                .into(),
        });
    }
    steps.truncate(MOST);
    steps
}

/// A function that varies no more than noise lets a constant vary.
fn about_constants(document: &ResultDocument) -> Option<String> {
    let functions = document.functions.iter();
    let probable = functions.filter_map(|(name, f)| Some((name, f.constant_p_value?)));
    let (name, p) = probable.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (p >= SIGNIFICANCE).then(|| {
        format!(
            "a constant {name} would match as well (p = {}): basis: constant",
            significant(p, 1)
        )
    })
}

/// Whether the iterations ran out on a model that is wrong: where it is right, steps of Gauss and Newton need few.
fn wanders(document: &ResultDocument) -> bool {
    document.outcome.status == Status::MaxIterations.name()
        && document.model.method == Solver::GaussNewton.name()
        && worst_fit(document).is_some_and(|worst| worst < POOR)
}

/// Steps that are too long, with as many nodes as would do by the order of the stepper.
fn about_steps(document: &ResultDocument) -> Option<String> {
    let half = document.half_step.as_ref()?;
    let is_exact = worst_fit(document).is_some_and(|worst| worst > EXACT);
    let beside_residuals = match is_exact {
        true => 0.0,
        false => half.change_per_residual,
    };
    // A tenth of the residuals is hidden by them.
    let times = (half.change_per_reading / COARSE).max(10.0 * beside_residuals);
    if half.change_per_reading <= COARSE && beside_residuals <= 1.0 {
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
    Some(format!("the steps are coarse: grid.nodes={nodes}"))
}

/// Whether the initial state of a record is sought.
fn start_is_sought(document: &ResultDocument, record: &str) -> bool {
    let scalar = format!("initial displacement of {record}");
    document.scalars.iter().any(|s| s.name == scalar)
}

/// What a record asks for that is hardly matched: its drive is doubted first.
fn about_mismatch(document: &ResultDocument, record: &ExperimentSummary) -> String {
    let drive = match record.driven_by.first().map(String::as_str) {
        None => {
            let worst =
                (record.channels.iter()).fold(100.0f64, |least, c| least.min(c.fit_percent));
            let unknown = match worst < HARDLY {
                true => {
                    ", or, if something unknown keeps it moving, compare accelerations instead of motions (fit.method=equation-error)"
                }
                false => "",
            };
            return more_freedom(document) + unknown;
        }
        Some("base") => "the motion of the base",
        Some(_) => "the force",
    };
    let start = match start_is_sought(document, &record.name) {
        true => "",
        false => ", and the motion the right start (initial: estimate)",
    };
    format!(
        "look whether {drive} has the right sign (`gain: -1` of a sensor turns it), unit and times{start}; or {}",
        more_freedom(document)
    )
}

/// Functions that change more, and terms that the model does not have.
fn more_freedom(document: &ResultDocument) -> String {
    let terms = [
        ("cubic_stiffness", ""),
        ("quadratic_damping", ""),
        ("coulomb_friction", " with its width"),
    ];
    let absent = terms
        .iter()
        .filter(|(term, _)| !document.model.terms.iter().any(|t| t == term));
    let absent: Vec<String> = absent.map(|(term, more)| format!("{term}{more}")).collect();
    let functions = "let a function change more (basis: piecewise-linear, more knots)";
    match absent.is_empty() {
        true => functions.into(),
        false => format!("{functions}, or add a term ({})", absent.join(", ")),
    }
}

/// Whether no function changes with time.
fn changes_nothing(document: &ResultDocument) -> bool {
    document.functions.values().all(|f| f.min == f.max)
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
    let tried = document
        .rungs
        .iter()
        .any(|r| r.start != StartStrategy::StartValues.name());
    let is_simulated = document.model.method != Solver::EquationError.name();
    let elsewhere = match tried || !is_simulated {
        true => "",
        false => "start from the readings (fit.initial=data), or ",
    };
    let poor = |c: &&ChannelSummary| c.fit_percent.is_finite() && c.fit_percent < POOR;
    let told = |c: &ChannelSummary| c.sigma.is_some() && c.whiteness_p_value.is_some();
    let named = document.experiments.iter();
    let mut named = named.flat_map(|e| e.channels.iter().map(move |c| (e, c)));
    match named.find(|(_, channel)| poor(channel)) {
        Some((_, channel)) if told(channel) && !is_coloured(&channel) => {
            let is_white = |p: f64| p >= SIGNIFICANCE;
            let left = match channel.whiteness_p_value.is_some_and(is_white) {
                true => "looks like noise",
                false => "is nearly noise",
            };
            Some(format!(
                "the {} is matched to {} only, but what is left {left}: no other device would do much better",
                channel.kind,
                percent(channel.fit_percent, 0)
            ))
        }
        Some((record, channel)) => {
            let matched = percent(channel.fit_percent, 0);
            let what = match channels().count() {
                1 => "the readings are".to_owned(),
                _ => format!("the {} of {} is", channel.kind, record.name),
            };
            let more = about_mismatch(document, record);
            Some(format!(
                "{what} matched to {matched} only: {elsewhere}{more}"
            ))
        }
        None => channels()
            .any(|c| is_coloured(&c))
            .then(|| format!("the residuals have a pattern: {}", more_freedom(document))),
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
        PatternSummary::Tone { frequency, beside } => {
            let end = if frequency > beside { "max" } else { "min" };
            format!(
                "the residuals of the {kind} swing at {} Hz, the readings at {}: of a hum or another mode a band leaves \
                 little (band: {{{end}: {}}}) in the experiment",
                significant(*frequency, 3),
                significant(*beside, 3),
                significant((frequency * beside).sqrt(), 2)
            )
        }
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
