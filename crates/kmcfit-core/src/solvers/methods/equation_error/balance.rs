//! The residual of the equation of motion beside each of its forces.

use super::equation::{EquationForm, Equations};
use super::nodal;
use super::widths;
use crate::functions::CoefficientKind;
use crate::problem::Problem;
use crate::record::Measurements;
use crate::simd::sum::rms;
use serde::{Deserialize, Serialize};

/// A force of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EquationPart {
    /// Inertia `m (y'' + b'')`.
    Inertia,
    /// Damping `c y'`.
    Damping,
    /// Force of the spring, `k y`.
    Stiffness,
    /// Quadratic stiffness.
    QuadraticStiffness,
    /// Cubic stiffness.
    CubicStiffness,
    /// Quintic stiffness.
    QuinticStiffness,
    /// Quadratic damping.
    QuadraticDamping,
    /// Coulomb friction.
    CoulombFriction,
    /// Static force.
    StaticForce,
    /// Measured force `f`.
    Force,
}

impl EquationPart {
    /// The force of a coefficient.
    pub fn of(kind: CoefficientKind) -> Self {
        match kind {
            CoefficientKind::Mass => Self::Inertia,
            CoefficientKind::Damping => Self::Damping,
            CoefficientKind::Stiffness => Self::Stiffness,
            CoefficientKind::QuadraticStiffness => Self::QuadraticStiffness,
            CoefficientKind::CubicStiffness => Self::CubicStiffness,
            CoefficientKind::QuinticStiffness => Self::QuinticStiffness,
            CoefficientKind::QuadraticDamping => Self::QuadraticDamping,
            CoefficientKind::CoulombFriction => Self::CoulombFriction,
            CoefficientKind::Offset => Self::StaticForce,
        }
    }

    /// Name in prose.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inertia => "inertia",
            Self::Damping => "damping",
            Self::Stiffness => "stiffness",
            Self::QuadraticStiffness => "quadratic stiffness",
            Self::CubicStiffness => "cubic stiffness",
            Self::QuinticStiffness => "quintic stiffness",
            Self::QuadraticDamping => "quadratic damping",
            Self::CoulombFriction => "friction",
            Self::StaticForce => "static force",
            Self::Force => "force",
        }
    }
}

/// Size of one force beside the residual.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EquationShare {
    /// The force.
    pub part: EquationPart,
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
    let kinds = kinds.map(|f| EquationPart::of(problem.functions.get(*f).quantity));
    let parts: Vec<EquationPart> = kinds.chain([EquationPart::Force]).collect();
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
                part,
                rms,
                residual_share: residual_rms / rms,
            })
            .collect(),
    })
}
