//! Overlaid figures of several runs, each with its own line style and its own time grid.

use super::Comparison;
use super::measures::Measures;
use super::run::{ComparedRun, ValidationChannel};
use super::table::short;
use crate::number_format::significant;
use crate::report::chart::{Axis, Colour, Dash, Figure, Mark, MarkKind, Panel, Style};
use crate::report::summary::count;
use kmcfit_core::internals::assessment::is_same_truth;
use kmcfit_core::internals::functions::Ratios;
use kmcfit_core::internals::system::NodalCoefficients;

/// Line style of run `index` in all figures; up to 24 runs differ in colour or dash pattern.
pub(super) fn style(index: usize) -> Style {
    // The last two colours, black and grey, are reserved for the true systems.
    let colour = Colour::nth(index % (Colour::ALL.len() - 2));
    let dash = Dash::nth(index + index / 12);
    // Dots are drawn larger than lines are wide.
    let width = if dash == Dash::Dotted { 2.2 } else { 1.6 };
    Style::new(colour).dash(dash).width(width)
}

/// The names of the figures.
pub(super) const NAMES: [&str; 5] = [
    "functions",
    "ratios",
    "validation",
    "residuals",
    "convergence",
];

/// Differences of curves below this share of their scale are not visible.
const INVISIBLE: f64 = 1e-6;

/// All figures of a comparison.
pub(super) fn all(comparison: &Comparison) -> Vec<Figure> {
    let figures = [
        functions(comparison),
        ratios(comparison),
        validation(comparison),
        residuals(comparison),
        convergence(comparison),
    ];
    figures.into_iter().flatten().collect()
}

/// The figure of the first screen: the function whose curves differ most; where all are constant, the residuals.
pub(super) fn main(comparison: &Comparison) -> Option<Figure> {
    let spread = |panel: &Panel| {
        let lines = panel
            .marks
            .iter()
            .filter(|mark| mark.kind == MarkKind::Line);
        let (low, high) = lines.map(|mark| span(&mark.y, SPIKES)).fold(EMPTY, union);
        (high - low) / scale(&comparison.runs, &panel.y.label)
    };
    let panels = functions(comparison).into_iter().flat_map(|f| f.panels);
    let most = panels
        .map(|panel| (spread(&panel), panel))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, panel)) = most else {
        let name = "main".to_owned();
        return residuals(comparison).map(|figure| Figure { name, ..figure });
    };
    let title = format!("{} of each model", panel.y.label);
    let figure = Figure::new("main", title, "The coefficient whose curves differ most.");
    Some(figure.panel(panel))
}

/// Largest magnitude of a function or ratio of all runs; of damping and c/m the critical value.
fn scale(runs: &[ComparedRun], label: &str) -> f64 {
    let size = |of: &dyn Fn(&NodalCoefficients) -> Vec<f64>| {
        let spans = runs
            .iter()
            .map(|run| span(&of(&run.finished.coefficients), SPIKES));
        let (low, high) = spans.fold(EMPTY, union);
        high.abs().max(low.abs())
    };
    let mass = || size(&|d| d.mass.clone());
    let stiffness = || size(&|d| d.coefficients[1].clone());
    let ratio = || size(&|d| Ratios::of(d).k_over_m);
    match label {
        "mass m" => mass(),
        "stiffness k" => stiffness(),
        "k/m" => ratio(),
        "c/m" => 2.0 * ratio().sqrt(),
        _ => 2.0 * (mass() * stiffness()).sqrt(),
    }
}

/// A curve of each system: caption, unit, values.
type Curve = (
    &'static str,
    &'static str,
    fn(&NodalCoefficients) -> Vec<f64>,
);

