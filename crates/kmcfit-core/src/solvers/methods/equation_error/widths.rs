//! Width of the bump functions of the weak form.
//!
//! Of a model that is right the widest bump functions have the smallest errors, as the noise of derivatives falls with the width. Where
//! a force is modelled only approximately (friction that depends on position or direction) its misfit is slow, and wide bump functions,
//! which average fast accelerations away, take it for inertia. The covariance of the scores shows which case it is: it is consistent in
//! both, and the width with the smallest one is the efficient one. The width is halved where this lowers the determinant of the covariance
//! of the least-squares estimates to half or less. Of 38 halvings on 24 simulated records of linear carriages and oscillators (24 s, 1 kHz)
//! none lowered it: its logarithm rose by 2.4 and more.
//!
//! The misfit that is left shifts the estimates in proportion to the width, so that the limit of short bump functions is as far as the last
//! halving was ([`change`]); that enters the intervals. A misfit that is in phase with an acceleration at every width remains.

use super::dense_rows::DenseRows;
use super::equation::{EquationForm, Equations};
use crate::problem::Problem;
use crate::record::Measurements;
use nalgebra::DVector;
use std::f64::consts::LN_2;

/// Chooses the width for the bump functions of these measurements, once.
pub(super) fn choose(problem: &Problem, measurements: &Measurements) {
    let _ = (measurements.halvings).get_or_init(|| halvings(problem, measurements));
}

/// Halvings of the width of the bump functions of all records, as the module comment states; none for functions of time, whose misfit is
/// another one.
fn halvings(problem: &Problem, measurements: &Measurements) -> i32 {
    let mut equations = Equations::of_width(problem, measurements, 0);
    if equations.form != EquationForm::Weak || !problem.functions.are_constants() {
        return 0;
    }
    let (parameters, functions) = (problem.parameters(), problem.functions.scalar_range().start);
    let zero = vec![0.0; parameters];
    let estimates =
        |equations: &Equations| DenseRows::of(problem, equations, &zero).estimates(functions);
    let Some((first, size)) = estimates(&equations) else {
        return 0;
    };
    let theta = first.resize_vertically(parameters, 0.0);
    let mut sizes = vec![size];
    if equations.restore(problem, theta.as_slice()) {
        sizes = estimates(&equations).map_or(sizes, |(_, size)| vec![size]);
    }
    while equations.set_halvings(problem, sizes.len() as i32)
        && let Some((_, size)) = estimates(&equations)
    {
        sizes.push(size);
    }
    let least = (sizes.iter().enumerate()).min_by(|a, b| a.1.total_cmp(b.1));
    match least {
        Some((halvings, size)) if *size < sizes[0] - LN_2 => halvings as i32,
        _ => 0,
    }
}

/// Change of the estimates `theta` by the last halving of the width, where it has been halved because of a misfit.
pub(super) fn change(
    problem: &Problem,
    measurements: &Measurements,
    equations: &mut Equations,
    theta: &[f64],
) -> Option<DVector<f64>> {
    let halvings = measurements.halvings.get().filter(|h| **h > 0)?;
    equations.set_halvings(problem, halvings - 1);
    let functions = problem.functions.scalar_range().start;
    let (step, _) = DenseRows::of(problem, equations, theta).estimates(functions)?;
    Some(step.resize_vertically(theta.len(), 0.0))
}
