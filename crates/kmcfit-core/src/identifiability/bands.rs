//! Confidence bands of functions and ratios.
//!
//! Without penalties the covariance of the parameters is `(J^T W J)^-1` (Cramér and Rao, for Gaussian
//! noise and the linearised predictions). With penalties it is the sandwich
//!
//! ```text
//! Cov = H^-1 (J^T W J) H^-1,    H = J^T W J + sum_j weight_j L_j^T L_j
//! ```
//!
//! which describes the scatter of the estimates between repetitions of the noise. It **excludes the smoothing bias**, the
//! shift of the mean estimate caused by penalties. With weights of restricted likelihood or cross-validation it is
//!
//! ```text
//! Cov = H^-1
//! ```
//!
//! the covariance of a random function whose prior is the penalty. It includes the smoothing bias on average over the record
//! (Wahba 1983; Nychka 1988): there a 95 % band holds the function at 95 % of the times, fewer where it bends most.
//! The standard error of a piecewise-linear function without a penalty includes the error of linear interpolation between its knots, as far
//! as its second differences show it.
//! Priors of scalars count as measurements. Total-variation penalties and
//! the curvature of the predictions are neglected.
//!
//! Active rows hold with equality: the covariance is that in their null space. Where an active bound leaves a function no
//! freedom, the band is one-sided, with the width it has without the bound. Where an undetermined direction changes a
//! function, its band is infinite.

use super::active::{ActiveRow, active_rows};
use super::band::Band;
use super::band_notes::notes;
use super::covariance::{CovarianceRoot, Information};
use super::curve::{Curve, Curves};
use super::degrees::{NoiseVariants, degrees_of_parameters};
use super::directions::Directions;
use super::equation_rows::EquationRows;
use super::quantities::Quantities;
use super::quantity::{Quantity, Side};
use super::sensitivity::Sensitivity;
use crate::functions::Ratio;
use crate::objective::{Evaluation, Refined};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::spans::{span_words, spans};
use nalgebra::{DMatrix, DVector};

/// Largest number of parameters with a full covariance; beyond it, smooth directions are used.
const MOST_PARAMETERS: usize = 800;
/// Largest number of smooth directions.
const MOST_SMOOTH: usize = 400;
/// Largest work of the decomposition of smooth directions, samples x directions^2.
const MOST_WORK: f64 = 2e9;
/// Largest number of nodes with bands, apart from the last one; longer grids are thinned evenly.
const MOST_NODES: usize = 4000;
/// Smallest share of the slope of a value in undetermined directions that makes the value undetermined.
const UNSEEN_SHARE: f64 = 1e-6;
/// Standard errors below this share of those without bounds count as zero.
const HELD: f64 = 1e-6;

/// Bands of all functions and of the ratios of the shared coefficient set.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    /// Times, s.
    pub times: Vec<f64>,
    /// One per function of the list.
    pub functions: Vec<Band>,
    /// `k/m`, `c/m`, natural frequency and damping ratio, as far as the system has these terms.
    pub ratios: Vec<Band>,
    /// Means over the record, and the scalars. Without a covariance of all parameters scalars have no standard errors.
    pub quantities: Quantities,
    /// Estimated standard deviation of samples without sigma, in their unit.
    pub sigma: Option<f64>,
    /// Number of undetermined directions.
    pub undetermined: usize,
    /// Covariance of the parameters, with penalties, priors and equality constraints; `None` with many parameters and where a
    /// combination is undetermined.
    pub covariance: Option<DMatrix<f64>>,
    /// Degrees of freedom of the estimate of each parameter ([`Problem::degrees_of_freedom`]).
    pub degrees_of_freedom: Vec<f64>,
    /// Notes on all bands.
    pub notes: Vec<String>,
}

