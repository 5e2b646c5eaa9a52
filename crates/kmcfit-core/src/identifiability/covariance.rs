//! Covariance of the parameters from one factorisation of the weighted Jacobian, and the directions that the data leave
//! undetermined. Standard errors ([`Problem::covariance`]) and bands ([`super::Bands`]) are computed from it.

use super::active::{ActiveRow, active_rows};
use super::columns::{stacked, with_column};
use super::covariance_kind::CovarianceKind;
use super::directions::Directions;
use super::equation_rows::{EquationRows, Scores};
use super::factorisation::Factorisation;
use super::misspecified::kernels;
use super::sensitivity::Sensitivity;
use super::step_error::{self, step_error};
use crate::functions::{Penalty, Prior, WeightRule};
use crate::noise::KernelCovariance;
use crate::objective::{Evaluation, Refined};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::simd::tall_qr::Triangle;
use nalgebra::{DMatrix, DVector, DVectorView};
use std::ops::Range;

/// Information on the parameters, in scaled directions.
pub(super) struct Information {
    sensitivity: Sensitivity,
    /// Rows of measurements, samples and then priors; their triangular factor where no sample is looked at by itself.
    measured: DMatrix<f64>,
    /// Rows of penalties and violated soft constraints.
    pulled: DMatrix<f64>,
    /// True with a penalty whose rule gives intervals that include the smoothing bias on average
    /// ([`WeightRule::gives_coverage`](crate::functions::WeightRule::gives_coverage)).
    is_bayesian: bool,
    /// Bound of the accumulated rounding error of a response as large as the largest sample.
    rounding: f64,
    /// Products `J^T W^(1/2) e` with the numerical error of the weighted predictions, where it is included.
    error: Option<DVector<f64>>,
    /// Samples of channels whose scores have the covariance of a kernel.
    kernels: Vec<Range<usize>>,
    /// Scores of the samples, for the kernel covariance of an equation error.
    scores: Option<Scores>,
}

/// Covariance root, `Cov = F F^T` on determined directions and zero on the others.
#[derive(Clone)]
pub(super) struct CovarianceRoot {
    /// `F`, directions x rank.
    pub root: DMatrix<f64>,
    /// Orthonormal basis of the undetermined directions, as columns.
    pub undetermined: DMatrix<f64>,
    /// Estimated variance of samples without sigma, in the square of their unit; `None` if all samples have one.
    pub variance: Option<f64>,
}

impl Information {
    pub fn new(problem: &Problem, theta: &[f64], sensitivity: Sensitivity) -> Self {
        let directions = &sensitivity.directions;
        let priors = problem.functions.priors();
        let row = |(j, prior): (usize, Prior)| directions.row([(j, 1.0 / prior.sigma)]);
        let priors: Vec<Vec<f64>> = priors.map(row).collect();
        let n = directions.len();
        let priors = DMatrix::from_fn(priors.len(), n, |i, k| priors[i][k]);
        // Otherwise some samples have an estimated variance, or scores with the covariance of a kernel.
        let is_reduced = kernels(problem).is_empty()
            && sensitivity.has_sigma.iter().all(|known| *known)
            && sensitivity.jacobian.nrows() > n
            && sensitivity.jacobian.iter().all(|x| x.is_finite());
        let measured = match is_reduced {
            true => stacked(&Triangle::factor(&sensitivity.jacobian), &priors),
            false => stacked(&sensitivity.jacobian, &priors),
        };
        Self::of_measured(problem, theta, sensitivity, measured)
    }