/// Mass, damping and stiffness of each run; `None` where all are constant.
pub(super) fn functions(Comparison { runs, measures, .. }: &Comparison) -> Option<Figure> {
    let curves: [Curve; 3] = [
        ("mass m", "kg", |d| d.mass.clone()),
        ("damping c", "N s/m", |d| d.coefficients[0].clone()),
        ("stiffness k", "N/m", |d| d.coefficients[1].clone()),
    ];
    let errors = list(measures, |m| {
        let e = m.errors?;
        let (m, c, k) = (e.mass, e.damping, e.stiffness);
        let [m, c, k] = [m, c, k].map(|x| significant(x, 2));
        Some(format!("m {m} kg, c {c} N s/m, k {k} N/m"))
    });
    let figure = Figure::new(
        "functions",
        "Mass, damping and stiffness",
        format!(
            "Coefficients of each run against time{}",
            over_the_truth(&errors)
        ),
    );
    overlay(figure, runs, &curves).varying()
}

/// Ratios of each run; `None` where all are constant.
pub(super) fn ratios(Comparison { runs, measures, .. }: &Comparison) -> Option<Figure> {
    let curves: [Curve; 2] = [
        ("k/m", "s⁻²", |d| Ratios::of(d).k_over_m),
        ("c/m", "s⁻¹", |d| Ratios::of(d).c_over_m),
    ];
    let errors = list(measures, |m| {
        let e = m.errors?;
        let (k, c) = (e.k_over_m, e.c_over_m);
        let [k, c] = [k, c].map(|x| significant(x, 2));
        Some(format!("k/m {k} per s², c/m {c} per s"))
    });
    let figure = Figure::new(
        "ratios",
        "Ratios k/m and c/m, identifiable without a force",
        format!(
            "Stiffness over mass and damping over mass of each run against time{}",
            over_the_truth(&errors)
        ),
    );
    overlay(figure, runs, &curves).varying()
}

fn over_the_truth(errors: &str) -> String {
    match errors {
        "" => ".".into(),
        errors => format!(", the truth as a thick grey line below them. Largest errors: {errors}."),
    }
}

/// `name: text; name: text` for the runs that have a text.
fn list(measures: &[Measures], of: impl Fn(&Measures) -> Option<String>) -> String {
    let one = |m: &Measures| Some(format!("{}: {}", m.name, of(m)?));
    let all: Vec<String> = measures.iter().filter_map(one).collect();
    all.join("; ")
}

fn overlay(figure: Figure, runs: &[ComparedRun], curves: &[Curve]) -> Figure {
    let truths = truths(runs);
    figure.panels(curves.iter().filter_map(|(label, unit, of)| {
        let found: Vec<Vec<f64>> = runs
            .iter()
            .map(|run| of(&run.finished.coefficients))
            .collect();
        let real: Vec<Vec<f64>> = truths.iter().map(|(_, _, truth)| of(truth)).collect();
        let all = found.iter().chain(&real).map(|f| span(f, 0.0));
        let (low, high) = all.fold(EMPTY, union);
        // Curves that are equal to this accuracy would be drawn on an axis of rounding errors.
        (high - low > INVISIBLE * scale(runs, label)).then_some(())?;
        let mut panel = Panel::of_time(*label, *unit);
        if let Some((low, high)) = without_spikes(&real, &found) {
            panel.y = panel.y.limits(low, high);
            panel.title = format!("cut off: {}", reaches(runs, &found, (low, high), unit));
        }
        let thick = Style::new(Colour::Grey).width(5.0);
        let truths = truths.iter().zip(&real);
        let truths = truths.map(|((label, run, _), y)| Mark::line(label, &run.times(), y, thick));
        let bands = runs.iter().enumerate().filter_map(|(i, run)| {
            let [low, high] = run.finished.band(band_name(label))?;
            let is_finite = low.iter().chain(&high).all(|x| x.is_finite());
            let style = style(i);
            let band = || Mark::band(&run.name, &run.times(), &low, &high, style.colour);
            is_finite.then(|| band().dash(style.dash))
        });
        let bands: Vec<Mark> = bands.collect();
        let found = runs.iter().zip(&found).enumerate();
        let found = found.map(|(i, (run, y))| Mark::line(&run.name, &run.times(), y, style(i)));
        Some(panel.marks(bands).marks(truths).marks(found))
    }))
}

