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

mod assembly;
mod basis;
mod coefficient;
mod constraints;
mod error;
mod identifiable;
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

use crate::constraints::Statement;
use crate::functions::{CoefficientKind, Parameterization, ScalarParameter};
use crate::problem::Problem;
use crate::record::Experiment;
use crate::signal::even_spacing;
use crate::solvers::{Measurements, Solver, states_from_readings};
use crate::system::{Grid, Method, System, Term};
use assembly::{Assemblies, Slot};
use constraints::{Constraint, RowKey, move_start, of_bounds};
use place::Placement;

/// Most nodes: more would be asked for by mistake, and end in a lack of memory.
const MOST_NODES: usize = 100_000_000;

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
    constraints: Vec<Constraint>,
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
    pub fn constrain(self, statement: Statement) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, None)
    }

    /// A soft constraint: its violation costs `weight * mean over its rows of the squared excess`.
    #[must_use]
    pub fn penalize(self, statement: Statement, weight: f64) -> Self {
        let key = format!("constraints[{}]", self.constraints.len());
        self.constraint(key, statement, Some(weight))
    }

    /// A constraint that the model states at `key`; soft with a weight.
    #[must_use]
    pub fn constraint(mut self, key: String, statement: Statement, soft: Option<f64>) -> Self {
        self.constraints.push(Constraint {
            key,
            statement,
            soft,
            assembly: 0,
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
                return Err(BuildError::new(key, "this experiment has no readings")
                    .found(format!("no channel of {}", self.records[i].name))
                    .expected("samples of displacement, velocity or acceleration"));
            }
            None => {}
        }
        let mut built = self.lower()?;
        built.move_start()?;
        Ok(built.problem)
    }

    /// The problem as it is specified, its start where it is given, with everything that belongs to it.
    ///
    /// # Errors
    /// At the first part that cannot be used.
    pub fn lower(&self) -> Result<Built, BuildError> {
        let assemblies = self.assemblies()?;
        self.check_records()?;
        let grid = match self.grid {
            Some(grid) => grid,
            None => self.grid_of_records()?,
        };
        let mut notices = Vec::new();
        let functions = self.parameterization(&grid, &assemblies, &mut notices)?;
        let system = System {
            grid,
            method: self.method,
            terms: self.terms()?,
        };
        let mut scalars = Vec::new();
        let mut validation = Vec::new();
        let mut experiments = Vec::new();
        for (i, record) in self.records.iter().enumerate() {
            let placement = Placement {
                key: format!("experiments[{i}]"),
                record,
                grid: &grid,
                assembly: assemblies.of_record[i],
                is_equation_error: self.is_equation_error(),
                simulation: self.simulation,
            };
            if record.validation {
                let mut own = Vec::new();
                validation.push((placement.experiment(&mut own)?, own));
            } else {
                experiments.push(placement.experiment(&mut scalars)?);
            }
        }
        let problem = Problem::new(system, functions.with_scalars(scalars), experiments);
        let mut problem = problem.map_err(|why| BuildError::new("functions", why.to_string()))?;
        let measured = self.measurements(&problem, &mut notices)?;
        let weight_search = self.add_penalties(&mut problem, measured.as_ref(), &mut notices)?;
        let mut rows = Vec::new();
        for slot in self.slots() {
            let assembly = slot.owner.map_or(0, |i| assemblies.of_record[i]);
            for constraint in of_bounds(&slot, assembly) {
                self.add(&constraint, &mut problem, &mut rows, &mut notices)?;
            }
        }
        for constraint in &self.constraints {
            self.add(constraint, &mut problem, &mut rows, &mut notices)?;
        }
        identifiable::check(&problem)?;
        self.start_at_samples(&mut problem);
        Ok(Built {
            problem,
            validation,
            weight_search,
            notices,
            rows,
        })
    }

    /// Refuses records that cannot be used, two of one name, and records that start at different times.
    fn check_records(&self) -> Result<(), BuildError> {
        if !self.records.is_empty() && self.records.iter().all(|r| r.validation) {
            let problem = "every experiment is held out of the fit";
            return Err(BuildError::new("experiments", problem)
                .found("`validation: true` in all of them")
                .expected("at least one experiment without"));
        }
        for (i, record) in self.records.iter().enumerate() {
            let key = format!("experiments[{i}]");
            if self.records[..i].iter().any(|r| r.name == record.name) {
                let problem = "two experiments have the same name";
                return Err(BuildError::new(format!("{key}.name"), problem)
                    .found(format!("`{}`", record.name))
                    .expected("a name of its own for every experiment"));
            }
            record.check(&key, self.is_equation_error())?;
        }
        let spans = self.records.iter().map(Record::span).enumerate();
        let mut spans = spans.filter_map(|(i, span)| Some((i, span?[0])));
        let Some((first, start)) = spans.next() else {
            return Ok(());
        };
        let slack = 1e-6 * self.records[first].spacing();
        match spans.find(|(_, other)| (other - start).abs() > slack) {
            Some((i, other)) => {
                let problem = "this record begins at another time than the first one";
                Err(BuildError::new(format!("experiments[{i}]"), problem)
                    .found(format!("{other} s"))
                    .expected(format!("{start} s, as the functions are shared"))
                    .hint(format!(
                        "`time_zero: {}` counts its times from its beginning",
                        other - start
                    )))
            }
            None => Ok(()),
        }
    }

    /// A grid over the span of the records.
    fn grid_of_records(&self) -> Result<Grid, BuildError> {
        let spans = self.records.iter().filter_map(Record::span);
        let Some([start, end]) = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
            return Err(
                BuildError::new("grid", "there are no samples to take it from")
                    .expected("a grid, or records with channels"),
            );
        };
        let nodes = match (self.nodes, self.common_times()) {
            (Some(nodes), _) => nodes,
            (None, Some(times)) => times.len(),
            (None, None) => {
                let problem = "the number of nodes is missing";
                return Err(BuildError::new("grid.nodes", problem)
                    .found("samples that are not all at the same, equally spaced times")
                    .expected("`nodes`"));
            }
        };
        if !(Grid::FEWEST_NODES..=MOST_NODES).contains(&nodes) {
            let problem = "this number of nodes cannot be used";
            return Err(BuildError::new("grid.nodes", problem)
                .found(nodes)
                .expected(format!("{} to {MOST_NODES}", Grid::FEWEST_NODES)));
        }
        Grid::new(start, end - start, nodes).ok_or_else(|| {
            BuildError::new("grid", "the times make no grid")
                .found(format!("{nodes} nodes over {} s", end - start))
                .expected("a positive duration whose steps are not zero")
        })
    }

    /// The times of all samples, where they are the same and equally spaced.
    fn common_times(&self) -> Option<&[f64]> {
        let mut times = self.records.iter().map(Record::common_times);
        let first = times.next()??;
        let same = times.all(|t| t == Some(first));
        (same && even_spacing(first).is_some()).then_some(first)
    }

    /// The force terms of the system.
    fn terms(&self) -> Result<Vec<Term>, BuildError> {
        let mut terms = Vec::new();
        for slot in self.slots().iter().filter(|slot| slot.owner.is_none()) {
            terms.extend(slot.kind.term(slot.width()?));
        }
        Ok(terms)
    }

    /// The functions on the grid.
    fn parameterization(
        &self,
        grid: &Grid,
        assemblies: &Assemblies,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<Parameterization, BuildError> {
        let mut list = Vec::new();
        for slot in self.slots() {
            let mut function = slot.spec.on(slot.kind, &slot.key, grid)?;
            function.owner = slot.owner.map(|i| self.records[i].name.clone());
            list.push(function);
        }
        if list.iter().all(|f| f.parameters() == 0) {
            notices.push(BuildNotice::NothingToFit);
        }
        let sets = assemblies.sets.clone();
        Parameterization::with_devices(list, sets, grid.nodes(), grid.step()).ok_or_else(|| {
            let problem = "a basis has functions that the grid cannot tell apart";
            BuildError::new("functions", problem)
        })
    }

    /// The states of the records as the samples give them, for the equation error.
    fn measurements(
        &self,
        problem: &Problem,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<Option<Measurements>, BuildError> {
        if !self.is_equation_error() || self.simulation {
            return Ok(None);
        }
        let measurements = Measurements::of(problem).map_err(|unsuited| {
            let fitted = self
                .records
                .iter()
                .enumerate()
                .filter(|(_, r)| !r.validation);
            let place = fitted.map(|(i, _)| i).nth(unsuited.experiment);
            let key = format!("experiments[{}]", place.unwrap_or_default());
            let problem = "the method `equation-error` cannot tell the motion from these readings";
            BuildError::new(key, problem)
                .found(unsuited.reason.to_string())
                .expected("readings from which displacement, velocity and acceleration follow")
        })?;
        let remarks = measurements.remarks(problem).into_iter();
        notices.extend(remarks.map(BuildNotice::Measurement));
        Ok(Some(measurements))
    }

    /// Initial states that are estimated without a start or a prior start where the samples do.
    fn start_at_samples(&self, problem: &mut Problem) {
        if problem.experiments.iter().all(|e| e.sought == [None; 2]) {
            return;
        }
        let fitted = self.records.iter().filter(|record| !record.validation);
        let mut start = problem.start();
        let first = problem.functions.scalar_range().start;
        let states = states_from_readings(problem);
        for ((record, experiment), state) in fitted.zip(&problem.experiments).zip(states) {
            let Some(state) = state else { continue };
            for (q, value) in [state.displacement, state.velocity].into_iter().enumerate() {
                if let (Some(index), true) = (experiment.sought[q], record.initial[q].is_open()) {
                    start[first + index] = value;
                }
            }
        }
        problem.start_from(&start);
    }
}
