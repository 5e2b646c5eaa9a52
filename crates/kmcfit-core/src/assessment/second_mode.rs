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
//! Marquardt (variable projection, Golub and Pereyra 1973, with the derivatives of the residuals by Kaufman 1975). Two modes are named where they explain the samples better than the model and its
//! noise by the Bayesian information criterion, their residuals are white or much smaller, and their frequencies are apart.

use super::Doubt;
use super::rivals::{fit_of_constants, penalty_freedom};
use crate::diagnostics::{ResidualDiagnostics, SIGNIFICANCE};
use crate::functions::Ratio;
use crate::objective::{Evaluation, all_diagnostics, diagnostics};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, ChannelKind, Experiment};
use crate::signal::{Spectrum, even_spacing, median};
use crate::simd::sum::rms;
use crate::threads::{available, map};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::TAU;

/// Fewest samples, and the number from the beginning of a record that is used.
const FEWEST: usize = 200;
const MOST: usize = 20_000;
/// Difference of the criteria from which the evidence is very strong (Kass and Raftery 1995).
const EVIDENCE: f64 = 10.0;
/// Ratio of two frequencies, less 1, below which slow variations resemble two modes.
const APART: f64 = 0.1;
/// Fewest beats of two modes in a record: their frequencies are as many spacings apart, and the main lobe of a window ends.
const BEATS: f64 = 2.0;
/// Largest damping ratio of a mode.
const DAMPED: f64 = 0.3;
/// Fewest frequency spacings of the lower mode.
const FEWEST_PERIODS: f64 = 4.0;
/// Damping ratio from which the search starts where the fit has none between these.
const START: f64 = 0.02;
const RATIOS: std::ops::RangeInclusive<f64> = 1e-3..=0.1;
/// Smallest ratio of the mean squares of the residuals before and after at which those after need not be white, and that of close modes.
const SMALLER: f64 = 4.0;
const MUCH_SMALLER: f64 = 50.0;
/// Smallest contribution of the weaker mode relative to the stronger one, root mean square.
const WEAKEST: f64 = 0.01;
/// Smallest p-value of white residuals.
const WHITE: f64 = 1e-3;
/// Steps of the search, and the relative decrease of the sum of squares at which it ends.
const STEPS: usize = 50;
const AT_REST: f64 = 1e-6;
/// Relative change of a parameter for finite differences.
const SMALL: f64 = 1e-4;

/// Natural frequency (Hz) and damping ratio.
type Mode = [f64; 2];

/// Warnings about second modes beside the constants of a fit, at most one for each experiment, given the diagnostics of the residuals of each
/// channel of each experiment.
pub(super) fn second_modes(
    problem: &Problem,
    evaluation: &Evaluation,
    residuals: &[Vec<ResidualDiagnostics>],
) -> Vec<Doubt> {
    warnings(problem, evaluation, residuals, |_| f64::INFINITY)
}

