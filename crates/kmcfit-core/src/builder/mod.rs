//! Construction of problems from specifications.
//!
//! A [`Builder`] takes three [`CoefficientSpec`]s (mass, damping, stiffness; further terms are optional), [`Record`]s of the
//! response and constraints, checks them, and builds the [`Problem`]. Model files are lowered to the same builder, so both
//! give the same problems and errors; the key of a [`BuildError`] is that of the model file.
//!
//! ```
//! use kmcfit_core::model::CoefficientSpec;
//! use kmcfit_core::builder::{Builder, Record};
//! use kmcfit_core::structure::CoefficientKind;
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
//! let damping = estimate(CoefficientKind::DAMPING).expect("the system has damping");
//! let stiffness = estimate(CoefficientKind::STIFFNESS).expect("the system has stiffness");
//! assert!((damping - 2.0).abs() < 1e-3 && (stiffness - 2500.0).abs() < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod automatic_knots;
mod basis;
mod coefficient;
mod coefficient_sets;
mod constraint_entry;
mod constraints;
mod error;
mod experiment;
mod identifiable;
mod input_error;
mod lowering;
mod notice;
mod penalties;
mod record;
mod structure;
mod variations;

pub use coefficient::UNKNOWN_MASS;
pub use constraints::listed;
pub use error::{BuildError, Contradiction};
pub(crate) use notice::BuildNotice;
pub use penalties::WeightSearch;
pub use record::{ChannelSpec, Record};

use crate::constraints::Constraint;
use crate::functions::CoefficientKind;
use crate::model::{CoefficientSpec, ConstraintSpec};
use crate::problem::Problem;
use crate::solvers::Solver;
use crate::system::{Grid, Method, State};
use coefficient_sets::Function;
use constraints::StatedConstraint;

/// Specification of a problem.
#[derive(Debug, Clone)]
pub struct Builder {
    /// Names of the coordinates of a structure; empty for one coordinate.
    coordinates: Vec<String>,
    /// Shared functions, masses first.
    functions: Vec<Function>,
    records: Vec<Record>,
    nodes: Option<usize>,
    grid: Option<Grid>,
    method: Method,
    solver: Solver,
    is_simulation: bool,
    constraints: Vec<StatedConstraint>,
    /// States at the first node, for initial states without a start; estimated from the samples where empty.
    states: Vec<State>,
}

impl Builder {
    /// A system with mass (kg), damping (N s/m) and stiffness (N/m), integrated by RK4.
    pub fn new([mass, damping, stiffness]: [CoefficientSpec; 3]) -> Self {
        Self::of(vec![
            (CoefficientKind::MASS, mass),
            (CoefficientKind::DAMPING, damping),
            (CoefficientKind::STIFFNESS, stiffness),
        ])
    }

    /// A system with these coefficient functions, mass first, in the order of [`CoefficientKind::ALL`].
    pub fn of(coefficients: Vec<(CoefficientKind, CoefficientSpec)>) -> Self {
        Self {
            coordinates: Vec::new(),
            functions: coefficients.into_iter().map(Function::one).collect(),
            records: Vec::new(),
            nodes: None,
            grid: None,
            method: Method::Rk4,
            solver: Solver::GaussNewton,
            is_simulation: false,
            constraints: Vec::new(),
            states: Vec::new(),
        }
    }

