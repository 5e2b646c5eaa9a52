//! The figure of the first screen of a page: the coefficient that varies most relative to its interval above the record, or the record
//! with the fitted response.

use super::FittedModel;
use super::chart::{Figure, Panel};
use super::document::ResultDocument;

/// Variations below this share of the largest value are rounding errors.
const ROUNDING: f64 = 1e-9;

impl FittedModel<'_> {
    /// The figure of the first screen; `None` without a varying coefficient and without samples.
    pub(super) fn main_figure(&self, document: &ResultDocument) -> Option<Figure> {
        let drawn = self.drawn();
        let first = drawn.channels.first();
        let panels = drawn.functions.panels.iter();
        let panels = self.model.problem.functions.iter().zip(panels);
        let panels = panels.filter(|(function, _)| document.is_determined(&function.name()));
        let scored = panels.filter_map(|(_, panel)| Some((variation(panel)?, panel)));
        let most = scored.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, panel)) = most else {
            let (experiment, channel) = self.channels().first().copied()?;
            let figure = first?.samples.clone();
            return Some(Figure {
                name: "main".into(),
                ..self.titled(figure, experiment, channel)
            });
        };
        let mut panel = panel.clone();
        panel.marks.retain(|mark| mark.label != "start");
        let title = format!("{} over the record", panel.y.label);
        let figure = Figure::new(
            "main",
            title,
            "The coefficient that varies most relative to its interval; below, the record.",
        );
        let below = first.map(|of_channel| {
            let mut panels = of_channel.samples.panels.clone();
            for panel in &mut panels {
                panel.marks.retain(|mark| mark.label == "samples");
            }
            panels
        });
        Some(figure.panel(panel).panels(below.into_iter().flatten()))
    }
}

/// Range of the estimate of a panel relative to the mean width of its band, or without one to its largest value; `None` for a constant.
/// Without a band a curve that reaches zero, as the rounding errors of a damping do, ranks last.
pub(super) fn variation(panel: &Panel) -> Option<f64> {
    let estimate = panel.marks.iter().find(|mark| mark.label == "estimate")?;
    let [low, high] = estimate.range();
    let largest = low.abs().max(high.abs());
    let range = high - low;
    (range > ROUNDING * largest).then_some(())?;
    let band = panel.marks.iter().find(|mark| !mark.high.is_empty());
    let width = band.map(|band| {
        let widths = band.high.iter().zip(&band.y).map(|(high, low)| high - low);
        widths.sum::<f64>() / band.y.len().max(1) as f64
    });
    let width = width.filter(|width| *width > 0.0);
    Some(match width {
        Some(width) => range / width,
        None if low * high <= 0.0 => 0.0,
        None => range / largest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Colour, Mark, Style};

    fn panel(y: &[f64], half_width: f64) -> Panel {
        let t: Vec<f64> = (0..y.len()).map(|i| i as f64).collect();
        let [low, high] =
            [-1.0, 1.0].map(|sign| y.iter().map(|y| y + sign * half_width).collect::<Vec<_>>());
        Panel::of_time("stiffness k", "N/m")
            .mark(Mark::band("95 % band", &t, &low, &high, Colour::Blue))
            .mark(Mark::line("estimate", &t, y, Style::nth(0)))
    }

    /// A range of 4 with a band of width 2 is twice its interval.
    #[test]
    fn variation_is_the_range_in_widths_of_the_band() {
        assert_eq!(variation(&panel(&[10.0, 12.0, 14.0], 1.0)), Some(2.0));
        assert_eq!(variation(&panel(&[10.0, 12.0, 20.0], 0.0)), Some(0.5));
        assert_eq!(variation(&panel(&[10.0, 10.0 + 1e-12, 10.0], 1.0)), None);
        assert_eq!(variation(&panel(&[-1e-7, 2e-7, 1e-7], 0.0)), Some(0.0));
    }
}
