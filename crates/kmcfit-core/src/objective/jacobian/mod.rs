//! Jacobian of all predictions with respect to all parameters, from forward sensitivities eight directions at a time.

mod observation_rows;
mod sensitivity_layout;

use super::{Evaluation, RecordTangent, SimulatedRecord};
use crate::problem::Problem;
use crate::record::{Channel, Experiment, LONG_RECORD_STEPS};
use crate::simd::LANES;
use crate::simd::sum::are_finite;
use crate::simd::tall_qr::{RowBlock, order_by};
use crate::step::tangents::TILE;
use crate::system::SystemTangent;
use nalgebra::DMatrix;
use observation_rows::JacobianRows;
use sensitivity_layout::SensitivityLayout;
use std::ops::Range;

impl Problem {
    /// Jacobian of the predictions (rows: samples of all channels of all experiments, in order) with respect to the
    /// parameters: [`Problem::predictions_tangent`] of all unit vectors, to machine precision.
    pub fn predictions_jacobian(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        if !self.system.structure.is_one() {
            return self.jacobian_of_structure(evaluation);
        }
        let mut jacobian = DMatrix::zeros(self.sample_count(), self.parameters());
        let order = self.positions();
        self.each_row_block(evaluation, &order, |block| {
            for (position, j) in order.iter().enumerate().take(block.begun()) {
                let mut column = jacobian.column_mut(*j);
                let rows = block.first..block.first + block.count;
                column.as_mut_slice()[rows].copy_from_slice(block.column(position));
            }
            block
        });
        self.add_sensors(evaluation, &mut jacobian);
        match are_finite(jacobian.as_slice()) {
            true => jacobian,
            false => self.jacobian_by_columns(evaluation),
        }
    }

    /// [`Problem::predictions_jacobian`] with [`Problem::whiten_rows`].
    pub(crate) fn whitened_jacobian(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = self.predictions_jacobian(evaluation);
        self.whiten_rows(&mut jacobian);
        jacobian
    }

    /// Whitens the rows (samples of all channels, in order) of channels with correlated noise
    /// ([`Channel::whiten_rows`]).
    pub(crate) fn whiten_rows(&self, rows: &mut DMatrix<f64>) {
        let mut first = 0;
        for channel in self.channels() {
            let samples = first..first + channel.len();
            first = samples.end;
            if channel.correlation().is_some() {
                for mut column in rows.column_iter_mut() {
                    channel.whiten_rows(&mut column.as_mut_slice()[samples.clone()]);
                }
            }
        }
    }

    /// Jacobian by tangents that share the linearised steps.
    fn jacobian_of_structure(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let parameters = self.parameters();
        let mut jacobian = DMatrix::zeros(self.sample_count(), parameters);
        let unit = |j: usize| {
            let mut unit = vec![0.0; parameters];
            unit[j] = 1.0;
            unit
        };
        for first in (0..parameters).step_by(LANES) {
            let columns = first..(first + LANES).min(parameters);
            let units: Vec<Vec<f64>> = columns.clone().map(unit).collect();
            let mut row = 0;
            for (e, experiment) in self.experiments.iter().enumerate() {
                let view = self.view(evaluation, e);
                let along = units
                    .iter()
                    .map(|unit| self.system_tangent(experiment, unit));
                let along: Vec<SystemTangent> = along.collect();
                let responses = view.driven().tangents(view.response, &along);
                let tangents = along.iter().zip(&responses).zip(&units);
                let tangents = tangents.map(|((along, response), unit)| RecordTangent {
                    nodal: &along.nodal,
                    response,
                    scalars: self.scalars(unit),
                });
                let tangents: Vec<RecordTangent> = tangents.collect();
                for channel in &experiment.channels {
                    let changes = channel.row_tangents(view, &tangents);
                    for (j, change) in columns.clone().zip(changes) {
                        let mut column = jacobian.column_mut(j);
                        column.as_mut_slice()[row..row + channel.len()].copy_from_slice(&change);
                    }
                    row += channel.len();
                }
            }
        }
        jacobian
    }

