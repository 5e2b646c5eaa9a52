//! Animation of the fitted system in the page of a fit: what the script needs besides the charts.

use crate::report::FittedModel;
use crate::report::chart::{Figure, Mark, Panel, Style, data, text_for_script};
use crate::report::document::ResultDocument;
use crate::report::text::escape;
use kmcfit_core::internals::functions::CoefficientFunction;
use kmcfit_core::internals::record::ChannelKind;
use serde::Serialize;

/// A coefficient of the animation.
#[derive(Serialize)]
struct Coefficient {
    /// Quantity and unit as on the axis of its chart.
    label: String,
    unit: String,
    min: f64,
    max: f64,
}

/// Contents of the animation.
#[derive(Serialize)]
struct Contents<'a> {
    coefficients: Vec<Coefficient>,
    /// Identifier of the chart with measured and modelled displacement; absent where no displacement is measured.
    chart: Option<&'a str>,
}

/// The folded animation of the first experiment: its numbers are those of the charts; only a displacement that no chart has is added.
/// Empty without scripts, and for a fit without a simulated response.
pub(super) fn animation(run: &FittedModel, document: &ResultDocument) -> String {
    let evaluation = &run.fit.best.evaluation;
    let (Some(first), Some(response)) = (
        run.model.problem.experiments.first(),
        evaluation.trajectories.first(),
    ) else {
        return String::new();
    };
    if !run.is_simulated() || response.displacement.is_empty() {
        return String::new();
    }
    let is_displacement = |kind: ChannelKind| kind == ChannelKind::Displacement;
    let channel = first
        .channels
        .iter()
        .position(|c| is_displacement(c.kind()));
    // The name of the chart in the section above.
    let titled = |c| run.titled(Figure::new("channel", "", ""), 0, c).name;
    let chart = channel.map(|c| format!("figure-{}", titled(c)));
    let coefficient = |(function, values): (&CoefficientFunction, Vec<f64>)| {
        let name = function.name();
        let finite = values.iter().copied().filter(|v| v.is_finite());
        let [min, max] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        });
        Coefficient {
            label: format!("{name} {}", function.quantity.symbol()),
            unit: run.unit(function).to_owned(),
            min,
            max,
        }
    };
    let coefficients = run.named_functions().into_iter().map(coefficient);
    let contents = Contents {
        coefficients: coefficients.collect(),
        chart: chart.as_deref(),
    };
    let added = match &chart {
        Some(_) => String::new(),
        None => {
            let times = run.model.problem.system.grid.times();
            let count = times.len().min(response.displacement.len());
            let unit = if document.is_rotation() { "rad" } else { "m" };
            let mark = Mark::line(
                "model",
                &times[..count],
                &response.displacement[..count],
                Style::nth(0),
            );
            let panel = Panel::of_time("displacement y", unit).mark(mark);
            let drawn = data(&Figure::new("", "", "").panel(panel), &[]);
            format!(
                "<script type=\"application/json\" class=\"response\">{}</script>\n",
                drawn.json
            )
        }
    };
    format!(
        "<details class=\"screen animation\" id=\"animation\">\n<summary>Animation of the fitted system: {}</summary>\n\
         <script type=\"application/json\" class=\"contents\">{}</script>\n{added}</details>\n",
        escape(&first.name),
        text_for_script(&contents)
    )
}
