//! Findings of fits from many starting points.

use super::{Cluster, Ranges, Waterfall, between};
use crate::functions::Parameterization;
use crate::problem::Problem;

/// Steps of the paths between two optima.
const PATH: usize = 40;
/// A path that rises by less than this share of the higher end's cost joins two ends of one valley.
const RISE: f64 = 0.05;

/// A finding.
#[derive(Debug, Clone, PartialEq)]
pub enum MultistartFinding {
    /// No starting point led to an optimum.
    Nowhere,
    /// How many starting points led to an optimum, and to how many different ones.
    Points {
        /// Fits that ended.
        ended: usize,
        /// Different optima.
        different: usize,
        /// The lowest cost.
        lowest: f64,
    },
    /// Whether a path between the two lowest optima hardly rises.
    OneValley(bool),
    /// An optimum below the fit.
    Lower {
        /// Its cost.
        cost: f64,
        /// The fit's.
        fit: f64,
    },
    /// No starting point led to an optimum as low as the fit, of this cost.
    NotReached(f64),
}

impl Ranges {
    /// Between the start of each function divided and multiplied by `spread`; about zero where the start is zero.
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
    /// The findings beside a fit with the parameters `theta`.
    pub fn findings(
        &self,
        problem: &Problem,
        theta: &[f64],
        clusters: &[Cluster],
    ) -> Vec<MultistartFinding> {
        let costs = self.costs();
        let Some(lowest) = costs.first().copied() else {
            return vec![MultistartFinding::Nowhere];
        };
        let mut findings = vec![MultistartFinding::Points {
            ended: self.order.len(),
            different: clusters.len().max(1),
            lowest,
        }];
        if let [first, second, ..] = clusters {
            let of = |cluster: &Cluster| self.runs[cluster.members[0]].found.as_ref();
            if let (Some(a), Some(b)) = (of(first), of(second)) {
                let paths = between(problem, &a.parameters, &b.parameters, PATH);
                let rise = RISE * second.cost.max(first.cost);
                findings.push(MultistartFinding::OneValley(paths.one_valley(rise)));
            }
        }
        // Below this share of what there is to explain a difference of costs is rounding.
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
