//! What determines the functions and the number of cycles within gaps of the records.
//!
//! Within a gap of several periods samples determine the integral of the natural frequency, up to whole cycles, and no shape of the
//! function. A narrow band there is the work of the basis or of the penalty: the first widens with a finer basis, and with the second
//! the scatter of the estimate `V_F`, caused by the noise, is a small share of the variance `V_B` that includes the prior.

use super::refinement::FinerBases;
use crate::diagnostics::NORMAL_975;
use crate::functions::WeightRule;
use crate::identifiability::{BandSettings, Bands, IDENTIFIED};
use crate::problem::Problem;
use crate::solvers::{CycleCount, Fit, cycles, gaps, varying_function};
use nalgebra::DVector;
use serde::Serialize;

/// Difference of deviances below which a number of cycles is not rejected, a likelihood ratio of 20.
const ACCEPTED: f64 = 6.0;
/// Share `V_F/V_B` below which the penalty carries a function: about 0.16 to 0.31 inside gaps, 0.6 to 0.9 outside.
const BY_PENALTY: f64 = 1.0 / 3.0;
/// Growth of the standard error with twice as many knots above which the basis carries a function.
const BY_BASIS: f64 = 5.0;
/// Relative step of the differences of the number of cycles.
const STEP: f64 = 1e-6;

/// What determines a function within a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum GapStatus {
    /// The samples outside the gap.
    Identified,
    /// The basis: with twice as many knots the standard error is more than five times as large.
    CarriedByBasis,
    /// The penalty: less than a third of the variance is that of the noise.
    CarriedByPenalty,
    /// Nothing: the band is wide, or several numbers of cycles are possible.
    NotIdentified,
}

/// A function within a gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FunctionInGap {
    /// Index of the function.
    #[serde(skip)]
    pub index: usize,
    /// Name of the function.
    pub function: String,
    /// What determines it.
    pub status: GapStatus,
}

/// A gap of the records.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GapAssessment {
    /// Last sample before the gap and first sample after it, s.
    pub span: [f64; 2],
    /// Number of cycles of the undamped oscillation in it.
    pub cycles: f64,
    /// 95 % interval of the number of cycles, over all numbers that the records do not reject; `None` without a covariance.
    pub ci95: Option<[f64; 2]>,
    /// Number of fits with other numbers of cycles that the records do not reject.
    pub other_counts: usize,
    /// The functions that vary over time.
    pub functions: Vec<FunctionInGap>,
}

/// Assesses all gaps of the records of a fit; without `bands` nothing within them is identified.
pub(super) fn gap_assessments(
    problem: &Problem,
    fit: &Fit,
    bands: Option<&Bands>,
) -> Vec<GapAssessment> {
    let spans = gaps(problem, &fit.best.evaluation.nodal);
    if spans.is_empty() {
        return Vec::new();
    }
    let widths = bands.map(|bands| Widths::of(problem, fit, bands));
    let each = spans.into_iter().map(|span| {
        let compared = fit.gaps.iter().find(|gap| gap.span == span);
        let others = compared.map_or(&[][..], |gap| &gap.counts[1..]);
        let accepted: Vec<CycleCount> = (others.iter().copied())
            .filter(|count| count.deviance < ACCEPTED)
            .collect();
        let own = cycles(problem, &fit.best.evaluation.nodal, span);
        let all = 0..problem.functions.ranges().len();
        let varying = all.filter(|f| problem.functions.get(*f).parameters() > 1);
        let functions = varying.map(|index| FunctionInGap {
            index,
            function: problem.functions.get(index).name(),
            status: match &widths {
                Some(widths) if accepted.is_empty() || varying_function(problem) != Some(index) => {
                    widths.status(problem, fit, index, span)
                }
                _ => GapStatus::NotIdentified,
            },
        });
        GapAssessment {
            span,
            cycles: own,
            ci95: bands
                .and_then(|bands| standard_error(problem, fit, bands, span))
                .map(|error| {
                    let all = accepted.iter().map(|count| count.cycles).chain([own]);
                    let [low, high] =
                        all.fold([own; 2], |[low, high], n| [low.min(n), high.max(n)]);
                    [low - NORMAL_975 * error, high + NORMAL_975 * error]
                }),
            other_counts: accepted.len(),
            functions: functions.collect(),
        }
    });
    each.collect()
}