/// Name of the band of a curve: `mass` of `mass m`.
fn band_name(label: &str) -> &str {
    label.split(' ').next().unwrap_or(label)
}

/// Share of the nodes, at either end of the sorted values of a run, that can be spikes.
const SPIKES: f64 = 0.03;
/// Spikes that extend the range by more than this factor are cut off, because they would flatten the curves.
const ROOM: f64 = 3.0;

/// Relative variation below which a curve is treated as constant.
const FLAT: f64 = 0.1;

/// The range of no values.
const EMPTY: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

fn union(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Range of the axis that excludes the spikes of some runs but includes all of `real`; `None` if no spikes need to be
/// cut off.
fn without_spikes(real: &[Vec<f64>], found: &[Vec<f64>]) -> Option<(f64, f64)> {
    let spans = |skip: f64| found.iter().map(move |f| span(f, skip)).fold(EMPTY, union);
    let truth = real.iter().map(|f| span(f, 0.0)).fold(EMPTY, union);
    let (all, most) = (union(truth, spans(0.0)), union(truth, spans(SPIKES)));
    let room = most.1 - most.0;
    // For constant values their magnitude is the reference.
    let room = room.max(FLAT * most.0.abs().max(most.1.abs()));
    let pad = 0.25 * room;
    let hidden = all.1 - all.0 > ROOM * room && room > 0.0;
    hidden.then_some((all.0.max(most.0 - pad), all.1.min(most.1 + pad)))
}

/// Lowest and highest finite value, without a share of the values at either end.
fn span(f: &[f64], skip: f64) -> (f64, f64) {
    let mut sorted: Vec<f64> = f.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let skipped = (skip * sorted.len() as f64) as usize;
    let kept = &sorted[skipped..sorted.len() - skipped];
    match (kept.first(), kept.last()) {
        (Some(low), Some(high)) => (*low, *high),
        _ => EMPTY,
    }
}

/// Runs with values outside the range, and these values.
fn reaches(
    runs: &[ComparedRun],
    found: &[Vec<f64>],
    (low, high): (f64, f64),
    unit: &str,
) -> String {
    let one = |(run, values): (&ComparedRun, &Vec<f64>)| {
        let (lowest, highest) = span(values, 0.0);
        let ends = [(lowest < low, lowest), (highest > high, highest)];
        let ends = ends.iter().filter(|(beyond, _)| *beyond);
        let ends: Vec<String> = ends.map(|(_, x)| format!("{} {unit}", short(*x))).collect();
        (!ends.is_empty()).then(|| format!("{} reaches {}", run.name, ends.join(" and ")))
    };
    let all: Vec<String> = runs.iter().zip(found).filter_map(one).collect();
    all.join(", ")
}

/// The true systems, each once, with label and the run that has its grid.
fn truths(runs: &[ComparedRun]) -> Vec<(String, &ComparedRun, &NodalCoefficients)> {
    let mut found: Vec<(&ComparedRun, &NodalCoefficients)> = Vec::new();
    let grid = |run: &'_ ComparedRun| run.finished.system.grid;
    for (run, truth) in runs
        .iter()
        .filter_map(|run| Some((run, run.finished.truth.as_ref()?)))
    {
        let is_same = |(other, known): &(&ComparedRun, &NodalCoefficients)| {
            is_same_truth((known, &grid(other)), (truth, &grid(run)))
        };
        if !found.iter().any(is_same) {
            found.push((run, truth));
        }
    }
    let several = found.len() > 1;
    let label = |run: &ComparedRun| match several {
        true => format!("truth of {}", run.name),
        false => "truth".to_string(),
    };
    found
        .into_iter()
        .map(|(run, truth)| (label(run), run, truth))
        .collect()
}

/// Samples of the validation records with the prediction of each run, one panel for each channel.
pub(super) fn validation(Comparison { runs, .. }: &Comparison) -> Option<Figure> {
    let mut channels: Vec<&ValidationChannel> = Vec::new();
    for channel in runs.iter().flat_map(|run| &run.validation) {
        if !channels.iter().any(|other| is_same_channel(other, channel)) {
            channels.push(channel);
        }
    }
    let panels: Vec<Panel> = channels
        .iter()
        .map(|channel| {
            let dots = Style::new(Colour::Black).width(2.4);
            let measured = Mark::points("measured", &channel.times, &channel.measured, dots);
            let predicted = runs.iter().enumerate().flat_map(|(i, run)| {
                let own = run.validation.iter();
                let own = own.filter(|other| is_same_channel(other, channel));
                own.map(move |c| Mark::line(&run.name, &c.times, &c.predicted, style(i)))
            });
            Panel::of_time(&channel.kind, &channel.unit)
                .title(&channel.record)
                .mark(measured)
                .marks(predicted)
        })
        .collect();
    let figure = Figure::new(
        "validation",
        "Validation records",
        "Samples that were not fitted, and the prediction of each model.",
    );
    (!panels.is_empty()).then(|| figure.panels(panels))
}

fn is_same_channel(one: &ValidationChannel, other: &ValidationChannel) -> bool {
    (&one.record, &one.kind, &one.unit) == (&other.record, &other.kind, &other.unit)
}

/// The residuals of the records, one panel for each name of an experiment.
pub(super) fn residuals(Comparison { runs, measures, .. }: &Comparison) -> Option<Figure> {
    let mut names: Vec<&str> = Vec::new();
    for response in runs.iter().flat_map(|run| &run.responses) {
        if !names.contains(&response.experiment.as_str()) {
            names.push(&response.experiment);
        }
    }
    let misfits = list(measures, |m| Some(format!("J/J0 {:.1e}", m.cost_ratio)));
    let figure = Figure::new(
        "residuals",
        "Residuals",
        format!("Fitted minus measured displacement of each run against time. {misfits}."),
    );
    let panels = names.iter().map(|name| {
        let title = if names.len() > 1 { *name } else { "" };
        let zero = Mark::horizontal("", 0.0, Style::new(Colour::Grey).width(0.8));
        let runs = runs.iter().enumerate().flat_map(|(i, run)| {
            let responses = run.responses.iter().filter(|m| m.experiment == *name);
            let style = style(i).width(1.2);
            responses.map(move |m| Mark::line(&run.name, &m.times, &m.residual, style))
        });
        let panel = Panel::of_time("y − y_obs", "m").title(title);
        panel.mark(zero).marks(runs)
    });
    (!names.is_empty()).then(|| figure.panels(panels))
}

/// `J/J0` against the iteration, both logarithmic, so that iteration 0 is not shown.
pub(super) fn convergence(Comparison { runs, measures, .. }: &Comparison) -> Option<Figure> {
    let ends = list(measures, |m| {
        Some(format!(
            "{:.1e} after {}",
            m.cost_ratio,
            count(m.iterations as usize, "iteration")
        ))
    });
    let lines = runs.iter().enumerate();
    let lines =
        lines.map(|(i, run)| Mark::line(&run.name, &run.iterations, &run.cost_ratio, style(i)));
    let panel = Panel::new(Axis::log("iteration", ""), Axis::log("cost J/J₀", "")).marks(lines);
    let figure = Figure::new(
        "convergence",
        "Convergence of J/J₀",
        format!("Cost over its first value against the iteration, both logarithmic. {ends}."),
    );
    // One iteration is no curve.
    let some = runs.iter().any(|run| run.iterations.len() > 1);
    some.then(|| figure.panel(panel))
}
