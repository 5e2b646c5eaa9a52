//! Problems from Rust, without a model file.
//!
//! A [`Builder`] takes what is known of the device as three [`Part`]s (and further terms), [`Record`]s of
//! its motion, and demands, checks them as a model file is checked, and makes the [`Problem`]; its
//! [`fit`](Problem::fit) needs no more. What a model file can say beyond it (sensors with gain and drift,
//! bands, weights chosen by a rule, functions of single experiments) is there in the modules below.
//!
//! ```
//! use kmcfit_core::{Builder, Part, Record};
//!
//! // A free decay of one second: m = 1 kg, c = 2 N s/m, k = 2500 N/m, so 8 Hz.
//! let times: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-3).collect();
//! let omega = (2500.0f64 - 1.0).sqrt();
//! let decay = |t: &f64| 0.01 * (-t).exp() * ((omega * t).cos() + (omega * t).sin() / omega);
//! let motion: Vec<f64> = times.iter().map(decay).collect();
//!
//! let device = [Part::fixed(1.0), Part::constant(1.0).min(0.0), Part::constant(2000.0)];
//! let record = Record::new("ring-down").from_state(0.01, 0.0).displacement(&times, &motion);
//! let problem = Builder::new(device).record(record).build()?;
//! let found = problem.fit()?;
//!
//! let [damping, stiffness] = [0, 1].map(|j| found.best.evaluation.device.coefficients[j][0]);
//! assert!((damping - 2.0).abs() < 1e-3 && (stiffness - 2500.0).abs() < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod part;
mod record;

pub use error::BuildError;
pub use part::Part;
pub use record::Record;

use crate::constraints::{Impossible, Statement};
use crate::functions::{CoefficientKind, Parameterization};
use crate::problem::Problem;
use crate::signal::even_spacing;
use crate::solvers::{StartProjection, states_from_readings};
use crate::system::{Grid, Method, System, Term};

/// Most nodes: more would be asked for by mistake, and end in a lack of memory.
const MOST_NODES: usize = 100_000_000;

/// What a problem is made of.
#[derive(Debug, Clone)]
pub struct Builder {
    parts: Vec<(CoefficientKind, Part)>,
    width: f64,
    records: Vec<Record>,
    nodes: Option<usize>,
    method: Method,
    demands: Vec<(Statement, Option<f64>)>,
}

impl Builder {
    /// A device with mass (kg), damping (N s/m) and stiffness (N/m), stepped by RK4.
    pub fn new([mass, damping, stiffness]: [Part; 3]) -> Self {
        Self {
            parts: vec![
                (CoefficientKind::Mass, mass),
                (CoefficientKind::Damping, damping),
                (CoefficientKind::Stiffness, stiffness),
            ],
            width: 0.0,
            records: Vec::new(),
            nodes: None,
            method: Method::Rk4,
            demands: Vec::new(),
        }
    }

    /// With a stiffness `k3` (N/m^3) on the cube of the displacement.
    #[must_use]
    pub fn cubic_stiffness(self, part: Part) -> Self {
        self.with(CoefficientKind::CubicStiffness, part)
    }

    /// With a damping (N s^2/m^2) on `|v| v`.
    #[must_use]
    pub fn quadratic_damping(self, part: Part) -> Self {
        self.with(CoefficientKind::QuadraticDamping, part)
    }

    /// With a friction (N) on `v / sqrt(v^2 + width^2)`, `width` in m/s.
    #[must_use]
    pub fn coulomb_friction(mut self, part: Part, width: f64) -> Self {
        self.width = width;
        self.with(CoefficientKind::CoulombFriction, part)
    }

    /// With a constant push (N) against the direction of `y`.
    #[must_use]
    pub fn offset(self, part: Part) -> Self {
        self.with(CoefficientKind::Offset, part)
    }

    fn with(mut self, quantity: CoefficientKind, part: Part) -> Self {
        self.parts.retain(|(known, _)| *known != quantity);
        self.parts.push((quantity, part));
        self
    }

