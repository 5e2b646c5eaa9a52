//! The residual of the equation of motion beside each of its forces.

use super::equation::{EquationForm, Equations};
use super::nodal;
use super::widths;
use crate::functions::CoefficientKind;
use crate::problem::Problem;
use crate::record::Measurements;
use crate::simd::sum::rms;
use serde::{Deserialize, Serialize};

/// Name of the inertia force `m (y'' + b'')` among the forces of a balance.
pub const INERTIA: &str = "inertia";
/// Name of the measured force.
const FORCE: &str = "force";

/// Size of one force beside the residual.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquationShare {
    /// The force: `inertia`, the name of a coefficient, or `force` for the measured one.
    pub part: String,
    /// Its root mean square, N (N m for a rotation).
    pub rms: f64,
    /// Root mean square of the residual, relative to it.
    pub residual_share: f64,
}

/// Root mean squares of the residual and of the forces of the equation of motion over all records, in the form in which its error is
/// minimised: averages by bump functions in the weak form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquationBalance {
    /// Form of the equation.
    pub form: EquationForm,
    /// Length of the bump functions of each record, s; empty in the pointwise form.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bump_lengths: Vec<f64>,
    /// Root mean square of the residual, N (N m for a rotation).
    pub residual_rms: f64,
    /// The forces; those that are zero at all times are omitted.
    pub parts: Vec<EquationShare>,
}

/// The residual of the equation of motion beside its forces at the parameters `theta`; `None` where a record does not provide a
/// response, and without records.
pub fn equation_balance(problem: &Problem, theta: &[f64]) -> Option<EquationBalance> {
    let measurements = Measurements::with_scalars(problem, problem.scalars(theta)).ok()?;
    widths::choose(problem, &measurements);
    let equations = Equations::of(problem, &measurements);
    if equations.list.is_empty() {
        return None;
    }
    let terms = problem.system.laws().len();
    let kinds = problem.functions.coefficient_set(0).iter();
    let kinds = kinds.map(|f| match problem.functions.get(*f).quantity {
        CoefficientKind::MASS => INERTIA,
        kind => kind.name(),
    });
    let parts: Vec<&str> = kinds.chain([FORCE]).collect();
    let mut forces = vec![Vec::new(); terms + 2];
    let mut residuals = Vec::new();
    for equation in &equations.list {
        let nodal = nodal(problem, equation.experiment, theta);
        residuals.extend(equation.residuals(&nodal));
        for (all, own) in forces.iter_mut().zip(equation.forces(&nodal)) {
            all.extend(own);
        }
    }
    let residual_rms = rms(&residuals);
    let sizes = parts.into_iter().zip(forces.iter().map(|force| rms(force)));
    let sizes = sizes.filter(|(_, size)| *size > 0.0);
    Some(EquationBalance {
        form: equations.form,
        bump_lengths: equations
            .list
            .iter()
            .filter_map(|e| e.bump_length())
            .collect(),
        residual_rms,
        parts: sizes
            .map(|(part, rms)| EquationShare {
                part: part.to_owned(),
                rms,
                residual_share: residual_rms / rms,
            })
            .collect(),
    })
}
