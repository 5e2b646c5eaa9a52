//! Gauss–Newton subproblem with the states as unknowns: sparse, with a size linear in the number of nodes, for functions
//! with many parameters.

use crate::constraints::Rows;
use crate::noise::Correlation;
use crate::objective::{Evaluation, RowSamples, SimulatedRecord};
use crate::problem::Problem;
use crate::qp::{ResponseVariables, StageLayout, Subproblem};
use crate::record::{Channel, ChannelKind, Experiment, Majorant, Sensor, Weighting};
use crate::rows::merge_columns;
use crate::signal::SecondOrder;
use crate::step::{StepJacobians, Trajectory};

/// Capacity for a linearised step besides the state before it: a component of the next state, three functions at both ends.
const OTHER_ENTRIES: usize = 7;

/// Linearised steps of all experiments.
pub fn steps(problem: &Problem, evaluation: &Evaluation) -> Vec<StepJacobians> {
    let each = (0..problem.experiments.len()).map(|e| {
        let view = problem.view(evaluation, e);
        view.driven().step_jacobians(view.response)
    });
    each.collect()
}

/// Subproblem in `(delta theta, delta x)` about `theta` and the node states `states`, one trajectory per experiment; initial
/// states are fixed or scalars in `theta`.
///
/// Residuals: `sqrt(w) (r + delta z)` for the samples. Equalities: the linearised steps
/// `delta x_{i+1} - dPhi_i (delta x_i, delta theta) = Phi_i(x_i) - x_{i+1}`, whose right-hand sides vanish where the states
/// are a response. `steps` are those of [`steps`].
pub fn subproblem(
    problem: &Problem,
    evaluation: &Evaluation,
    steps: &[StepJacobians],
) -> Subproblem {
    let parameters = problem.parameters();
    let components: Vec<usize> = (evaluation.trajectories.iter())
        .map(Trajectory::components)
        .collect();
    let records = || problem.experiments.iter().zip(&components);
    let states: usize = records().map(|(e, count)| count * (e.nodes - 1)).sum();
    let mut sub = Subproblem::new(parameters + states);
    sub.elimination_order = problem.functions.first_nodes();
    for (experiment, count) in records() {
        let nodes = 1..experiment.nodes as u32;
        let positions = nodes.flat_map(|i| std::iter::repeat_n(i, *count));
        sub.elimination_order.extend(positions);
    }
    sub.layout = layout(problem, &components);
    let mut base = parameters;
    for (e, steps) in steps.iter().enumerate() {
        let experiment = &problem.experiments[e];
        let view = problem.view(evaluation, e);
        let columns = UnknownColumns {
            problem,
            experiment,
            base,
            components: components[e],
        };
        columns.add_steps(steps, view.response, &mut sub.equalities);
        for (channel, predicted) in experiment.channels.iter().zip(&evaluation.predictions[e]) {
            columns.add_samples(channel, predicted, view, &mut sub);
        }
        base += components[e] * (experiment.nodes - 1);
    }
    sub
}

/// Assignment of the unknowns to nodes; `None` if a function is neither nodal nor constant, or experiments share an initial state.
fn layout(problem: &Problem, components: &[usize]) -> Option<StageLayout> {
    let functions = &problem.functions;
    let mut layout = StageLayout::of(functions)?;
    let first_scalar = functions.scalar_range().start;
    let mut first = problem.parameters();
    for (experiment, components) in problem.experiments.iter().zip(components) {
        let initial = experiment.initial_parameters.iter();
        let initial = initial.map(|index| index.map(|index| first_scalar + index));
        let initial: Vec<Option<usize>> = initial.collect();
        for variable in initial.iter().copied().flatten() {
            let constants = &mut layout.constants;
            constants.remove(constants.iter().position(|j| *j == variable)?);
        }
        layout.responses.push(ResponseVariables {
            first,
            nodes: experiment.nodes,
            initial,
        });
        first += components * (experiment.nodes - 1);
    }
    Some(layout)
}

