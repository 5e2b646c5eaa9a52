//! The derivatives of all predictions with respect to all parameters, from tangents in lanes.

mod moving;
mod reader;

use super::{Channel, Evaluation, View};
use crate::dynamics::{Course, TILE};
use crate::lanes::sum::are_finite;
use crate::lanes::tall::Piece;
use crate::problem::{Experiment, Problem};
use moving::Moving;
use nalgebra::DMatrix;
use reader::Reader;

impl Problem {
    /// The change of every prediction (rows: readings of all channels of all experiments, in order)
    /// along every parameter: [`Problem::predictions_tangent`] of all unit vectors, to rounding.
    pub fn predictions_jacobian(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.reading_count(), self.parameters());
        let order = self.places();
        self.each_piece(evaluation, &order, |piece| {
            for (place, j) in order.iter().enumerate().take(piece.begun()) {
                let mut column = jacobian.column_mut(*j);
                let rows = piece.first..piece.first + piece.count;
                column.as_mut_slice()[rows].copy_from_slice(piece.column(place));
            }
            piece
        });
        self.add_sensors(evaluation, &mut jacobian);
        match are_finite(jacobian.as_slice()) {
            true => jacobian,
            false => self.jacobian_by_columns(evaluation),
        }
    }

    /// One direction after the other: for numbers at the ends of their range, where the order of the
    /// operations decides what is still finite.
    fn jacobian_by_columns(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.reading_count(), self.parameters());
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

    /// The parameter at each place of the tangents: in the order in which they begin to matter, so that
    /// those that have not begun cost nothing.
    pub(crate) fn places(&self) -> Vec<usize> {
        let first = self.functions.first_nodes();
        let mut order: Vec<usize> = (0..self.parameters()).collect();
        order.sort_by_key(|j| first[*j]);
        order
    }

    /// Whether the pieces of [`Problem::each_piece`] are all there is to the Jacobian: nothing of a sensor is
    /// sought, and no channel is filtered.
    pub(crate) fn comes_in_pieces(&self) -> bool {
        let is_plain = |channel: &Channel| {
            channel.filter().is_empty() && channel.sensor().indices().iter().all(Option::is_none)
        };
        self.channels().all(is_plain)
    }

    /// Gives `take` the rows of the Jacobian, some at a time, with the parameters in `order` at their places
    /// ([`Problem::places`]), and without what the sensors and filters do; it returns the piece, or another one, to
    /// go on with. The rows of a channel come in their order, those of several channels in turn.
    pub(crate) fn each_piece(
        &self,
        evaluation: &Evaluation,
        order: &[usize],
        mut take: impl FnMut(Piece) -> Piece,
    ) {
        let mut row = 0;
        for (e, experiment) in self.experiments.iter().enumerate() {
            if experiment.reading_count() > 0 && !order.is_empty() {
                let view = self.view(evaluation, e);
                sweep(self, experiment, view, order, row, &mut take);
            }
            row += experiment.reading_count();
        }
    }

    /// What the sensors that are sought add to a Jacobian, and what the filters make of it.
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

/// Goes through the motion of one experiment, whose first reading has the row `row`.
fn sweep(
    problem: &Problem,
    experiment: &Experiment,
    view: View,
    order: &[usize],
    mut row: usize,
    take: &mut impl FnMut(Piece) -> Piece,
) {
    let moving = Moving::new(&problem.functions, order, experiment);
    let mut tangents = moving.tangents();
    let mut readers = Vec::with_capacity(experiment.channels.len());
    for channel in &experiment.channels {
        let mut piece = Piece::new(order.len());
        piece.restart(row);
        readers.push((Reader::new(channel, view), piece));
        row += channel.len();
    }
    let mut give = |piece: &mut Piece| {
        let next = piece.first + piece.count;
        let full = std::mem::take(piece);
        *piece = take(full);
        piece.restart(next);
    };
    let course = Course {
        oscillator: view.oscillator,
        device: view.device,
        excitation: view.excitation,
        motion: view.motion,
    };
    let steps = view.motion.nodes() - 1;
    let mut from = 0;
    while from < steps {
        let to = (from + TILE).min(steps);
        moving.fill(&mut tangents, from);
        tangents.advance(course, from..to);
        for (reader, piece) in &mut readers {
            while reader.read(&tangents, from..to, piece) {
                give(piece);
            }
        }
        from = to;
    }
    for (_, piece) in &mut readers {
        if piece.count > 0 {
            give(piece);
        }
    }
}

/// What the sensor of one channel adds to its rows, from `row` on, and what its filter makes of them.
fn add_sensor(channel: &Channel, view: View, row: usize, jacobian: &mut DMatrix<f64>) {
    let parameters = jacobian.ncols();
    let scalars = parameters - view.scalars.len();
    for (role, index) in channel.sensor().indices().into_iter().enumerate() {
        let Some(index) = index else {
            continue;
        };
        for i in 0..channel.len() {
            jacobian[(row + i, scalars + index)] += match role {
                0 => channel.sensed(view, i).value,
                1 => 1.0,
                _ => channel.age(i),
            };
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
