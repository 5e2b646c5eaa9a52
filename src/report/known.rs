//! What a fit is worth: how well the readings determine what was found, and what it says of records that it has not seen.

use super::meaning::Doubts;
use super::measured::{self, HalfStep, StatisticsSummary};
use super::seen::SeenChannel;
use crate::config::{HoldOut, Model};
use kmcfit_core::internals::dynamics::Breakdown;
use kmcfit_core::internals::identifiability::{BandSettings, Bands, Judgement, verdicts};
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{Fit, Solver, Status, predict_held_out};
use nalgebra::DMatrix;

/// Up to so many free values the bands are computed with every fit: some milliseconds.
const FEW_PARAMETERS: usize = 64;

/// How well the readings determine what was found: computed once, told in several places.
#[derive(Debug, Clone)]
pub struct Known {
    pub(super) half_step: HalfStep,
    pub(super) statistics: StatisticsSummary,
    /// `None` for the equation error, which simulates no motion to doubt.
    pub(super) doubts: Option<Doubts>,
    pub(super) covariance: Option<DMatrix<f64>>,
    pub(super) bands: Option<Bands>,
    pub(super) judgements: Vec<Judgement>,
    /// What is said of the records that took no part.
    pub(super) held_out: Vec<HeldOut>,
}

impl Known {
    /// For a simulated motion; errors, bands and judgements for up to 64 free values, and only where they can be
    /// believed.
    pub fn of(model: &Model, fit: &Fit) -> Self {
        let (problem, best) = (&model.problem, &fit.best);
        let mut known = Self {
            half_step: Ok(None),
            statistics: StatisticsSummary::default(),
            doubts: None,
            covariance: None,
            bands: None,
            judgements: Vec::new(),
            held_out: model
                .held_out
                .iter()
                .map(|out| HeldOut::of(model, fit, out))
                .collect(),
        };
        if model.settings.solver == Solver::EquationError {
            return known;
        }
        known.half_step = measured::refined(problem, &best.evaluation);
        known.statistics = measured::statistics(problem, &best.evaluation);
        let few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let tells_errors = few && problem.reading_count() > problem.parameters();
        let mut doubts = Doubts::of(
            problem,
            &best.evaluation,
            &known.half_step,
            &known.statistics,
            tells_errors,
        );
        if fit.outcome.status == Status::Failed {
            doubts.no_device = Some("the device is not identified: the fit failed".into());
            doubts.errors_hold = false;
        }
        if tells_errors && doubts.errors_hold {
            let settings = BandSettings {
                draws: 0,
                ..BandSettings::default()
            };
            let bands = Bands::at(problem, &best.parameters, &best.evaluation, &settings);
            known.judgements = verdicts(problem, &best.evaluation, &bands);
            known.bands = Some(bands);
            known.covariance = problem.covariance(&best.evaluation);
        }
        known.doubts = Some(doubts);
        known
    }
}

/// A record that took no part in the fit, and what the found device says of it.
#[derive(Debug, Clone)]
pub(super) struct HeldOut {
    /// The record.
    pub out: HoldOut,
    /// The problem of that record alone and its point; what the record leaves open is found from its own readings.
    pub found: Result<(Problem, Evaluation), Breakdown>,
}

impl HeldOut {
    fn of(model: &Model, fit: &Fit, out: &HoldOut) -> Self {
        Self {
            out: out.clone(),
            found: predict_held_out(
                &model.problem,
                &fit.best.evaluation,
                &out.experiment,
                &out.scalars,
                &model.settings,
            ),
        }
    }

    /// Its channels; none where there is no motion.
    pub fn channels(&self) -> Vec<SeenChannel<'_>> {
        let Ok((problem, evaluation)) = &self.found else {
            return Vec::new();
        };
        let predictions = evaluation.predictions.iter().flatten();
        let channels = problem.channels().zip(predictions).enumerate();
        channels
            .map(|(i, (channel, predicted))| SeenChannel {
                channel,
                predicted,
                note: self.out.notes.get(i),
            })
            .collect()
    }
}
