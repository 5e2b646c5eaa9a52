//! Classical estimates of natural frequency and damping ratio, beside those of the fit: the logarithmic decrement of a free decay, and peak and
//! half-power width of the mobility of a forced response. They use the samples alone, apart from the size of the noise.
//!
//! In a free decay the extremes of successive half cycles have half differences `A_i` at times `t_i` with
//!
//! ```text
//! log A_i = a - i delta / 2,    t_i = t_0 + i / (2 f_d),    zeta = delta / sqrt(4 pi^2 + delta^2),    f_n = f_d / sqrt(1 - zeta^2)
//! ```
//!
//! by weighted linear regression. The mobility `|y'/f|` of a linear system has its peak at `f_n` and the half-power width `2 zeta f_n`. Intervals
//! of 95 % include the frequency spacing of the spectra, the width of their window, and the scatter of the mobility, but no nonlinearity.

use crate::diagnostics::{NORMAL_975, student_half_width};
use crate::functions::Ratio;
use crate::identifiability::{Bands, Quantity};
use crate::number_format::resolved;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Channel, Experiment, Waveform};
use crate::signal::{Mobility, even_spacing};
use crate::simd::sum::rms;
use crate::structure::Law;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Fewest half cycles for a decrement.
const FEWEST: usize = 8;
/// Smallest amplitude of a half cycle relative to the noise.
const ABOVE_NOISE: f64 = 8.0;
/// Factor of standard errors for half differences that share an extreme: their correlation is one half.
const SHARED: f64 = std::f64::consts::SQRT_2;
/// Smallest half-power width in frequency spacings.
const RESOLVED: f64 = 15.0;
/// Frequency spacings by which leakage widens a half-power width at most: measured on records whose segments are shorter than the decay.
const WINDOW: f64 = 6.0;
/// Part of a record, as its inverse, over which coefficients are taken at its ends.
const ENDS: usize = 6;

/// Method of a classical estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClassicalMethod {
    /// Regression of the extremes of a free decay.
    LogarithmicDecrement,
    /// Peak and half-power width of the frequency response.
    FrequencyResponse,
}

/// Natural frequency and damping ratio by a classical method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClassicalEstimate {
    /// Name of the experiment.
    pub experiment: String,
    /// The method.
    pub method: ClassicalMethod,
    /// Natural frequency, Hz.
    pub frequency: f64,
    /// Its 95 % interval, Hz.
    pub frequency_interval: [f64; 2],
    /// Damping ratio; `None` where the frequencies are not resolved.
    pub damping_ratio: Option<f64>,
    /// Its 95 % interval.
    pub damping_interval: Option<[f64; 2]>,
    /// True if both intervals overlap those of the fit.
    pub agrees: bool,
}

impl ClassicalEstimate {
    /// The estimate beside that of the fit, as a clause.
    pub fn sentence(&self) -> String {
        let [names, of_damping] = match self.method {
            ClassicalMethod::LogarithmicDecrement => {
                ["extremes of the decay", "logarithmic decrement"]
            }
            ClassicalMethod::FrequencyResponse => ["FRF peak", "half-power width"],
        };
        let number = |value: f64, [low, high]: [f64; 2]| {
            let [value, ..] = resolved([value, low, high], 0.5 * (high - low));
            value
        };
        let damping = self.damping_ratio.zip(self.damping_interval);
        let damping = damping.map(|(value, interval)| {
            format!(", damping ratio {} ({of_damping})", number(value, interval))
        });
        format!(
            "{names} {} Hz{}: {}",
            number(self.frequency, self.frequency_interval),
            damping.unwrap_or_default(),
            match self.agrees {
                true => "agree with the estimates",
                false => "disagree with the estimates beyond both intervals",
            }
        )
    }
}

