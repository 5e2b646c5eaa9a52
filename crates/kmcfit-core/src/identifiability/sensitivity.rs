//! The weighted Jacobian of all predictions and its singular values.

use super::directions::Directions;
use super::factorisation::Factorisation;
use crate::objective::Evaluation;
use crate::problem::Problem;
use nalgebra::DMatrix;
use std::ops::Range;

/// Singular values above this share of the largest count along smooth directions of many parameters, where the error of
/// the stepper, some 1e-5 of a response, makes the scale over time faintly seen.
pub const COARSE_RANK: f64 = 1e-5;
/// Most work of a decomposition, rows x columns x the smaller of both, for it to take some seconds: 1000
/// samples of 3000 parameters. Beyond it the directions are made coarser.
const MOST_WORK: f64 = 3.1e9;
/// Number of smooth directions, then.
const COARSE: usize = 600;

/// `sqrt(w_i) dz_i/dtheta . d_k` for all samples `i` and directions `k`.
///
/// `w` are the weights of the samples (`1/sigma^2`, or the quadrature weights of the integral cost; of
/// a robust loss those of the squares that stand for it), and the directions `d_k` have natural sizes
/// ([`Directions`]), so the entries have no unit with sigmas, and that of `sqrt(J)` without.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// Samples x directions.
    pub jacobian: DMatrix<f64>,
    /// `sqrt(w_i) r_i` with the residuals `r = model - sample`.
    pub residuals: Vec<f64>,
    /// `sqrt(w_i)`, in the inverse unit of the channel or with the root of a second.
    pub roots: Vec<f64>,
    /// Whether each sample has a standard deviation.
    pub has_sigma: Vec<bool>,
    /// What the columns differentiate along.
    pub directions: Directions,
    /// The name of each function of the list.
    names: Vec<String>,
}

impl Sensitivity {
    /// At an evaluated point, along all parameters; along some 600 smooth directions where these are
    /// more than about 1000 samples of 3000 parameters ([`Directions::is_coarse`] says so): their rank is
    /// that of functions on as many knots. The whole Jacobian is still to be had by
    /// [`Sensitivity::along`], 2000 samples of 6000 parameters in a second; its decomposition takes a
    /// minute.
    pub fn of(problem: &Problem, evaluation: &Evaluation) -> Self {
        let (rows, columns) = (problem.sample_count() as f64, problem.parameters() as f64);
        let fits = rows * columns * rows.min(columns) <= MOST_WORK;
        let most = if fits { usize::MAX } else { COARSE };
        Self::along(
            problem,
            evaluation,
            Directions::new(problem, evaluation, most, COARSE),
        )
    }

    /// Along given directions.
    pub fn along(problem: &Problem, evaluation: &Evaluation, directions: Directions) -> Self {
        let (mut roots, mut residuals) = (Vec::new(), Vec::new());
        let mut has_sigma = Vec::new();
        for (channel, predicted) in problem.predicted(evaluation) {
            for (i, r) in channel.residuals(predicted).enumerate() {
                let root = channel.weight(i, r).sqrt();
                roots.push(root);
                residuals.push(root * r);
                has_sigma.push(channel.weighting().is_sigma());
            }
        }
        let mut jacobian = match directions.is_coarse() {
            true => by_tangents(problem, evaluation, &directions, roots.len()),
            false => directions.of_jacobian(problem.predictions_jacobian(evaluation)),
        };
        for mut column in jacobian.column_iter_mut() {
            (column.iter_mut().zip(&roots)).for_each(|(a, root)| *a *= root);
        }
        Self {
            jacobian,
            residuals,
            roots,
            has_sigma,
            names: problem.functions.iter().map(|f| f.name()).collect(),
            directions,
        }
    }

    /// Singular values and directions.
    pub fn spectrum(&self) -> SingularSpectrum {
        let mut factorisation = Factorisation::of(&self.jacobian);
        if self.directions.is_coarse() {
            // Along smooth directions the scale over time shows through the error of the stepper.
            factorisation = factorisation.above(COARSE_RANK);
        }
        SingularSpectrum {
            factorisation,
            directions: self.directions.clone(),
            names: self.names.clone(),
        }
    }
}

