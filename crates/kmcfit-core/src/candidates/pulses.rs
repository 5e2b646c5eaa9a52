//! Errors of single samples of a measured force: a spike, a cut peak, a lost sample, or an unmeasured impact.
//!
//! An error `p_j` of sample `j` of the force adds the response to a triangular pulse, with the derivatives `G_j` of the weighted and whitened
//! residuals. Orthogonally to the derivatives of the model, the pulse with the largest score
//!
//! ```text
//! t_j = -z_j^T e / (|z_j| s),    s^2 = e^T e / (n - q - k)
//! ```
//!
//! is removed from the residuals `e` until no score is significant (orthogonal matching pursuit, Pati et al. 1993). Few pulses that leave no
//! significant one explain the residuals; a missing term or a varying coefficient leaves many.

use super::addition::Addition;
use super::record_columns::Column;
use crate::alternatives::{Span, extended, measured, weighted_residuals};
use crate::functions::{CoefficientFunction, CoefficientKind};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::signal::Signal;
use crate::solvers::weighted_jacobian;
use crate::structure::Law;
use crate::system::{Grid, InputQuantity};
use nalgebra::{DMatrix, DVector};

/// Smallest score of a first pulse: the largest of 10,000 standard normal numbers exceeds it with a probability of 0.0004.
const SIGNIFICANT: f64 = 5.5;
/// Smallest score of a first pulse that restores a cut peak, at the largest or smallest value: one of two standard normal numbers exceeds
/// it with a probability of 0.0005.
const CUT: f64 = 3.5;
/// Score of a pulse above which the residuals are not yet explained.
const REMAINS: f64 = 4.5;
/// Largest number of pulses that explain residuals.
const MOST: usize = 8;
/// Largest number of derivatives, 8 bytes each.
const MOST_DERIVATIVES: usize = 4_000_000;
/// Part of the derivatives of a pulse outside the span of the others below which it is no candidate.
const APART: f64 = 1e-3;

/// The errors of few samples of the force that explain the residuals of a problem with one record; `None` where there are none, for a long
/// record, and with a static force or a stated error of the input.
pub(super) fn pulses(problem: &Problem, theta: &[f64]) -> Option<Column> {
    let [experiment] = problem.experiments.as_slice() else {
        return None;
    };
    let (quantity, signal) = measured(experiment)?;
    let is_force = quantity == InputQuantity::Force && experiment.input_error.is_none();
    let mut kinds = problem.functions.iter().map(|f| f.quantity);
    let has_static_force = kinds.any(|kind| kind == CoefficientKind::STATIC_FORCE);
    let nodes = problem.functions.nodes();
    let count = problem.sample_count();
    let is_short = nodes.saturating_mul(count) <= MOST_DERIVATIVES;
    let is_few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
    (is_force && !has_static_force && is_short && is_few).then_some(())?;
    let pulses = CoefficientFunction::nodal(CoefficientKind::STATIC_FORCE, vec![0.0; nodes]);
    let (extended, at) = extended(problem, theta, vec![(pulses, Law::Offset)])?;
    let evaluation = extended.evaluate(&at).ok()?;
    let jacobian = weighted_jacobian(&extended, &evaluation);
    let first = problem.functions.scalar_range().start;
    let own: Vec<usize> = (0..first).chain(first + nodes..jacobian.ncols()).collect();
    let model = Span::of(jacobian.select_columns(&own));
    // A static force acts against positive displacements.
    let mut by_sample = DMatrix::zeros(jacobian.nrows(), signal.times().len());
    for (node, sample, share) in hats(&problem.system.grid, nodes, signal) {
        by_sample
            .column_mut(sample)
            .axpy(-share, &jacobian.column(first + node), 1.0);
    }
    drop(jacobian);
    let residuals = model.orthogonal(weighted_residuals(&extended, &evaluation));
    let found = pursuit(
        &model,
        by_sample.clone(),
        residuals,
        own.len(),
        &peaks(signal.values()),
    )?;
    let (sample, error) = found
        .iter()
        .copied()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let peaks = peaks(signal.values());
    let is_peak = found.len() == 1 && peaks.iter().any(|(peak, _)| *peak == sample);
    let columns = found.iter().map(|(j, _)| by_sample.column(*j).into_owned());
    Some(Column {
        addition: Addition::InputPulses {
            count: found.len(),
            time: *signal.times().get(sample)?,
            error,
        },
        columns: columns.collect(),
        // A peak is one of few places.
        searched: if is_peak { 0 } else { found.len() },
    })
}