    /// Jacobian by one tangent solve per column, for values near the limits of the floating-point range, where the order of
    /// operations determines what is finite.
    fn jacobian_by_columns(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.sample_count(), self.parameters());
        let mut unit = vec![0.0; self.parameters()];
        for (j, mut column) in jacobian.column_iter_mut().enumerate() {
            unit[j] = 1.0;
            let changes = self.predictions_tangent(evaluation, &unit);
            unit[j] = 0.0;
            let all = changes.iter().flatten().flatten();
            column
                .iter_mut()
                .zip(all)
                .for_each(|(a, change)| *a = *change);
        }
        jacobian
    }

    /// Parameter of each column of the sensitivities, ordered by the first node that it affects; columns cost nothing before
    /// that node.
    pub(crate) fn positions(&self) -> Vec<usize> {
        let first = self.functions.first_nodes().into_iter();
        order_by(&first.map(|node| node as usize).collect::<Vec<_>>())
    }

    /// True if the row blocks of [`Problem::each_row_block`] form the complete Jacobian: there is one coordinate, no sensor parameter is
    /// estimated, no channel is filtered, and no noise is correlated.
    pub(crate) fn is_computed_by_blocks(&self) -> bool {
        let is_plain = |channel: &Channel| {
            channel.filter().is_empty()
                && channel.correlation().is_none()
                && !channel.sensor().is_estimated()
        };
        self.system.structure.is_one() && self.channels().all(is_plain)
    }

    /// Passes the rows of the Jacobian to `take` in blocks, with columns in `order` ([`Problem::positions`]) and without the
    /// contributions of sensors and filters; `take` returns a block to fill next. Rows of one channel come in order, those of
    /// several channels alternate.
    pub(crate) fn each_row_block(
        &self,
        evaluation: &Evaluation,
        order: &[usize],
        mut take: impl FnMut(RowBlock) -> RowBlock,
    ) {
        let mut row = 0;
        for (e, experiment) in self.experiments.iter().enumerate() {
            if experiment.sample_count() > 0 && !order.is_empty() {
                let view = self.view(evaluation, e);
                let all = 0..experiment.nodes - 1;
                sweep(self, experiment, view, order, row, all, &mut take);
            }
            row += experiment.sample_count();
        }
    }

    /// Step in the middle of the only record of a problem, at the end of a tile; `None` for several records or a short one.
    pub(crate) fn middle(&self) -> Option<usize> {
        let [experiment] = self.experiments.as_slice() else {
            return None;
        };
        let steps = experiment.nodes - 1;
        (steps >= LONG_RECORD_STEPS).then(|| steps / 2 / TILE * TILE)
    }

    /// [`Problem::each_row_block`] for the samples within some steps of the only record, starting with a tile; returns the
    /// derivatives of displacement and velocity at their end. Steps after the first treat their initial state as two further
    /// columns, behind the others.
    pub(crate) fn each_row_block_of_part(
        &self,
        evaluation: &Evaluation,
        order: &[usize],
        steps: Range<usize>,
        mut take: impl FnMut(RowBlock) -> RowBlock,
    ) -> Vec<[f64; 2]> {
        let (experiment, view) = (&self.experiments[0], self.view(evaluation, 0));
        sweep(self, experiment, view, order, 0, steps, &mut take)
    }

    /// Adds the derivatives with respect to sensor parameters to a Jacobian and applies the filters.
    fn add_sensors(&self, evaluation: &Evaluation, jacobian: &mut DMatrix<f64>) {
        let mut row = 0;
        for (e, experiment) in self.experiments.iter().enumerate() {
            let view = self.view(evaluation, e);
            for channel in &experiment.channels {
                add_sensor(channel, view, row, jacobian);
                row += channel.len();
            }
        }
    }
}