/// One tangent solve for each direction.
fn by_tangents(
    problem: &Problem,
    evaluation: &Evaluation,
    directions: &Directions,
    samples: usize,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(samples, directions.len());
    for k in 0..directions.len() {
        let changes = problem.predictions_tangent(evaluation, &directions.column(k));
        let all = changes.iter().flatten().flatten();
        (jacobian.column_mut(k).iter_mut().zip(all)).for_each(|(entry, change)| *entry = *change);
    }
    jacobian
}

/// What the samples see: `J = U S V^T`.
#[derive(Debug, Clone)]
pub struct SingularSpectrum {
    factorisation: Factorisation,
    directions: Directions,
    names: Vec<String>,
}

/// A direction of the parameters with what the samples make of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Its singular value.
    pub singular_value: f64,
    /// Change of the parameters, in their units.
    pub change: Vec<f64>,
    /// Change of each function over the nodes, in its unit, with its name.
    pub functions: Vec<(String, Vec<f64>)>,
}

impl SingularSpectrum {
    /// Decreasing; as many as the smaller of samples and directions. In standard deviations of all
    /// samples together per change by 100 % of the natural sizes ([`Directions`]).
    pub fn singular_values(&self) -> &[f64] {
        &self.factorisation.singular_values
    }

    /// Number of those that count.
    pub fn rank(&self) -> usize {
        self.factorisation.rank
    }

    /// Number of directions that were looked at: that of the parameters, unless it is coarse.
    pub fn of(&self) -> usize {
        self.directions.len()
    }

    /// Number of directions that are not seen.
    pub fn unseen(&self) -> usize {
        self.of() - self.rank()
    }

    /// The directions that it is about.
    pub fn directions(&self) -> &Directions {
        &self.directions
    }

    /// The part of `z` that is not seen.
    pub fn unseen_part(&self, z: &DMatrix<f64>) -> DMatrix<f64> {
        let seen = self.factorisation.determined();
        let mut rest = z.clone();
        // Twice: what the first pass leaves to rounding.
        for _ in 0..2 {
            let inside = seen.tr_mul(&rest);
            rest -= seen * inside;
        }
        rest
    }

    /// The directions of these ranks, best first, as changes of every function over time.
    pub fn at(&self, problem: &Problem, ranks: Range<usize>) -> Vec<Seen> {
        let each = ranks
            .filter(|k| *k < self.factorisation.vectors().ncols())
            .map(|k| {
                let z = self.factorisation.vectors().column(k);
                let change = self.directions.to_parameters(z.as_slice());
                Seen {
                    singular_value: self.singular_values()[k],
                    functions: functions_along(problem, &change, &self.names),
                    change,
                }
            });
        each.collect()
    }

    /// The `count` directions that the samples see best.
    pub fn best(&self, problem: &Problem, count: usize) -> Vec<Seen> {
        self.at(problem, 0..count)
    }

    /// The `count` directions that they see worst, the worst last, of those they do see.
    pub fn worst(&self, problem: &Problem, count: usize) -> Vec<Seen> {
        self.at(problem, self.rank().saturating_sub(count)..self.rank())
    }

    /// In words.
    pub fn sentence(&self) -> String {
        let (rank, of) = (self.rank(), self.of());
        match self.directions.is_coarse() {
            false => format!("the samples see {rank} of {of} directions"),
            true => format!(
                "the samples see {rank} of {of} smooth directions to better than {COARSE_RANK:e} of the \
                 best (of {} parameters; below that the stepper's own error shows)",
                self.directions.parameters()
            ),
        }
    }
}

fn functions_along(problem: &Problem, change: &[f64], names: &[String]) -> Vec<(String, Vec<f64>)> {
    let functions = &problem.functions;
    let parts = functions.iter().zip(functions.ranges()).zip(names);
    let each = parts.map(|((function, range), name)| {
        let values = (function.design).multiply(&change[range.clone()], functions.nodes());
        (name.clone(), values)
    });
    each.collect()
}
