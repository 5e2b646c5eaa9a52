//! Problems from specifications: the front door of the library, and the one lowering of a model file.
//!
//! A [`Builder`] takes three [`CoefficientSpec`]s (mass, damping, stiffness; further terms are optional), [`Record`]s of the
//! response and constraints, checks them, and builds the [`Problem`]. A model file is lowered to the same builder, so that both give
//! the same problem and refuse the same mistakes; the key of a [`BuildError`] is that of the model file.
//!
//! ```
//! use kmcfit_core::{Builder, CoefficientKind, CoefficientSpec, Record};
//!
//! // A free decay of one second: m = 1 kg, c = 2 N s/m, k = 2500 N/m, so 8 Hz.
//! let times: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-3).collect();
//! let omega = (2500.0f64 - 1.0).sqrt();
//! let decay = |t: &f64| 0.01 * (-t).exp() * ((omega * t).cos() + (omega * t).sin() / omega);
//! let samples: Vec<f64> = times.iter().map(decay).collect();
//!
//! let system = [
//!     CoefficientSpec::fixed(1.0),
//!     CoefficientSpec::constant(1.0).min(0.0),
//!     CoefficientSpec::constant(2000.0),
//! ];
//! let record = Record::new("ring-down").from_state(0.01, 0.0).displacement(&times, &samples);
//! let problem = Builder::new(system).record(record).build()?;
//! let fit = problem.fit()?;
//!
//! let estimate = |kind| problem.coefficient(kind, &fit.best.parameters).map(|values| values[0]);
//! let damping = estimate(CoefficientKind::Damping).expect("the system has damping");
//! let stiffness = estimate(CoefficientKind::Stiffness).expect("the system has stiffness");
//! assert!((damping - 2.0).abs() < 1e-3 && (stiffness - 2500.0).abs() < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod basis;
mod coefficient;
mod coefficient_sets;
mod constraints;
mod error;
mod identifiable;
mod lowering;
mod notice;
mod penalties;
mod place;
mod record;

pub use basis::{BasisSpec, Knots};
pub use coefficient::{CoefficientSpec, PenaltySpec, PenaltyWeight, Start};
pub use constraints::listed;
pub use error::{BuildError, Contradiction};
pub use notice::BuildNotice;
pub use penalties::WeightSearch;
pub use record::{ChannelSpec, Record, ScalarSpec, SensorSpec};

use crate::constraints::Constraint;
use crate::functions::{CoefficientKind, ScalarParameter};
use crate::problem::Problem;
use crate::record::Experiment;
use crate::solvers::Solver;
use crate::system::{Grid, Method};
use constraints::{ConstraintSpec, RowKey, move_start};

/// Specification of a problem.
#[derive(Debug, Clone)]
pub struct Builder {
    coefficients: Vec<(CoefficientKind, CoefficientSpec)>,
    records: Vec<Record>,
    nodes: Option<usize>,
    grid: Option<Grid>,
    method: Method,
    solver: Solver,
    simulation: bool,
    constraints: Vec<ConstraintSpec>,
}

/// A problem that was built, before its start is moved into the constraints.
#[derive(Debug, Clone)]
pub struct Built {
    /// The problem.
    pub problem: Problem,
    /// Records that are kept out of the fit, each with the scalars that it estimates for itself.
    pub validation: Vec<(Experiment, Vec<ScalarParameter>)>,
    /// Weights that are to be chosen from the samples.
    pub weight_search: Option<WeightSearch>,
    /// Remarks on the specification that are no errors.
    pub notices: Vec<BuildNotice>,
    rows: Vec<RowKey>,
}

impl Built {
    /// Moves the start of the search into the constraints.
    ///
    /// # Errors
    /// Where the constraints contradict each other, or no start inside them was found.
    pub fn move_start(&mut self) -> Result<(), BuildError> {
        let notice = move_start(&mut self.problem, &self.rows)?;
        self.notices.extend(notice);
        Ok(())
    }
}

impl Builder {
    /// A system with mass (kg), damping (N s/m) and stiffness (N/m), stepped by RK4.
    pub fn new([mass, damping, stiffness]: [CoefficientSpec; 3]) -> Self {
        Self::of(vec![
            (CoefficientKind::Mass, mass),
            (CoefficientKind::Damping, damping),
            (CoefficientKind::Stiffness, stiffness),
        ])
    }