    /// With one more record of the same device.
    #[must_use]
    pub fn record(mut self, record: Record) -> Self {
        self.records.push(record);
        self
    }

    /// On so many time nodes; without, one per reading, for which the readings of all records must be at the
    /// same equally spaced times.
    #[must_use]
    pub fn nodes(mut self, nodes: usize) -> Self {
        self.nodes = Some(nodes);
        self
    }

    /// Stepped by another method.
    #[must_use]
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Demands that a statement about the functions hold.
    #[must_use]
    pub fn demand(mut self, statement: Statement) -> Self {
        self.demands.push((statement, None));
        self
    }

    /// Lets a statement be broken at the price `weight * mean over its rows of the squared excess`.
    #[must_use]
    pub fn prefer(mut self, statement: Statement, weight: f64) -> Self {
        self.demands.push((statement, Some(weight)));
        self
    }

    /// The problem, its start moved into what is demanded.
    ///
    /// # Errors
    /// At the first part that cannot be meant.
    pub fn build(&self) -> Result<Problem, BuildError> {
        self.records.iter().try_for_each(Record::check)?;
        let grid = self.grid()?;
        let mut parts: Vec<&(CoefficientKind, Part)> = self.parts.iter().collect();
        parts.sort_by_key(|(quantity, _)| CoefficientKind::ALL.iter().position(|q| q == quantity));
        let list = parts
            .iter()
            .map(|(quantity, part)| part.on(*quantity, &grid));
        let list: Vec<_> = list.collect::<Result<_, _>>()?;
        let mut penalties = Vec::new();
        let mut variations = Vec::new();
        for (index, ((_, part), function)) in parts.iter().zip(&list).enumerate() {
            let (smooth, variation) = part.penalties(index, function, &grid)?;
            penalties.extend(smooth);
            variations.extend(variation);
        }
        let functions = Parameterization::new(list, grid.nodes(), grid.step());
        let functions = functions.ok_or_else(|| {
            BuildError::new(
                "functions",
                "the nodes cannot tell the functions of a basis apart",
            )
        })?;
        let mut scalars = Vec::new();
        let experiments = self.records.iter().map(|r| r.on(&grid, &mut scalars));
        let experiments = experiments.collect::<Result<_, _>>()?;
        let oscillator = System {
            grid,
            method: self.method,
            terms: self.terms(&parts)?,
        };
        let functions = functions.with_scalars(scalars);
        let problem = Problem::new(oscillator, functions, experiments);
        let mut problem = problem.map_err(|why| BuildError::new("problem", why.to_string()))?;
        problem.parts_mut().penalties = penalties;
        problem.parts_mut().variations = variations;
        self.constrain(&parts, &mut problem)?;
        begin_at_readings(&mut problem);
        into_the_constraints(&mut problem)?;
        Ok(problem)
    }

