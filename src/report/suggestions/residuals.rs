//! Suggestions from the size and the patterns of the residuals.

use super::{Suggestion, is_poor, of_channel};
use crate::config::Model;
use crate::report::document::{ChannelSummary, ExperimentSummary, ResultDocument};
use kmcfit_core::assessment::{BEYOND_SIGMA, Doubt, EXACT, POOR, ResidualPattern};
use kmcfit_core::candidates::Candidate;
use kmcfit_core::diagnostics::SIGNIFICANCE;
use kmcfit_core::number_format::{percent, significant, times_in_words};
use kmcfit_core::solvers::StartStrategy;

/// Residuals with a lower probability under white noise have a pattern.
const PATTERN: f64 = 1e-3;
/// Fit of a free record, per cent, below which an unknown force may act.
const HARDLY: f64 = 50.0;

/// The suggestion from the first pattern in the residuals of a channel, or from a sigma that is too small.
pub(super) fn about_patterns(document: &ResultDocument) -> Option<Suggestion> {
    // The equation error supports robust losses and bands, but estimates no sensor.
    let is_possible = |pattern: &ResidualPattern| match pattern {
        ResidualPattern::Offset | ResidualPattern::Drift => document.is_simulated(),
        ResidualPattern::Tone { frequency, beside } => {
            !is_of_system(document, *frequency) && band(document, *frequency, *beside).is_some()
        }
        ResidualPattern::Outliers { .. } => true,
    };
    let pattern = |c: &ChannelSummary| c.pattern.clone().filter(is_possible);
    let mut patterns = document
        .channels()
        .filter_map(|c| Some((&c.kind, pattern(c)?)));
    if let Some((channel, pattern)) = patterns.next() {
        return Some(of_pattern(document, channel, &pattern));
    }
    let fit = document.worst_fit().unwrap_or(100.0);
    let times = document.doubts().find_map(|doubt| match doubt {
        Doubt::BeyondSigma { times } => Some(*times),
        _ => None,
    })?;
    let estimated = document.experiments.iter().enumerate().flat_map(|(i, e)| {
        (e.channels.iter()).map(move |c| format!("experiments.{i}.sigma.{}=estimate", c.kind))
    });
    (fit > POOR).then(|| {
        Suggestion::change(
            "larger_sigma",
            format!(
                "sigma is too small: the residuals are {} times sigma although the fit is {}; estimate it",
                times_in_words(times),
                percent(fit, 2)
            ),
            estimated.collect(),
        )
    })
}

/// True for a frequency within the half-power width of the system, to the resolution of the record: no other source is its cause.
fn is_of_system(document: &ResultDocument, frequency: f64) -> bool {
    let value = |name: &str| document.estimates.get(name).map(|estimate| estimate.value);
    let (natural, ratio) = (value("natural_frequency"), value("damping_ratio"));
    let resolution = 1.0 / document.model.duration;
    let width = |natural: f64| ratio.map_or(0.0, |ratio| ratio.abs() * natural) + resolution;
    natural.is_some_and(|natural| (frequency - natural).abs() <= width(natural))
}

/// The end of a band, and its frequency, that parts a tone from the response at `beside` and from the system, whose natural frequency may be
/// another one; `None` for a tone between these.
fn band(document: &ResultDocument, tone: f64, beside: f64) -> Option<(&'static str, f64)> {
    let natural = document.estimates.get("natural_frequency");
    let natural = natural.map_or(beside, |estimate| estimate.value);
    let (end, nearest) = match tone > beside {
        true => ("max", beside.max(natural)),
        false => ("min", beside.min(natural)),
    };
    let is_apart = (tone > beside) == (tone > nearest);
    is_apart.then(|| (end, (tone * nearest).sqrt()))
}

fn of_pattern(document: &ResultDocument, channel: &str, pattern: &ResidualPattern) -> Suggestion {
    let of = |what: &str, keys: &[&str]| {
        let change = |i: usize| {
            let each = keys.iter();
            each.map(|key| format!("experiments.{i}.{key}")).collect()
        };
        let text = format!("{channel}: {what}");
        (text, of_channel(document, channel, change))
    };
    let offset = format!("sensors.{channel}.offset=estimate");
    let drift = format!("sensors.{channel}.drift=estimate");
    let (kind, (text, overrides)) = match pattern {
        ResidualPattern::Outliers { samples, first } => {
            let outliers = match samples {
                1 => format!("one outlier, at {first} s"),
                _ => format!("{samples} outliers, the first at {first} s"),
            };
            let what = format!("{outliers}: use a robust loss");
            (
                "robust_loss",
                of(&what, &[&format!("loss.{channel}=huber")]),
            )
        }
        ResidualPattern::Offset => (
            "estimate_offset",
            of("the residuals have an offset: estimate it", &[&offset]),
        ),
        ResidualPattern::Drift => (
            "estimate_drift",
            of(
                "the residuals drift: estimate offset and drift",
                &[&offset, &drift],
            ),
        ),
        ResidualPattern::Tone { frequency, beside } => {
            let found = band(document, *frequency, *beside);
            let set = found.map(|(end, limit)| format!("band.{end}={}", super::written(limit)));
            let what = format!(
                "the residuals oscillate at {} Hz, the response at {} Hz (mains hum or another mode): restrict the frequency band",
                significant(*frequency, 3),
                significant(*beside, 3)
            );
            (
                "restrict_band",
                of(&what, &set.iter().map(String::as_str).collect::<Vec<_>>()),
            )
        }
    };
    Suggestion::change(kind, text, overrides)
}