    /// A system with these coefficient functions, mass first, in the order of [`CoefficientKind::ALL`].
    pub fn of(coefficients: Vec<(CoefficientKind, CoefficientSpec)>) -> Self {
        Self {
            coefficients,
            records: Vec::new(),
            nodes: None,
            grid: None,
            method: Method::Rk4,
            solver: Solver::GaussNewton,
            simulation: false,
            constraints: Vec::new(),
        }
    }

    /// A stiffness `k3` (N/m^3) on the cube of the displacement.
    #[must_use]
    pub fn cubic_stiffness(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::CubicStiffness, spec)
    }

    /// A damping (N s^2/m^2) on `|v| v`.
    #[must_use]
    pub fn quadratic_damping(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::QuadraticDamping, spec)
    }

    /// A friction (N) on `v / sqrt(v^2 + width^2)`, `width` in m/s.
    #[must_use]
    pub fn coulomb_friction(self, spec: CoefficientSpec, width: f64) -> Self {
        self.coefficient(CoefficientKind::CoulombFriction, spec.width(width))
    }

    /// A constant force (N) against the direction of `y`.
    #[must_use]
    pub fn offset(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::Offset, spec)
    }

    /// A coefficient function of the system; replaces an earlier one of its kind.
    #[must_use]
    pub fn coefficient(mut self, kind: CoefficientKind, spec: CoefficientSpec) -> Self {
        self.coefficients.retain(|(known, _)| *known != kind);
        self.coefficients.push((kind, spec));
        let place = |kind: CoefficientKind| CoefficientKind::ALL.iter().position(|k| *k == kind);
        self.coefficients.sort_by_key(|(kind, _)| place(*kind));
        self
    }

    /// One more record of the same system.
    #[must_use]
    pub fn record(mut self, record: Record) -> Self {
        self.records.push(record);
        self
    }

    /// Number of time nodes; without, one per sample, for which the samples of all records must be at the same equally
    /// spaced times.
    #[must_use]
    pub fn nodes(mut self, nodes: usize) -> Self {
        self.nodes = Some(nodes);
        self
    }

    /// The time grid, in place of one over the span of the records.
    #[must_use]
    pub fn grid(mut self, grid: Grid) -> Self {
        self.grid = Some(grid);
        self
    }

    /// The stepper.
    #[must_use]
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// The method that the fit will use, for checks that depend on it: the equation error compares no response with the samples.
    #[must_use]
    pub fn solver(mut self, solver: Solver) -> Self {
        self.solver = solver;
        self
    }

    /// For a simulation: channels tell how long a record is and where it starts, and are not compared.
    #[must_use]
    pub fn simulation(mut self) -> Self {
        self.simulation = true;
        self
    }

    /// A constraint on the coefficient functions.
    #[must_use]
    pub fn constrain(self, statement: Constraint) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, None)
    }

    /// A soft constraint: its violation costs `weight * mean over its rows of the squared excess`.
    #[must_use]
    pub fn penalize(self, statement: Constraint, weight: f64) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, Some(weight))
    }

    /// A constraint that the model states at `key`; soft with a weight.
    #[must_use]
    pub fn constraint(mut self, key: String, statement: Constraint, soft: Option<f64>) -> Self {
        self.constraints.push(ConstraintSpec {
            key,
            statement,
            soft,
            coefficient_set: 0,
        });
        self
    }

    fn is_equation_error(&self) -> bool {
        self.solver == Solver::EquationError
    }

    /// The problem, its start moved into the constraints.
    ///
    /// # Errors
    /// At the first part that cannot be used; also where a weight is left to a rule, which [`choose_weight`](crate::choose_weight)
    /// needs beside the problem.
    pub fn build(&self) -> Result<Problem, BuildError> {
        let empty = self.records.iter().position(|r| r.channels.is_empty());
        match empty {
            None if self.records.is_empty() => {
                return Err(BuildError::new("experiments", "there are no records")
                    .expected("at least one record"));
            }
            Some(i) => {
                let key = format!("experiments[{i}]");
                return Err(BuildError::new(key, "this experiment has no samples")
                    .found(format!("no channel of {}", self.records[i].name))
                    .expected("samples of displacement, velocity or acceleration"));
            }
            None => {}
        }
        let mut built = self.lower()?;
        built.move_start()?;
        Ok(built.problem)
    }
}