impl Bands {
    /// Computes the bands at the parameters `theta`, evaluated in `evaluation`.
    pub fn at(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Self {
        Self::with_half_step(problem, theta, evaluation, None)
    }

    /// [`Bands::at`], with the results on half the step where they are known.
    pub(crate) fn with_half_step(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        halved: Option<Refined>,
    ) -> Self {
        let samples = problem.sample_count().max(1) as f64;
        let affordable = (MOST_WORK / samples).sqrt() as usize;
        let smooth = affordable.min(MOST_SMOOTH);
        let directions = Directions::new(problem, evaluation, MOST_PARAMETERS, smooth);
        let sensitivity = Sensitivity::along(problem, evaluation, directions);
        let information = Information::new(problem, theta, sensitivity)
            .with_error_of_steps(problem, evaluation, halved);
        Self::from_information(problem, theta, evaluation, &information)
    }

    /// Computes the bands of the equation error at its minimum `theta`, from the scores of its samples.
    pub fn of_equation_error(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        equation: &EquationRows,
    ) -> Self {
        let information = Information::of_equation_error(problem, theta, evaluation, equation);
        Self::from_information(problem, theta, evaluation, &information)
    }

    fn from_information(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        information: &Information,
    ) -> Self {
        let mut active = active_rows(problem, theta);
        active.extend(information.held().iter().cloned());
        let equal: Vec<&ActiveRow> = active.iter().filter(|r| r.equality).collect();
        let bounded = active.iter().any(|r| !r.equality);
        let all: Vec<&ActiveRow> = active.iter().collect();
        let without_bounds = information.factor(&equal);
        let with_bounds = match bounded {
            true => information.factor(&all),
            false => without_bounds.clone(),
        };
        let stride = problem.functions.nodes().div_ceil(MOST_NODES);
        let all = problem.functions.nodes();
        // Constants have one value, which both ends show.
        let is_equal = |values: &Vec<f64>| values.iter().all(|value| *value == values[0]);
        let is_constant = problem
            .functions
            .values(theta)
            .iter()
            .enumerate()
            .all(|(f, values)| problem.functions.is_constant_or_known(f) && is_equal(values));
        let stride = if is_constant { all } else { stride };
        let thinned = (0..all - 1).step_by(stride);
        let nodes: Vec<usize> = thinned.chain([all - 1]).collect();
        let variants = match information.is_equation() {
            true => None,
            false => NoiseVariants::of(problem, evaluation, Some(information.sensitivity())),
        };
        let directions = &information.sensitivity().directions;
        let times: Vec<f64> = nodes.iter().map(|i| problem.system.grid.time(*i)).collect();
        let errors = StandardErrors {
            variants: variants.as_ref(),
            factors: match bounded {
                true => vec![&with_bounds, &without_bounds],
                false => vec![&without_bounds],
            }
            .into_iter()
            .map(Rows::of)
            .collect(),
            directions,
            bounds_of: bounds_of(problem.parameters(), &active),
            inwards: active.iter().map(|row| inwards(directions, row)).collect(),
        };
        let curves = Curves::at(problem, theta, Some(nodes));
        let bands = |list: Vec<Curve>| -> Vec<Band> {
            let each = list.into_iter();
            each.filter_map(|curve| errors.band(problem, &curves, curve, &times))
                .collect()
        };
        let covariance = match problem.parameters() {
            1..=FEW_PARAMETERS => information.of_parameters(&without_bounds),
            _ => None,
        };
        let mut quantities = Quantities {
            kind: information.kind(),
            ..Quantities::at(problem, theta)
        };
        quantities
            .all_mut()
            .for_each(|quantity| errors.add_to_mean(quantity));
        if covariance.is_none() {
            let scalars = quantities.scalars.iter_mut();
            scalars.for_each(|scalar| scalar.standard_error = f64::NAN);
        }
        let undetermined = without_bounds.undetermined.ncols();
        let mut notes = notes(problem, information, &active);
        if undetermined > 0 {
            notes.push(format!(
                "parameter combinations that are not identifiable: {undetermined}; the bands of the functions they change are infinite"
            ));
        }
        Self {
            functions: bands(Curve::functions(problem)),
            ratios: bands(Curve::ratios()),
            quantities,
            sigma: with_bounds.variance.map(f64::sqrt),
            covariance,
            undetermined,
            degrees_of_freedom: degrees_of_parameters(problem, errors.variants),
            notes,
            times,
        }
    }

    /// Band of a ratio.
    pub fn ratio(&self, ratio: Ratio) -> Option<&Band> {
        self.ratios.iter().find(|band| band.name == ratio.name())
    }
}

fn norm(x: impl Iterator<Item = f64>) -> f64 {
    x.map(|x| x * x).sum::<f64>().sqrt()
}

/// Slope of an active row along the directions, and its norm.
fn inwards(directions: &Directions, row: &ActiveRow) -> (Vec<f64>, f64) {
    let slope = match row.equality {
        // Not asked for.
        true => Vec::new(),
        false => directions.row(row.entries.iter().copied()),
    };
    let length = norm(slope.iter().copied());
    (slope, length)
}

/// Indices of the active rows without equality that have each parameter.
fn bounds_of(parameters: usize, active: &[ActiveRow]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); parameters];
    for (i, row) in active.iter().enumerate().filter(|(_, row)| !row.equality) {
        row.entries.iter().for_each(|(j, _)| all[*j].push(i));
    }
    all
}

/// Rows of a covariance root and of the undetermined directions, one for each direction, as the columns of matrices.
struct Rows {
    root: DMatrix<f64>,
    undetermined: DMatrix<f64>,
}

impl Rows {
    fn of(factor: &CovarianceRoot) -> Self {
        Self {
            root: factor.root.transpose(),
            undetermined: factor.undetermined.transpose(),
        }
    }

    /// Standard error of a quantity with this slope along the directions; infinite where undetermined directions change it.
    fn error(&self, slope: &[(usize, f64)], basis_error: f64) -> f64 {
        let norm_of = |rows: &DMatrix<f64>| {
            let mut sum = DVector::zeros(rows.nrows());
            for (k, x) in slope {
                sum.axpy(*x, &rows.column(*k), 1.0);
            }
            sum.norm()
        };
        let size = norm(slope.iter().map(|(_, x)| *x));
        let error = norm_of(&self.root).hypot(basis_error);
        match norm_of(&self.undetermined) > UNSEEN_SHARE * size || error.is_nan() {
            true => f64::INFINITY,
            false => error,
        }
    }
}

