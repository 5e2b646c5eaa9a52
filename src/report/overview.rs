//! Overview of a model file before a fit: data as read, units, sampling, start values, what the samples can determine, and a verdict.

use super::findings;
use crate::config::{ChannelNote, Model};
use kmcfit_core::assessment::Doubt;
use kmcfit_core::diagnostics::standard_deviation;
use kmcfit_core::finding::Finding;
use kmcfit_core::functions::{CoefficientFunction, Ratio};
use kmcfit_core::identifiability::{ScalingAmbiguity, Sensitivity, structural_rank};
use kmcfit_core::number_format::significant;
use kmcfit_core::objective::Evaluation;
use kmcfit_core::problem::FEW_PARAMETERS;
use kmcfit_core::record::{Channel, Experiment};
use kmcfit_core::signal::{Spectrum, median_spacing};

/// Largest deviation of distances from multiples of the median one, relative to it, of regular samples with gaps: rounded times have some.
const REGULAR: f64 = 0.05;

/// The overview as text, one statement a line.
pub fn overview(model: &Model) -> String {
    let mut lines = Vec::new();
    let own = model.problem.experiments.iter().zip(&model.notes);
    let validation = model.validation.iter().map(|v| (&v.experiment, &v.notes));
    for (experiment, notes) in own.chain(validation) {
        for (channel, note) in experiment.channels.iter().zip(notes) {
            lines.extend(of_channel(experiment, channel, note));
        }
    }
    lines.extend(Finding::texts(&model.data));
    let assumed = model.assumptions();
    let units = assumed.filter(|doubt| matches!(doubt, Doubt::UnitsAssumed { .. }));
    lines.extend(units.map(|units| format!("units: {}", units.sentence())));
    let grid = &model.problem.system.grid;
    lines.push(format!(
        "{}: {} nodes over {} s ({}), {} parameters, {}",
        model.title,
        grid.nodes(),
        grid.duration(),
        model.problem.system.method.name(),
        model.problem.functions.parameters(),
        model.settings.solver.name(),
    ));
    let start = model.problem.evaluate(&model.problem.start());
    let (known, mut reasons) = identifiability(model, start.as_ref().ok());
    match &start {
        Ok(evaluation) => lines.push(start_values(model, evaluation)),
        Err(error) => reasons.push(format!("the start values have no response: {error}")),
    }
    lines.extend(known);
    lines.push(verdict(model, &reasons));
    lines.join("\n") + "\n"
}

/// Samples, sampling, frequency and size of a channel.
fn of_channel(experiment: &Experiment, channel: &Channel, note: &ChannelNote) -> Vec<String> {
    let (name, kind, unit) = (&experiment.name, note.kind.name(), note.unit.symbol());
    let mut lines = vec![format!(
        "{name}: {} samples of the {kind} in {unit} ({})",
        channel.len(),
        note.format
    )];
    let ignored = note.ignored.iter();
    lines.extend(ignored.map(|(count, reason)| {
        format!("{name}: {count} samples of the {kind} not used: {reason}")
    }));
    let times = channel.times();
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return lines;
    };
    let spacing = match times.len() {
        0 | 1 => return lines,
        _ => median_spacing(times),
    };
    let on_raster = |pair: &[f64]| {
        let steps = (pair[1] - pair[0]) / spacing;
        (steps - steps.round()).abs() <= REGULAR && steps.round() >= 1.0
    };
    let every = match times.windows(2).all(on_raster) {
        true => format!(
            "one every {} s ({} Hz)",
            significant(spacing, 4),
            significant(1.0 / spacing, 4)
        ),
        false => format!(
            "at irregular times, about one every {} s",
            significant(spacing, 4)
        ),
    };
    let [from, to] = [*first, *last].map(|time| significant(time, 4));
    let frequency = Spectrum::of(channel.observed(), spacing).map(|spectrum| spectrum.dominant());
    let frequency = frequency.filter(|f| f.is_finite() && *f > 0.0).map(|f| {
        let periods = significant(f * (last - first), 2);
        format!(
            "; dominant frequency {} Hz, {periods} periods",
            significant(f, 4)
        )
    });
    let size = standard_deviation(channel.observed()) / note.unit.factor();
    lines.push(format!(
        "{name}: {every} from {from} to {to} s{}; standard deviation {} {unit}",
        frequency.unwrap_or_default(),
        significant(size, 3)
    ));
    lines
}