/// Samples at the largest positive value, with the sign 1, and at the smallest negative one, with the sign -1.
fn peaks(values: &[f64]) -> Vec<(usize, f64)> {
    let largest = values.iter().fold(0.0f64, |most, f| most.max(*f));
    let smallest = values.iter().fold(0.0f64, |least, f| least.min(*f));
    // Noise about a force of one sign has no peak on the other side.
    let [smallest, largest] = match largest > -smallest {
        true => [smallest.min(-0.5 * largest), largest],
        false => [smallest, largest.max(-0.5 * smallest)],
    };
    let signs = values.iter().map(|f| match *f {
        f if f == largest => 1.0,
        f if f == smallest => -1.0,
        _ => 0.0,
    });
    let found: Vec<(usize, f64)> = signs.enumerate().filter(|(_, sign)| *sign != 0.0).collect();
    // A level that is held is no peak.
    if found.len() > MOST {
        Vec::new()
    } else {
        found
    }
}

/// Values at the nodes of signals that are 1 at one of the samples and 0 at the others, as node, sample and value other than 0.
fn hats(grid: &Grid, nodes: usize, signal: &Signal) -> Vec<(usize, usize, f64)> {
    let times = signal.times();
    let mut hats = Vec::with_capacity(2 * nodes);
    for node in 0..nodes {
        let t = grid.time(node);
        let right = times.partition_point(|time| *time <= t);
        match (right.checked_sub(1), times.get(right)) {
            (Some(left), Some(next)) => {
                let share = (t - times[left]) / (next - times[left]);
                hats.push((node, left, 1.0 - share));
                hats.push((node, right, share));
            }
            (Some(last), None) => hats.push((node, last, 1.0)),
            (None, _) => {}
        }
    }
    hats.retain(|(.., share)| *share != 0.0);
    hats
}

/// Indices and sizes of the columns that explain the residuals; `None` where none is significant, or more than [`MOST`] are. The first one may be
/// that of a cut peak.
fn pursuit(
    model: &Span,
    mut columns: DMatrix<f64>,
    mut residuals: DVector<f64>,
    parameters: usize,
    peaks: &[(usize, f64)],
) -> Option<Vec<(usize, f64)>> {
    let sizes: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
    model.make_orthogonal(&mut columns);
    let mut found = Vec::new();
    for threshold in std::iter::once(SIGNIFICANT).chain([REMAINS; MOST]) {
        let left = residuals.len().checked_sub(parameters + found.len() + 1)?;
        let deviation = (residuals.norm_squared() / left.max(1) as f64).sqrt();
        let products = columns.tr_mul(&residuals);
        let scores = columns.column_iter().enumerate().map(|(j, column)| {
            let norm = column.norm();
            let is_apart = norm > APART * sizes[j];
            match is_apart {
                true => products[j] / (norm * deviation),
                false => 0.0,
            }
        });
        let scores: Vec<f64> = scores.collect();
        let largest = scores.iter().copied().enumerate();
        let (mut best, score) = largest.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        score.is_finite().then_some(())?;
        if score.abs() < threshold {
            // The pulse, against the score, restores a cut peak.
            let cut = peaks.iter().map(|(j, sign)| (*j, -sign * scores[*j]));
            let cut = cut.max_by(|a, b| a.1.total_cmp(&b.1));
            match cut.filter(|(_, score)| found.is_empty() && *score >= CUT) {
                Some((peak, _)) => best = peak,
                None => return (!found.is_empty()).then_some(found),
            }
        }
        let column = columns.column(best).clone_owned();
        let square = column.norm_squared();
        found.push((best, -products[best] / square));
        residuals -= &column * (products[best] / square);
        let shares = columns.tr_mul(&column) / square;
        columns -= &column * shares.transpose();
    }
    None
}
