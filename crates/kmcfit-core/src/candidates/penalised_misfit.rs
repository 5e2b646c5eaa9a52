//! The penalised misfit, by which models of the same samples are compared.
//!
//! ```text
//! V = sum over channels of (n ln E + p ln N) + (q + s) ln N
//! ```
//!
//! with the variance `E` of the innovations of the `n` residuals of a channel under an autoregressive process whose order `p` minimises `V`, the
//! number `q` of parameters, the number `s` of those that were searched, and the number `N` of all samples: the Bayesian information criterion of
//! Schwarz (1978) with noise that each model has for itself. A model that leaves correlated residuals pays for their process, and one that leaves
//! white ones does not.

use crate::alternatives::{Minimum, weighted_residuals};
use crate::noise::{Correlation, CorrelationLaw, select_order, uninterrupted_runs};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::simd::sum::rms;
use crate::solvers::weighted_jacobian;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Highest order of the process of the residuals.
pub(super) const HIGHEST_ORDER: usize = 8;
/// Rounds of regression and estimation of the process after the first.
const ROUNDS: usize = 2;

/// Samples of a channel among those of all.
struct ChannelRows {
    samples: Range<usize>,
    times: Vec<f64>,
    /// Runs without a gap; none for samples that are not equally spaced, whose residuals count as uncorrelated.
    runs: Vec<Range<usize>>,
}

/// Process of the residuals of a channel.
struct Process {
    order: usize,
    /// Variance of the innovations relative to that of the residuals.
    share: f64,
    correlation: Correlation,
}

/// A model linearised where its weighted residuals have the least squares.
pub(super) struct Linearised {
    channels: Vec<ChannelRows>,
    /// Derivatives of the weighted residuals.
    pub(super) jacobian: DMatrix<f64>,
    pub(super) residuals: DVector<f64>,
}

/// A model as judged by its penalised misfit.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    /// The penalised misfit.
    pub(super) misfit: f64,
    /// Change of the parameters, and of those that are added, from the point of linearisation, to the least squares.
    pub(super) change: DVector<f64>,
    /// Sum of the squares of the residuals without a process.
    pub(super) squares: f64,
    /// Highest order of the processes.
    pub(super) order: usize,
    /// Change of the parameters to the estimates under the processes.
    pub(super) estimate: DVector<f64>,
    /// Covariance of these.
    pub(super) covariance: DMatrix<f64>,
    /// Degrees of freedom of the residuals.
    pub(super) degrees: f64,
    /// Parts of the misfit.
    pub(super) of_channels: Vec<ChannelMisfit>,
}

/// Part of the penalised misfit of a channel.
#[derive(Debug, Clone)]
pub(super) struct ChannelMisfit {
    pub(super) misfit: f64,
    /// Order of the process of the residuals.
    pub(super) order: usize,
}

impl Linearised {
    /// At an evaluation of a problem with white noise.
    pub(super) fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let channels = problem.channels().zip(problem.channel_samples());
        let channels = channels.map(|(channel, samples)| ChannelRows {
            samples,
            times: channel.times().to_vec(),
            runs: uninterrupted_runs(channel.times()).unwrap_or_default(),
        });
        Self {
            channels: channels.collect(),
            jacobian: weighted_jacobian(problem, evaluation),
            residuals: weighted_residuals(problem, evaluation),
        }
    }

    /// The model itself.
    pub(super) fn own(&self) -> Judged {
        self.with(&[], 0)
    }

    /// The model with further derivatives of the residuals, and `searched` parameters that were searched.
    pub(super) fn with(&self, further: &[DVector<f64>], searched: usize) -> Judged {
        let residuals = &self.residuals;
        let own = self.jacobian.column_iter().map(|c| c.into_owned());
        let columns: Vec<DVector<f64>> = own.chain(further.iter().cloned()).collect();
        let columns = DMatrix::from_columns(&columns);
        let mut minimum = Minimum::of(&columns, residuals);
        let (squares, change) = (minimum.squares, minimum.change.clone());
        let mut found: Option<Judged> = None;
        for round in 0..=ROUNDS {
            let rest = residuals + &columns * &minimum.change;
            let processes = self.processes(&rest);
            let parameters = minimum.rank + searched;
            let of_channels = self.misfits(&rest, &processes);
            let price = (residuals.len() as f64).ln();
            let misfits = of_channels.iter().map(|channel| channel.misfit);
            let misfit = misfits.sum::<f64>() + parameters as f64 * price;
            let order = of_channels.iter().map(|channel| channel.order).max();
            let order = order.unwrap_or(0);
            if found.as_ref().is_none_or(|found| misfit < found.misfit) {
                let degrees = residuals.len().saturating_sub(minimum.rank) as f64;
                let variance = minimum.squares / degrees.max(1.0);
                found = Some(Judged {
                    misfit,
                    change: change.clone(),
                    squares,
                    order,
                    estimate: minimum.change.clone(),
                    covariance: &minimum.root * minimum.root.transpose() * variance,
                    degrees,
                    of_channels,
                });
            }
            if order == 0 || round == ROUNDS {
                break;
            }
            let mut whitened = columns.clone();
            for mut column in whitened.column_iter_mut() {
                self.whiten(&processes, column.as_mut_slice());
            }
            let mut right = residuals.clone();
            self.whiten(&processes, right.as_mut_slice());
            minimum = Minimum::of(&whitened, &right);
        }
        found.expect("at least one round")
    }

    /// Changes to the least squares with further derivatives of the residuals.
    pub(super) fn squares_with(&self, further: &[DVector<f64>]) -> DVector<f64> {
        let own = self.jacobian.column_iter().map(|c| c.into_owned());
        let columns: Vec<DVector<f64>> = own.chain(further.iter().cloned()).collect();
        Minimum::of(&DMatrix::from_columns(&columns), &self.residuals).change
    }

    /// Process of the residuals of each channel; `None` where they are white.
    fn processes(&self, residuals: &DVector<f64>) -> Vec<Option<Process>> {
        let each = self.channels.iter().map(|channel| {
            let values = &residuals.as_slice()[channel.samples.clone()];
            let process = select_order(values, &channel.runs, HIGHEST_ORDER);
            let (order, share) = (process.order(), process.innovation_variance());
            let law = CorrelationLaw::Autoregressive(process);
            let correlation = (order > 0).then(|| Correlation::new(law, &channel.times))??;
            Some(Process {
                order,
                share,
                correlation,
            })
        });
        each.collect()
    }

    fn misfits(
        &self,
        residuals: &DVector<f64>,
        processes: &[Option<Process>],
    ) -> Vec<ChannelMisfit> {
        let price = (residuals.len() as f64).ln();
        let each = self.channels.iter().zip(processes);
        let of_channels = each.map(|(channel, process)| {
            let values = &residuals.as_slice()[channel.samples.clone()];
            let (share, order) = process.as_ref().map_or((1.0, 0), |p| (p.share, p.order));
            let innovations = (rms(values).powi(2) * share).max(f64::MIN_POSITIVE);
            ChannelMisfit {
                misfit: values.len() as f64 * innovations.ln() + order as f64 * price,
                order,
            }
        });
        of_channels.collect()
    }

    fn whiten(&self, processes: &[Option<Process>], values: &mut [f64]) {
        for (channel, process) in self.channels.iter().zip(processes) {
            if let Some(process) = process {
                let own = &mut values[channel.samples.clone()];
                let whitened = process.correlation.whiten(own);
                own.copy_from_slice(&whitened);
            }
        }
    }
}
