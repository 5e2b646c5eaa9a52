//! Terms missing from the equation of motion, tested one by one in the weak form.
//!
//! The equation of motion is multiplied by bump functions `(1 - s^2)^3`, `|s| < 1`, of 0.7 periods and integrated. This is the
//! equation with the derivatives moved to the bump functions by parts (Shinbrot 1957): errors of the second derivative at
//! frequencies above those of the response are averaged out of the residuals `e` and of the factors of all terms. With the
//! part `z` of a candidate's factor that is orthogonal to the terms of the model,
//!
//! ```text
//! p = sum_i z_i e_i / sum_i z_i^2,    t = p / s.e.(p)
//! ```
//!
//! with the [kernel covariance](KernelCovariance) of the scores `z_i (e_i - p z_i)`. A term is missing where `t` is large; it is
//! added, and the remaining candidates are tested again.

use super::measured::{Measured, Measurements};
use super::rows::equation_rows;
use crate::functions::CoefficientKind;
use crate::identifiability::EquationRows;
use crate::noise::KernelCovariance;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::simd::sum::rms;
use crate::system::Term;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::ops::Range;

/// Half of the length of a bump function, in periods.
const HALF_LENGTH: f64 = 0.35;
/// Bump functions per half length.
const OVERLAP: usize = 2;
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
/// Fewest bump functions per parameter.
const FEWEST: usize = 8;

/// Kinds of terms that are tested. A quadratic or quintic stiffness is not among them: beside the other terms its factor is close to
/// that of a static force or of a cubic stiffness, whose names it would take.
const TESTED: [CoefficientKind; 4] = [
    CoefficientKind::CubicStiffness,
    CoefficientKind::QuadraticDamping,
    CoefficientKind::CoulombFriction,
    CoefficientKind::Offset,
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
}

