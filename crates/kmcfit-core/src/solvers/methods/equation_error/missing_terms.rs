//! Terms missing from the equation of motion, tested one by one in the weak form.
//!
//! The residuals `e` are those of the [weak form](super::equation) at the minimum of its error. With the part `z` of a candidate's factor
//! that is orthogonal to the terms of the model,
//!
//! ```text
//! p = sum_i z_i e_i / sum_i z_i^2,    t = p / s.e.(p)
//! ```
//!
//! with the [kernel covariance](KernelCovariance) of the scores `z_i (e_i - p z_i)`. A term is missing where `t` is large; it is
//! added, and the remaining candidates are tested again.

use super::dense_rows::DenseRows;
use super::equation::{EquationForm, Equations};
use super::rows::measurements_at;
use super::scale_row;
use super::widths;
use crate::functions::CoefficientKind;
use crate::noise::KernelCovariance;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::simd::sum::rms;
use crate::structure::Law;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Width of the sign of the velocity in the candidate for Coulomb friction, relative to the root mean square of the velocity.
const WIDTH: f64 = 0.01;
/// Smallest `|t|` of a missing term: none of 200 records without one has a larger one, terms of 5 % of the spring force have 58 and more
/// (systems of `tests/missing_terms.rs`).
const SIGNIFICANT: f64 = 4.5;
/// Smallest force of a missing term, relative to the largest term of the model: errors of differences and of the integration of
/// a filter are a few thousandths.
const NOTICEABLE: f64 = 3e-3;
/// Most terms that are added.
const MOST_TERMS: usize = 2;

/// Kinds of terms that are tested. The factor of a quadratic or quintic stiffness is close to that of a static force or of a cubic stiffness,
/// whose names it would take where no refit compares them: the weak form tests a quintic beside a cubic alone.
const TESTED_TERMS: [CoefficientKind; 6] = [
    CoefficientKind::QUADRATIC_STIFFNESS,
    CoefficientKind::CUBIC_STIFFNESS,
    CoefficientKind::QUINTIC_STIFFNESS,
    CoefficientKind::QUADRATIC_DAMPING,
    CoefficientKind::COULOMB_FRICTION,
    CoefficientKind::STATIC_FORCE,
];

/// A term of the equation of motion that the residuals show and the model does not have.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct MissingTerm {
    /// Kind of its coefficient.
    pub term: CoefficientKind,
    /// Estimated coefficient, in its SI unit.
    pub value: f64,
    /// Estimate over its standard error.
    pub t: f64,
    /// Root mean square of its force, relative to the largest term of the model.
    pub share: f64,
    /// Width of Coulomb friction with which it was tested, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
}

/// Missing terms at the minimum `theta` of the equation error, the most significant one first; none where they cannot be tested.
pub fn missing_terms(problem: &Problem, theta: &[f64]) -> Vec<MissingTerm> {
    if !(1..=FEW_PARAMETERS).contains(&problem.parameters()) {
        return Vec::new();
    }
    let Ok(measurements) = measurements_at(problem, theta) else {
        return Vec::new();
    };
    widths::choose(problem, &measurements);
    let equations = Equations::at(problem, &measurements, theta);
    if equations.form != EquationForm::Weak {
        return Vec::new();
    }
    let weak = WeakForm::of(problem, theta, &equations);
    let mut left = candidates(problem, &equations);
    let mut terms = weak.terms.clone();
    let mut found = Vec::new();
    while found.len() < MOST_TERMS {
        let tests = left.iter().enumerate().filter_map(|(i, candidate)| {
            let factor = weak.factor(candidate.term);
            Some((i, weak.test(&terms, &factor, candidate)?, factor))
        });
        let best = tests.max_by(|a, b| a.1.t.abs().total_cmp(&b.1.t.abs()));
        let Some((i, test, factor)) = best else { break };
        if test.t.abs() < SIGNIFICANT || test.share < NOTICEABLE {
            break;
        }
        left.remove(i);
        terms.push(factor);
        found.push(test);
    }
    found
}

/// A term that may be missing.
struct Candidate {
    kind: CoefficientKind,
    term: Law,
}