/// Classical estimate from the first channel of the first experiment that allows one, for a linear model; of a forced response with constant
/// coefficients only. It agrees where it differs from the estimates by at most the half widths of both intervals, as errors that are independent.
/// Beside coefficients that vary their range over the record counts, and the change of the amplitude of a slow decay with the natural frequency,
/// `omega^(-1/2)`, to half of its size.
pub(super) fn classical_estimate(
    problem: &Problem,
    evaluation: &Evaluation,
    bands: Option<&Bands>,
) -> Option<ClassicalEstimate> {
    let functions = &problem.functions;
    let set = functions.coefficient_set(0);
    let is_constant = set.iter().all(|f| functions.is_constant_or_known(*f));
    let is_linear = problem.system.laws() == [Law::Damping, Law::Stiffness];
    let at_nodes = |ratio: Ratio| ratio.at_nodes(problem.system.laws(), &evaluation.nodal);
    let [natural, ratio] = [Ratio::NaturalFrequency, Ratio::DampingRatio].map(at_nodes);
    is_linear.then_some(())?;
    let is_steady = |values: &[f64]| values.iter().all(|v| *v == values[0]);
    let is_constant = is_constant && is_steady(&natural) && is_steady(&ratio);
    let each = problem.experiments.iter().zip(&evaluation.predictions);
    let mut each = each.filter(|(experiment, _)| {
        experiment.coefficient_set == 0 && (is_constant || experiment.is_free())
    });
    let mut found =
        each.find_map(|(experiment, predictions)| of_experiment(experiment, predictions.first()?))?;
    let interval = |ratio: Ratio, values: &[f64]| {
        let mean = bands.and_then(|bands| bands.quantities.ratio(ratio));
        let interval = mean.and_then(Quantity::interval);
        let range = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |r, x| {
                [r[0].min(*x), r[1].max(*x)]
            });
        let [low, high] = interval.unwrap_or(range);
        [low.min(range[0]), high.max(range[1])]
    };
    let is_near =
        |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a + b - c - d).abs() <= (b - a).hypot(d - c);
    let frequency = interval(Ratio::NaturalFrequency, &natural);
    let [low, high] = interval(Ratio::DampingRatio, &ratio);
    let adiabatic = adiabatic_ratio(&natural, problem.system.grid.duration());
    let margin = 0.5 * adiabatic.abs();
    let damping = [low + adiabatic - margin, high + adiabatic + margin];
    found.agrees = is_near(found.frequency_interval, frequency)
        && found
            .damping_interval
            .is_none_or(|own| is_near(own, damping));
    Some(found)
}

/// Mean damping ratio that a change of the natural frequency over a record adds to that of a decay.
fn adiabatic_ratio(frequency: &[f64], duration: f64) -> f64 {
    let part = (frequency.len() / ENDS).max(1);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let at = |from: usize| mean(&frequency[from..from + part]).ln();
    let change = 0.5 * (at(frequency.len() - part) - at(0));
    let ratio = change / (TAU * mean(frequency) * duration);
    if ratio.is_finite() { ratio } else { 0.0 }
}

fn of_experiment(experiment: &Experiment, predicted: &[f64]) -> Option<ClassicalEstimate> {
    let channel = experiment.channels.first()?;
    let is_plain =
        channel.base().is_empty() && channel.filter().is_empty() && !channel.sensor().is_delayed();
    let spacing = even_spacing(channel.times()).filter(|_| is_plain)?;
    match (experiment.is_free(), &experiment.input.force) {
        (true, _) => {
            let residuals: Vec<f64> = channel.residuals(predicted).collect();
            // The residuals of a poor fit are no noise.
            let bends = channel
                .observed()
                .windows(3)
                .map(|x| x[0] - 2.0 * x[1] + x[2]);
            let rough = rms(&bends.collect::<Vec<f64>>()) / 6f64.sqrt();
            let noise = rms(&residuals).min(rough);
            decrement(experiment, channel, spacing, noise)
        }
        (false, Some(Waveform::Samples(_))) if experiment.input.base.is_none() => {
            half_power(experiment, channel, spacing)
        }
        _ => None,
    }
}

/// Times and values of the extremes of successive half cycles, from the parabola through the largest sample and its neighbours.
fn extremes(values: &[f64], spacing: f64, noise: f64) -> Vec<[f64; 2]> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let mut all: Vec<[f64; 2]> = Vec::new();
    let mut best: Option<usize> = None;
    let position = |i: usize| {
        let [a, b, c] = [values[i - 1], values[i], values[i + 1]];
        let bend = a - 2.0 * b + c;
        let shift = if bend == 0.0 {
            0.0
        } else {
            0.5 * (a - c) / bend
        };
        [spacing * (i as f64 + shift), b - 0.25 * (a - c) * shift]
    };
    for i in 1..values.len() - 1 {
        let x = values[i] - mean;
        match best {
            Some(at) if (values[at] - mean) * x > 0.0 => {
                if x.abs() > (values[at] - mean).abs() {
                    best = Some(i);
                }
            }
            Some(at) => {
                all.push(position(at));
                best = Some(i);
            }
            None => best = Some(i),
        }
        let last = all.len();
        if last >= 2 && (all[last - 1][1] - all[last - 2][1]).abs() < 2.0 * ABOVE_NOISE * noise {
            all.pop();
            break;
        }
    }
    // The first half cycle is cut by the beginning of the record.
    all.drain(..all.len().min(1));
    all
}