    /// Information of the rows `measured`, penalties and violated soft constraints.
    pub fn of_measured(
        problem: &Problem,
        theta: &[f64],
        sensitivity: Sensitivity,
        measured: DMatrix<f64>,
    ) -> Self {
        let directions = &sensitivity.directions;
        let mut pulls = Vec::new();
        for group in &problem.soft {
            let root = group.row_weight().sqrt();
            for i in 0..group.rows.len() {
                if group.excess(i, theta) != 0.0 {
                    pulls.push(directions.row(group.rows.row(i).map(|(j, a)| (j, root * a))));
                }
            }
        }
        let n = directions.len();
        let mut pulled = DMatrix::from_fn(pulls.len(), n, |i, k| pulls[i][k]);
        for penalty in &problem.penalties {
            pulled = stacked(&pulled, &roughness(problem, penalty, directions));
        }
        let samples = problem.channels().flat_map(|c| c.observed());
        let largest = samples.fold(0.0f64, |most, y| most.max(y.abs()));
        Self {
            measured,
            pulled,
            is_bayesian: is_bayesian(problem),
            sensitivity,
            rounding: f64::EPSILON * largest * problem.system.grid.nodes() as f64,
            error: None,
            kernels: kernels(problem),
            scores: None,
        }
    }

    /// Information of the equation error at its minimum `theta`, with the covariance from the scores of the samples.
    pub fn of_equation_error(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        equation: &EquationRows,
    ) -> Self {
        let n = problem.parameters();
        let directions = Directions::new(problem, evaluation, n, n);
        let jacobian = directions.of_jacobian(equation.rows.clone());
        let residuals = equation.residuals.clone();
        let sensitivity = Sensitivity::of_rows(jacobian, residuals, directions);
        let functions = problem.functions.scalar_range().start;
        let scores = Scores::of(equation, &sensitivity, theta, functions);
        let measured = sensitivity.jacobian.clone();
        let information = Self {
            scores: Some(scores),
            kernels: Vec::new(),
            ..Self::of_measured(problem, theta, sensitivity, measured)
        };
        match &equation.change {
            Some(change) => information.with_error(change),
            None => information,
        }
    }

    /// True for the equation error.
    pub fn is_equation(&self) -> bool {
        self.scores.is_some()
    }

    /// Kind of the covariance.
    pub fn kind(&self) -> CovarianceKind {
        match () {
            () if self.is_equation() || !self.kernels.is_empty() => CovarianceKind::Kernel,
            () if self.is_pulled() => CovarianceKind::Penalised,
            () if self.is_bayesian => CovarianceKind::Bayesian,
            () => CovarianceKind::Information,
        }
    }

    /// Rows held with equality besides the constraints.
    pub fn held(&self) -> &[ActiveRow] {
        self.scores.as_ref().map_or(&[], |scores| &scores.held)
    }

    /// Includes the discretisation error of the time steps, from the results on half the step where they are known.
    pub fn with_error_of_steps(
        self,
        problem: &Problem,
        evaluation: &Evaluation,
        halved: Option<Refined>,
    ) -> Self {
        let weight_roots = &self.sensitivity.weight_roots;
        let error = match halved {
            None => step_error(problem, evaluation, weight_roots),
            Some(halved) => step_error::of_changes(problem, evaluation, weight_roots, halved),
        };
        match error {
            Some(error) => self.with_error(&error),
            None => self,
        }
    }

    /// Includes this error of the weighted predictions alone.
    pub fn with_error(self, error: &DVector<f64>) -> Self {
        Self {
            error: Some(self.sensitivity.jacobian.tr_mul(error)),
            ..self
        }
    }

    /// Shift of each parameter by the included error, and its standard error without it, with the rows `held` fixed. `None`
    /// where no error is included.
    pub fn shifts(&self, held: &[&ActiveRow]) -> Option<Vec<[f64; 2]>> {
        self.error.as_ref()?;
        let columns = self.columns(&self.factor(held));
        let (shift, root) = columns.split_last()?;
        let each = shift.iter().enumerate().map(|(i, shift)| {
            let variance: f64 = root.iter().map(|column| column[i] * column[i]).sum();
            [*shift, variance.sqrt()]
        });
        Some(each.collect())
    }