    fn grid(&self) -> Result<Grid, BuildError> {
        let refuse = |problem: String| Err(BuildError::new("grid", problem));
        let spans = self.records.iter().filter_map(Record::span);
        let Some([start, end]) = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
            return Err(BuildError::new("records", "there are none"));
        };
        let nodes = match self.nodes {
            Some(nodes) => nodes,
            None => match self.common_spacing() {
                Some(times) => times.len(),
                None => {
                    return refuse(
                        "`nodes` is needed: the readings are not all at the same, equally spaced \
                         times"
                            .into(),
                    );
                }
            },
        };
        if nodes < Grid::FEWEST_NODES {
            return refuse(format!("{nodes} nodes, fewer than {}", Grid::FEWEST_NODES));
        }
        if nodes > MOST_NODES {
            return refuse(format!("{nodes} nodes, more than {MOST_NODES}"));
        }
        match Grid::new(start, end - start, nodes) {
            Some(grid) => Ok(grid),
            None => refuse(format!("{nodes} nodes over {} s make no grid", end - start)),
        }
    }

    /// The times of all readings, where they are the same and equally spaced.
    fn common_spacing(&self) -> Option<&[f64]> {
        let mut times = self.records.iter().map(Record::common_times);
        let first = times.next()??;
        let same = times.all(|t| t == Some(first));
        (same && even_spacing(first).is_some()).then_some(first)
    }

    fn terms(&self, parts: &[&(CoefficientKind, Part)]) -> Result<Vec<Term>, BuildError> {
        let friction = parts
            .iter()
            .any(|(q, _)| *q == CoefficientKind::CoulombFriction);
        if friction && !(self.width.is_finite() && self.width > 0.0) {
            let problem = format!("its width is {} m/s, not positive", self.width);
            return Err(BuildError::new("coulomb_friction", problem));
        }
        let terms = parts.iter().filter_map(|(q, _)| q.term(self.width));
        Ok(terms.collect())
    }

    fn constrain(
        &self,
        parts: &[&(CoefficientKind, Part)],
        problem: &mut Problem,
    ) -> Result<(), BuildError> {
        let mut all: Vec<(Statement, Option<f64>)> = Vec::new();
        for (quantity, part) in parts {
            all.extend(part.limits(*quantity)?.into_iter().map(|s| (s, None)));
        }
        all.extend(self.demands.iter().cloned());
        for (statement, price) in all {
            if let Some(price) = price
                && !(price.is_finite() && price > 0.0)
            {
                let problem = format!("its price is {price}, not positive");
                return Err(BuildError::new(format!("{statement:?}"), problem));
            }
            let rows = statement.build(&problem.oscillator.grid, &problem.functions);
            let mut rows =
                rows.map_err(|why| BuildError::new(format!("{statement:?}"), in_words(&why)))?;
            if price.is_some() && !rows.cones.is_empty() {
                let problem = "a cap on the damping ratio cannot be soft";
                return Err(BuildError::new(format!("{statement:?}"), problem));
            }
            rows.groups.iter_mut().for_each(|group| group.soft = price);
            let added = problem.constrain(rows);
            added.map_err(|why| BuildError::new("demands", why.to_string()))?;
        }
        Ok(())
    }
}

fn in_words(why: &Impossible) -> String {
    let names = |list: &[CoefficientKind]| {
        let names: Vec<&str> = list.iter().map(|q| q.name()).collect();
        names.join(", ")
    };
    match why {
        Impossible::Absent(quantity) => format!("the device has no {}", quantity.name()),
        Impossible::Fixed(list) => format!("{} cannot be constrained: fixed", names(list)),
        Impossible::Broken { name, time } => {
            format!("no fit can satisfy it: `{name}` is broken at {time} s by what is given")
        }
    }
}

/// Initial states that are sought begin where the readings do.
fn begin_at_readings(problem: &mut Problem) {
    if problem.experiments.iter().all(|e| e.sought == [None; 2]) {
        return;
    }
    let mut start = problem.start();
    let first = problem.functions.scalar_range().start;
    let states = states_from_readings(problem);
    for (experiment, state) in problem.experiments.iter().zip(states) {
        let Some(state) = state else { continue };
        let parts = [state.displacement, state.velocity];
        for (sought, value) in experiment.sought.into_iter().zip(parts) {
            if let Some(index) = sought {
                start[first + index] = value;
            }
        }
    }
    problem.start_from(&start);
}

/// Moves the start into the constraints.
fn into_the_constraints(problem: &mut Problem) -> Result<(), BuildError> {
    if problem.constraints.is_empty() {
        return Ok(());
    }
    let contradiction = |names: Vec<String>| {
        let problem = format!("they contradict each other: {}", names.join(", "));
        Err(BuildError::new("demands", problem))
    };
    match problem.feasible_start(&problem.start()) {
        StartProjection::Kept(_) => Ok(()),
        StartProjection::Moved { parameters, .. } => {
            problem.start_from(&parameters);
            Ok(())
        }
        StartProjection::Contradiction(names) | StartProjection::ContradictionAmong(names) => {
            contradiction(names)
        }
        StartProjection::Unsolved(status) => Err(BuildError::new("demands", status.sentence())),
    }
}