/// The same for a fit whose functions vary: beside constants in their place, where two modes also explain the samples better than the
/// functions that vary, by the Bayesian information criterion.
pub(super) fn second_modes_in_place(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Vec<Doubt> {
    let constants = || {
        let few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let (constants, fit) = few.then(|| fit_of_constants(problem, theta, evaluation))??;
        let effective = match problem.penalties.is_empty() {
            true => 0.0,
            false => {
                let of_penalties = problem.effective_parameters(theta, evaluation)?;
                penalty_freedom(problem, Some(&of_penalties))
            }
        };
        let more = (problem.parameters() - constants.parameters()) as f64 - effective;
        Some((constants, fit, more))
    };
    let Some((constants, fit, more)) = constants() else {
        return Vec::new();
    };
    let there = &fit.best.evaluation;
    let residuals = all_diagnostics(&constants, there);
    let advantage = |e: usize| {
        let of = |problem: &Problem, evaluation: &Evaluation| {
            let channel = &problem.experiments[e].channels[0];
            let innovations = channel.innovations(&evaluation.predictions[e][0]);
            mean_square(&innovations[..innovations.len().min(MOST)])
        };
        let n = problem.experiments[e].channels[0].len().min(MOST) as f64;
        // Of the functions that vary over the constants.
        n * (of(&constants, there) / of(problem, evaluation)).ln() - more * n.ln()
    };
    warnings(&constants, there, &residuals, |e| -advantage(e))
}

/// Warnings where the gain of two modes over the fit of an experiment exceeds [`EVIDENCE`], and with `beside`, less the gain of another
/// model, zero.
fn warnings(
    problem: &Problem,
    evaluation: &Evaluation,
    residuals: &[Vec<ResidualDiagnostics>],
    beside: impl Fn(usize) -> f64,
) -> Vec<Doubt> {
    if problem.parameters() > FEW_PARAMETERS {
        return Vec::new();
    }
    let each = (0..problem.experiments.len()).filter_map(|e| {
        let (frequencies, gain) = second_mode(problem, evaluation, e, residuals[e].first()?)?;
        (gain + beside(e) > 0.0).then_some(())?;
        Some(Doubt::SecondMode {
            experiment: problem.experiments[e].name.clone(),
            frequencies,
        })
    });
    each.collect()
}

/// Frequencies of two modes in the first channel of an experiment, the stronger first, and the difference of the criteria; `of_residuals` are the
/// diagnostics of its residuals.
fn second_mode(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    of_residuals: &ResidualDiagnostics,
) -> Option<([f64; 2], f64)> {
    let experiment = &problem.experiments[e];
    let channel = experiment.channels.first()?;
    let predicted = evaluation.predictions[e].first()?;
    let is_suspect =
        channel.correlation().is_some() || of_residuals.whiteness.p_value < SIGNIFICANCE;
    let is_possible = channel.filter().is_empty() && channel.base().is_empty() && is_suspect;
    let spacing = even_spacing(channel.times()).filter(|_| is_possible)?;
    let record = Samples::of(experiment, channel, spacing)?;
    let count = record.observed.len();
    let innovations = channel.innovations(predicted);
    let before = mean_square(&innovations[..count]);
    let residuals: Vec<f64> = channel.residuals(predicted).take(count).collect();
    let nodal = evaluation.nodal_of(experiment.coefficient_set);
    let own = [Ratio::NaturalFrequency, Ratio::DampingRatio];
    let own = own.map(|ratio| median(ratio.at_nodes(problem.system.laws(), nodal)));
    let starts = record.starts(own, &residuals)?;
    let found = map(starts.len(), available(), |i| record.search(starts[i]));
    let found = found.into_iter().flatten();
    let (modes, found) = found.min_by(|a, b| a.1.square.total_cmp(&b.1.square))?;
    let after = found.square / count as f64;
    let n = count as f64;
    let order = channel.correlation().map_or(0, |c| c.order());
    let more = 2.0 + found.of_mode() as f64 - order as f64;
    let gain = n * (before / after).ln() - more * n.ln();
    let [low, high] = [modes[0][0].min(modes[1][0]), modes[0][0].max(modes[1][0])];
    let is_resolved = low > FEWEST_PERIODS / (spacing * n) && high < 0.5 / spacing;
    let smaller = match high > (1.0 + APART) * low {
        true => SMALLER,
        false => MUCH_SMALLER,
    };
    let is_explained =
        mean_square(&residuals) > smaller * after || record.is_white(channel, &found);
    let are_modes = (high - low) * spacing * n > BEATS && modes.iter().all(|m| m[1] < DAMPED);
    let [first, second] = found.sizes();
    let is_noticeable = first.min(second) > WEAKEST * first.max(second);
    (gain > EVIDENCE && is_explained && is_resolved && are_modes && is_noticeable).then(|| {
        let frequencies = match first >= second {
            true => [modes[0][0], modes[1][0]],
            false => [modes[1][0], modes[0][0]],
        };
        (frequencies, gain)
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

/// Least squares of the samples by the responses of two modes and a constant.
struct Sum {
    square: f64,
    /// Columns of the first mode, of the second, and the constant.
    columns: DMatrix<f64>,
    factors: DVector<f64>,
    /// Factor of the normal matrix of the columns.
    normal: Cholesky<f64, Dyn>,
    residuals: DVector<f64>,
}

impl<'a> Samples<'a> {
    fn of(experiment: &Experiment, channel: &'a Channel, spacing: f64) -> Option<Self> {
        let count = channel.len().min(MOST);
        (count >= FEWEST).then_some(())?;
        let excitation = experiment.excitation.as_ref().filter(|e| !e.is_zero());
        let input = excitation.map(|excitation| {
            let at = |i: usize| {
                let sample = channel.input_at_sample(Some(excitation), i);
                if excitation.frame(0).is_some() {
                    sample.base
                } else {
                    sample.force
                }
            };
            (0..count).map(at).collect()
        });
        let initial = experiment.initial.clone();
        let is_still = initial.displacement(0) == 0.0 && initial.velocity(0) == 0.0;
        Some(Self {
            kind: channel.kind(),
            spacing,
            observed: &channel.observed()[..count],
            is_from_rest: is_still && experiment.begins_known() && input.is_some(),
            input,
        })
    }

    /// Starts of the search: the mode of the model, or that of the strongest peak, and the strongest ones beside it, near and far.
    fn starts(&self, own: Mode, residuals: &[f64]) -> Option<Vec<[Mode; 2]>> {
        let of_samples = Spectrum::of(self.observed, self.spacing)?;
        let of_residuals = Spectrum::of(residuals, self.spacing)?;
        let beside = |spectrum: &Spectrum, first: f64, apart: f64| {
            let each = spectrum.frequencies().zip(spectrum.density());
            let least = FEWEST_PERIODS * spectrum.resolution();
            let others = each.filter(|(f, _)| *f > least && (f - first).abs() > apart);
            let highest = others.max_by(|a, b| a.1.total_cmp(b.1));
            highest.map(|(second, _)| [first, second])
        };
        let [frequency, ratio] = own;
        let is_mode = frequency.is_finite() && frequency > 0.0;
        let firsts = is_mode.then_some(frequency).into_iter();
        let mut pairs = Vec::new();
        for first in firsts.chain([of_samples.dominant()]) {
            for apart in [BEATS * of_samples.resolution(), APART * first] {
                pairs.extend(beside(&of_residuals, first, apart));
                pairs.extend(beside(&of_samples, first, apart));
            }
        }
        pairs.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        pairs.dedup();
        let ratio = if RATIOS.contains(&ratio) {
            ratio
        } else {
            START
        };
        let starts = pairs.into_iter().map(|pair| pair.map(|f| [f, ratio]));
        Some(starts.collect())
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
        let mut found = self.sum(modes(&logs))?;
        let mut damping = 1e-2;
        let mut derivatives = self.derivatives(&logs, modes, &found);
        for _ in 0..STEPS {
            let [normal, gradient] = &derivatives;
            let mut normal = normal.clone();
            for j in 0..4 {
                normal[(j, j)] *= 1.0 + damping;
            }
            let step = normal.cholesky()?.solve(gradient);
            // A factor of 2 at most.
            let moved: [f64; 4] = std::array::from_fn(|j| logs[j] - step[j].clamp(-0.7, 0.7));
            let is_possible = moved[1] < 0.0 && moved[3] < 0.0;
            let there = is_possible.then(|| self.sum(modes(&moved))).flatten();
            match there.filter(|sum| sum.square < found.square) {
                Some(next) => {
                    let is_at_rest = next.square > (1.0 - AT_REST) * found.square;
                    (logs, found) = (moved, next);
                    damping = (0.1 * damping).max(1e-6);
                    if is_at_rest {
                        break;
                    }
                    derivatives = self.derivatives(&logs, modes, &found);
                }
                None => damping *= 10.0,
            }
            if damping > 1e6 {
                break;
            }
        }
        Some((modes(&logs), found))
    }

    /// `J^T J` and `J^T r` of the residuals `r` and their derivatives `J` in the logarithms of frequencies and ratios: the changes of the
    /// contributions at the present factors, as far as the columns do not have them.
    fn derivatives(
        &self,
        logs: &[f64; 4],
        modes: impl Fn(&[f64; 4]) -> [Mode; 2],
        found: &Sum,
    ) -> [DMatrix<f64>; 2] {
        let moved: [Mode; 4] = std::array::from_fn(|j| {
            let mut moved = *logs;
            moved[j] += SMALL;
            modes(&moved)[j / 2]
        });
        let count = found.of_mode();
        let factors = |j: usize, column: usize| found.factors[j / 2 * count + column];
        let has_input = self.input.is_some();
        let inputs = std::array::from_fn(|j| if has_input { factors(j, 0) } else { 0.0 });
        let starts = std::array::from_fn(|j| match self.is_from_rest {
            true => [0.0; 2],
            false => [
                factors(j, count - 2),
                factors(j, count - 1) * TAU * moved[j][0],
            ],
        });
        let mut changes = self.responses(moved, inputs, starts);
        for (j, mut change) in changes.column_iter_mut().enumerate() {
            change -= found.contribution(j / 2);
        }
        changes /= -SMALL;
        let known = found.columns.tr_mul(&changes);
        let normal = changes.tr_mul(&changes) - known.tr_mul(&found.normal.solve(&known));
        let gradient = changes.tr_mul(&found.residuals);
        [
            normal,
            DMatrix::from_column_slice(4, 1, gradient.as_slice()),
        ]
    }

    /// Least squares of the samples by the columns of two modes and a constant.
    fn sum(&self, modes: [Mode; 2]) -> Option<Sum> {
        let count = self.observed.len();
        let still = [[0.0; 2]; 2];
        let mut each = Vec::new();
        if self.input.is_some() {
            each.push(self.responses(modes, [1.0; 2], still));
        }
        if !self.is_from_rest {
            each.push(self.responses(modes, [0.0; 2], [[1.0, 0.0]; 2]));
            let speeds = modes.map(|mode| [0.0, TAU * mode[0]]);
            each.push(self.responses(modes, [0.0; 2], speeds));
        }
        let mut columns = DMatrix::from_element(count, 2 * each.len() + 1, 1.0);
        for (position, pair) in each.iter().enumerate() {
            columns.set_column(position, &pair.column(0));
            columns.set_column(each.len() + position, &pair.column(1));
        }
        let observed = DVector::from_column_slice(self.observed);
        let mut normal = columns.tr_mul(&columns);
        let sizes = normal.diagonal().map(f64::sqrt);
        let is_regular = sizes.iter().all(|size| *size > 0.0);
        // Columns of length 1 for the factorisation.
        for (i, mut row) in normal.row_iter_mut().enumerate() {
            row.component_div_assign(&(sizes[i] * &sizes).transpose());
        }
        let normal = normal.cholesky().filter(|_| is_regular)?;
        let moments = columns.tr_mul(&observed).component_div(&sizes);
        let factors = normal.solve(&moments).component_div(&sizes);
        let residuals = &observed - &columns * &factors;
        let square = residuals.norm_squared();
        let mut lower = normal.unpack();
        for (i, mut row) in lower.row_iter_mut().enumerate() {
            row *= sizes[i];
        }
        square.is_finite().then(|| Sum {
            square,
            columns,
            factors,
            normal: Cholesky::pack_dirty(lower),
            residuals,
        })
    }

    /// Responses of modes at the samples, as columns, to factors of the input, linear between samples, from displacements and
    /// velocities, exactly.
    fn responses<const N: usize>(
        &self,
        modes: [Mode; N],
        factors: [f64; N],
        starts: [[f64; 2]; N],
    ) -> DMatrix<f64> {
        let h = self.spacing;
        let steps: [ModeStep; N] = std::array::from_fn(|j| ModeStep::of(modes[j], h));
        let count = self.observed.len();
        let mut out = DMatrix::zeros(count, N);
        let (mut q, mut v) = (starts.map(|s| s[0]), starts.map(|s| s[1]));
        for i in 0..count {
            let [now, next] = self.input.as_ref().map_or([0.0; 2], |input| {
                [input[i], input.get(i + 1).copied().unwrap_or(input[i])]
            });
            for j in 0..N {
                let step = &steps[j];
                let (u, w) = (factors[j] * now, factors[j] * next);
                out[(i, j)] = match self.kind {
                    ChannelKind::Displacement => q[j],
                    ChannelKind::Velocity => v[j],
                    ChannelKind::Acceleration => u - step.pull[0] * q[j] - step.pull[1] * v[j],
                };
                let forced = [0, 1].map(|k| step.input[k][0] * u + step.input[k][1] * w);
                let [a, b] = step.state;
                (q[j], v[j]) = (
                    a[0] * q[j] + a[1] * v[j] + forced[0],
                    b[0] * q[j] + b[1] * v[j] + forced[1],
                );
            }
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

impl Sum {
    /// Number of columns of a mode.
    fn of_mode(&self) -> usize {
        self.columns.ncols() / 2
    }

    fn contribution(&self, mode: usize) -> DVector<f64> {
        let (from, count) = (mode * self.of_mode(), self.of_mode());
        self.columns.columns(from, count) * self.factors.rows(from, count)
    }

    /// Root mean squares of the contributions of the modes.
    fn sizes(&self) -> [f64; 2] {
        [0, 1].map(|mode| rms(self.contribution(mode).as_slice()))
    }
}

/// Step of a mode from a sample to the next.
struct ModeStep {
    /// Displacement and velocity from those before.
    state: [[f64; 2]; 2],
    /// Displacement and velocity from the input before and after.
    input: [[f64; 2]; 2],
    /// Acceleration from displacement and velocity, negative.
    pull: [f64; 2],
}

impl ModeStep {
    fn of([frequency, ratio]: Mode, h: f64) -> Self {
        let omega = TAU * frequency;
        let decay = ratio * omega;
        let damped = omega * (1.0 - ratio * ratio).max(0.0).sqrt().max(1e-6);
        let (sine, cosine) = (damped * h).sin_cos();
        let (c, s, shrink) = (cosine, sine / damped, (-decay * h).exp());
        let square = omega * omega;
        let state = [
            [shrink * (c + decay * s), shrink * s],
            [-shrink * square * s, shrink * (c - decay * s)],
        ];
        // The particular solution to an input linear in time is linear.
        let slope = 1.0 / (h * square);
        let level = |slope: f64| -2.0 * ratio * slope / omega;
        let from = |level: f64, slope: f64| {
            let end = [level + slope * h, slope];
            [0, 1].map(|k| end[k] - state[k][0] * level - state[k][1] * slope)
        };
        let before = from(1.0 / square + level(-slope), -slope);
        let after = from(level(slope), slope);
        Self {
            state,
            input: [[before[0], after[0]], [before[1], after[1]]],
            pull: [square, 2.0 * decay],
        }
    }
}

fn mean_square(values: &[f64]) -> f64 {
    rms(values).powi(2)
}
