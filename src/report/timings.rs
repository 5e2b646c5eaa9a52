//! Wall-clock time of a run by activity.

use kmcfit_core::solvers::Fit;
use kmcfit_core::step::arithmetic;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Wall-clock time of a run by activity. The parts do not overlap, and their sum is the total.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TimingsSummary {
    /// Vector instructions of the steppers: `AVX-512`, `AVX2` or `scalar`.
    pub arithmetic: String,
    /// Forward solves of the fit: responses, predictions and costs.
    pub forward: PartSummary,
    /// Adjoint solves of the fit: gradients.
    pub adjoint: PartSummary,
    /// Tangent solves of the fit, and the step Jacobians that replace them for many parameters.
    pub tangent: PartSummary,
    /// Quadratic programs of the fit, on stages or by Clarabel.
    pub qp: PartSummary,
    /// Assembly, factorisation and solution of Gauss-Newton steps; the recursion of L-BFGS; the equation error without
    /// its quadratic programs.
    pub linear_algebra: PartSummary,
    /// Starting points from the samples, with their subproblems.
    pub start: PartSummary,
    /// Reading of data, and writing of results except `result.json`.
    pub io: PartSummary,
    /// Assessment: errors and bands, statistics, step-size check, validation records, predictions.
    #[serde(default)]
    pub analysis: PartSummary,
    /// Rendering of tables, figures and the page.
    #[serde(default)]
    pub report: PartSummary,
    /// The rest: building the model, bookkeeping.
    pub other: PartSummary,
    /// From the start of model building to the result.
    pub total: PartSummary,
}

/// Time of one part.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PartSummary {
    /// s.
    pub seconds: f64,
    /// Number of calls, if counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
}

impl PartSummary {
    fn new(time: Duration, count: Option<u64>) -> Self {
        Self {
            seconds: time.as_secs_f64(),
            count,
        }
    }
}

/// Times of the work around a fit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OverheadTimings {
    /// Reading and writing.
    pub io: Duration,
    /// See [`TimingsSummary::analysis`].
    pub analysis: Duration,
    /// See [`TimingsSummary::report`].
    pub report: Duration,
}

impl OverheadTimings {
    /// The sum of all.
    pub fn sum(&self) -> Duration {
        self.io + self.analysis + self.report
    }
}

impl TimingsSummary {
    /// Timings of a run with the total time `total`.
    pub fn new(fit: &Fit, overhead: &OverheadTimings, total: Duration) -> Self {
        let (counts, times) = (&fit.counts, &fit.timings);
        let counted = |time, count| PartSummary::new(time, Some(count));
        let part = |time| PartSummary::new(time, None);
        Self {
            arithmetic: arithmetic().into(),
            forward: counted(times.forward, counts.forward),
            adjoint: counted(times.adjoint, counts.adjoint),
            tangent: counted(times.tangent, counts.tangent),
            qp: counted(times.qp, counts.qp),
            linear_algebra: part(times.linear_algebra),
            start: part(times.start),
            io: part(overhead.io),
            analysis: part(overhead.analysis),
            report: part(overhead.report),
            other: part(total.saturating_sub(times.sum() + overhead.sum())),
            total: part(total),
        }
    }
}
