//! Automatic knots: a spline that is richer than the data need, and a penalty whose weight they choose.

use super::{BuildError, Builder, Record};
use crate::functions::WeightRule;
use crate::model::{KnotSpec, PenaltySpec, WeightChoice};
use crate::problem::FEW_PARAMETERS;
use crate::record::Weighting;
use crate::signal::{Spectrum, median_spacing};
use crate::system::Grid;

/// Most intervals: with a penalty whose weight the data choose, more change neither estimate nor interval.
const INTERVALS: usize = 40;
/// Samples per interval.
const SAMPLES_PER_INTERVAL: usize = 10;
/// Fewest periods of the vibration per interval: a coefficient that varies faster absorbs offsets, harmonics and second modes.
const PERIODS_PER_INTERVAL: f64 = 2.0;
/// Parameters left to the other functions, initial states and sensors, of those for which covariances are computed.
const OTHERS: usize = 12;
/// Order of the penalised derivative.
const ORDER: usize = 2;

impl Builder {
    /// The specification with automatic knots replaced by their number; functions without a penalty are given one on their
    /// curvature, with a weight by restricted likelihood, or for the equation error by the period.
    pub(super) fn with_knots(&self, grid: &Grid) -> Result<Self, BuildError> {
        let automatic = self
            .entries()
            .into_iter()
            .filter(|e| e.spec.has_automatic_knots());
        let keys: Vec<String> = automatic.map(|e| format!("{}.knots", e.key)).collect();
        let mut next = self.clone();
        let Some(key) = keys.first() else {
            return Ok(next);
        };
        let weight = match (self.is_equation_error(), self.without_likelihood()) {
            (true, _) => WeightRule::Period,
            (false, None) => WeightRule::RestrictedLikelihood,
            (false, Some(record)) => {
                let problem = "automatic knots need a likelihood of the samples";
                return Err(BuildError::new(key, problem)
                    .found(format!("no `sigma` in experiments[{record}]"))
                    .expected(
                        "`sigma` in every experiment, a number or `estimate`; or a number of knots",
                    ));
            }
        };
        let samples: usize = (self.records.iter())
            .flat_map(|record| &record.channels)
            .map(|channel| channel.times.len())
            .sum();
        let room = (FEW_PARAMETERS - OTHERS) / keys.len();
        let most = grid.nodes().saturating_sub(5).min(room.saturating_sub(3));
        let slow = self.periods().map_or(usize::MAX, |periods| {
            (periods / PERIODS_PER_INTERVAL) as usize
        });
        // The light penalty of the equation error leaves the smoothness to the knots.
        let richest = if self.is_equation_error() {
            most
        } else {
            INTERVALS
        };
        let intervals = richest
            .min(samples / SAMPLES_PER_INTERVAL)
            .min(most)
            .min(slow)
            .max(1);
        let own = next.records.iter_mut().flat_map(|r| &mut r.coefficients);
        let own = own.map(|(_, spec)| spec);
        let shared = next.functions.iter_mut().map(|function| &mut function.spec);
        for spec in shared.chain(own) {
            if spec.has_automatic_knots() {
                spec.knots = Some(KnotSpec::Count(intervals + 1));
                if spec.penalties().is_empty() {
                    let penalty = PenaltySpec::tikhonov(ORDER, WeightChoice::Rule(weight));
                    *spec = spec.clone().penalty(penalty);
                }
            }
        }
        Ok(next)
    }

    /// Most periods of the dominant frequency of a channel over its samples; `None` without a channel that has one.
    fn periods(&self) -> Option<f64> {
        let channels = self.records.iter().flat_map(|record| &record.channels);
        let periods = channels.filter_map(|channel| {
            let (first, last) = (channel.times.first()?, channel.times.last()?);
            (channel.times.len() > 1).then_some(())?;
            let spectrum = Spectrum::of(&channel.values, median_spacing(&channel.times))?;
            Some(spectrum.dominant() * (last - first))
        });
        periods.reduce(f64::max)
    }

    /// The first record with a channel without standard deviation, validation records excepted.
    pub(super) fn without_likelihood(&self) -> Option<usize> {
        let is_without = |record: &Record| {
            let mut weightings = record.channels.iter().map(|c| c.weighting.as_ref());
            !record.validation && weightings.any(|w| !w.is_some_and(Weighting::is_sigma))
        };
        match self.is_simulation {
            true => None,
            false => self.records.iter().position(is_without),
        }
    }
}
