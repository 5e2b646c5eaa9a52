//! Lowering of a builder to a problem: grid, functions, records, penalties, constraints and start.

use super::coefficient_sets::{CoefficientSets, FunctionEntry};
use super::constraints::{RowKey, move_start, of_bounds};
use super::experiment::ExperimentBuilder;
use super::{BuildError, BuildNotice, Builder, Record, WeightSearch, identifiable, input_error};
use crate::functions::{Parameterization, ScalarParameter};
use crate::problem::Problem;
use crate::record::Experiment;
use crate::signal::even_spacing;
use crate::solvers::{Measurements, estimate_states};
use crate::structure::Structure;
use crate::system::{Grid, System};
use std::sync::Arc;

/// Largest number of nodes, a safeguard against mistyped numbers.
const MOST_NODES: usize = 100_000_000;

/// A problem with its notices, before the projection of its start onto the constraints.
#[derive(Debug, Clone)]
pub struct Built {
    /// The problem.
    pub problem: Problem,
    /// Validation records, each with its own estimated scalars.
    pub validation: Vec<(Experiment, Vec<ScalarParameter>)>,
    /// Weights to be chosen by a rule.
    pub weight_search: Option<WeightSearch>,
    /// Notices on the specification.
    pub notices: Vec<BuildNotice>,
    rows: Vec<RowKey>,
}

impl Built {
    /// Projects the start onto the constraints.
    ///
    /// # Errors
    /// If the constraints contradict each other, or no feasible start is found.
    pub fn move_start(&mut self) -> Result<(), BuildError> {
        let notice = move_start(&mut self.problem, &self.rows)?;
        self.notices.extend(notice);
        Ok(())
    }
}

impl Builder {
    /// Lowers the specification to a problem, with the start as given, before its projection onto the constraints.
    ///
    /// # Errors
    /// The first invalid part.
    pub fn lower(&self) -> Result<Built, BuildError> {
        self.check_records()?;
        let grid = match self.grid {
            Some(grid) => grid,
            None => self.grid_of_records()?,
        };
        self.with_knots(&grid)?.on_grid(grid)
    }

    /// Lowers a specification without automatic parts.
    fn on_grid(&self, grid: Grid) -> Result<Built, BuildError> {
        let coefficient_sets = self.coefficient_sets()?;
        let mut notices = Vec::new();
        let functions = self.parameterization(&grid, &coefficient_sets, &mut notices)?;
        let system = System {
            grid,
            method: self.method,
            structure: self.build_structure()?,
        };
        let mut scalars = Vec::new();
        let mut validation = Vec::new();
        let mut experiments = Vec::new();
        for (i, record) in self.records.iter().enumerate() {
            let builder = ExperimentBuilder {
                key: format!("experiments[{i}]"),
                record,
                grid: &grid,
                coefficient_set: coefficient_sets.of_record[i],
                builder: self,
            };
            if record.validation {
                let mut own = Vec::new();
                validation.push((builder.build(&mut own)?, own));
            } else {
                experiments.push(builder.build(&mut scalars)?);
            }
        }
        let problem = Problem::new(system, functions.with_scalars(scalars), experiments);
        let mut problem = problem.map_err(|why| BuildError::new("functions", why.to_string()))?;
        let measured = self.measurements(&problem, &mut notices)?;
        let weight_search = self.add_penalties(&mut problem, measured.as_deref(), &mut notices)?;
        let mut rows = Vec::new();
        let starts = problem.functions.values(&problem.start());
        for (j, (entry, start)) in self.entries().iter().zip(&starts).enumerate() {
            let coefficient_set = entry.owner.map_or(0, |i| coefficient_sets.of_record[i]);
            for constraint in of_bounds(entry, j, start, coefficient_set) {
                self.add(&constraint, &mut problem, &mut rows, &mut notices)?;
            }
        }
        for constraint in &self.constraints {
            self.add(constraint, &mut problem, &mut rows, &mut notices)?;
        }
        identifiable::check(&problem)?;
        input_error::check(&problem, self.solver)?;
        self.start_at_samples(&mut problem);
        Ok(Built {
            problem,
            validation,
            weight_search,
            notices,
            rows,
        })
    }