/// Means of the functions at the start values, with natural frequency and damping ratio.
fn start_values(model: &Model, evaluation: &Evaluation) -> String {
    let problem = &model.problem;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let values = problem.functions.values(&problem.functions.start());
    let functions = problem.functions.iter().zip(&values);
    let is_stated =
        |function: &CoefficientFunction| !(model.has_unknown_mass && function.name() == "mass");
    let functions =
        functions
            .filter(|(function, _)| is_stated(function))
            .map(|(function, values)| {
                let over = if model.has_unknown_mass {
                    " / mass"
                } else {
                    ""
                };
                let text = format!(
                    "{}{over} {} {}",
                    function.name(),
                    significant(mean(values), 4),
                    model.unit(function)
                );
                text.trim_end().to_owned()
            });
    let functions: Vec<String> = functions.collect();
    let mean = |ratio: Ratio| mean(&ratio.at_nodes(problem.system.laws(), &evaluation.nodal));
    let ratios = [Ratio::NaturalFrequency, Ratio::DampingRatio].map(mean);
    let [frequency, damping] = ratios.map(|x| significant(x, 4));
    format!(
        "start values: {}; natural frequency {frequency} Hz, damping ratio {damping}",
        functions.join(", ")
    )
}

/// What the samples determine at the start values, and the reasons of the verdict from it.
fn identifiability(model: &Model, evaluation: Option<&Evaluation>) -> (Vec<String>, Vec<String>) {
    let problem = &model.problem;
    let count = structural_rank(problem);
    let findings = count.findings.iter();
    let mut lines: Vec<String> = findings
        .map(|finding| findings::rank(finding).sentence)
        .collect();
    if model.has_unknown_mass {
        lines.clear();
        lines.push(
            "the mass is unknown: the coefficients are determined as ratios to it".to_owned(),
        );
    }
    let spectrum = evaluation.filter(|_| (1..=FEW_PARAMETERS).contains(&problem.parameters()));
    let spectrum = spectrum.map(|evaluation| Sensitivity::of(problem, evaluation).spectrum());
    let mut reasons = Vec::new();
    match spectrum {
        Some(spectrum) => {
            let sentence = format!("at the start values {}", spectrum.sentence());
            let scalings = ScalingAmbiguity::at(problem, &problem.start()).undetermined(&spectrum);
            let scalings = scalings
                .iter()
                .map(|named| format!("undetermined: {}", named.name));
            // A penalty may determine what the samples do not.
            if spectrum.undetermined() > 0 && problem.penalties.is_empty() {
                reasons.push(sentence);
            } else {
                lines.push(sentence);
            }
            lines.extend(scalings);
        }
        None if count.rank_bound < count.parameters => reasons.push(count.headline()),
        None => {}
    }
    (lines, reasons)
}

/// The verdict on the model file: `Ready`, or `Check` with its reasons.
fn verdict(model: &Model, reasons: &[String]) -> String {
    let warnings = Finding::texts(&model.warnings);
    let count = match warnings.len() {
        0 => None,
        1 => Some("the warning on standard error".to_owned()),
        count => Some(format!("the {count} warnings on standard error")),
    };
    let all: Vec<String> = count.into_iter().chain(reasons.iter().cloned()).collect();
    match all.as_slice() {
        [] => "Ready      the model and its data are valid".to_owned(),
        reasons => {
            let line = |(i, reason): (usize, &String)| {
                let level = if i == 0 { "Check" } else { "" };
                format!("{level:<11}{reason}")
            };
            reasons
                .iter()
                .enumerate()
                .map(line)
                .collect::<Vec<_>>()
                .join("\n")
        }
    }
}
