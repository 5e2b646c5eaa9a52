//! The candidates of a problem, judged by one linearisation at its least squares.

use super::Candidate;
use super::addition::Addition;
use super::estimates::estimates;
use super::jump_basis::is_jump;
use super::penalised_misfit::{Judged, Linearised};
use super::pulses::pulses;
use super::record_columns::{Column, of_records, second_modes};
use crate::alternatives::{Span, extended, finer_basis, with_functions};
use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Parameterization};
use crate::identifiability::Quantity;
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::simd::sum::rms;
use crate::solvers::weighted_jacobian;
use crate::structure::Law;
use crate::threads::{analyses_at_once, map};
use nalgebra::DVector;
use std::ops::Range;

/// Forces that a model may lack.
const TERMS: [CoefficientKind; 5] = [
    CoefficientKind::QUADRATIC_STIFFNESS,
    CoefficientKind::CUBIC_STIFFNESS,
    CoefficientKind::QUINTIC_STIFFNESS,
    CoefficientKind::QUADRATIC_DAMPING,
    CoefficientKind::COULOMB_FRICTION,
];
/// Width of the sign of the velocity of friction, relative to the root mean square of the velocity.
const WIDTH: f64 = 0.01;
/// Degree of the polynomials of the linear stage.
const DEGREE: usize = 2;
/// Cells of the record between which a jump is looked for.
const CELLS: usize = 26;

/// A candidate of the linear stage.
pub(super) struct LinearCandidate {
    pub(super) addition: Addition,
    pub(super) judged: Judged,
    /// Number of its parameters, after those of the model.
    pub(super) parameters: usize,
}

impl LinearCandidate {
    /// As a candidate beside a model with a penalised misfit.
    pub(super) fn candidate(&self, problem: &Problem, theta: &[f64], misfit: f64) -> Candidate {
        let changes = self.judged.estimate.as_slice();
        let starts = theta.iter().copied().chain(std::iter::repeat(0.0));
        let at: Vec<f64> = starts.zip(changes).map(|(a, d)| a + d).collect();
        let is_single = matches!(self.addition, Addition::Term(..) | Addition::Record(_));
        let candidate = Candidate {
            name: self.addition.name(problem),
            words: String::new(),
            additions: vec![self.addition],
            to_constants: false,
            gain: misfit - self.judged.misfit,
            parameters: self.parameters,
            order: self.judged.order,
            // A parameter of the linear stage is the last.
            estimates: match (is_single, self.addition) {
                (true, Addition::Term(kind, _)) => {
                    last(kind.name(), kind.unit(), &at, &self.judged)
                }
                (true, addition) => estimates(addition, problem, &at, &self.judged),
                _ => Vec::new(),
            },
            is_refitted: false,
            parameters_by_name: Vec::new(),
        };
        Candidate {
            words: candidate.in_words(problem),
            ..candidate
        }
    }

    /// Estimates of the parameters that are added, at the point of linearisation.
    pub(super) fn further(&self) -> &[f64] {
        let all = self.judged.change.as_slice();
        &all[all.len() - self.parameters..]
    }
}

fn last(name: &str, unit: &str, at: &[f64], judged: &Judged) -> Vec<Quantity> {
    let i = at.len() - 1;
    let quantity = Quantity {
        gradient: vec![(i, 1.0)],
        ..Quantity::new(name, unit, at[i])
    };
    vec![quantity.with_covariance(&judged.covariance, judged.degrees)]
}

fn width(evaluation: &Evaluation) -> Option<f64> {
    let responses = evaluation.trajectories.iter();
    let speeds: Vec<f64> = responses
        .flat_map(|r| r.velocity(0).iter().copied())
        .collect();
    Some(WIDTH * rms(&speeds)).filter(|width| *width > 0.0 && width.is_finite())
}

/// The candidates of a problem with white noise at its least squares, judged.
pub(super) fn linear_candidates(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    linearised: &Linearised,
) -> Vec<LinearCandidate> {
    let span = Span::of(linearised.jacobian.clone());
    let rest = span.orthogonal(linearised.residuals.clone());
    let mut all = of_structure(problem, theta, evaluation).unwrap_or_default();
    all.extend(jumps(problem, evaluation, &span, &rest));
    all.extend(of_records(problem, evaluation));
    all.extend(second_modes(problem, evaluation, &span, &rest));
    all.extend(pulses(problem, theta));
    let judged = map(all.len(), analyses_at_once(problem.sample_count()), |i| {
        linearised.with(&all[i].columns, all[i].searched)
    });
    let judged = all
        .iter()
        .zip(judged)
        .map(|(column, judged)| LinearCandidate {
            addition: column.addition,
            judged,
            parameters: column.columns.len(),
        });
    judged.collect()
}

/// Functions that are estimated without a known value, a penalty or a prior.
fn open_functions(problem: &Problem) -> impl Iterator<Item = (usize, &CoefficientFunction)> {
    let functions = problem.functions.iter().enumerate();
    functions.filter(|(index, function)| {
        let is_penalised = problem.penalties.iter().any(|p| p.function == *index)
            || problem.variations.iter().any(|v| v.function == *index)
            || problem.jumps.iter().any(|j| j.function == *index);
        let grid = &problem.system.grid;
        let basis = function.basis.as_ref();
        let is_open = basis.is_some_and(|basis| !is_jump(grid, basis));
        is_open && !is_penalised && function.prior.is_none()
    })
}