/// Missing terms at the minimum `theta` of the equation error, the most significant one first; none where they cannot be tested.
pub fn missing_terms(problem: &Problem, theta: &[f64]) -> Vec<MissingTerm> {
    if !(1..=FEW_PARAMETERS).contains(&problem.parameters()) {
        return Vec::new();
    }
    let scalars = problem.scalars(theta);
    let (Ok(equation), Ok(measurements)) = (
        equation_rows(problem, theta),
        Measurements::with_scalars(problem, scalars),
    ) else {
        return Vec::new();
    };
    let measured: Vec<&Measured> = measurements.experiments.iter().flatten().collect();
    let weak = WeakForm::of(problem, theta, &equation, &measured);
    if weak.residuals.len() < FEWEST * problem.parameters() {
        return Vec::new();
    }
    let mut left = candidates(problem, &measured);
    let mut terms = weak.terms.clone();
    let mut found = Vec::new();
    while found.len() < MOST_TERMS {
        let tests = left.iter().enumerate().filter_map(|(i, candidate)| {
            let factor = weak.averaged(|record, at| candidate.factor(measured[record], at));
            Some((i, weak.test(&terms, &factor, candidate.kind)?, factor))
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
    term: Term,
}

impl Candidate {
    fn factor(&self, measured: &Measured, at: usize) -> f64 {
        self.term.phi(measured.y[at], measured.v[at])
    }
}

/// The terms that the model does not have.
fn candidates(problem: &Problem, measured: &[&Measured]) -> Vec<Candidate> {
    let speeds: Vec<f64> = measured.iter().flat_map(|m| m.v.iter().copied()).collect();
    let width = WIDTH * rms(&speeds);
    let set = problem.functions.coefficient_set(0);
    let is_there = |kind: CoefficientKind| {
        let mut kinds = set.iter().map(|f| problem.functions.get(*f).quantity);
        kinds.any(|k| k == kind)
    };
    let in_bands = measured.iter().any(|m| m.corner.is_some());
    let kinds = TESTED.into_iter();
    kinds
        // The filter of an acceleration removes a static force.
        .filter(|kind| !(is_there(*kind) || in_bands && *kind == CoefficientKind::Offset))
        .filter_map(|kind| {
            Some(Candidate {
                kind,
                term: kind.term(width)?,
            })
        })
        .collect()
}

/// The equation of motion integrated with bump functions.
struct WeakForm {
    /// Samples of each record, and the half length of its bump functions in samples.
    records: Vec<(Range<usize>, usize)>,
    /// Averaged factors of the parameters.
    terms: Vec<DVector<f64>>,
    residuals: DVector<f64>,
    /// Bump functions of each record.
    windows: Vec<Range<usize>>,
    /// Root mean square of the largest term.
    largest: f64,
}

impl WeakForm {
    fn of(
        problem: &Problem,
        theta: &[f64],
        equation: &EquationRows,
        measured: &[&Measured],
    ) -> Self {
        let halves = measured.iter().map(|m| {
            let period = TAU / m.frequency;
            (HALF_LENGTH * period / m.weight).round() as usize
        });
        let records: Vec<_> = equation.records.iter().cloned().zip(halves).collect();
        let mut first = 0;
        let windows = records.iter().map(|(samples, half)| {
            let count = centres(samples.len(), *half).count();
            first += count;
            first - count..first
        });
        let mut weak = Self {
            windows: windows.collect(),
            records,
            terms: Vec::new(),
            residuals: DVector::zeros(0),
            largest: 0.0,
        };
        let roots: Vec<f64> = measured.iter().map(|m| m.weight.sqrt()).collect();
        let start = |record: usize| equation.records[record].start;
        weak.residuals =
            weak.averaged(|record, i| equation.residuals[start(record) + i] / roots[record]);
        let masses = problem.functions.ranges()[problem.functions.coefficient_set(0)[0]].clone();
        let functions = problem.functions.scalar_range().start;
        for (j, value) in theta[..functions].iter().enumerate() {
            let of_parameter =
                weak.averaged(|record, i| equation.rows[(start(record) + i, j)] / roots[record]);
            let size = (of_parameter.norm_squared() / of_parameter.len().max(1) as f64).sqrt();
            weak.largest = weak.largest.max(value.abs() * size);
            // Without a scale the equation holds at zero: that of the mass is kept.
            if size > 0.0 && !(equation.is_scale_free && masses.contains(&j)) {
                weak.terms.push(of_parameter);
            }
        }
        weak
    }

    /// Averages of a series, by record and sample, weighted by the bump functions.
    fn averaged(&self, value: impl Fn(usize, usize) -> f64) -> DVector<f64> {
        let count = self.windows.last().map_or(0, |windows| windows.end);
        let mut averages = Vec::with_capacity(count);
        for (record, (samples, half)) in self.records.iter().enumerate() {
            let bump: Vec<f64> = (0..=2 * half).map(|k| bump(k, *half)).collect();
            let sum: f64 = bump.iter().sum();
            for centre in centres(samples.len(), *half) {
                let weighted = bump.iter().enumerate();
                let total: f64 = weighted
                    .map(|(k, b)| b * value(record, centre - half + k))
                    .sum();
                averages.push(total / sum);
            }
        }
        DVector::from_vec(averages)
    }

    /// The test of a candidate beside the `terms`; `None` where its factor is a combination of theirs.
    fn test(
        &self,
        terms: &[DVector<f64>],
        factor: &DVector<f64>,
        kind: CoefficientKind,
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
            term: kind,
            value: -slope,
            t: -slope / error.max(f64::MIN_POSITIVE),
            share: slope.abs() * size / self.largest,
        })
    }
}

/// Centres of the bump functions among so many samples.
fn centres(samples: usize, half: usize) -> impl Iterator<Item = usize> {
    (half..samples.saturating_sub(half)).step_by((half / OVERLAP).max(1))
}

/// Bump function at sample `k` of `2 half + 1`.
fn bump(k: usize, half: usize) -> f64 {
    let s = (k as f64 - half as f64) / (half as f64 + 1.0);
    (1.0 - s * s).powi(3)
}
