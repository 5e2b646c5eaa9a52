//! Problems with further terms.

use crate::functions::{CoefficientFunction, CoefficientSet, Parameterization};
use crate::problem::Problem;
use crate::structure::Law;

/// The problem with further coefficients, at zero, and their terms, without penalties and constraints, and its parameters.
pub(crate) fn extended(
    problem: &Problem,
    theta: &[f64],
    further: Vec<(CoefficientFunction, Law)>,
) -> Option<(Problem, Vec<f64>)> {
    let functions = &problem.functions;
    let (nodes, step) = (functions.nodes(), problem.system.grid.step());
    let mut list: Vec<CoefficientFunction> = functions.iter().cloned().collect();
    let first = list.len();
    let (new, terms): (Vec<CoefficientFunction>, Vec<Law>) = further.into_iter().unzip();
    let zeros = vec![0.0; new.iter().map(CoefficientFunction::parameters).sum()];
    list.extend(new);
    let set = |set: &CoefficientSet| {
        let all = set.iter().copied().chain(first..list.len());
        CoefficientSet::from(all.collect::<Vec<usize>>())
            .with_known_parts(set.known_parts().to_vec())
    };
    let sets: Vec<CoefficientSet> = functions.coefficient_sets().iter().map(set).collect();
    let longer = Parameterization::with_coefficient_sets(list, sets, nodes, step)?
        .with_scalars(functions.scalars().to_vec());
    let scalars = functions.scalar_range().start;
    Some((
        with_functions(problem, longer, terms)?,
        [&theta[..scalars], &zeros, &theta[scalars..]].concat(),
    ))
}

/// The problem with these functions and further terms, without penalties and constraints.
pub(crate) fn with_functions(
    problem: &Problem,
    functions: Parameterization,
    terms: Vec<Law>,
) -> Option<Problem> {
    let changed = problem.clone().with(|parts| {
        parts.functions = functions;
        parts.system.structure.extend(terms);
        parts.penalties.clear();
        parts.variations.clear();
        parts.constraints = Default::default();
        parts.soft.clear();
        parts.jumps.clear();
    });
    changed.ok()
}