fn decrement(
    experiment: &Experiment,
    channel: &Channel,
    spacing: f64,
    noise: f64,
) -> Option<ClassicalEstimate> {
    let extremes = extremes(channel.observed(), spacing, noise);
    (extremes.len() > FEWEST).then_some(())?;
    let halves: Vec<f64> = extremes
        .windows(2)
        .map(|w| 0.5 * (w[1][1] - w[0][1]).abs())
        .collect();
    let weights: Vec<f64> = halves.iter().map(|a| a * a).collect();
    let logs: Vec<f64> = halves.iter().map(|a| a.ln()).collect();
    let times: Vec<f64> = extremes[1..].iter().map(|e| e[0]).collect();
    let [fall, fall_error] = slope(&logs, &weights)?;
    let [half, half_error] = slope(&times, &weights)?;
    let quantile = SHARED * student_half_width(halves.len() as f64 - 2.0);
    let ratio = |fall: f64| {
        let delta = -2.0 * fall;
        delta / (4.0 * PI * PI + delta * delta).sqrt()
    };
    // The largest of several noisy samples is too large by about the noise, relatively more at the end of the decay.
    let raised: Vec<f64> = halves.iter().map(|a| noise / a).collect();
    let [bias, _] = slope(&raised, &weights)?;
    let fall = fall - bias;
    let zeta = ratio(fall);
    let undamped = |half: f64| 0.5 / half / (1.0 - zeta * zeta).sqrt();
    let margin = quantile * fall_error + bias.abs();
    let [low, high] = [-1.0, 1.0].map(|sign| ratio(fall - sign * margin));
    let [slow, fast] = [-1.0, 1.0].map(|sign| undamped(half - sign * quantile * half_error));
    (half > quantile * half_error && zeta.is_finite()).then(|| ClassicalEstimate {
        experiment: experiment.name.clone(),
        method: ClassicalMethod::LogarithmicDecrement,
        frequency: undamped(half),
        frequency_interval: [slow, fast],
        damping_ratio: Some(zeta),
        damping_interval: Some([low, high]),
        agrees: true,
    })
}

/// Slope of values against their index by weighted least squares, and its standard error from their scatter.
fn slope(values: &[f64], weights: &[f64]) -> Option<[f64; 2]> {
    let total: f64 = weights.iter().sum();
    let mean = |of: &dyn Fn(usize) -> f64| {
        (0..values.len()).map(|i| weights[i] * of(i)).sum::<f64>() / total
    };
    let (middle, level) = (mean(&|i| i as f64), mean(&|i| values[i]));
    let spread = mean(&|i| (i as f64 - middle).powi(2));
    let slope = mean(&|i| (i as f64 - middle) * (values[i] - level)) / spread;
    let rest = mean(&|i| (values[i] - level - slope * (i as f64 - middle)).powi(2));
    let degrees = values.len() as f64 - 2.0;
    let error = (rest / (spread * degrees)).sqrt();
    (slope.is_finite() && error.is_finite()).then_some([slope, error])
}

fn half_power(
    experiment: &Experiment,
    channel: &Channel,
    spacing: f64,
) -> Option<ClassicalEstimate> {
    let force: Vec<f64> = channel
        .times()
        .iter()
        .map(|t| experiment.input.force_at(*t))
        .collect();
    let found = Mobility::of(&force, channel.observed(), spacing, channel.kind() as i32)?;
    let spacing = found.resolution;
    let peak = found.peak()?;
    let squares = &found.squares;
    // The peak may be at each frequency whose mobility differs from the largest by its scatter only.
    let within = |k: usize| {
        squares[k] >= squares[peak] * (1.0 - 2.0 * NORMAL_975 * found.scatter(peak)).max(0.5)
    };
    let last = squares.len() - 1;
    let lowest = (1..=peak).rev().take_while(|k| within(*k)).last()?;
    let highest = (peak..last).take_while(|k| within(*k)).last()?;
    let frequency = spacing * peak as f64;
    // Crossings of half the peak, by interpolation.
    let half = 0.5 * squares[peak];
    let crossing = |outside: usize, inside: usize| {
        let share = (squares[inside] - half) / (squares[inside] - squares[outside]);
        spacing * (inside as f64 + share * (outside as f64 - inside as f64))
    };
    let below = (1..peak).rev().find(|k| squares[*k] < half)?;
    let above = (peak + 1..last).find(|k| squares[*k] < half)?;
    let width = crossing(above, above - 1) - crossing(below, below + 1);
    let is_resolved = width > RESOLVED * spacing;
    let to_ratio = |width: f64| 0.5 * width.max(0.0) / frequency;
    // The width of the peak scatters as the mobility at its sides.
    let scatter = NORMAL_975 * found.scatter(peak) * width;
    Some(ClassicalEstimate {
        experiment: experiment.name.clone(),
        method: ClassicalMethod::FrequencyResponse,
        frequency,
        frequency_interval: [
            spacing * (lowest as f64 - 1.0),
            spacing * (highest as f64 + 1.0),
        ],
        damping_ratio: is_resolved.then(|| to_ratio(width)),
        damping_interval: is_resolved.then(|| {
            [
                to_ratio(width - WINDOW * spacing - scatter),
                to_ratio(width + spacing + scatter),
            ]
        }),
        agrees: true,
    })
    .filter(|e| e.frequency_interval[0] > 0.0 && e.frequency * TAU > 0.0)
}
