//! Groups converged minima whose `c/m`, `k/m` (and further coefficients over m) and displacements agree within a
//! tolerance.

use super::Waterfall;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::Status;

/// Minima within the tolerance of the one with the lowest cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Indices of the runs, by rising cost.
    pub members: Vec<usize>,
    /// Lowest cost.
    pub cost: f64,
}

impl Waterfall {
    /// Clusters by rising cost. A run joins the first cluster whose best member is within `tolerance` in both ratios and
    /// responses. Runs that have not converged are left out, because they have not reached a minimum.
    pub fn clusters(&self, problem: &Problem, tolerance: f64) -> Vec<Cluster> {
        let mut clusters: Vec<Cluster> = Vec::new();
        for &i in &self.order {
            let run = &self.runs[i];
            let (Some(found), Status::Converged) = (&run.found, run.status) else {
                continue;
            };
            let near = |cluster: &&mut Cluster| {
                let best = self.runs[cluster.members[0]].found.as_ref();
                best.is_some_and(|best| {
                    distance(problem, &best.evaluation, &found.evaluation) <= tolerance
                })
            };
            match clusters.iter_mut().find(near) {
                Some(cluster) => cluster.members.push(i),
                None => clusters.push(Cluster {
                    members: vec![i],
                    cost: found.evaluation.cost,
                }),
            }
        }
        clusters
    }
}

/// Distance from evaluation `a` to evaluation `b`, dimensionless: the larger of the RMS difference of the displacements, divided by their RMS
/// in `a`, and of the largest RMS difference over the nodes of any coefficient divided by the mass (`c/m`, `k/m`, …), relative to the quotient
/// of their natural scales ([`Problem::natural_scales`]) in `a`. A difference that is NaN counts as infinite.
fn distance(problem: &Problem, a: &Evaluation, b: &Evaluation) -> f64 {
    let natural = problem.natural_scales(a);
    let mut ratios = 0.0f64;
    for (which, assembly) in problem.functions.coefficient_sets().iter().enumerate() {
        let (one, two) = (a.nodal_of(which), b.nodal_of(which));
        for (j, (p, q)) in one.coefficients.iter().zip(&two.coefficients).enumerate() {
            let size = natural[assembly[j + 1]] / natural[assembly[0]];
            let changes =
                (0..p.len()).map(|i| p[i] / one.inertias[0][i] - q[i] / two.inertias[0][i]);
            ratios = ratios.max(relative(rms(changes), size));
        }
    }
    let pairs = a.trajectories.iter().zip(&b.trajectories);
    let changes = pairs.flat_map(|(a, b)| {
        let nodes = a.displacement(0).iter().zip(b.displacement(0));
        nodes.map(|(a, b)| a - b)
    });
    let own = a
        .trajectories
        .iter()
        .flat_map(|t| t.displacement(0).iter().copied());
    ratios.max(relative(rms(changes), rms(own)))
}

/// Returns `change / size`: zero if `change` is zero, infinite if the quotient is NaN.
fn relative(change: f64, size: f64) -> f64 {
    let quotient = change / size;
    match change {
        0.0 => 0.0,
        _ if quotient.is_nan() => f64::INFINITY,
        _ => quotient,
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_that_is_not_a_number_is_infinite() {
        assert_eq!(relative(3.0, 2.0), 1.5);
        assert_eq!(relative(0.0, 0.0), 0.0);
        assert_eq!(relative(1.0, 0.0), f64::INFINITY);
        assert_eq!(relative(f64::NAN, 1.0), f64::INFINITY);
        assert_eq!(relative(f64::INFINITY, f64::INFINITY), f64::INFINITY);
    }
}
