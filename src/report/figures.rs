//! The standard figures of a fit, from plain slices.

use super::figure::{Axis, Figure, Panel};
use super::mark::{Colour, Dash, Mark, Style};
use super::predict::PredictedMotion;
use kmcfit_core::internals::diagnostics::ResidualDiagnostics;
use kmcfit_core::internals::simulate::Trajectory;
use kmcfit_core::internals::solvers::{PathPoint, WeightPath, WeightRule};

/// Beyond this number of readings the dots are drawn smaller.
const MANY: usize = 400;

/// A band may reach this many times the range of the curves beyond them.
const WIDE_BAND: f64 = 1.5;
/// What stays within this share of its size is flat to the eye.
const FLAT: f64 = 0.1;

/// Lowest and highest finite value.
fn extent<'a>(values: impl Iterator<Item = &'a f64>) -> Option<(f64, f64)> {
    let finite = values.copied().filter(|v| v.is_finite());
    finite.fold(None, |range: Option<(f64, f64)>, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

fn time() -> Axis {
    Axis::linear("time t", "s")
}

/// One measured channel: what was measured, its unit, the times in s, and the readings.
pub type Channel<'a> = (&'a str, &'a str, &'a [f64], &'a [f64]);

/// The measured motion, one panel for each channel.
pub fn observation(channels: &[Channel]) -> Figure {
    let figure = Figure::new(
        "observation",
        "Observed motion",
        "The measured channels against time, one panel for each.",
    );
    channels.iter().fold(figure, |figure, (label, unit, t, y)| {
        let width = if t.len() > MANY { 2.0 } else { 3.5 };
        let mark = Mark::points("", t, y, Style::new(Colour::Blue).width(width));
        figure.panel(Panel::new(time(), Axis::linear(*label, *unit)).mark(mark))
    })
}

/// A channel's readings and what the model says of them, in the unit of the channel.
pub fn channel((label, unit): (&str, &str), t: &[f64], observed: &[f64], model: &[f64]) -> Figure {
    let width = if t.len() > MANY { 2.0 } else { 3.5 };
    let dots = Style::new(Colour::Grey).width(width);
    let line = Style::new(Colour::Blue).width(1.4);
    Figure::new(
        "channel",
        "Readings and model",
        "The readings of the channel and what the fitted model says of them, against time.",
    )
    .panel(
        Panel::new(time(), Axis::linear(label, unit))
            .mark(Mark::points("readings", t, observed, dots))
            .mark(Mark::line("model", t, model, line)),
    )
}

/// The residuals of a channel against time, and their autocorrelation beside the band in which that of
/// white noise lies in 95 of 100 lags.
pub fn residuals(
    (label, unit): (&str, &str),
    t: &[f64],
    residuals: &[f64],
    diagnostics: &ResidualDiagnostics,
) -> Figure {
    let width = if t.len() > MANY { 2.0 } else { 3.5 };
    let lags: Vec<f64> = (0..diagnostics.autocorrelation.len())
        .map(|lag| lag as f64 * diagnostics.step)
        .collect();
    let band = Style::new(Colour::Grey).dash(Dash::Dashed);
    Figure::new("residuals", "Residuals", diagnostics.whiteness.to_string())
        .panel(
            Panel::new(time(), Axis::linear(format!("model - {label}"), unit)).mark(Mark::points(
                "",
                t,
                residuals,
                Style::new(Colour::Blue).width(width),
            )),
        )
        .panel(
            Panel::new(
                Axis::linear("lag", "s"),
                Axis::linear("autocorrelation", ""),
            )
            .mark(Mark::horizontal(
                "95 % of white noise",
                diagnostics.band,
                band,
            ))
            .mark(Mark::horizontal("", -diagnostics.band, band))
            .mark(Mark::line(
                "residuals",
                &lags,
                &diagnostics.autocorrelation,
                Style::new(Colour::Blue),
            )),
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
    // Both solid, told apart by width: dashes vanish where the gradient norm jumps up and down.
    let gradient = Style::new(Colour::Orange).width(0.9 * factor);
    let squares = gradient_norm_squared_ratio;
    Figure::new(
        "convergence",
        "Convergence",
        "Cost and squared gradient norm, relative to the start, against the iteration.",
    )
    .panel(
        Panel::new(
            Axis::log("iteration", ""),
            Axis::log("relative to the start", ""),
        )
        .mark(Mark::line(
            "gradient norm G²/G₀²",
            iterations,
            squares,
            gradient,
        ))
        .mark(Mark::line("cost J/J₀", iterations, cost_ratio, cost)),
    )
}

/// The motion at one iteration: the iteration, the times in s, and the displacements in m.
pub type Snapshot<'a> = (usize, &'a [f64], &'a [f64]);

/// The observed displacement and the motion of the fit at some iterations; times in s,
/// displacements in m.
pub fn motion(t_obs: &[f64], y_obs: &[f64], snapshots: &[Snapshot]) -> Figure {
    let observed = Mark::points(
        "observed",
        t_obs,
        y_obs,
        Style::new(Colour::Grey).width(4.5),
    );
    let panel = Panel::new(time(), Axis::linear("displacement y", "m")).mark(observed);
    let last = snapshots.len().saturating_sub(1);
    let panel = snapshots
        .iter()
        .enumerate()
        .fold(panel, |panel, (index, (iteration, t, y))| {
            let label = format!("iteration {iteration}");
            // The last one lies on the observation, where only black shows well.
            let style = match index {
                0 => Style::nth(0),
                _ if index == last => Style::new(Colour::Black).dash(Dash::Dashed),
                _ => Style::nth(index),
            };
            panel.mark(Mark::line(label, t, y, style))
        });
    Figure::new(
        "motion",
        "Motion during the fit",
        "The observed displacement against time, and the motion of the fit at some iterations.",
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
    /// What the fit found.
    pub found: &'a [f64],
    /// Lower and upper edge of its uncertainty.
    pub band: Option<(&'a [f64], &'a [f64])>,
    /// Where the fit started.
    pub start: Option<&'a [f64]>,
    /// The true function, where known.
    pub truth: Option<&'a [f64]>,
}

impl<'a> FunctionCurve<'a> {
    /// A function that was found, with nothing else known.
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

    /// What is shown where the band would make the curves flat lines: the curves with room around them.
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

    /// The function against the times `t` in s.
    fn panel(&self, t: &[f64]) -> Panel {
        let band = |(low, high)| Mark::band("95 % band", t, low, high, Colour::Blue);
        let start = |y| Mark::line("start", t, y, Style::new(Colour::Green).dash(Dash::Dotted));
        let mut axis = Axis::linear(self.name, self.unit);
        let mut beyond = "";
        if let Some((low, high)) = self.room() {
            axis = axis.limits(low, high);
            beyond = "the band reaches beyond this panel";
        }
        Panel::new(time(), axis)
            .title(beyond)
            .maybe(self.band.map(band))
            .maybe(self.start.map(start))
            .mark(Mark::line(
                "found",
                t,
                self.found,
                Style::new(Colour::Blue).width(1.8),
            ))
            .maybe(self.truth.map(|y| truth(t, y)))
    }
}

fn truth(t: &[f64], y: &[f64]) -> Mark {
    Mark::line(
        "truth",
        t,
        y,
        Style::new(Colour::Vermillion).dash(Dash::Dashed),
    )
}

/// The coefficient functions against the times `t` in s, one panel each.
pub fn functions(t: &[f64], curves: &[FunctionCurve]) -> Figure {
    let figure = Figure::new(
        "functions",
        "Coefficient functions",
        "The coefficient functions that were found, against time, one panel for each.",
    );
    curves
        .iter()
        .fold(figure, |figure, curve| figure.panel(curve.panel(t)))
}

/// The error of a gradient against the step of the difference that tests it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientCurve<'a> {
    /// Nodes of the time grid.
    pub nodes: usize,
    /// Which adjoint made the gradient: `discrete` or `continuous`.
    pub adjoint: &'a str,
    /// Step along the gradient.
    pub step: &'a [f64],
    /// |(J(p - a g) - J(p))/a + G²| / G² at each step a.
    pub error: &'a [f64],
}

/// The error of the gradient against the step, a panel for each adjoint and a line for each grid.
pub fn gradient_error(curves: &[GradientCurve]) -> Figure {
    let mut adjoints: Vec<&str> = Vec::new();
    let mut nodes: Vec<usize> = curves.iter().map(|curve| curve.nodes).collect();
    nodes.sort_unstable();
    nodes.dedup();
    for curve in curves {
        if !adjoints.contains(&curve.adjoint) {
            adjoints.push(curve.adjoint);
        }
    }
    let figure = Figure::new(
        "gradient_error",
        "Error of the gradient",
        "Relative error of the gradient against the step of the difference that tests it.",
    );
    let panels = adjoints
        .iter()
        .map(|adjoint| gradient_panel(curves, adjoint, &nodes));
    panels.fold(figure.columns(adjoints.len()), Figure::panel)
}

/// The curves of one adjoint, finest grid on top; a grid looks the same in all panels.
fn gradient_panel(curves: &[GradientCurve], adjoint: &str, nodes: &[usize]) -> Panel {
    let axes = Panel::new(Axis::log("step a", ""), Axis::log("relative error", ""));
    let curves = curves.iter().filter(|curve| curve.adjoint == adjoint);
    curves.fold(axes.title(format!("{adjoint} adjoint")), |panel, curve| {
        let index = nodes.iter().position(|&n| n == curve.nodes).unwrap_or(0);
        let label = format!("N = {}", curve.nodes);
        panel.mark(Mark::line(
            label,
            curve.step,
            curve.error,
            Style::nth(index),
        ))
    })
}

/// What a free motion can show, on the time grid. An empty slice stands for something unknown.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RatioCurves<'a> {
    /// k/m in 1/s².
    pub k_over_m: &'a [f64],
    /// c/m in 1/s.
    pub c_over_m: &'a [f64],
    /// Natural frequency in Hz.
    pub frequency: &'a [f64],
    /// Damping ratio.
    pub damping_ratio: &'a [f64],
}

impl<'a> RatioCurves<'a> {
    fn each(&self) -> [&'a [f64]; 4] {
        [
            self.k_over_m,
            self.c_over_m,
            self.frequency,
            self.damping_ratio,
        ]
    }
}

/// The ratios of the coefficient functions against the times `t` in s, and the true ones where
/// known; a ratio that was not found has no panel. `bands` are the lower and upper ends of their bands,
/// as many as are known.
pub fn ratios(
    t: &[f64],
    found: &RatioCurves,
    truth: Option<&RatioCurves>,
    bands: &[[Vec<f64>; 2]],
) -> Figure {
    let names = [
        ("k/m", "s⁻²"),
        ("c/m", "s⁻¹"),
        ("natural frequency", "Hz"),
        ("damping ratio ζ", ""),
    ];
    let truth = truth.copied().unwrap_or_default();
    let mut figure = Figure::new(
        "ratios",
        "Ratios of the coefficient functions",
        "Stiffness and damping over mass, natural frequency and damping ratio against time.",
    )
    .columns(2);
    let pairs = found.each().into_iter().zip(truth.each());
    for (i, ((name, unit), (found, truth))) in names.iter().zip(pairs).enumerate() {
        if !found.is_empty() {
            let truth = (!truth.is_empty()).then_some(truth);
            let curve = FunctionCurve {
                truth,
                band: bands.get(i).map(|[low, high]| (&low[..], &high[..])),
                ..FunctionCurve::new(name, unit, found)
            };
            figure = figure.panel(curve.panel(t));
        }
    }
    figure
}

/// The motion from other initial states, one panel each, and the true one where known; times in s,
/// displacements in m.
pub fn predictions(t: &[f64], motions: &[PredictedMotion]) -> Figure {
    let figure = Figure::new(
        "predictions",
        "Predictions",
        "The free motion of the device that was found from other initial states, against time.",
    );
    motions.iter().fold(figure, |figure, predicted| {
        let found = Style::new(Colour::Blue).width(1.8);
        let state = &predicted.summary;
        let title = format!(
            "from y = {} m, v = {} m/s",
            state.displacement, state.velocity
        );
        let true_motion = |motion: &Trajectory| truth(t, &motion.displacement);
        figure.panel(
            Panel::new(time(), Axis::linear("displacement y", "m"))
                .title(title)
                .mark(Mark::line(
                    "predicted",
                    t,
                    &predicted.motion.displacement,
                    found,
                ))
                .maybe(predicted.truth.as_ref().map(true_motion)),
        )
    })
}

/// The path of weights: misfit and roughness against the weight, with what each rule picks.
pub fn weight_path(path: &WeightPath) -> Figure {
    let column = |f: fn(&PathPoint) -> f64| path.points.iter().map(f).collect::<Vec<f64>>();
    let weights = column(|p| p.weight);
    let curve = |label: &str, values: Vec<f64>, colour: Colour| {
        Mark::line(label, &weights, &values, Style::new(colour).width(1.8))
    };
    let panel = |y: Axis, mark: Mark| {
        let panel = Panel::new(Axis::log("weight", ""), y).mark(mark);
        let dashes = [Dash::Dashed, Dash::Dotted, Dash::DashDot];
        let picks = WeightRule::ALL
            .iter()
            .zip(path.picks)
            .zip(dashes)
            .enumerate();
        picks.fold(panel, |panel, (i, ((rule, pick), dash))| {
            let style = Style::nth(i + 1).dash(dash);
            let mark = |i: usize| Mark::vertical(rule.name(), path.points[i].weight, style);
            panel.maybe(pick.map(mark))
        })
    };
    Figure::new(
        "weights",
        "Choice of the weight",
        "Misfit, roughness and effective degrees of freedom against the weight of the smoothness, \
         with the weight that each rule picks.",
    )
    .panel(panel(
        Axis::log("misfit", ""),
        curve("misfit", column(|p| p.misfit), Colour::Blue),
    ))
    .panel(panel(
        Axis::log("roughness", ""),
        curve("roughness", column(|p| p.roughness), Colour::Black),
    ))
    .panel(panel(
        Axis::log("degrees of freedom", ""),
        curve(
            "degrees of freedom",
            column(|p| p.degrees_of_freedom),
            Colour::Green,
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::svg;

    /// Of a single iteration there is no line: both curves are dots, three times as wide.
    #[test]
    fn a_single_iteration_shows() {
        let one = svg::render(&convergence(&[1.0], &[1e-3], &[1e-4]));
        let two = svg::render(&convergence(&[1.0, 2.0], &[1e-3, 1e-4], &[1e-4, 1e-6]));
        for (dot, line) in [("66", "22"), ("27", "9")] {
            let width = |w: &str| format!("stroke-width=\"{w}\"");
            assert!(
                one.contains(&width(dot)) && !one.contains(&width(line)),
                "{one}"
            );
            assert!(
                two.contains(&width(line)) && !two.contains(&width(dot)),
                "{two}"
            );
        }
    }
}