    /// The covariance root with the shift of the estimates by the included error as a further column.
    fn with_shift(&self, root: DMatrix<f64>, inverse_root: &DMatrix<f64>) -> DMatrix<f64> {
        let Some(moments) = &self.error else {
            return root;
        };
        with_column(root, &-(inverse_root * inverse_root.tr_mul(moments)))
    }

    /// Rows of samples, priors and penalties, stacked.
    pub fn rows(&self) -> DMatrix<f64> {
        stacked(&self.measured, &self.pulled)
    }

    pub fn sensitivity(&self) -> &Sensitivity {
        &self.sensitivity
    }

    /// True with penalties or violated soft constraints, where the covariance is a sandwich.
    pub fn is_pulled(&self) -> bool {
        self.pulled.nrows() > 0 && !self.is_bayesian
    }

    /// Covariance with the rows `held` fixed: `H^+ M H^+` in the null space of these rows, with `H = J^T W J + R` and
    /// `M = J^T W J` (`W` multiplied by the estimated variance for samples without sigma); `H^+`, the Bayesian covariance, for
    /// penalties whose rule gives coverage. For channels whose innovations are not white the part of their scores in `M` is that of
    /// a kernel ([`KernelCovariance`]), as for an equation error all of them.
    pub fn factor(&self, held: &[&ActiveRow]) -> CovarianceRoot {
        let directions = &self.sensitivity.directions;
        let n = directions.len();
        let rows: Vec<Vec<f64>> = held
            .iter()
            .map(|row| {
                let mut row = directions.row(row.entries.iter().copied());
                let size = row.iter().map(|x| x * x).sum::<f64>().sqrt();
                row.iter_mut()
                    .for_each(|x| *x /= size.max(f64::MIN_POSITIVE));
                row
            })
            .collect();
        let all = self.rows();
        let (inverse_root, undetermined) = match rows.is_empty() {
            true => split(&Factorisation::complete(&all)),
            false => {
                let held = DMatrix::from_fn(rows.len(), n, |i, k| rows[i][k]);
                let held = Factorisation::complete(&held);
                let free = held.undetermined();
                let (root, undetermined) = split(&Factorisation::complete(&(all * free)));
                (free * root, free * undetermined)
            }
        };
        let mut answers = &self.measured * &inverse_root;
        if let Some(scores) = &self.scores {
            let root = scores.root(&inverse_root, answers.norm_squared());
            let Some(root) = root else {
                return CovarianceRoot {
                    root: DMatrix::zeros(n, 0),
                    undetermined: DMatrix::identity(n, n),
                    variance: None,
                };
            };
            return CovarianceRoot {
                root: self.with_shift(root, &inverse_root),
                undetermined: scores.undetermined(undetermined),
                variance: None,
            };
        }
        let variance = self.variance(&answers);
        if let Some(variance) = variance {
            let samples = self
                .sensitivity
                .weight_roots
                .iter()
                .zip(&self.sensitivity.has_sigma);
            for (mut row, (root, has_sigma)) in answers.row_iter_mut().zip(samples) {
                if !has_sigma {
                    row *= root * variance.sqrt();
                }
            }
        }
        let rank = inverse_root.ncols();
        let is_bayesian = self.is_bayesian && variance.is_none();
        if is_bayesian && self.kernels.is_empty() {
            return CovarianceRoot {
                root: self.with_shift(inverse_root.clone(), &inverse_root),
                undetermined,
                variance,
            };
        }
        self.replace_scores(&mut answers);
        if is_bayesian {
            answers = stacked(&answers, &(&self.pulled * &inverse_root));
        }
        let root = match answers.nrows() >= rank && rank > 0 {
            true => &inverse_root * answers.qr().r().transpose(),
            false => &inverse_root * answers.transpose(),
        };
        CovarianceRoot {
            root: self.with_shift(root, &inverse_root),
            undetermined,
            variance,
        }
    }