/// Forces, and functions that vary more.
fn of_structure(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Option<Vec<Column>> {
    let grid = &problem.system.grid;
    let set = problem.functions.coefficient_set(0);
    let has = |kind: CoefficientKind| {
        let mut own = set.iter().map(|f| problem.functions.get(*f).quantity);
        own.any(|own| own == kind)
    };
    let width = width(evaluation)?;
    let terms = TERMS.into_iter().filter(|kind| !has(*kind));
    let terms: Vec<(CoefficientKind, Law)> =
        terms.filter_map(|k| Some((k, k.law(width)?))).collect();
    let nodes = problem.functions.nodes();
    let constants = terms
        .iter()
        .map(|(kind, law)| (CoefficientFunction::constant(*kind, 0.0, nodes), *law));
    let (longer, _) = extended(problem, theta, constants.collect())?;
    let mut list: Vec<CoefficientFunction> = longer.functions.iter().cloned().collect();
    let mut varied = Vec::new();
    for (index, own) in open_functions(problem) {
        let (addition, basis) = match own.parameters() {
            1 => {
                let degree = DEGREE;
                let of_time = Addition::Variation {
                    function: index,
                    degree,
                    next: 2 * degree,
                };
                (of_time, Basis::Polynomial { degree })
            }
            _ => {
                let Some(finer) = own.basis.as_ref().and_then(|b| finer_basis(problem, b)) else {
                    continue;
                };
                (
                    Addition::FinerBasis {
                        function: index,
                        halvings: 1,
                    },
                    finer,
                )
            }
        };
        list[index] = in_basis(own, basis, problem);
        varied.push((index, addition));
    }
    let sets = longer.functions.coefficient_sets().to_vec();
    let functions = Parameterization::with_coefficient_sets(list, sets, nodes, grid.step())?
        .with_scalars(problem.functions.scalars().to_vec());
    (functions.parameters() <= 2 * FEW_PARAMETERS).then_some(())?;
    let longer = longer.with(|parts| parts.functions = functions).ok()?;
    // The coefficients that the evaluation lacks are zero.
    let jacobian = weighted_jacobian(&longer, evaluation);
    let columns = |range: Range<usize>| range.map(|j| jacobian.column(j).into_owned()).collect();
    let mut all = Vec::new();
    for (index, addition) in varied {
        let range = longer.functions.ranges()[index].clone();
        let first = match addition {
            // The first polynomial is the constant.
            Addition::Variation { .. } => range.start + 1,
            _ => range.start,
        };
        all.push(Column {
            addition,
            columns: columns(first..range.end),
            searched: 0,
        });
        if let Addition::Variation { function, .. } = addition {
            all.push(Column {
                addition: Addition::Variation {
                    function,
                    degree: 1,
                    next: DEGREE,
                },
                columns: columns(first..first + 1),
                searched: 0,
            });
        }
    }
    let first = longer.functions.scalar_range().start - terms.len();
    for (i, (kind, law)) in terms.iter().enumerate() {
        all.push(Column {
            addition: Addition::Term(*kind, *law),
            columns: columns(first + i..first + i + 1),
            searched: 0,
        });
    }
    Some(all)
}

/// A function of an open kind in another basis, at zero.
fn in_basis(own: &CoefficientFunction, basis: Basis, problem: &Problem) -> CoefficientFunction {
    let grid = &problem.system.grid;
    let zeros = vec![0.0; basis.parameters(grid)];
    CoefficientFunction {
        owner: own.owner.clone(),
        is_known_part: own.is_known_part,
        offset: own.offset.clone(),
        ..CoefficientFunction::free(own.quantity, basis, grid, zeros)
    }
}

/// The jump of each constant stiffness that leaves the least squares.
fn jumps(
    problem: &Problem,
    evaluation: &Evaluation,
    span: &Span,
    rest: &DVector<f64>,
) -> Vec<Column> {
    let stiffness = open_functions(problem)
        .filter(|(_, f)| f.parameters() == 1 && f.quantity == CoefficientKind::STIFFNESS);
    let each = stiffness.filter_map(|(index, own)| {
        let grid = &problem.system.grid;
        let knots = crate::functions::basis::uniform_knots(grid, CELLS + 1);
        let basis = Basis::PiecewiseConstant {
            knots: knots.clone(),
        };
        let mut list: Vec<CoefficientFunction> = problem.functions.iter().cloned().collect();
        list[index] = in_basis(own, basis, problem);
        let sets = problem.functions.coefficient_sets().to_vec();
        let functions =
            Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?
                .with_scalars(problem.functions.scalars().to_vec());
        let range = functions.ranges()[index].clone();
        let cells = with_functions(problem, functions, Vec::new())?;
        let jacobian = weighted_jacobian(&cells, evaluation);
        let mut after = DVector::zeros(jacobian.nrows());
        let mut best: Option<(f64, f64, DVector<f64>)> = None;
        for cell in (1..CELLS).rev() {
            after += jacobian.column(range.start + cell);
            let gain = span.gain(std::slice::from_ref(&after), rest);
            if best.as_ref().is_none_or(|(most, ..)| gain > *most) {
                best = Some((gain, knots[cell], after.clone()));
            }
        }
        let (_, time, column) = best?;
        Some(Column {
            addition: Addition::Jump {
                function: index,
                time,
            },
            columns: vec![column],
            searched: 1,
        })
    });
    each.collect()
}
