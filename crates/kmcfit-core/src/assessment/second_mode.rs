//! A second mode in a response: the residuals of the model beside those of a sum of two modes.
//!
//! Each mode with a natural frequency and a damping ratio contributes to the samples, up to factors, its response from rest to the measured
//! input and two free decays,
//!
//! ```text
//! q'' + 2 zeta omega q' + omega^2 q = u
//! ```
//!
//! so that the factors are linear least squares for given frequencies and ratios, and these four follow by the method of Levenberg and
//! Marquardt (variable projection, Golub and Pereyra 1973). Two modes are named where they explain the samples better than the model and its
//! noise by the Bayesian information criterion, their residuals are white or much smaller, and their frequencies are apart.

use super::FitWarning;
use crate::diagnostics::SIGNIFICANCE;
use crate::functions::Ratios;
use crate::objective::{Evaluation, diagnostics};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, ChannelKind, Experiment};
use crate::signal::{Spectrum, even_spacing};
use crate::threads::{available, map};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Fewest samples, and the number from the beginning of a record that is used.
const FEWEST: usize = 200;
const MOST: usize = 20_000;
/// Difference of the criteria from which the evidence is very strong (Kass and Raftery 1995).
const EVIDENCE: f64 = 10.0;
/// Smallest ratio of two frequencies, less 1.
const APART: f64 = 0.1;
/// Largest damping ratio of a mode.
const DAMPED: f64 = 0.3;
/// Fewest frequency spacings of the lower mode.
const FEWEST_PERIODS: f64 = 4.0;
/// Damping ratio from which the search starts.
const START: f64 = 0.02;
/// Smallest ratio of the mean squares of the residuals before and after at which those after need not be white.
const SMALLER: f64 = 4.0;
/// Smallest contribution of the weaker mode relative to the stronger one, root mean square.
const WEAKEST: f64 = 0.01;
/// Smallest p-value of white residuals.
const WHITE: f64 = 1e-3;
/// Steps of the search, and the relative decrease of the sum of squares at which it ends.
const STEPS: usize = 25;
const AT_REST: f64 = 1e-6;
/// Relative change of a parameter for finite differences.
const SMALL: f64 = 1e-4;

/// Natural frequency (Hz) and damping ratio.
type Mode = [f64; 2];

/// Warnings about second modes where the coefficients are constant, at most one for each experiment.
pub(super) fn second_modes(problem: &Problem, evaluation: &Evaluation) -> Vec<FitWarning> {
    // A coefficient that varies spreads one mode over a band.
    let functions = &problem.functions;
    let is_constant = |values: &[f64]| values.iter().all(|v| *v == values[0]);
    let is_steady = (functions
        .coefficient_set(0)
        .iter()
        .all(|f| functions.is_constant_or_known(*f)))
        && evaluation.nodal.functions().all(is_constant);
    if problem.parameters() > FEW_PARAMETERS || !is_steady {
        return Vec::new();
    }
    let each = (0..problem.experiments.len()).filter_map(|e| {
        let frequencies = second_mode(problem, evaluation, e)?;
        Some(FitWarning::SecondMode {
            experiment: problem.experiments[e].name.clone(),
            frequencies,
        })
    });
    each.collect()
}

/// Frequencies of two modes in the first channel of an experiment, the stronger first.
fn second_mode(problem: &Problem, evaluation: &Evaluation, e: usize) -> Option<[f64; 2]> {
    let experiment = &problem.experiments[e];
    let channel = experiment.channels.first()?;
    let predicted = evaluation.predictions[e].first()?;
    let is_suspect = channel.correlation().is_some()
        || diagnostics(channel, predicted).whiteness.p_value < SIGNIFICANCE;
    let is_possible = channel.filter().is_empty() && channel.base().is_empty() && is_suspect;
    let spacing = even_spacing(channel.times()).filter(|_| is_possible)?;
    let record = Samples::of(experiment, channel, spacing)?;
    let count = record.observed.len();
    let innovations = channel.innovations(predicted);
    let before = mean_square(&innovations[..count]);
    let residuals: Vec<f64> = channel.residuals(predicted).take(count).collect();
    let nodal = evaluation.nodal_of(experiment.coefficient_set);
    let frequency = median(&Ratios::of(nodal).frequency);
    let starts = record.starts(frequency, &residuals)?;
    let found = map(starts.len(), available(), |i| record.search(starts[i]));
    let found = found.into_iter().flatten();
    let (modes, found) = found.min_by(|a, b| a.1.square.total_cmp(&b.1.square))?;
    let after = found.square / count as f64;
    let n = count as f64;
    let order = channel.correlation().map_or(0, |c| c.order());
    let more = 2.0 + found.columns as f64 - order as f64;
    let gain = n * (before / after).ln() - more * n.ln();
    let is_explained =
        mean_square(&residuals) > SMALLER * after || record.is_white(channel, &found);
    let [low, high] = [modes[0][0].min(modes[1][0]), modes[0][0].max(modes[1][0])];
    let is_resolved = low > FEWEST_PERIODS / (spacing * n) && high < 0.5 / spacing;
    let are_modes = high > (1.0 + APART) * low && modes.iter().all(|m| m[1] < DAMPED);
    let [first, second] = found.sizes;
    let is_noticeable = first.min(second) > WEAKEST * first.max(second);
    (gain > EVIDENCE && is_explained && is_resolved && are_modes && is_noticeable).then(|| {
        match first >= second {
            true => [modes[0][0], modes[1][0]],
            false => [modes[1][0], modes[0][0]],
        }
    })
}