    /// Replaces the rows of channels whose innovations are not white by a root of the kernel's covariance of their scores.
    fn replace_scores(&self, answers: &mut DMatrix<f64>) {
        let rank = answers.ncols();
        for samples in &self.kernels {
            let residuals = &self.sensitivity.residuals[samples.clone()];
            let mut scores = answers.rows(samples.start, samples.len()).into_owned();
            for (mut row, residual) in scores.row_iter_mut().zip(residuals) {
                row *= *residual;
            }
            let record = 0..samples.len();
            let found = KernelCovariance::of(&scores, std::slice::from_ref(&record), rank as f64);
            let Some(found) = found else {
                continue;
            };
            let eigen = found.sum.symmetric_eigen();
            let mut rows = answers.rows_mut(samples.start, samples.len());
            rows.fill(0.0);
            for k in 0..rank {
                let root = eigen.eigenvalues[k].max(0.0).sqrt();
                rows.set_row(k, &(eigen.eigenvectors.column(k).transpose() * root));
            }
        }
    }

    /// Covariance of the parameters from its root; `None` where a combination is undetermined or the noise is unknown.
    pub fn of_parameters(&self, covariance: &CovarianceRoot) -> Option<DMatrix<f64>> {
        let is_known = covariance.variance.is_none_or(|v| v > 0.0 && v.is_finite());
        if covariance.undetermined.ncols() > 0 || !is_known || covariance.root.ncols() == 0 {
            return None;
        }
        let root = DMatrix::from_columns(&self.columns(covariance));
        Some(&root * root.transpose())
    }

    /// Columns of the covariance root as changes of the parameters.
    fn columns(&self, covariance: &CovarianceRoot) -> Vec<DVector<f64>> {
        let directions = &self.sensitivity.directions;
        let column =
            |z: DVectorView<f64>| DVector::from_vec(directions.to_parameters(z.as_slice()));
        covariance.root.column_iter().map(column).collect()
    }

    /// Estimated variance `sum r^2 / (n - effective parameters)` of samples without sigma; infinite if the difference is not
    /// positive. The rounding error of the response is a lower bound, so that an exact fit does not make every parameter
    /// appear determined.
    fn variance(&self, answers: &DMatrix<f64>) -> Option<f64> {
        let s = &self.sensitivity;
        let without: Vec<usize> = (0..s.weight_roots.len())
            .filter(|i| !s.has_sigma[*i])
            .collect();
        if without.is_empty() {
            return None;
        }
        let squares = without
            .iter()
            .map(|&i| (s.residuals[i] / s.weight_roots[i]).powi(2));
        let effective: f64 = without.iter().map(|&i| answers.row(i).norm_squared()).sum();
        let left = without.len() as f64 - effective;
        let squares: f64 = squares.sum();
        Some(match () {
            () if left <= 0.5 => f64::INFINITY,
            () if squares == 0.0 => self.rounding.powi(2),
            () => squares / left,
        })
    }
}

/// True if the intervals of a problem are Bayesian: some penalty has a rule that gives coverage.
pub(crate) fn is_bayesian(problem: &Problem) -> bool {
    let rules = problem.penalties.iter().filter_map(|p| p.rule);
    rules.into_iter().any(WeightRule::gives_coverage)
}

/// Root of the inverse, and basis of the undetermined combinations.
fn split(factorisation: &Factorisation) -> (DMatrix<f64>, DMatrix<f64>) {
    let undetermined = factorisation.undetermined().into_owned();
    (factorisation.inverse_root(), undetermined)
}

impl Problem {
    /// Covariance of the parameters at an evaluated point, from the linearised predictions: `(J^T W J)^-1` with
    /// `W = 1/sigma^2`, or the inverse covariance matrix of correlated noise, where the samples have a sigma (the Cramér–Rao bound
    /// for Gaussian noise), otherwise multiplied by the mean square of the residuals. Penalties, constraints and priors are not included. `None` where a combination of
    /// parameters is not identifiable, there are too many parameters, or the noise level is unknown.
    pub fn covariance(&self, evaluation: &Evaluation) -> Option<DMatrix<f64>> {
        let (n, samples) = (self.parameters(), self.sample_count());
        if n == 0 || n > FEW_PARAMETERS || samples <= n {
            return None;
        }
        let directions = Directions::new(self, evaluation, n, n);
        covariance(self, &Sensitivity::along(self, evaluation, directions))
    }
}

