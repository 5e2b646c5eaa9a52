//! Columns of parameters of records, and of what sensors may add to their samples.

use super::addition::Addition;
use super::second_mode::{Mode, ModeSamples};
use crate::alternatives::{RecordColumns, Span, record_parameters};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::Spectrum;
use crate::simd::sum::rms;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Frequencies of the mains, Hz.
const MAINS: [f64; 2] = [50.0, 60.0];
/// Peaks of the spectrum of the residuals that are looked at for a second mode, and distances from each, in spacings of frequencies.
const PEAKS: usize = 3;
const BESIDE_PEAK: [f64; 3] = [-0.4, 0.0, 0.4];
/// Damping ratios of a second mode that are looked at.
const RATIOS: [f64; 3] = [0.003, 0.01, 0.03];
/// Fewest periods of a second mode in a record.
const PERIODS: f64 = 4.0;

/// What is added, with the derivatives of the weighted residuals in its parameters, or with other residuals.
pub(super) struct Column {
    pub(super) addition: Addition,
    pub(super) columns: Vec<DVector<f64>>,
    pub(super) searched: usize,
}

/// Parameters of records, and what their sensors may add to the samples.
pub(super) fn of_records(problem: &Problem, evaluation: &Evaluation) -> Vec<Column> {
    let parameters = record_parameters(problem);
    let columns = RecordColumns::of(problem, evaluation, &parameters);
    let of_parameters = parameters.iter().filter_map(|parameter| {
        let column = columns.column(problem, evaluation, *parameter)?;
        Some(Column {
            addition: Addition::Record(*parameter),
            columns: vec![DVector::from_vec(column)],
            searched: 0,
        })
    });
    let mut all: Vec<Column> = of_parameters.collect();
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for c in 0..experiment.channels.len() {
            let tones = MAINS.into_iter();
            let tones = tones.map(|frequency| Addition::Tone {
                experiment: e,
                channel: c,
                frequency,
            });
            let curve = Addition::SensorCurve {
                experiment: e,
                channel: c,
            };
            all.extend(tones.chain([curve]).map(|addition| Column {
                addition,
                columns: added_columns(problem, evaluation, &columns, addition),
                searched: 0,
            }));
        }
    }
    all
}

/// Weighted columns of what a sensor adds to its samples: a tone, or a square and a cube of the response.
pub(super) fn added_columns(
    problem: &Problem,
    evaluation: &Evaluation,
    columns: &RecordColumns,
    addition: Addition,
) -> Vec<DVector<f64>> {
    let rows = |(e, c): (usize, usize), value: &dyn Fn(usize) -> f64| {
        let count = problem.experiments[e].channels[c].len();
        let own = (0..count).map(value).collect();
        DVector::from_vec(columns.weighted(problem, (e, c), own))
    };
    match addition {
        Addition::SensorCurve {
            experiment: e,
            channel: c,
        } => {
            let predicted = &evaluation.predictions[e][c];
            let size = rms(predicted).max(f64::MIN_POSITIVE);
            let powers = [2, 3].map(|power| rows((e, c), &|i| (predicted[i] / size).powi(power)));
            powers.into()
        }
        Addition::Tone {
            experiment: e,
            channel: c,
            frequency,
        } => {
            let times = problem.experiments[e].channels[c].times();
            let phase = |i: usize| TAU * frequency * (times[i] - times[0]);
            vec![
                rows((e, c), &|i| phase(i).cos()),
                rows((e, c), &|i| phase(i).sin()),
            ]
        }
        _ => Vec::new(),
    }
}

/// Weighted columns of a mode of a channel.
pub(super) fn mode_columns(
    problem: &Problem,
    columns: &RecordColumns,
    samples: &ModeSamples,
    (e, c): (usize, usize),
    mode: Mode,
) -> Vec<DVector<f64>> {
    let own = samples.columns(mode);
    let weighted = own.column_iter().map(|column| {
        let column = column.iter().copied().collect();
        DVector::from_vec(columns.weighted(problem, (e, c), column))
    });
    weighted.collect()
}

/// The second mode in each channel that leaves the least squares.
pub(super) fn second_modes(
    problem: &Problem,
    evaluation: &Evaluation,
    span: &Span,
    rest: &DVector<f64>,
) -> Vec<Column> {
    let columns = RecordColumns::of(problem, evaluation, &[]);
    let mut all = Vec::new();
    let mut rows = problem.channel_samples().into_iter();
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for c in 0..experiment.channels.len() {
            let Some(rows) = rows.next() else {
                continue;
            };
            let Some(samples) = ModeSamples::of(problem, e, c) else {
                continue;
            };
            let Some(spectrum) = Spectrum::of(&rest.as_slice()[rows], samples.spacing) else {
                continue;
            };
            let mut best: Option<(f64, Mode, Vec<DVector<f64>>)> = None;
            for mode in modes(&spectrum) {
                let found = mode_columns(problem, &columns, &samples, (e, c), mode);
                let gain = span.gain(&found, rest);
                if best.as_ref().is_none_or(|(most, ..)| gain > *most) {
                    best = Some((gain, mode, found));
                }
            }
            all.extend(best.map(|(_, mode, columns)| Column {
                addition: Addition::SecondMode {
                    experiment: e,
                    channel: c,
                    mode,
                },
                columns,
                searched: 2,
            }));
        }
    }
    all
}

/// Modes at the highest peaks of a spectrum.
fn modes(spectrum: &Spectrum) -> Vec<Mode> {
    let resolution = spectrum.resolution();
    let density: Vec<(f64, f64)> = spectrum
        .frequencies()
        .zip(spectrum.density().iter().copied())
        .collect();
    let is_peak = |i: usize| {
        let at = |i: usize| density.get(i).map_or(0.0, |(_, d)| *d);
        at(i) >= at(i.wrapping_sub(1)) && at(i) > at(i + 1)
    };
    let mut peaks: Vec<(f64, f64)> = (0..density.len())
        .filter(|i| is_peak(*i) && density[*i].0 > PERIODS * resolution)
        .map(|i| density[i])
        .collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found = Vec::new();
    for (peak, _) in peaks.into_iter().take(PEAKS) {
        for apart in BESIDE_PEAK {
            found.extend(RATIOS.map(|ratio| [peak + apart * resolution, ratio]));
        }
    }
    found
}