    /// Error for invalid records, duplicate names, and records that start at different times.
    fn check_records(&self) -> Result<(), BuildError> {
        if !self.records.is_empty() && self.records.iter().all(|r| r.validation) {
            let problem = "all experiments are validation records";
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
                let problem = "this record starts at another time than the first one";
                Err(BuildError::new(format!("experiments[{i}]"), problem)
                    .found(format!("{other} s"))
                    .expected(format!("{start} s, as the functions are shared"))
                    .hint(format!(
                        "`time_zero: {}` sets the start of a record to time 0",
                        other - start
                    )))
            }
            None => Ok(()),
        }
    }

    /// Grid over the span of the records.
    fn grid_of_records(&self) -> Result<Grid, BuildError> {
        let spans = self.records.iter().filter_map(Record::span);
        let Some([start, end]) = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
            return Err(
                BuildError::new("grid", "the grid cannot be chosen without samples")
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
            let problem = "invalid number of nodes";
            return Err(BuildError::new("grid.nodes", problem)
                .found(nodes)
                .expected(format!("{} to {MOST_NODES}", Grid::FEWEST_NODES)));
        }
        Grid::new(start, end - start, nodes).ok_or_else(|| {
            BuildError::new("grid", "invalid time axis")
                .found(format!("{nodes} nodes over {:?} s", end - start))
                .expected("a positive duration whose steps are not zero")
        })
    }

    /// Times of all samples, if equal for all channels and equally spaced.
    fn common_times(&self) -> Option<&[f64]> {
        let mut times = self.records.iter().map(Record::common_times);
        let first = times.next()??;
        let same = times.all(|t| t == Some(first));
        (same && even_spacing(first).is_some()).then_some(first)
    }

    /// The structure of the system.
    fn build_structure(&self) -> Result<Structure, BuildError> {
        let (mut inertias, mut elements) = (Vec::new(), Vec::new());
        let is_shared = |entry: &&FunctionEntry| entry.owner.is_none() && !entry.is_known_part;
        let entries = self.entries();
        for (entry, function) in entries.iter().filter(is_shared).zip(&self.functions) {
            let ends = function.ends.clone();
            match entry.kind.law(entry.width()?) {
                None => inertias.push(ends),
                Some(law) => elements.push((law, ends)),
            }
        }
        let count = self.coordinates.len().max(1);
        let structure = Structure::new(count, 0, inertias, elements);
        structure.map_err(|why| BuildError::new("structure", why.to_string()))
    }

    /// Functions on the grid.
    fn parameterization(
        &self,
        grid: &Grid,
        coefficient_sets: &CoefficientSets,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<Parameterization, BuildError> {
        let mut list = Vec::new();
        for entry in self.entries() {
            let mut function = entry.spec.on(entry.kind, &entry.key, grid)?;
            function.owner = entry.owner.map(|i| self.records[i].name.clone());
            function.label = (!self.coordinates.is_empty()).then(|| entry.name.to_owned());
            function.is_known_part = entry.is_known_part;
            list.push(function);
        }
        if list.iter().all(|f| f.parameters() == 0) {
            notices.push(BuildNotice::NothingToFit);
        }
        let sets = coefficient_sets.sets.clone();
        Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step()).ok_or_else(
            || {
                let problem = "the functions of a basis are linearly dependent on the grid";
                BuildError::new("functions", problem)
            },
        )
    }

    /// States estimated from the samples, for the equation error.
    fn measurements(
        &self,
        problem: &Problem,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<Option<Arc<Measurements>>, BuildError> {
        if !self.is_equation_error() || self.is_simulation {
            return Ok(None);
        }
        let measurements = Measurements::of(problem).map_err(|unsuited| {
            let fitted = self
                .records
                .iter()
                .enumerate()
                .filter(|(_, r)| !r.validation);
            let position = fitted.map(|(i, _)| i).nth(unsuited.experiment);
            let key = format!("experiments[{}]", position.unwrap_or_default());
            let problem =
                "the method `equation-error` cannot derive the response from these samples";
            BuildError::new(key, problem)
                .found(unsuited.reason.to_string())
                .expected("samples from which displacement, velocity and acceleration follow")
        })?;
        let remarks = measurements.remarks(problem).into_iter();
        notices.extend(remarks.map(|remark| BuildNotice::Measurement { remark }));
        Ok(Some(measurements))
    }

    /// Sets initial states without a start or prior to those estimated from the samples.
    fn start_at_samples(&self, problem: &mut Problem) {
        // The estimated states are those of one coordinate.
        let is_one = problem.system.structure.is_one();
        if !is_one || problem.experiments.iter().all(|e| e.begins_known()) {
            return;
        }
        let fitted = self.records.iter().filter(|record| !record.validation);
        let mut start = problem.start();
        let first = problem.functions.scalar_range().start;
        let states = match self.states.is_empty() {
            true => estimate_states(problem),
            false => self.states.iter().cloned().map(Some).collect(),
        };
        for ((record, experiment), state) in fitted.zip(&problem.experiments).zip(states) {
            let Some(state) = state else { continue };
            for (q, value) in [state.displacement(0), state.velocity(0)]
                .into_iter()
                .enumerate()
            {
                if let (Some(index), true) = (
                    experiment.initial_parameters[q],
                    record.initial[q].is_open(),
                ) {
                    start[first + index] = value;
                }
            }
        }
        problem.start_from(&start);
    }
}
