//! Refits with what is added to the predictions of a channel: a second mode, a tone, a curve of the sensor.

use super::addition::Addition;
use super::found::Found;
use super::penalised_misfit::Linearised;
use super::record_columns::{added_columns, mode_columns};
use super::second_mode::{Mode, ModeSamples};
use crate::alternatives::RecordColumns;
use crate::problem::Problem;
use nalgebra::DVector;

/// Rounds of a refit with what is added to predictions, and change of the sum of squares at which they end.
const ROUNDS: usize = 12;
const AT_REST: f64 = 1e-8;
/// Relative change of a frequency or a ratio for derivatives.
const SMALL: f64 = 1e-4;
/// Largest change of the logarithm of a frequency and a ratio in a round.
const FARTHEST: [f64; 2] = [0.02, 0.7];

/// Refit with what is added to the predictions of a channel.
pub(super) fn refit(
    problem: &Problem,
    theta: &[f64],
    addition: Addition,
    (e, c): (usize, usize),
) -> Option<Found> {
    let mut theta = theta.to_vec();
    let count = theta.len();
    let mut evaluation = problem.evaluate(&theta).ok()?;
    let samples = ModeSamples::of(problem, e, c);
    let mut mode = match addition {
        Addition::SecondMode { mode, .. } => mode,
        _ => [0.0; 2],
    };
    let mut before = f64::INFINITY;
    let mut best: Option<Found> = None;
    for _ in 0..ROUNDS {
        let columns = RecordColumns::of(problem, &evaluation, &[]);
        let further = |mode: Mode| -> Option<Vec<DVector<f64>>> {
            match addition {
                Addition::SecondMode { .. } => Some(mode_columns(
                    problem,
                    &columns,
                    samples.as_ref()?,
                    (e, c),
                    mode,
                )),
                _ => Some(added_columns(problem, &evaluation, &columns, addition)),
            }
        };
        let linearised = Linearised::at(problem, &evaluation);
        let mut own = further(mode)?;
        let factors = own.len();
        if let Addition::SecondMode { .. } = addition {
            let judged = linearised.squares_with(&own);
            let values = &judged.as_slice()[count..];
            let sum = |columns: &[DVector<f64>]| {
                let mut sum = DVector::zeros(linearised.residuals.len());
                columns
                    .iter()
                    .zip(values)
                    .for_each(|(column, value)| sum.axpy(*value, column, 1.0));
                sum
            };
            let here = sum(&own);
            for j in 0..2 {
                let mut moved = mode;
                moved[j] *= 1.0 + SMALL;
                own.push((sum(&further(moved)?) - &here) / SMALL);
            }
        }
        let judged = linearised.with(&own, 0);
        let squares = judged.squares;
        if !squares.is_finite() || squares > before {
            break;
        }
        let is_at_rest = squares > (1.0 - AT_REST) * before;
        before = squares;
        let change = judged.change.clone();
        let parameters = own.len();
        best = Some(Found {
            additions: vec![match addition {
                Addition::SecondMode { .. } => Addition::SecondMode {
                    experiment: e,
                    channel: c,
                    mode,
                },
                other => other,
            }],
            judged,
            theta: theta.clone(),
            named: Vec::new(),
            parameters,
        });
        if is_at_rest {
            break;
        }
        if let Addition::SecondMode { .. } = addition {
            for j in 0..2 {
                let step = change[count + factors + j].clamp(-FARTHEST[j], FARTHEST[j]);
                mode[j] *= step.exp();
            }
            (mode.iter().all(|x| x.is_finite() && *x > 0.0) && mode[1] < 1.0).then_some(())?;
        }
        theta
            .iter_mut()
            .zip(change.as_slice())
            .for_each(|(a, d)| *a += d);
        evaluation = problem.evaluate(&theta).ok()?;
    }
    best
}