/// Columns of the unknowns of one experiment.
struct UnknownColumns<'a> {
    problem: &'a Problem,
    experiment: &'a Experiment,
    base: usize,
    components: usize,
}

impl UnknownColumns<'_> {
    /// Column of component `q` of the state at node `i`; `None` for a fixed initial state.
    fn state(&self, i: usize, q: usize) -> Option<usize> {
        match i {
            0 => Some(self.scalar(self.experiment.initial_parameters[q]?)),
            _ => Some(self.base + self.components * (i - 1) + q),
        }
    }

    fn scalar(&self, index: usize) -> usize {
        self.problem.functions.scalar_range().start + index
    }

    fn add_steps(&self, steps: &StepJacobians, states: &Trajectory, equalities: &mut Rows) {
        let mut entries = Vec::new();
        let rows = self.components * steps.iter().len();
        equalities.reserve(rows, rows * (self.components + OTHER_ENTRIES));
        for (i, step) in steps.iter().enumerate() {
            for q in 0..self.components {
                entries.clear();
                entries.extend(self.state(i + 1, q).map(|j| (j, 1.0)));
                for s in 0..self.components {
                    entries.extend(self.state(i, s).map(|j| (j, -step.by_state(s, q))));
                }
                let slope = |f: usize, side: usize| -step.by_function(f, side, q);
                self.add_function_slopes(i, &slope, &mut entries);
                let missing = step.end(q) - states.component(q)[i + 1];
                equalities.push(entries.iter().copied(), missing);
            }
        }
    }

    /// Adds the dependence on the functions' values at both ends of step `i`, with `slope(function, side)`.
    fn add_function_slopes(
        &self,
        i: usize,
        slope: &dyn Fn(usize, usize) -> f64,
        entries: &mut Vec<(usize, f64)>,
    ) {
        let functions = &self.problem.functions;
        let set = functions.coefficient_set(self.experiment.coefficient_set);
        for (position, f) in set.parts() {
            let (function, range) = (functions.get(f), &functions.ranges()[f]);
            for side in 0..2 {
                let slope = slope(position, side);
                if slope != 0.0 {
                    let add = |(j, b): (usize, f64)| entries.push((range.start + j, slope * b));
                    function.design.row(i + side).for_each(add);
                }
            }
        }
    }

    fn add_sensor(
        &self,
        channel: &Channel,
        factors: [f64; Sensor::PARAMETERS],
        entries: &mut Vec<(usize, f64)>,
    ) {
        for (index, factor) in channel.sensor().indices().into_iter().zip(factors) {
            entries.extend(index.map(|index| (self.scalar(index), factor)));
        }
    }

    fn add_samples(
        &self,
        channel: &Channel,
        predicted: &[f64],
        view: SimulatedRecord,
        sub: &mut Subproblem,
    ) {
        let [gain, ..] = channel.sensor().values(view.scalars);
        // A displacement at a node by a known sensor is the state itself.
        let known = !channel.sensor().is_estimated();
        let plain = known && channel.kind() == ChannelKind::Displacement;
        let coordinate = plain.then(|| channel.coordinate()).flatten();
        let mut samples = (!view.system.structure.is_one()).then(|| RowSamples::new(channel, view));
        let mut row = |i: usize, entries: &mut Vec<(usize, f64)>| {
            let position = channel.position(view, i);
            if let (Some(j), Some(node)) = (coordinate, position.as_node()) {
                entries.extend(self.state(node, j).map(|index| (index, gain)));
                return;
            }
            if let Some(samples) = &mut samples {
                let factors = known.then_some([0.0; Sensor::PARAMETERS]);
                let factors = factors.unwrap_or_else(|| samples.sensor_factors(i));
                let sensed = samples.observe(i);
                for (side, by) in sensed.states.iter().enumerate() {
                    for (q, slope) in by.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
                        let index = self.state(position.step + side, q);
                        entries.extend(index.map(|index| (index, gain * slope)));
                    }
                }
                let slope = |f: usize, side: usize| gain * sensed.functions[side][f];
                self.add_function_slopes(position.step, &slope, entries);
                self.add_sensor(channel, factors, entries);
                return;
            }
            let sensed = channel.sensed(view, i);
            for (j, slope) in sensed.states.iter().enumerate() {
                if *slope != 0.0 {
                    let index = self.state(position.step + j / 2, j % 2);
                    entries.extend(index.map(|index| (index, gain * slope)));
                }
            }
            let slope = |f: usize, side: usize| gain * sensed.functions[side][f];
            self.add_function_slopes(position.step, &slope, entries);
            self.add_sensor(
                channel,
                channel.sensor_factors(view, i, sensed.value),
                entries,
            );
        };
        let Majorant {
            weight_roots,
            weighted,
        } = channel.majorant(predicted);
        if channel.filter().is_empty() && channel.correlation().is_none() {
            let mut entries = Vec::new();
            for (i, (root, r)) in weight_roots.iter().zip(&weighted).enumerate() {
                entries.clear();
                row(i, &mut entries);
                let row = entries.iter().map(|(j, a)| (*j, root * a));
                sub.residuals.push(row, -r);
            }
            return;
        }
        let rows = (0..channel.len()).map(|i| {
            let mut entries = Vec::new();
            row(i, &mut entries);
            entries
        });
        let mut rows: Vec<Vec<(usize, f64)>> = rows.collect();
        if !channel.filter().is_empty() {
            let filtered = add_filter(channel.filter(), rows, sub);
            rows = filtered.into_iter().map(|j| vec![(j, 1.0)]).collect();
        }
        if let Some(correlation) = channel.correlation() {
            sub.layout = None;
            rows = whitened(correlation, channel.weighting(), &rows);
        }
        for (row, (root, r)) in rows.iter().zip(weight_roots.iter().zip(&weighted)) {
            sub.residuals
                .push(row.iter().map(|(j, a)| (*j, root * a)), -r);
        }
    }
}