/// Integrates the sensitivities of one experiment over `steps`, with the first sample in row `row`; returns the derivatives
/// of displacement and velocity at the end.
fn sweep(
    problem: &Problem,
    experiment: &Experiment,
    view: SimulatedRecord,
    order: &[usize],
    mut row: usize,
    steps: Range<usize>,
    take: &mut impl FnMut(RowBlock) -> RowBlock,
) -> Vec<[f64; 2]> {
    let layout = SensitivityLayout::new(&problem.functions, order, experiment);
    let is_later = steps.start > 0;
    let positions = order.len() + 2 * usize::from(is_later);
    let mut tangents = match is_later {
        false => layout.tangents(),
        true => layout.tangents_from_any_state(),
    };
    let mut readers = Vec::with_capacity(experiment.channels.len());
    for channel in &experiment.channels {
        let is_before = |i: &usize| channel.position(view, *i).step < steps.start;
        let first = match steps.start {
            0 => 0,
            _ => (0..channel.len()).take_while(is_before).count(),
        };
        let mut block = RowBlock::new(positions);
        block.restart(row + first);
        readers.push((JacobianRows::new(channel, view, first), block));
        row += channel.len();
    }
    let mut give = |block: &mut RowBlock| {
        let next = block.first + block.count;
        let full = std::mem::take(block);
        *block = take(full);
        block.restart(next);
    };
    let mut from = steps.start;
    let mut last = 0;
    while from < steps.end {
        let to = (from + TILE).min(steps.end);
        layout.set_perturbations(&mut tangents, from, from == steps.start);
        tangents.advance(view.driven(), view.response, from..to);
        for (reader, block) in &mut readers {
            while reader.read(&tangents, from..to, block) {
                give(block);
            }
        }
        last = to - from;
        from = to;
    }
    for (_, block) in &mut readers {
        if block.count > 0 {
            give(block);
        }
    }
    let end = |position: usize| {
        let [y, v] = tangents.states(position / LANES)[last];
        [y[position % LANES], v[position % LANES]]
    };
    (0..positions).map(end).collect()
}

