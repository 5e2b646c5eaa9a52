//! The standard figures of a fit, from plain slices.

use super::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style};
use kmcfit_core::functions::{Ratio, WeightRule};
use kmcfit_core::number_format::at_most;
use kmcfit_core::signal::{even_spacing, median};
use kmcfit_core::solvers::{PathPoint, WeightPath};
use kmcfit_core::study::PredictedResponse;

/// Number of samples beyond which the dots are smaller.
const MANY: usize = 400;
/// Multiple of the median spacing of samples from which a spacing is a gap.
const GAP: f64 = 10.0;

/// Largest extent of a band beyond the curves, relative to their range, that the axis includes.
const WIDE_BAND: f64 = 1.5;
/// Half-width of a band relative to the range of its curve, below which the line of the curve covers it.
const NARROW_BAND: f64 = 0.01;
/// Relative variation below which a curve is treated as constant.
const FLAT: f64 = 0.1;

/// Lowest and highest finite value.
fn extent<'a>(values: impl Iterator<Item = &'a f64>) -> Option<(f64, f64)> {
    let finite = values.copied().filter(|v| v.is_finite());
    finite.fold(None, |range: Option<(f64, f64)>, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// Style of samples.
fn dots(colour: Colour, count: usize) -> Style {
    Style::new(colour).width(if count > MANY { 2.0 } else { 3.5 })
}

/// A curve over the times of samples, undefined within each gap; `None` without gaps.
fn broken_at_gaps(t: &[f64], y: &[f64]) -> Option<[Vec<f64>; 2]> {
    if even_spacing(t).is_some() {
        return None;
    }
    let spacings: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let median = match spacings.is_empty() {
        true => 0.0,
        false => median(spacings),
    };
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut last: Option<f64> = None;
    for (time, value) in t.iter().copied().zip(y.iter().copied()) {
        if let Some(before) = last
            && time - before > GAP * median
        {
            times.push(0.5 * (before + time));
            values.push(f64::NAN);
        }
        times.push(time);
        values.push(value);
        last = Some(time);
    }
    Some([times, values])
}

/// Samples and prediction of a channel, in the unit of the channel.
pub fn channel(
    (label, unit): (&str, &str),
    t: &[f64],
    observed: Vec<f64>,
    model: impl FnOnce() -> Vec<f64>,
) -> Figure {
    let dots = dots(Colour::Grey, t.len());
    // One after the other: each is thinned when it is added.
    let samples = Mark::points_of("samples", [t.to_vec(), observed], dots);
    let panel = Panel::of_time(label, unit).mark(samples);
    let line = Style::new(Colour::Blue).width(1.4);
    let model = model();
    let broken = broken_at_gaps(t, &model);
    let (times, response) = match &broken {
        Some([times, response]) => (times.as_slice(), response.as_slice()),
        None => (t, model.as_slice()),
    };
    Figure::new(
        "channel",
        "Samples and model",
        "Samples of the channel and the fitted response against time.",
    )
    .panel(panel.mark(Mark::line("model", times, response, line)))
}

/// The residuals of a channel against time with twice their standard deviation `sigma`, where it is one for all; `description` says
/// what their test of autocorrelation gave.
pub fn residuals(
    (label, unit): (&str, &str),
    t: &[f64],
    residuals: &[f64],
    sigma: Option<f64>,
    description: &str,
) -> Figure {
    let dots = Mark::points("", t, residuals, dots(Colour::Blue, t.len()));
    let dashed = Style::new(Colour::Black).dash(Dash::Dashed).width(1.0);
    let bounds = sigma.into_iter().flat_map(|sigma| {
        [
            Mark::horizontal("±2 sigma", 2.0 * sigma, dashed),
            Mark::horizontal("", -2.0 * sigma, dashed),
        ]
    });
    Figure::new("residuals", "Residuals", description).panel(
        Panel::of_time(format!("{label}, measured - model"), unit)
            .mark(dots)
            .marks(bounds),
    )
}

/// Cost J/J₀ and squared gradient norm G²/G₀² against the iteration, both relative to the start;
/// both axes are logarithmic, so iteration 0 is not shown.
pub fn convergence(
    iterations: &[f64],
    cost_ratio: &[f64],
    gradient_norm_squared_ratio: &[f64],
) -> Figure {
    // A single iteration is a dot.
    let factor = if iterations.len() == 1 { 3.0 } else { 1.0 };
    let cost = Style::new(Colour::Blue).width(2.2 * factor);
    // Solid lines of different width: dashes are not visible on a strongly varying gradient norm.
    let gradient = Style::new(Colour::Orange).width(0.9 * factor);
    let squares = gradient_norm_squared_ratio;
    let y = Axis::log("relative to the start", "");
    Figure::new(
        "convergence",
        "Convergence",
        "Cost and squared gradient norm, relative to the start, against the iteration.",
    )
    .panel(Panel::new(Axis::log("iteration", ""), y).marks([
        Mark::line("gradient norm G²/G₀²", iterations, squares, gradient),
        Mark::line("cost J/J₀", iterations, cost_ratio, cost),
    ]))
}

/// The response at one iteration: iteration, times in s, and displacements in m.
pub type Snapshot<'a> = (usize, &'a [f64], &'a [f64]);

/// The measured displacement and the response of the fit at some iterations; times in s, displacements in m.
pub fn response(t_obs: &[f64], y_obs: &[f64], snapshots: &[Snapshot]) -> Figure {
    let grey = Style::new(Colour::Grey).width(4.5);
    let last = snapshots.len().saturating_sub(1);
    let lines = snapshots.iter().enumerate();
    let lines = lines.map(|(index, (iteration, t, y))| {
        // The last one coincides with the record, so it is drawn black.
        let style = match index == last && index > 0 {
            true => Style::new(Colour::Black).dash(Dash::Dashed),
            false => Style::nth(index),
        };
        Mark::line(format!("iteration {iteration}"), t, y, style)
    });
    let panel = Panel::of_time("displacement y", "m")
        .mark(Mark::points("observed", t_obs, y_obs, grey))
        .marks(lines);
    Figure::new(
        "motion",
        "Response during the fit",
        "Measured displacement against time, and the response at some iterations.",
    )
    .panel(panel)
}

/// A coefficient function on the time grid, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FunctionCurve<'a> {
    /// Name and symbol, as in `mass m`.
    pub name: &'a str,
    /// Unit, as in `kg`.
    pub unit: &'a str,
    /// Estimate.
    pub found: &'a [f64],
    /// Lower and upper end of its confidence band.
    pub band: Option<(&'a [f64], &'a [f64])>,
    /// Start values.
    pub start: Option<&'a [f64]>,
    /// True function, if known.
    pub truth: Option<&'a [f64]>,
}

impl<'a> FunctionCurve<'a> {
    /// A curve of the estimate alone.
    pub fn new(name: &'a str, unit: &'a str, found: &'a [f64]) -> Self {
        Self {
            name,
            unit,
            found,
            band: None,
            start: None,
            truth: None,
        }
    }

    /// Limits of the axis if the full band would flatten the curves: the range of the curves with a margin.
    fn room(&self) -> Option<(f64, f64)> {
        let (low, high) = self.band?;
        let curves = [Some(self.found), self.start, self.truth];
        let curves = extent(curves.into_iter().flatten().flatten())?;
        let band = extent(low.iter().chain(high))?;
        let size = curves.0.abs().max(curves.1.abs());
        let room = WIDE_BAND * (curves.1 - curves.0).max(FLAT * size);
        let limits = (curves.0 - room, curves.1 + room);
        let is_wide = room > 0.0 && (band.0 < limits.0 || band.1 > limits.1);
        is_wide.then(|| (limits.0.max(band.0), limits.1.min(band.1)))
    }

    /// Label of the band; with its largest half-width if it is too narrow to be visible beside the curve.
    fn band_label(&self) -> String {
        let label = "95 % band";
        let (Some((low, high)), Some(range)) = (self.band, extent(self.found.iter())) else {
            return label.into();
        };
        let half_widths = high.iter().zip(low).map(|(high, low)| 0.5 * (high - low));
        let half_width = half_widths.filter(|w| w.is_finite()).fold(0.0, f64::max);
        let is_visible = half_width >= NARROW_BAND * (range.1 - range.0);
        if is_visible || half_width == 0.0 {
            return label.into();
        }
        let share = half_width / range.0.abs().max(range.1.abs());
        if !share.is_finite() {
            return label.into();
        }
        let percent = at_most(100.0 * share, 2);
        let symbol = self.name.split(' ').next_back().unwrap_or_default();
        format!("{label}, at most ±{percent} % of max {symbol}")
    }

    /// The function against the times `t` in s.
    pub fn panel(&self, t: &[f64]) -> Panel {
        let label = self.band_label();
        let band = |(low, high)| Mark::band(label, t, low, high, Colour::Blue);
        let start = |y| Mark::line("start", t, y, Style::new(Colour::Green).dash(Dash::Dotted));
        let mut panel = Panel::of_time(self.name, self.unit);
        if let Some((low, high)) = self.room() {
            panel.y = panel.y.limits(low, high);
            panel.title = "the band reaches beyond this panel".into();
        }
        panel
            .marks(self.band.map(band))
            .marks(self.start.map(start))
            .mark(found("estimate", t, self.found))
            .marks(self.truth.map(|y| truth(t, y)))
    }
}

fn found(label: &str, t: &[f64], y: &[f64]) -> Mark {
    Mark::line(label, t, y, Style::new(Colour::Blue).width(1.8))
}

/// The true values.
pub(super) fn truth(t: &[f64], y: &[f64]) -> Mark {
    let style = Style::new(Colour::Vermillion).dash(Dash::Dashed);
    Mark::line("truth", t, y, style)
}

/// The coefficient functions against the times `t` in s, one panel each.
pub fn functions(panels: impl IntoIterator<Item = Panel>) -> Figure {
    Figure::new(
        "functions",
        "Coefficient functions",
        "Estimated coefficients against time, one panel for each.",
    )
    .panels(panels)
}

/// Values of the ratios, in the order of [`Ratio::ALL`].
pub type RatioCurves = [Vec<f64>; 4];

/// The ratios of the coefficient functions against the times `t` in s, and the true ones if known; a ratio without
/// values has no panel. `bands` are the lower and upper ends of the bands of the first ratios.
pub fn ratios(
    t: &[f64],
    found: &RatioCurves,
    truth: Option<&RatioCurves>,
    bands: &[[Vec<f64>; 2]],
) -> Figure {
    let label = |ratio: Ratio| match ratio {
        Ratio::StiffnessOverMass => ("k/m", "s⁻²"),
        Ratio::DampingOverMass => ("c/m", "s⁻¹"),
        Ratio::NaturalFrequency => ("natural frequency", "Hz"),
        Ratio::DampingRatio => ("damping ratio ζ", ""),
    };
    let parts = Ratio::ALL.map(label).into_iter().enumerate();
    let parts = parts.filter(|(i, _)| !found[*i].is_empty());
    Figure::new(
        "ratios",
        "Ratios of the coefficient functions",
        "Stiffness and damping over mass, natural frequency and damping ratio against time.",
    )
    .columns(2)
    .panels(parts.map(|(i, (name, unit))| {
        let curve = FunctionCurve {
            truth: truth.map(|truth| truth[i].as_slice()),
            band: bands.get(i).map(|[low, high]| (&low[..], &high[..])),
            ..FunctionCurve::new(name, unit, &found[i])
        };
        curve.panel(t)
    }))
}

/// The response to other initial states, one panel each, and the true one if known; times in s, displacements in m.
pub fn predictions(t: &[f64], responses: &[PredictedResponse]) -> Figure {
    Figure::new(
        "predictions",
        "Predictions",
        "Predicted free response from other initial states against time.",
    )
    .panels(responses.iter().map(|predicted| {
        let state = &predicted.summary;
        let (y, v) = (state.displacement, state.velocity);
        Panel::of_time("displacement y", "m")
            .title(format!("from y = {y} m, v = {v} m/s"))
            .mark(found("predicted", t, predicted.response.displacement(0)))
            .marks(
                predicted
                    .truth
                    .as_ref()
                    .map(|m| truth(t, m.displacement(0))),
            )
    }))
}

/// The weight path: misfit and roughness against the weight, with the choice of each rule.
pub fn weight_path(path: &WeightPath) -> Figure {
    type Part = fn(&PathPoint) -> f64;
    let parts: [(&str, Colour, Part); 3] = [
        ("misfit", Colour::Blue, |p| p.misfit),
        ("roughness", Colour::Black, |p| p.roughness),
        ("degrees of freedom", Colour::Green, |p| {
            p.degrees_of_freedom
        }),
    ];
    let weights: Vec<f64> = path.points.iter().map(|p| p.weight).collect();
    let panel = |(label, colour, part): (&str, Colour, Part)| {
        let values: Vec<f64> = path.points.iter().map(part).collect();
        let style = Style::new(colour).width(1.8);
        let dashes = [Dash::Dashed, Dash::Dotted, Dash::DashDot];
        let picks = WeightPath::RULES.iter().zip(path.picks).zip(dashes);
        let picks = picks.enumerate().filter_map(|(i, ((rule, pick), dash))| {
            let style = Style::nth(i + 1).dash(dash);
            Some(Mark::vertical(*rule, path.points[pick?].weight, style))
        });
        // Only total variation has a criterion on its path, and its rule alone.
        let is_bic = path.points.iter().any(|p| p.bic.is_some());
        let bic = is_bic.then(|| {
            let style = Style::nth(1).dash(Dash::Dashed);
            Mark::vertical(WeightRule::Bic.name(), path.chosen_weight(), style)
        });
        Panel::new(Axis::log("weight", ""), Axis::log(label, ""))
            .mark(Mark::line(label, &weights, &values, style))
            .marks(picks)
            .marks(bic)
    };
    Figure::new(
        "weights",
        "Choice of the weight",
        "Misfit, roughness and effective degrees of freedom against the weight of the smoothness, \
         with the weight that each rule selects.",
    )
    .panels(parts.map(panel))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band of half-width 0.02 N/m on a stiffness from 4 to 5 N/m is 2 % of that range and visible; one of 0.005 N/m is not.
    #[test]
    fn a_narrow_band_has_its_half_width_in_the_legend() {
        let (t, found) = ([0.0, 1.0], [4.0, 5.0]);
        let label = |half_width: f64| {
            let [low, high] = [-1.0, 1.0].map(|sign| found.map(|y| y + sign * half_width));
            let curve = FunctionCurve {
                band: Some((&low, &high)),
                ..FunctionCurve::new("stiffness k", "N/m", &found)
            };
            curve.panel(&t).marks[0].label.clone()
        };
        assert_eq!(label(0.02), "95 % band");
        assert_eq!(label(0.005), "95 % band, at most ±0.1 % of max k");
    }
}
