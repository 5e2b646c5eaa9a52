//! Sensitivity: the weighted Jacobian of all predictions, and its singular values.

use super::directions::Directions;
use super::factorisation::Factorisation;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::rows::append;
use nalgebra::DMatrix;

/// Rank threshold along smooth directions of many parameters, relative to the largest singular value. The error of the
/// stepper, about 1e-5 of a response, otherwise makes the scale over time appear determined.
pub const COARSE_RANK: f64 = 1e-5;
/// Largest work of a decomposition, rows x columns x the smaller of both: some seconds, as for 1000 samples of 3000
/// parameters. Beyond it, smooth directions are used.
const MOST_WORK: f64 = 3.1e9;
/// Number of smooth directions.
const COARSE: usize = 600;

/// Weighted Jacobian `sqrt(w_i) dz_i/dtheta . d_k` for all samples `i` and directions `k`; for correlated noise the rows are
/// whitened ([`Channel::whiten_rows`](crate::record::Channel::whiten_rows)).
///
/// `w` are the weights of the samples: `1/sigma^2`, or the quadrature weights of the integral cost, for a robust loss
/// those of its quadratic majorant. The directions `d_k` have natural sizes ([`Directions`]), so the entries are
/// dimensionless with sigmas, and otherwise have the unit of `sqrt(J)`.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// Samples x directions.
    pub jacobian: DMatrix<f64>,
    /// Weighted residuals `sqrt(w_i) r_i`, `r = model - sample`.
    pub residuals: Vec<f64>,
    /// `sqrt(w_i)`, in the inverse unit of the channel or with the root of a second.
    pub weight_roots: Vec<f64>,
    /// True for each sample with a standard deviation.
    pub has_sigma: Vec<bool>,
    /// Directions of the columns.
    pub directions: Directions,
}

impl Sensitivity {
    /// Sensitivity at an evaluated point along all parameters; along about 600 smooth directions for problems larger than 1000
    /// samples of 3000 parameters ([`Directions::is_coarse`]), whose rank is that of functions with as many knots.
    /// [`Sensitivity::along`] computes the full Jacobian of 2000 samples of 6000 parameters in a second; its decomposition
    /// takes a minute.
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
        let jacobian = match directions.is_coarse() {
            true => by_tangents(problem, evaluation, &directions),
            false => directions.of_jacobian(problem.predictions_jacobian(evaluation)),
        };
        Self::weighted(problem, evaluation, directions, jacobian)
    }

    /// Weights the derivatives `jacobian` of the predictions along the directions by the noise of the problem.
    pub(super) fn weighted(
        problem: &Problem,
        evaluation: &Evaluation,
        directions: Directions,
        mut jacobian: DMatrix<f64>,
    ) -> Self {
        let (mut weight_roots, mut residuals) = (Vec::new(), Vec::new());
        let mut has_sigma = Vec::new();
        for (channel, predicted) in problem.predicted(evaluation) {
            let mut majorant = channel.majorant(predicted);
            let factor = channel.information_root(predicted);
            (majorant.weight_roots.iter_mut()).for_each(|root| *root *= factor);
            append(&mut weight_roots, majorant.weight_roots);
            append(&mut residuals, majorant.weighted);
            has_sigma.extend(std::iter::repeat_n(
                channel.weighting().is_sigma(),
                channel.len(),
            ));
        }
        problem.whiten_rows(&mut jacobian);
        for mut column in jacobian.column_iter_mut() {
            (column.iter_mut().zip(&weight_roots)).for_each(|(a, root)| *a *= root);
        }
        Self {
            jacobian,
            residuals,
            weight_roots,
            has_sigma,
            directions,
        }
    }

    /// Rows with the weight one: residuals of another equation than the misfit, along the directions.
    pub(super) fn of_rows(
        jacobian: DMatrix<f64>,
        residuals: Vec<f64>,
        directions: Directions,
    ) -> Self {
        let count = residuals.len();
        Self {
            jacobian,
            residuals,
            weight_roots: vec![1.0; count],
            has_sigma: vec![true; count],
            directions,
        }
    }

    /// Singular value decomposition.
    pub fn spectrum(&self) -> SingularSpectrum {
        let mut factorisation = Factorisation::of(&self.jacobian);
        if self.directions.is_coarse() {
            // Along smooth directions the error of the stepper makes the scale over time appear determined.
            factorisation = factorisation.above(COARSE_RANK);
        }
        SingularSpectrum {
            factorisation,
            directions: self.directions.clone(),
        }
    }
}

/// Jacobian from one tangent solve for each direction.
fn by_tangents(
    problem: &Problem,
    evaluation: &Evaluation,
    directions: &Directions,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(problem.sample_count(), directions.len());
    for k in 0..directions.len() {
        let changes = problem.predictions_tangent(evaluation, &directions.column(k));
        let all = changes.iter().flatten().flatten();
        (jacobian.column_mut(k).iter_mut().zip(all)).for_each(|(entry, change)| *entry = *change);
    }
    jacobian
}

/// Singular value decomposition `J = U S V^T` of a sensitivity.
#[derive(Debug, Clone)]
pub struct SingularSpectrum {
    factorisation: Factorisation,
    directions: Directions,
}

impl SingularSpectrum {
    /// Singular values, decreasing, as many as the smaller of samples and directions: the response of all samples, in standard
    /// deviations, to a change by 100 % of the natural sizes ([`Directions`]).
    pub fn singular_values(&self) -> &[f64] {
        &self.factorisation.singular_values
    }

    /// Numerical rank.
    pub fn rank(&self) -> usize {
        self.factorisation.rank
    }

    /// Number of directions: that of the parameters, unless smooth directions are used.
    pub fn of(&self) -> usize {
        self.directions.len()
    }

    /// Number of undetermined directions.
    pub fn undetermined(&self) -> usize {
        self.of() - self.rank()
    }

    /// Directions of the columns.
    pub fn directions(&self) -> &Directions {
        &self.directions
    }

    /// Component of `z` in the undetermined directions.
    pub fn unseen_part(&self, z: &DMatrix<f64>) -> DMatrix<f64> {
        let determined = self.factorisation.determined();
        let mut rest = z.clone();
        // A second pass removes the rounding errors of the first.
        for _ in 0..2 {
            let inside = determined.tr_mul(&rest);
            rest -= determined * inside;
        }
        rest
    }

    /// The change of the parameters, in their units, along the best determined direction.
    pub fn best(&self) -> Vec<f64> {
        let first = self.factorisation.vectors().column(0);
        self.directions.to_parameters(first.as_slice())
    }

    /// Rank as a sentence.
    pub fn sentence(&self) -> String {
        let (rank, of) = (self.rank(), self.of());
        match self.directions.is_coarse() {
            false => format!("the samples determine {rank} of {of} parameter combinations"),
            true => format!(
                "the samples determine {rank} of {of} smooth parameter combinations at a threshold of {COARSE_RANK:e} of the \
                 largest singular value (of {} parameters; the step-size error limits the threshold)",
                self.directions.parameters()
            ),
        }
    }
}