/// Suggestions for the first channel that is fitted poorly.
pub(super) fn about_misfit(document: &ResultDocument, model: &Model) -> Vec<Suggestion> {
    let records = document.experiments.iter().enumerate();
    let mut named = records.flat_map(|(i, e)| e.channels.iter().map(move |c| (i, e, c)));
    // No change of a model with one mode explains two.
    let explains = |doubt: &Doubt| match doubt {
        Doubt::Preferred { candidates } => candidates.first().is_some_and(Candidate::explains),
        _ => true,
    };
    if document.has_two_modes() && document.doubts().all(explains) {
        return Vec::new();
    }
    let Some((i, record, channel)) = named.find(|(_, _, c)| is_poor(c.fit_percent)) else {
        return Vec::new();
    };
    let (kind, fit) = (&channel.kind, percent(channel.fit_percent, 0));
    let has_outliers = |sigma: f64| channel.rms_residual > BEYOND_SIGMA * sigma;
    if channel.robust && channel.sigma.is_some_and(has_outliers) {
        return vec![Suggestion::outside(
            "outliers_limited",
            format!(
                "{kind}: outliers cause the low fit of {fit}; the robust loss limits their influence on the estimates"
            ),
        )];
    }
    let is_white = channel.whiteness_p_value.is_some_and(|p| p >= SIGNIFICANCE);
    if channel.sigma.is_some() && is_white && !is_coloured(channel) {
        return vec![Suggestion::outside(
            "noise_limited",
            format!(
                "{kind}: fit {fit}, but the residuals have no significant autocorrelation: measurement noise limits the fit, not the model"
            ),
        )];
    }
    of_record(document, i, record, model)
}

fn is_coloured(channel: &ChannelSummary) -> bool {
    channel.sigma.is_some()
        && channel.fit_percent < EXACT
        && (channel
            .noise
            .as_ref()
            .is_some_and(|noise| !noise.input_errors)
            || channel.whiteness_p_value.is_some_and(|p| p < PATTERN))
}

/// Overrides for the equation error, which takes no estimated offset: those of the fit are stated.
fn equation_of_motion(
    document: &ResultDocument,
    i: usize,
    record: &ExperimentSummary,
) -> Vec<String> {
    let of_channel = |c: &ChannelSummary| {
        let mut estimated = document.nuisance_parameters.iter();
        let is_offset = |name: &str| {
            name.contains("offset") && name.contains(&c.kind) && name.contains(&record.name)
        };
        let offset = estimated.find(|scalar| is_offset(&scalar.name))?;
        let value = super::written(offset.value);
        Some(format!("experiments.{i}.sensors.{}.offset={value}", c.kind))
    };
    let offsets = record.channels.iter().filter_map(of_channel);
    offsets
        .chain(["fit={method: equation-error}".to_owned()])
        .collect()
}

/// Changes of the start, the sensors and the method for a record that the fit does not explain.
fn of_record(
    document: &ResultDocument,
    i: usize,
    record: &ExperimentSummary,
    model: &Model,
) -> Vec<Suggestion> {
    let name = &record.name;
    let mut steps = Vec::new();
    let start = StartStrategy::StartValues.name();
    let is_tried = document.attempts.iter().any(|r| r.start != start);
    if document.is_simulated() && !is_tried {
        steps.push(Suggestion::change(
            "start_from_data",
            "start from the record",
            vec!["fit.initial=data".to_owned()],
        ));
    }
    let Some(drive) = record.driven_by.first() else {
        let worst = (record.channels.iter()).fold(100.0f64, |least, c| least.min(c.fit_percent));
        if worst < HARDLY && document.is_simulated() && model.is_kept_up() {
            steps.push(Suggestion::change(
                "equation_of_motion",
                "if an unmeasured force acts, fit the equation of motion",
                equation_of_motion(document, i, record),
            ));
        }
        return steps;
    };
    let sensors = |key: &str| -> Vec<String> {
        let channels = record.channels.iter();
        channels
            .map(|c| format!("experiments.{i}.sensors.{}.{key}", c.kind))
            .collect()
    };
    if drive == "base" {
        steps.push(Suggestion::change(
            "absolute",
            format!("{name}: if the response is measured relative to the ground, not to the base, say so"),
            sensors("absolute=true"),
        ));
    }
    let initial = format!("initial displacement of {name}");
    if !document
        .nuisance_parameters
        .iter()
        .any(|s| s.name == initial)
    {
        steps.push(Suggestion::change(
            "estimate_initial",
            format!("{name}: estimate the initial state"),
            vec![format!("experiments.{i}.initial=estimate")],
        ));
    }
    steps
}
