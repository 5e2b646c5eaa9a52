//! Overlaid figures of several runs, each with its own line style and its own time grid.

use super::ComparedRun;
use crate::report::chart::{Colour, Dash, Figure, Mark, Panel, Style};
use crate::report::{ResultTable, Run};
use kmcfit_core::functions::Ratio;
use kmcfit_core::structure::Law;
use kmcfit_core::system::NodalCoefficients;

/// The figures of a comparison.
pub(super) fn all(runs: &[ComparedRun]) -> [Option<Figure>; 2] {
    [functions(runs), validation(runs)]
}

/// Line style of run `index`; up to 24 runs differ in colour or dash pattern.
fn style(index: usize) -> Style {
    // The last two colours, black and grey, are those of samples and of the true system.
    let colour = Colour::nth(index % (Colour::ALL.len() - 2));
    let dash = Dash::nth(index + index / 12);
    Style::new(colour).dash(dash).width(1.6)
}

/// A curve of each system: caption, unit, values.
type ComparedCurve = (
    &'static str,
    &'static str,
    fn(&[Law], &NodalCoefficients) -> Vec<f64>,
);

const CURVES: [ComparedCurve; 5] = [
    ("mass m", "kg", |_, d| d.inertias[0].clone()),
    ("damping c", "N s/m", |_, d| d.coefficients[0].clone()),
    ("stiffness k", "N/m", |_, d| d.coefficients[1].clone()),
    ("k/m", "s⁻²", |laws, d| {
        Ratio::StiffnessOverMass.at_nodes(laws, d)
    }),
    ("c/m", "s⁻¹", |laws, d| {
        Ratio::DampingOverMass.at_nodes(laws, d)
    }),
];

/// Coefficients and ratios of each run; `None` where all are constant.
fn functions(runs: &[ComparedRun]) -> Option<Figure> {
    let figure = Figure::new(
        "functions",
        "Coefficients and ratios",
        "Coefficients of each run against time with their 95 % bands, the truth as a thick grey line below them. A free response determines \
         the ratios only.",
    );
    figure
        .panels(CURVES.iter().map(|curve| overlay(runs, curve)))
        .varying()
}

fn overlay(runs: &[ComparedRun], (label, unit, of): &ComparedCurve) -> Panel {
    let times = |run: &ComparedRun| run.finished.system.grid.times();
    let found: Vec<Vec<f64>> = runs
        .iter()
        .map(|run| of(run.finished.system.laws(), &run.finished.coefficients))
        .collect();
    let real = runs.iter().find_map(|run| {
        Some((
            run,
            of(run.finished.system.laws(), run.finished.truth.as_ref()?),
        ))
    });
    let thick = Style::new(Colour::Grey).width(5.0);
    let truth = real.map(|(run, y)| Mark::line("truth", &times(run), &y, thick));
    let name = label.split(' ').next().unwrap_or(label);
    let bands = runs.iter().enumerate().filter_map(|(i, run)| {
        let [low, high] = run.finished.band(name)?;
        let is_finite = low.iter().chain(&high).all(|x| x.is_finite());
        let style = style(i);
        let band = || Mark::band(&run.name, &times(run), &low, &high, style.colour);
        is_finite.then(|| band().dash(style.dash))
    });
    let curves = runs.iter().zip(&found).enumerate();
    let curves = curves.map(|(i, (run, y))| Mark::line(&run.name, &times(run), y, style(i)));
    let panel = Panel::of_time(*label, *unit);
    panel.marks(bands).marks(truth).marks(curves)
}

/// A channel of a validation record, from its table in the folder of the run.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    /// Record, kind and unit, which channels of one panel have in common.
    key: [String; 3],
    table: ResultTable,
}

/// The channels of the validation records of a run.
pub(super) fn channels(run: &Run) -> Vec<Channel> {
    let mut all = Vec::new();
    for (number, record) in run.document.validation.iter().enumerate() {
        for channel in &record.channels {
            let file = format!("channels/validation-{}-{}.csv", number + 1, channel.kind);
            let key = [&record.name, &channel.kind, &channel.unit];
            let table = ResultTable::read(&run.folder.join(file)).ok();
            all.extend(table.map(|table| Channel {
                key: key.map(Clone::clone),
                table,
            }));
        }
    }
    all
}

/// A panel for each channel, with the prediction of each run that has it.
fn panels(runs: &[ComparedRun]) -> Vec<Panel> {
    let mut channels: Vec<(usize, &Channel)> = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        channels.extend(run.validation.iter().map(|channel| (i, channel)));
    }
    let mut keys: Vec<&[String; 3]> = Vec::new();
    for (_, channel) in &channels {
        if !keys.contains(&&channel.key) {
            keys.push(&channel.key);
        }
    }
    let of = |channel: &Channel, column: &str| {
        Some([channel.table.column("t_s")?, channel.table.column(column)?])
    };
    let panel = |key: &&[String; 3]| {
        let [record, kind, unit] = key;
        let alike = || channels.iter().filter(|(_, channel)| channel.key == **key);
        let dots = Style::new(Colour::Black).width(2.4);
        let measured = alike()
            .next()
            .and_then(|(_, channel)| of(channel, "measured"));
        let curves = alike().filter_map(|(i, channel)| {
            let [t, y] = of(channel, "predicted")?;
            let name = &runs[*i].name;
            Some(Mark::line(name, &t, &y, style(*i).width(1.2)))
        });
        Panel::of_time(kind, unit)
            .title(record)
            .marks(measured.map(|[t, y]| Mark::points("measured", &t, &y, dots)))
            .marks(curves)
    };
    keys.iter().map(panel).collect()
}

/// Samples of the validation records with the prediction of each run.
fn validation(runs: &[ComparedRun]) -> Option<Figure> {
    let panels = panels(runs);
    let figure = Figure::new(
        "validation",
        "Validation records",
        "Samples that were not fitted, and the prediction of each model.",
    );
    (!panels.is_empty()).then(|| figure.panels(panels))
}