/// The terms that the model does not have.
fn candidates(problem: &Problem, equations: &Equations) -> Vec<Candidate> {
    let measured = || equations.list.iter().map(|equation| equation.measured);
    let speeds: Vec<f64> = measured().flat_map(|m| m.v.iter().copied()).collect();
    let width = WIDTH * rms(&speeds);
    let set = problem.functions.coefficient_set(0);
    let is_there = |kind: CoefficientKind| {
        let mut kinds = set.iter().map(|f| problem.functions.get(*f).quantity);
        kinds.any(|k| k == kind)
    };
    let in_bands = measured().any(|m| m.corner.is_some());
    // Where the model has no spring, a nonlinear one takes the place of another misfit: only a linear one is tested.
    let is_spring = |f: &&usize| problem.functions.get(**f).quantity == CoefficientKind::STIFFNESS;
    let has_spring = set.iter().find(is_spring).is_some_and(|f| {
        let function = problem.functions.get(*f);
        function.parameters() > 0 || function.offset.iter().any(|k| *k != 0.0)
    });
    let kinds = TESTED_TERMS.into_iter().map(|kind| match kind {
        CoefficientKind::CUBIC_STIFFNESS if !has_spring => CoefficientKind::STIFFNESS,
        kind => kind,
    });
    kinds
        // The filter of an acceleration removes a static force.
        .filter(|kind| {
            let is_tested = match *kind {
                CoefficientKind::STIFFNESS => true,
                CoefficientKind::QUADRATIC_STIFFNESS => false,
                CoefficientKind::QUINTIC_STIFFNESS => {
                    is_there(CoefficientKind::CUBIC_STIFFNESS) && !is_there(*kind)
                }
                kind => !is_there(kind),
            };
            is_tested && !(in_bands && *kind == CoefficientKind::STATIC_FORCE)
        })
        .filter_map(|kind| {
            Some(Candidate {
                kind,
                term: kind.law(width)?,
            })
        })
        .collect()
}

/// Rows of the weak form, each with the root of the weight that a robust loss gives it.
struct WeakForm<'a> {
    equations: &'a Equations<'a>,
    /// Root of the weight of each bump function.
    weight_roots: Vec<f64>,
    /// Factors of the parameters.
    terms: Vec<DVector<f64>>,
    residuals: DVector<f64>,
    /// Bump functions of each record.
    windows: Vec<Range<usize>>,
    /// Root mean square of the largest term.
    largest: f64,
}

impl<'a> WeakForm<'a> {
    fn of(problem: &Problem, theta: &[f64], equations: &'a Equations<'a>) -> Self {
        let dense = DenseRows::of(problem, equations, theta);
        let mut weak = Self {
            equations,
            weight_roots: dense.weight_roots,
            terms: Vec::new(),
            residuals: dense.residuals,
            windows: dense.records,
            largest: 0.0,
        };
        let is_scale_free = scale_row(problem, &problem.constraints, theta).is_some();
        let masses = problem.functions.ranges()[problem.functions.coefficient_set(0)[0]].clone();
        let functions = problem.functions.scalar_range().start;
        for (j, value) in theta[..functions].iter().enumerate() {
            let of_parameter = dense.rows.column(j).into_owned();
            let size = (of_parameter.norm_squared() / of_parameter.len().max(1) as f64).sqrt();
            weak.largest = weak.largest.max(value.abs() * size);
            // Without a scale the equation holds at zero: that of the mass is kept.
            if size > 0.0 && !(is_scale_free && masses.contains(&j)) {
                weak.terms.push(of_parameter);
            }
        }
        weak
    }

    /// Factor of a candidate.
    fn factor(&self, term: Law) -> DVector<f64> {
        let each = self.equations.list.iter().flat_map(|e| e.factor_of(term));
        let weighted = each.zip(&self.weight_roots).map(|(x, root)| root * x);
        DVector::from_vec(weighted.collect())
    }

    /// The test of a candidate beside the `terms`; `None` where its factor is a combination of theirs.
    fn test(
        &self,
        terms: &[DVector<f64>],
        factor: &DVector<f64>,
        candidate: &Candidate,
    ) -> Option<MissingTerm> {
        let scaled: Vec<DVector<f64>> = terms.iter().map(|term| term.normalize()).collect();
        let basis = DMatrix::from_columns(&scaled).qr().q();
        let rest = |series: &DVector<f64>| series - &basis * basis.tr_mul(series);
        let (z, e) = (rest(factor), rest(&self.residuals));
        let square = z.norm_squared();
        (square > 1e-12 * factor.norm_squared()).then_some(())?;
        let slope = z.dot(&e) / square;
        let errors = &e - slope * &z;
        let scores = DMatrix::from_columns(&[z.component_mul(&errors)]);
        let estimated = (terms.len() + 1) as f64;
        let covariance = KernelCovariance::of(&scores, &self.windows, estimated)?;
        let error = covariance.sum[(0, 0)].max(0.0).sqrt() / square;
        let size = (factor.norm_squared() / factor.len() as f64).sqrt();
        // The residual has the sign of the left side of the equation of motion, which lacks the term.
        Some(MissingTerm {
            term: candidate.kind,
            value: -slope,
            t: -slope / error.max(f64::MIN_POSITIVE),
            share: slope.abs() * size / self.largest,
            width: candidate.term.width(),
        })
    }
}