/// Rows `W (rows/sigma)`: each is a combination of the rows of a sample and of some before it.
fn whitened(
    correlation: &Correlation,
    weighting: &Weighting,
    rows: &[Vec<(usize, f64)>],
) -> Vec<Vec<(usize, f64)>> {
    let mut out = vec![Vec::new(); rows.len()];
    let scaled = |i: usize, factor: f64| {
        let factor = factor / weighting.sigma(i).unwrap_or(1.0);
        rows[i].iter().map(move |(j, a)| (*j, factor * a))
    };
    correlation.each_row(|i, coefficients, size| {
        out[i].extend(scaled(i, size));
        for (lag, a) in coefficients.iter().enumerate() {
            out[i].extend(scaled(i - 1 - lag, -a * size));
        }
        merge_columns(&mut out[i]);
    });
    out
}

/// Adds filtered changes of the predictions as unknowns and returns their columns. Each section is a recurrence, run forward
/// over the record for all sections and then backward, from rest. With recurrences in both directions the variables have no
/// elimination order along time.
fn add_filter(
    filter: &[SecondOrder],
    rows: Vec<Vec<(usize, f64)>>,
    sub: &mut Subproblem,
) -> Vec<usize> {
    let mut signal = rows;
    let mut indices = Vec::new();
    sub.elimination_order.clear();
    sub.layout = None;
    for backward in [false, true] {
        if backward {
            signal.reverse();
        }
        for section in filter {
            indices = sub.add_variables(signal.len());
            for i in 0..signal.len() {
                let mut entries = vec![(indices[i], 1.0)];
                for (lag, b) in section.b.iter().enumerate().filter(|(lag, _)| *lag <= i) {
                    entries.extend(signal[i - lag].iter().map(|(j, a)| (*j, -b * a)));
                }
                for (lag, a) in section.a.iter().enumerate().filter(|(lag, _)| *lag < i) {
                    entries.push((indices[i - lag - 1], *a));
                }
                sub.equalities.push(entries, 0.0);
            }
            signal = indices.iter().map(|j| vec![(*j, 1.0)]).collect();
        }
    }
    indices.reverse();
    indices
}