/// Standard error of the number of cycles, by the delta method.
fn standard_error(problem: &Problem, fit: &Fit, bands: &Bands, span: [f64; 2]) -> Option<f64> {
    let covariance = bands.covariance.as_ref()?;
    let theta = &fit.best.parameters;
    let slopes: Vec<f64> = (0..theta.len())
        .map(|j| {
            let step = STEP * theta[j].abs().max(STEP);
            let at = |step: f64| {
                let mut moved = theta.clone();
                moved[j] += step;
                cycles(problem, &problem.functions.nodal(&moved), span)
            };
            (at(step) - at(-step)) / (2.0 * step)
        })
        .collect();
    let slopes = DVector::from_vec(slopes);
    Some((covariance * &slopes).dot(&slopes).max(0.0).sqrt())
}

/// Bands under other assumptions, with which those of the fit are compared.
struct Widths<'a> {
    /// Those of the fit.
    own: &'a Bands,
    /// From the noise alone, and with the prior of the penalties.
    penalised: Option<[Bands; 2]>,
    /// With finer bases.
    finer: Option<Bands>,
}

impl<'a> Widths<'a> {
    fn of(problem: &Problem, fit: &Fit, own: &'a Bands) -> Self {
        let settings = BandSettings {
            draws: 0,
            ..BandSettings::default()
        };
        let theta = &fit.best.parameters;
        let bands = |problem: &Problem| Bands::at(problem, theta, &fit.best.evaluation, &settings);
        let with_rule = |rule: Option<WeightRule>| {
            let mut own = problem.clone();
            let penalties = &mut own.parts_mut().penalties;
            penalties.iter_mut().for_each(|p| p.rule = rule);
            bands(&own)
        };
        let is_penalised = !problem.penalties.is_empty();
        let rules = [None, Some(WeightRule::RestrictedLikelihood)];
        Self {
            own,
            penalised: is_penalised.then(|| rules.map(with_rule)),
            finer: FinerBases::new(problem, theta).and_then(|finer| finer.bands(&settings)),
        }
    }

    fn status(
        &self,
        problem: &Problem,
        fit: &Fit,
        index: usize,
        [from, to]: [f64; 2],
    ) -> GapStatus {
        let bands = self.own;
        let inside = |bands: &Bands| -> Vec<usize> {
            let each = 0..bands.times.len();
            each.filter(|i| (from..=to).contains(&bands.times[*i]))
                .collect()
        };
        let mean = |bands: &Bands| {
            let nodes = inside(bands);
            let errors = nodes
                .iter()
                .map(|i| bands.functions[index].standard_error[*i].powi(2));
            errors.sum::<f64>() / nodes.len().max(1) as f64
        };
        let size = problem.median_scales(&fit.best.evaluation)[index];
        let own = &bands.functions[index];
        let is_known = |i: &usize| own.half_width(*i) <= IDENTIFIED * size;
        if !inside(bands).iter().all(is_known) {
            return GapStatus::NotIdentified;
        }
        let is_penalised = problem.penalties.iter().any(|p| p.function == index);
        match (&self.penalised, &self.finer) {
            (Some([noise, prior]), _) if is_penalised => {
                match mean(noise) < BY_PENALTY * mean(prior) {
                    true => GapStatus::CarriedByPenalty,
                    false => GapStatus::Identified,
                }
            }
            (_, Some(finer)) if mean(finer) <= BY_BASIS.powi(2) * mean(bands) => {
                GapStatus::Identified
            }
            _ => GapStatus::CarriedByBasis,
        }
    }
}