    /// Adds a quadratic stiffness `k2` (N/m^2), the factor of `y^2`: the asymmetric part of a spring.
    #[must_use]
    pub fn quadratic_stiffness(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::QUADRATIC_STIFFNESS, spec)
    }

    /// Adds a cubic stiffness `k3` (N/m^3), the factor of `y^3`.
    #[must_use]
    pub fn cubic_stiffness(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::CUBIC_STIFFNESS, spec)
    }

    /// Adds a quintic stiffness `k5` (N/m^5), the factor of `y^5`.
    #[must_use]
    pub fn quintic_stiffness(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::QUINTIC_STIFFNESS, spec)
    }

    /// Adds a quadratic damping (N s^2/m^2), the factor of `|v| v`.
    #[must_use]
    pub fn quadratic_damping(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::QUADRATIC_DAMPING, spec)
    }

    /// Adds Coulomb friction (N), the factor of `v / sqrt(v^2 + width^2)`, `width` in m/s.
    #[must_use]
    pub fn coulomb_friction(self, spec: CoefficientSpec, width: f64) -> Self {
        self.coefficient(CoefficientKind::COULOMB_FRICTION, spec.width(width))
    }

    /// Adds a static force (N), positive against the direction of `y`.
    #[must_use]
    pub fn offset(self, spec: CoefficientSpec) -> Self {
        self.coefficient(CoefficientKind::STATIC_FORCE, spec)
    }

    /// Sets a coefficient function; replaces an earlier one of its kind.
    #[must_use]
    pub fn coefficient(mut self, kind: CoefficientKind, spec: CoefficientSpec) -> Self {
        self.functions.retain(|known| known.kind != kind);
        let position = |kind: CoefficientKind| CoefficientKind::ALL.iter().position(|k| *k == kind);
        let is_before = |known: &Function| position(known.kind) < position(kind);
        let at = self.functions.partition_point(is_before);
        self.functions.insert(at, Function::one((kind, spec)));
        self
    }

    /// Adds a record.
    #[must_use]
    pub fn record(mut self, record: Record) -> Self {
        self.records.push(record);
        self
    }

    /// Sets the number of nodes; by default one per sample, which requires samples at the same equally spaced times in all
    /// records.
    #[must_use]
    pub fn nodes(mut self, nodes: usize) -> Self {
        self.nodes = Some(nodes);
        self
    }

    /// Sets the time grid; by default it covers the span of the records.
    #[must_use]
    pub fn grid(mut self, grid: Grid) -> Self {
        self.grid = Some(grid);
        self
    }

    /// Sets the integrator.
    #[must_use]
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Sets the solver of the later fit, for checks that depend on it: the equation error compares no response with the samples.
    #[must_use]
    pub fn solver(mut self, solver: Solver) -> Self {
        self.solver = solver;
        self
    }

    /// Sets the states at the first node of the fitted records from which initial states without a start begin, in place of estimates from
    /// the samples.
    #[must_use]
    pub fn states(mut self, states: Vec<State>) -> Self {
        self.states = states;
        self
    }

    /// Builds a problem for simulation: channels define the length and start of a record and are not compared.
    #[must_use]
    pub fn simulation(mut self) -> Self {
        self.is_simulation = true;
        self
    }

    /// Adds a constraint.
    #[must_use]
    pub fn constrain(self, statement: Constraint) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, None)
    }

    /// Adds a soft constraint, with the penalty `weight * mean over its rows of the squared violation`.
    #[must_use]
    pub fn penalize(self, statement: Constraint, weight: f64) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, Some(weight))
    }

    /// Adds the constraints of a model file.
    ///
    /// # Errors
    /// The first invalid one.
    pub fn constraints(mut self, list: &[ConstraintSpec], grid: &Grid) -> Result<Self, BuildError> {
        if list.is_empty() {
            return Err(BuildError::new("constraints", "there is no constraint")
                .found("an empty list")
                .expected("at least one constraint, or no `constraints`"));
        }
        for (i, spec) in list.iter().enumerate() {
            for (key, constraint) in
                constraint_entry::read(&format!("constraints[{i}]"), grid, spec)?
            {
                self = self.constraint(key, constraint, spec.soft);
            }
        }
        Ok(self)
    }

    /// Adds a constraint with the key `key` of a model file; soft with a weight.
    #[must_use]
    fn constraint(mut self, key: String, statement: Constraint, soft: Option<f64>) -> Self {
        self.constraints.push(StatedConstraint {
            key,
            statement,
            soft,
            coefficient_set: 0,
            function: None,
        });
        self
    }

    fn is_equation_error(&self) -> bool {
        self.solver == Solver::EquationError
    }

    /// Builds the problem, with its start projected onto the constraints.
    ///
    /// # Errors
    /// The first invalid part; also a weight chosen by a rule, which requires [`choose_weight`](crate::solvers::choose_weight).
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
