//! Findings of a multistart analysis: number of minima, lower minima.

use super::{Cluster, Ranges, Waterfall};
use crate::functions::Parameterization;
use crate::problem::Problem;

/// A finding of a multistart analysis.
#[derive(Debug, Clone, PartialEq)]
pub enum MultistartFinding {
    /// No starting point converged to a minimum.
    NoMinimum,
    /// Number of converged starting points and of distinct minima.
    Points {
        /// Converged fits.
        ended: usize,
        /// Distinct minima.
        different: usize,
        /// Lowest cost.
        lowest: f64,
    },
    /// A minimum below the fit.
    Lower {
        /// Cost of the minimum.
        cost: f64,
        /// Cost of the fit.
        fit: f64,
    },
    /// No starting point converged to a cost as low as that of the fit, the value.
    NotReached(f64),
}

impl Ranges {
    /// Ranges from each start divided by `spread` to the start multiplied by it; about zero where the start is zero.
    pub fn around_starts(functions: &Parameterization, spread: f64) -> Self {
        let around = |start: f64, size: f64| match start == 0.0 {
            true => [-size, size],
            false => {
                let (a, b) = (start / spread, start * spread);
                [a.min(b), a.max(b)]
            }
        };
        let of_functions = functions.iter().map(|f| {
            let mut values = vec![0.0; functions.nodes()];
            f.values_into(&f.start, &mut values);
            around(values.iter().sum::<f64>() / values.len() as f64, 1.0)
        });
        let of_scalars = functions.scalars().iter().map(|s| around(s.start, s.size));
        Self::Constants(of_functions.chain(of_scalars).collect())
    }
}

impl Waterfall {
    /// Findings in comparison with a fit at the parameters `theta`.
    pub fn findings(
        &self,
        problem: &Problem,
        theta: &[f64],
        clusters: &[Cluster],
    ) -> Vec<MultistartFinding> {
        let costs = self.costs();
        let Some(lowest) = costs.first().copied() else {
            return vec![MultistartFinding::NoMinimum];
        };
        let mut findings = vec![MultistartFinding::Points {
            ended: self.order.len(),
            different: clusters.len().max(1),
            lowest,
        }];
        // Differences of costs below this share of the zero-response misfit are rounding errors.
        let rounding = 1e-12 * problem.zero_response_misfit();
        let fit = problem.evaluate(theta).map(|here| here.cost);
        findings.extend(fit.ok().and_then(|fit| {
            if lowest < fit * (1.0 - 1e-6) - rounding {
                Some(MultistartFinding::Lower { cost: lowest, fit })
            } else {
                (lowest > fit * 1.01 + rounding).then_some(MultistartFinding::NotReached(fit))
            }
        }));
        findings
    }
}
