//! Constants in place of functions that vary, with one thing more: forces that depend on the amplitude, an error of a record, a second mode.
//!
//! In one record with a varying amplitude `A(t)` a coefficient that varies with time and one that depends on the amplitude are nearly
//! interchangeable: by harmonic balance
//!
//! ```text
//! k(t) ~ k + 3/4 k3 A^2 + 5/8 k5 A^4,    c(t) ~ c + 8/(3 pi) c2 w A + 4/pi F/(w A)
//! ```

use super::jump_basis::is_jump;
use super::penalised_misfit::Linearised;
use super::{Addition, Candidate, Candidates, GAIN};
use crate::alternatives::{Refit, with_functions};
use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::median;

/// The candidates beside constants, in place of all functions of a problem with white noise that vary, that are about as good as the model or
/// better; `None` where none varies, or constants alone are as good.
pub(super) fn of(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<Vec<Candidate>> {
    let (constants, start) = constants(problem, theta)?;
    let held = held_by_penalties(problem, theta, evaluation);
    let price = (problem.sample_count() as f64).ln();
    let own = Linearised::at(problem, evaluation).own().misfit - held * price;
    let own = own.min(with_half_degrees(problem, theta).unwrap_or(own));
    let refit = Refit::of(constants, &start)?;
    let alone = Linearised::at(&refit.problem, refit.evaluation()).own();
    // Where constants alone are as good, a function that varies is a finer basis than the samples need, and no wrong one.
    (own - alone.misfit < -GAIN).then_some(())?;
    let beside = Candidates::at(&refit.problem, &refit.fit.best.parameters, Some(own))?;
    let others = beside
        .list
        .into_iter()
        .filter(|c| c.is_refitted && c.gain > -GAIN);
    let all = others.map(|candidate| {
        let candidate = Candidate {
            to_constants: true,
            ..candidate
        };
        Candidate {
            name: format!("constants with {}", candidate.name),
            words: candidate.in_words(&refit.problem),
            ..candidate
        }
    });
    Some(all.collect())
}

/// Penalised misfit with half the degree of each polynomial, which a model with a [candidate](super::Candidate::added_to) has: its higher degrees
/// are for the intervals, and no reason for constants. `None` without one.
fn with_half_degrees(problem: &Problem, theta: &[f64]) -> Option<f64> {
    problem.penalties.is_empty().then_some(())?;
    let (mut halved, mut start) = (problem.clone(), theta.to_vec());
    for function in 0..problem.functions.ranges().len() {
        let Some(Basis::Polynomial { degree }) = halved.functions.get(function).basis else {
            continue;
        };
        let addition = Addition::Variation {
            function,
            degree: degree.div_ceil(2),
            next: degree,
        };
        (halved, start) = addition.added(&halved, &start, &[])?;
    }
    (start.len() < theta.len()).then_some(())?;
    let refit = Refit::of(halved, &start)?;
    Some(
        Linearised::at(&refit.problem, refit.evaluation())
            .own()
            .misfit,
    )
}

/// Parameters that penalties hold.
fn held_by_penalties(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> f64 {
    if problem.penalties.is_empty() {
        return 0.0;
    }
    let effective = problem.effective_parameters(theta, evaluation);
    let pairs = problem.penalties.iter().zip(effective.unwrap_or_default());
    let held = pairs.map(|(penalty, effective)| {
        problem.functions.ranges()[penalty.function].len() as f64 - effective
    });
    held.sum()
}

/// The problem with a constant for each function that can vary, and its start at their medians; `None` where none can.
pub(super) fn constants(problem: &Problem, theta: &[f64]) -> Option<(Problem, Vec<f64>)> {
    let functions = &problem.functions;
    let grid = &problem.system.grid;
    let values = functions.values(theta);
    let mut start = Vec::new();
    let mut list: Vec<CoefficientFunction> = Vec::new();
    for (f, own) in functions.iter().enumerate() {
        let jumps = (own.basis.as_ref()).is_some_and(|basis| is_jump(grid, basis));
        let is_whole = own.offset.iter().all(|known| *known == 0.0);
        let is_varying = own.parameters() > 1 && is_whole && !jumps;
        if is_varying {
            let level = median(&*values[f]);
            start.push(level);
            list.push(CoefficientFunction {
                owner: own.owner.clone(),
                is_known_part: own.is_known_part,
                ..CoefficientFunction::free(own.quantity, Basis::Constant, grid, vec![level])
            });
        } else {
            start.extend(&theta[functions.ranges()[f].clone()]);
            list.push(own.clone());
        }
    }
    (start.len() + functions.scalars().len() < theta.len()).then_some(())?;
    start.extend(problem.scalars(theta));
    let sets = functions.coefficient_sets().to_vec();
    let functions = Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?
        .with_scalars(functions.scalars().to_vec());
    Some((with_functions(problem, functions, Vec::new())?, start))
}