/// Adds the derivatives with respect to the sensor parameters of one channel to its rows from `row`, and filters them.
fn add_sensor(channel: &Channel, view: SimulatedRecord, row: usize, jacobian: &mut DMatrix<f64>) {
    let parameters = jacobian.ncols();
    let scalars = parameters - view.scalars.len();
    let sensor = channel.sensor();
    if sensor.is_estimated() {
        for i in 0..channel.len() {
            let factors = channel.sensor_factors(view, i, channel.observed_value(view, i));
            for (index, factor) in sensor.indices().into_iter().zip(factors) {
                if let Some(index) = index {
                    jacobian[(row + i, scalars + index)] += factor;
                }
            }
        }
    }
    if !channel.filter().is_empty() {
        for j in 0..parameters {
            let mut column = jacobian.column_mut(j);
            let rows = &mut column.as_mut_slice()[row..row + channel.len()];
            let filtered = channel.filtered(rows);
            rows.copy_from_slice(&filtered);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Parameterization};
    use crate::objective::GradientKind;
    use crate::record::ChannelKind;
    use crate::record::Weighting;
    use crate::structure::{Law, Structure};
    use crate::system::Method;
    use crate::system::{Excitation, Grid, State, System};

    const NODES: usize = 70;

    /// Two records with coefficient sets that differ in their stiffness, the second over the first `nodes` nodes of the grid,
    /// each with a displacement at every third node and `count` accelerations from the first node.
    fn problem(with_knots: bool, nodes: usize, count: usize) -> Problem {
        let grid = Grid::new(0.0, 7.0, NODES).expect("a grid");
        let function = |quantity, knots: u32, start: f64| match with_knots {
            false => CoefficientFunction::constant(quantity, start, NODES),
            true => {
                let spacing = grid.duration() / f64::from(knots - 1);
                let knots = (0..knots).map(|i| f64::from(i) * spacing).collect();
                let basis = Basis::PiecewiseLinear { knots };
                let start = vec![start; basis.parameters(&grid)];
                CoefficientFunction::free(quantity, basis, &grid, start)
            }
        };
        let list = vec![
            CoefficientFunction::constant(CoefficientKind::MASS, 1.3, NODES),
            function(CoefficientKind::DAMPING, 5, 0.2),
            function(CoefficientKind::STIFFNESS, 20, 2.0),
            function(CoefficientKind::STIFFNESS, 20, 3.0),
        ];
        let coefficient_sets = vec![vec![0, 1, 2], vec![0, 1, 3]];
        let functions =
            Parameterization::with_coefficient_sets(list, coefficient_sets, NODES, grid.step());
        let force: Vec<f64> = grid.times().iter().map(|t| (3.0 * t).sin()).collect();
        let record = |coefficient_set: usize, nodes: usize| {
            let channel = |kind, at: Vec<usize>| {
                let times: Vec<f64> = at.iter().map(|i| grid.time(*i)).collect();
                let values = times.iter().map(|t| (2.0 * t).cos()).collect();
                let weighting = Weighting::Sigma(0.1);
                Channel::new(kind, times, values, weighting, &grid, nodes).expect("samples")
            };
            let accelerations = (0..count.min(nodes)).collect();
            let thirds = (0..nodes).step_by(3).collect();
            Experiment {
                coefficient_set,
                ..Experiment::free("driven", State::rest(1), nodes)
                    .with_excitation(Excitation::force_at_nodes(&force))
                    .with_channel(channel(ChannelKind::Acceleration, accelerations))
                    .with_channel(channel(ChannelKind::Displacement, thirds))
            }
        };
        let system = System {
            grid,
            method: Method::Rk4,
            structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
        };
        let records = vec![record(0, NODES), record(1, nodes)];
        Problem::new(system, functions.expect("functions"), records).unwrap()
    }

    /// Covers the ends of tiles, of lanes and of records, and returned blocks with arbitrary contents.
    #[test]
    fn row_blocks_form_the_jacobian_that_agrees_with_the_gradient() {
        let lengths = [1, 7, 8, 9, 64, 65, 66, NODES];
        for (with_knots, nodes) in [(true, 5), (true, 65), (false, 9), (false, NODES)] {
            for count in lengths {
                let problem = problem(with_knots, nodes, count);
                let theta = problem.start();
                let evaluation = problem.evaluate(&theta).expect("a motion");
                let expected = problem.jacobian_by_columns(&evaluation);
                let order = problem.positions();
                let mut found = DMatrix::zeros(expected.nrows(), expected.ncols());
                problem.each_row_block(&evaluation, &order, |mut block| {
                    for (position, j) in order.iter().enumerate() {
                        if position < block.begun() {
                            let rows = block.first..block.first + block.count;
                            let column = &mut found.column_mut(*j);
                            column.as_mut_slice()[rows].copy_from_slice(block.column(position));
                        }
                        block.column_mut(position).fill(f64::NAN);
                    }
                    block
                });
                for (found, expected) in found.column_iter().zip(expected.column_iter()) {
                    let size = expected.amax();
                    assert!((found - expected).amax() <= 1e-12 * size, "{nodes} {count}");
                }
                let slopes: Vec<f64> = (problem.experiments.iter().zip(&evaluation.predictions))
                    .flat_map(|(e, predicted)| e.channels.iter().zip(predicted))
                    .flat_map(|(channel, predicted)| channel.slopes(predicted))
                    .collect();
                let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete);
                for (column, slope) in expected.column_iter().zip(&gradient.euclidean) {
                    let parts = column.iter().zip(&slopes).map(|(a, s)| a * s);
                    let (sum, size) =
                        parts.fold((0.0, 0.0), |(sum, size), p: f64| (sum + p, size + p.abs()));
                    assert!((slope - sum).abs() <= 1e-12 * size, "{nodes} {count}");
                }
            }
        }
    }
}