/// Samples of a channel with the input at them.
struct Samples<'a> {
    kind: ChannelKind,
    spacing: f64,
    observed: &'a [f64],
    /// Force or acceleration of the base; `None` for a free record.
    input: Option<Vec<f64>>,
    /// True for a response that begins at rest.
    is_from_rest: bool,
}

/// Least squares of a sum of modes.
struct Sum {
    square: f64,
    residuals: Vec<f64>,
    /// Root mean squares of the contributions of the modes.
    sizes: [f64; 2],
    /// Number of columns of a mode.
    columns: usize,
}

impl<'a> Samples<'a> {
    fn of(experiment: &Experiment, channel: &'a Channel, spacing: f64) -> Option<Self> {
        let count = channel.len().min(MOST);
        (count >= FEWEST).then_some(())?;
        let excitation = experiment.excitation.as_ref().filter(|e| !e.is_zero());
        let input = excitation.map(|excitation| {
            let at = |i: usize| {
                let sample = channel.input_at_sample(Some(excitation), i);
                if excitation.base.is_some() {
                    sample.base
                } else {
                    sample.force
                }
            };
            (0..count).map(at).collect()
        });
        let initial = experiment.initial;
        let is_still = initial.displacement == 0.0 && initial.velocity == 0.0;
        Some(Self {
            kind: channel.kind(),
            spacing,
            observed: &channel.observed()[..count],
            is_from_rest: is_still && experiment.initial_parameters == [None; 2] && input.is_some(),
            input,
        })
    }

    /// Starts of the search: the mode of the model, or that of the strongest peak, and the next strongest ones.
    fn starts(&self, frequency: f64, residuals: &[f64]) -> Option<Vec<[Mode; 2]>> {
        let peaks = |values: &[f64], beside: f64| {
            let spectrum = Spectrum::of(values, self.spacing)?;
            let each = spectrum.frequencies().zip(spectrum.density());
            let is_apart = |f: f64| {
                f > FEWEST_PERIODS * spectrum.resolution() && (f / beside - 1.0).abs() > APART
            };
            let apart = each.filter(|(f, _)| is_apart(*f));
            apart.max_by(|a, b| a.1.total_cmp(b.1)).map(|(f, _)| f)
        };
        let first = Spectrum::of(self.observed, self.spacing)?.dominant();
        let mut pairs = Vec::new();
        if frequency.is_finite() && frequency > 0.0 {
            pairs.extend(peaks(residuals, frequency).map(|second| [frequency, second]));
        }
        pairs.extend(peaks(self.observed, first).map(|second| [first, second]));
        pairs.extend(peaks(residuals, first).map(|second| [first, second]));
        pairs.dedup();
        Some(
            pairs
                .into_iter()
                .map(|pair| pair.map(|f| [f, START]))
                .collect(),
        )
    }

    /// Local minimum of the sum of squares from a start.
    fn search(&self, start: [Mode; 2]) -> Option<([Mode; 2], Sum)> {
        let mut logs: [f64; 4] = std::array::from_fn(|i| start[i / 2][i % 2].ln());
        let modes = |logs: &[f64; 4]| -> [Mode; 2] {
            [
                [logs[0].exp(), logs[1].exp()],
                [logs[2].exp(), logs[3].exp()],
            ]
        };
        let mut own = modes(&logs).map(|mode| self.columns(mode));
        let mut found = self.sum(own.each_ref())?;
        let mut damping = 1e-2;
        for _ in 0..STEPS {
            let mut jacobian = DMatrix::zeros(self.observed.len(), 4);
            for j in 0..4 {
                let mut moved = logs;
                moved[j] += SMALL;
                let other = self.columns(modes(&moved)[j / 2]);
                let there = match j / 2 {
                    0 => self.sum([&other, &own[1]]),
                    _ => self.sum([&own[0], &other]),
                }?;
                let pairs = there.residuals.iter().zip(&found.residuals);
                let change = DVector::from_iterator(
                    self.observed.len(),
                    pairs.map(|(a, b)| (a - b) / SMALL),
                );
                jacobian.set_column(j, &change);
            }
            let mut normal = jacobian.tr_mul(&jacobian);
            let gradient = jacobian.tr_mul(&DVector::from_column_slice(&found.residuals));
            for j in 0..4 {
                normal[(j, j)] *= 1.0 + damping;
            }
            let step = normal.cholesky()?.solve(&gradient);
            // A factor of 2 at most.
            let moved: [f64; 4] = std::array::from_fn(|j| logs[j] - step[j].clamp(-0.7, 0.7));
            let is_possible = moved[1] < 0.0 && moved[3] < 0.0;
            let other = modes(&moved).map(|mode| self.columns(mode));
            match (self.sum(other.each_ref())).filter(|s| is_possible && s.square < found.square) {
                Some(next) => {
                    let is_at_rest = next.square > (1.0 - AT_REST) * found.square;
                    (logs, own, found) = (moved, other, next);
                    damping = (0.1 * damping).max(1e-6);
                    if is_at_rest {
                        break;
                    }
                }
                None => damping *= 10.0,
            }
            if damping > 1e6 {
                break;
            }
        }
        Some((modes(&logs), found))
    }