impl Problem {
    /// Covariance of the estimates with penalties, priors and equality constraints: that of the bands ([`super::Bands`]). `None` with more
    /// than [`FEW_PARAMETERS`] parameters, and where a combination of parameters is undetermined.
    pub fn covariance_of_estimates(
        &self,
        theta: &[f64],
        evaluation: &Evaluation,
    ) -> Option<DMatrix<f64>> {
        let n = self.parameters();
        if n == 0 || n > FEW_PARAMETERS || self.sample_count() <= n {
            return None;
        }
        let directions = Directions::new(self, evaluation, n, n);
        let sensitivity = Sensitivity::along(self, evaluation, directions);
        let active = active_rows(self, theta);
        let equal: Vec<&ActiveRow> = active.iter().filter(|row| row.equality).collect();
        let information = Information::new(self, theta, sensitivity);
        information.of_parameters(&information.factor(&equal))
    }

    /// Effective number of parameters of each penalised function that the samples determine: those of the function minus
    /// `w tr(H^-1 L^T L)`, for each penalty. `None` with more than [`FEW_PARAMETERS`] parameters.
    pub fn effective_parameters(&self, theta: &[f64], evaluation: &Evaluation) -> Option<Vec<f64>> {
        let n = self.parameters();
        if n == 0 || n > FEW_PARAMETERS {
            return None;
        }
        let directions = Directions::new(self, evaluation, n, n);
        let sensitivity = Sensitivity::along(self, evaluation, directions);
        let information = Information::new(self, theta, sensitivity);
        let root = Factorisation::of(&information.rows()).inverse_root();
        let directions = &information.sensitivity.directions;
        let each = self.penalties.iter().map(|penalty| {
            let count = self.functions.ranges()[penalty.function].len() as f64;
            count - (roughness(self, penalty, directions) * &root).norm_squared()
        });
        Some(each.collect())
    }
}

/// [`Problem::covariance`] from the sensitivity along all parameters.
pub(super) fn covariance(problem: &Problem, sensitivity: &Sensitivity) -> Option<DMatrix<f64>> {
    let (samples, n) = sensitivity.jacobian.shape();
    let factorisation = Factorisation::of(&sensitivity.jacobian);
    let squares: f64 = sensitivity.residuals.iter().map(|r| r * r).sum();
    let scale = match problem.channels().all(|c| c.weighting().is_sigma()) {
        true => 1.0,
        false => squares / (samples - n) as f64,
    };
    // An exact fit gives no estimate of the noise.
    (factorisation.rank == n && scale > 0.0).then(|| {
        let root = factorisation.inverse_root();
        let column = |z: &[f64]| DVector::from_vec(sensitivity.directions.to_parameters(z));
        let columns: Vec<_> = root.column_iter().map(|z| column(z.as_slice())).collect();
        let root = DMatrix::from_columns(&columns);
        &root * root.transpose() * scale
    })
}

/// Rows `sqrt(weight) L` of a penalty along the directions, or their triangular factor where that has fewer rows.
fn roughness(problem: &Problem, penalty: &Penalty, directions: &Directions) -> DMatrix<f64> {
    let range = problem.functions.ranges()[penalty.function].clone();
    let (rows, n) = (penalty.rows.len(), directions.len());
    let mut out = DMatrix::zeros(rows, n);
    for k in 0..n {
        let theta = directions.column(k);
        let part = &theta[range.clone()];
        if part.iter().any(|x| *x != 0.0) {
            let image = penalty.rows.multiply(part);
            out.set_column(k, &DVector::from_vec(image));
        }
    }
    out *= penalty.weight.sqrt();
    if rows > n { out.qr().r() } else { out }
}
