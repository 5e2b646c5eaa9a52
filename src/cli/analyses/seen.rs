//! What the readings see: the spectrum of the sensitivity, bands and verdicts.

use crate::config::StudyPlan;
use crate::report::findings;
use crate::report::study::*;
use kmcfit_core::internals::assessment::Plausibility;
use kmcfit_core::internals::diagnostics::normal_half_width;
use kmcfit_core::internals::functions::Ratios;
use kmcfit_core::internals::identifiability::{
    self, BandSettings, Bands, Gauge, Sensitivity, Spectrum, anchors, verdicts,
};
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::system::NodalCoefficients;

/// Directions that are drawn of each end of the spectrum.
const DIRECTIONS: usize = 3;
/// Unseen directions that are named one by one.
const NAMED: usize = 400;
/// Draws of the simultaneous bands.
const DRAWS: usize = 10_000;

fn known(values: &[f64]) -> Numbers {
    let finite = |x: &f64| x.is_finite().then_some(*x);
    values.iter().map(finite).collect()
}

/// What the readings see.
pub fn spectrum(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> SpectrumPiece {
    let spectrum: Spectrum = Sensitivity::of(problem, evaluation).spectrum();
    let gauge = Gauge::at(problem, theta);
    let mut unseen = gauge.unseen(&spectrum);
    unseen.truncate(NAMED);
    let record = |seen: identifiability::Seen| DirectionRecord {
        singular_value: seen.singular_value,
        functions: seen.functions,
    };
    SpectrumPiece {
        sentence: spectrum.sentence(),
        rank: spectrum.rank(),
        of: spectrum.of(),
        unseen: (unseen.into_iter())
            .map(|named| NamedRecord {
                name: named.name,
                share: named.share,
            })
            .collect(),
        times: problem.oscillator.grid.times(),
        best: (spectrum.best(problem, DIRECTIONS).into_iter())
            .map(record)
            .collect(),
        worst: (spectrum.worst(problem, DIRECTIONS).into_iter())
            .map(record)
            .collect(),
        singular_values: spectrum.singular_values().to_vec(),
    }
}

/// Bands, verdicts and anchors.
pub fn bands(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    plan: &StudyPlan,
    truth: Option<&NodalCoefficients>,
) -> BandsPiece {
    let settings = BandSettings {
        draws: DRAWS,
        seed: plan.seed,
    };
    let bands = Bands::at(problem, theta, evaluation, &settings);
    let factor = normal_half_width(plan.confidence);
    let plausibility = Plausibility::at(problem, evaluation);
    let judged = match plausibility.errors_hold {
        true => verdicts(problem, evaluation, &bands),
        false => Vec::new(),
    };
    let mut notes = bands.notes.clone();
    notes.extend(plausibility.unidentified.iter().map(findings::unidentified));
    notes.extend(plausibility.warnings.iter().map(findings::warning));
    let ratios = truth.map(Ratios::of);
    let list = bands.functions.iter().chain(&bands.ratios);
    let records = list.enumerate().map(|(i, band)| {
        let ends = |factor: f64| -> [Numbers; 2] {
            let each: Vec<[f64; 2]> = (0..band.values.len())
                .map(|t| band.ends(t, factor))
                .collect();
            [0, 1].map(|side| known(&each.iter().map(|e| e[side]).collect::<Vec<f64>>()))
        };
        let [low, high] = ends(factor);
        let [simultaneous_low, simultaneous_high] = match band.simultaneous {
            Some(factor) => ends(factor),
            None => [Vec::new(), Vec::new()],
        };
        let true_values: Option<&[f64]> = match band.name.as_str() {
            "k/m" => ratios.as_ref().map(|r| r.k_over_m.as_slice()),
            "c/m" => ratios.as_ref().map(|r| r.c_over_m.as_slice()),
            "natural frequency" => ratios.as_ref().map(|r| r.frequency.as_slice()),
            "damping ratio" => ratios.as_ref().map(|r| r.damping_ratio.as_slice()),
            _ => truth.and_then(|t| t.functions().nth(i)),
        };
        BandRecord {
            name: band.name.clone(),
            unit: band.unit.clone(),
            values: known(&band.values),
            low,
            high,
            simultaneous_low,
            simultaneous_high,
            truth: true_values.map(known).unwrap_or_default(),
            notes: band.notes.clone(),
        }
    });
    let grid = &problem.oscillator.grid;
    let fixed = evaluation.trajectories.first().map(|m| anchors(grid, m));
    BandsPiece {
        times: bands.times.clone(),
        bands: records.collect(),
        notes,
        verdicts: (judged.into_iter())
            .map(|j| JudgementRecord {
                verdict: j.verdict.name().into(),
                name: j.name,
                sentence: j.sentence,
            })
            .collect(),
        turning_points: fixed
            .as_ref()
            .map_or(Vec::new(), |a| a.turning_points.clone()),
        zero_crossings: fixed.map_or(Vec::new(), |a| a.zero_crossings),
    }
}