    /// Least squares of the samples by the [columns](Self::columns) of two modes and a constant.
    fn sum(&self, each: [&Vec<Vec<f64>>; 2]) -> Option<Sum> {
        let columns = each[0].len();
        let count = self.observed.len();
        let constant = vec![1.0; count];
        let all: Vec<&Vec<f64>> = each.into_iter().flatten().chain([&constant]).collect();
        let matrix = DMatrix::from_fn(count, all.len(), |i, j| all[j][i]);
        let sizes: Vec<f64> = matrix.column_iter().map(|c| c.norm()).collect();
        let scaled = DMatrix::from_fn(count, all.len(), |i, j| {
            matrix[(i, j)] / sizes[j].max(f64::MIN_POSITIVE)
        });
        let observed = DVector::from_column_slice(self.observed);
        let normal = scaled.tr_mul(&scaled);
        let factors = normal.cholesky()?.solve(&scaled.tr_mul(&observed));
        let residuals = &observed - &scaled * &factors;
        let part = |from: usize| {
            let part = scaled.columns(from, columns) * factors.rows(from, columns);
            part.norm() / (count as f64).sqrt()
        };
        let square = residuals.norm_squared();
        square.is_finite().then(|| Sum {
            square,
            sizes: [part(0), part(columns)],
            residuals: residuals.as_slice().to_vec(),
            columns,
        })
    }

    /// Responses of a mode at the samples: from rest to the input, and from a displacement and a velocity.
    fn columns(&self, mode: Mode) -> Vec<Vec<f64>> {
        let mut columns = Vec::new();
        if let Some(input) = &self.input {
            columns.push(self.response(mode, [0.0, 0.0], input));
        }
        if !self.is_from_rest {
            let still = vec![0.0; self.observed.len()];
            columns.push(self.response(mode, [1.0, 0.0], &still));
            columns.push(self.response(mode, [0.0, TAU * mode[0]], &still));
        }
        columns
    }

    /// Response to an input that is linear between samples, exactly.
    fn response(&self, [frequency, ratio]: Mode, start: [f64; 2], input: &[f64]) -> Vec<f64> {
        let h = self.spacing;
        let omega = TAU * frequency;
        let decay = ratio * omega;
        let damped = omega * (1.0 - ratio * ratio).max(0.0).sqrt().max(1e-6);
        let (sine, cosine) = (damped * h).sin_cos();
        let (c, s, shrink) = (cosine, sine / damped, (-decay * h).exp());
        let [[a, b], [d, e]] = [
            [shrink * (c + decay * s), shrink * s],
            [-shrink * omega * omega * s, shrink * (c - decay * s)],
        ];
        let [mut q, mut v] = start;
        let mut out = Vec::with_capacity(input.len());
        for i in 0..input.len() {
            let u = input[i];
            out.push(match self.kind {
                ChannelKind::Displacement => q,
                ChannelKind::Velocity => v,
                ChannelKind::Acceleration => u - 2.0 * decay * v - omega * omega * q,
            });
            let next = input.get(i + 1).copied().unwrap_or(u);
            // Particular solution, linear in time.
            let slope = (next - u) / (h * omega * omega);
            let level = u / (omega * omega) - 2.0 * ratio * slope / omega;
            let (x, y) = (q - level, v - slope);
            q = a * x + b * y + level + slope * h;
            v = d * x + e * y + slope;
        }
        out
    }

    fn is_white(&self, channel: &Channel, found: &Sum) -> bool {
        let pairs = self.observed.iter().zip(&found.residuals);
        let predicted: Vec<f64> = pairs.map(|(y, r)| y - r).collect();
        let plain = channel
            .first(predicted.len())
            .with_noise(Default::default());
        diagnostics(&plain, &predicted).whiteness.p_value >= WHITE
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

fn median(values: &[f64]) -> f64 {
    crate::signal::median(values)
}