/// What gives quantities their standard errors.
struct StandardErrors<'a> {
    variants: Option<&'a NoiseVariants>,
    /// With all active rows fixed, and with only the equalities fixed; a single one where no bound is active.
    factors: Vec<Rows>,
    directions: &'a Directions,
    /// Active bounds, by the parameters that they have.
    bounds_of: Vec<Vec<usize>>,
    /// Slope of each active row along the directions, inwards, and its norm.
    inwards: Vec<(Vec<f64>, f64)>,
}

impl StandardErrors<'_> {
    /// Adds standard error and degrees of freedom to a mean, with only the equalities fixed.
    fn add_to_mean(&self, mean: &mut Quantity) {
        let slope = self.directions.slope(mean.gradient.iter().copied());
        let factor = &self.factors[self.factors.len() - 1];
        mean.standard_error = factor.error(&slope, mean.basis_error);
        mean.degrees = self.degrees(mean);
    }

    fn degrees(&self, quantity: &Quantity) -> f64 {
        let degrees = |variants: &NoiseVariants| variants.degrees(&quantity.gradient);
        self.variants.map_or(f64::INFINITY, degrees)
    }

    /// Adds standard error, degrees of freedom and side to a value at a time; where active bounds leave it no freedom the error is that without
    /// them.
    fn add_to_value(&self, value: &mut Quantity, is_function: bool) {
        let slope = self.directions.slope(value.gradient.iter().copied());
        let error = |factor: &Rows| match value.value.is_finite() {
            true => factor.error(&slope, value.basis_error),
            false => f64::INFINITY,
        };
        let with_bounds = error(&self.factors[0]);
        let without_bounds = self.factors.get(1).map_or(with_bounds, error);
        (value.standard_error, value.side) = match () {
            () if !value.value.is_finite() => (with_bounds, Side::Both),
            () if without_bounds == 0.0 => (0.0, Side::Neither),
            () if with_bounds > HELD * without_bounds => (with_bounds, Side::Both),
            () if is_function => (without_bounds, self.side(value, &slope)),
            () => (without_bounds, Side::Both),
        };
        value.degrees = self.degrees(value);
    }

    /// Band of a curve; `None` for a ratio that the system does not have.
    fn band(
        &self,
        problem: &Problem,
        curves: &Curves,
        curve: Curve,
        times: &[f64],
    ) -> Option<Band> {
        let terms = curve.terms(problem)?;
        let is_function = matches!(curve, Curve::Function(_));
        let point = |i: usize| {
            let mut point = curves.quantity(&terms, &[(i, 1.0)]);
            self.add_to_value(&mut point, is_function);
            point
        };
        let points: Vec<Quantity> = (0..times.len()).map(point).collect();
        let mut notes = Vec::new();
        let mut note = |words: &str, holds: &dyn Fn(&Quantity) -> bool| {
            let found = spans(times, |i| holds(&points[i]));
            if !found.is_empty() {
                notes.push(format!("{words} on {}", span_words(&found)));
            }
        };
        note("not defined", &|point| !point.value.is_finite());
        note("not identifiable", &|point| {
            point.value.is_finite() && point.standard_error.is_infinite()
        });
        note("one-sided, because a bound is active,", &|point| {
            matches!(point.side, Side::Above | Side::Below)
        });
        Some(Band {
            name: terms.name,
            unit: terms.unit.to_owned(),
            points,
            notes,
        })
    }

    /// Sides on which a function's value may change where the active rows leave it no freedom.
    fn side(&self, value: &Quantity, slope: &[(usize, f64)]) -> Side {
        let size = norm(slope.iter().map(|(_, x)| *x));
        let own = value.gradient.iter().map(|(j, _)| *j);
        let mut lists: Vec<&[usize]> = own.map(|j| self.bounds_of[j].as_slice()).collect();
        // Each row of these ascending lists once, in ascending order: bounds at all nodes are thousands of rows.
        let rows = std::iter::from_fn(|| {
            let next = *lists.iter().filter_map(|list| list.first()).min()?;
            for list in &mut lists {
                *list = list.strip_prefix(&[next]).unwrap_or(list);
            }
            Some(next)
        });
        for (inwards, length) in rows.map(|r| &self.inwards[r]) {
            let dot: f64 = slope.iter().map(|(k, x)| inwards[*k] * x).sum();
            let cosine = dot / (length * size).max(f64::MIN_POSITIVE);
            if cosine.abs() > 1.0 - HELD {
                return if cosine > 0.0 {
                    Side::Above
                } else {
                    Side::Below
                };
            }
        }
        // Several rows together fix the value.
        Side::Both
    }
}
