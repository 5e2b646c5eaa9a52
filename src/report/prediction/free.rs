//! Free responses of an identified system from given initial states, with 95 % bands for the errors of its parameters.

use super::identified::system_of;
use crate::report::chart::Figure;
use crate::report::{CsvTable, Run, figures, prediction_table};
use kmcfit_core::number_format::significant;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Weighting};
use kmcfit_core::step::SimulationError;
use kmcfit_core::study::{PredictedResponse, PredictionSummary, predict};
use kmcfit_core::system::State;
use serde::Serialize;

/// Free responses from several initial states.
pub struct FreePredictions {
    /// Responses at the nodes of the run.
    responses: Vec<PredictedResponse>,
    /// 95 % band of each at the nodes; `None` without a covariance of the parameters.
    bands: Vec<Option<Vec<[f64; 2]>>>,
    times: Vec<f64>,
    is_rotation: bool,
}

/// Key numbers of a free response with their 95 % bands, SI.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeSummary {
    #[serde(flatten)]
    summary: PredictionSummary,
    /// Band of the peak displacement; none without a covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_95: Option<[f64; 2]>,
    /// Band of the displacement at the last node.
    #[serde(skip_serializing_if = "Option::is_none")]
    last_95: Option<[f64; 2]>,
}

impl FreePredictions {
    /// Responses of a run from each of the states.
    ///
    /// # Errors
    /// A [`SimulationError`] if a simulation fails.
    pub fn of(run: &Run, states: &[State]) -> Result<Self, SimulationError> {
        let truth = run.truth.as_ref();
        let responses = predict(&run.system, &run.coefficients, truth, states)?;
        Ok(Self {
            responses,
            bands: bands(run, states),
            times: run.system.grid.times(),
            is_rotation: run.document.is_rotation(),
        })
    }

    /// Key numbers.
    pub fn summaries(&self) -> Vec<FreeSummary> {
        let pairs = self.responses.iter().zip(&self.bands);
        let summary = |(predicted, band): (&PredictedResponse, &Option<Vec<[f64; 2]>>)| {
            let y = predicted.response.displacement(0);
            let peak = (0..y.len()).max_by(|i, j| y[*i].abs().total_cmp(&y[*j].abs()));
            // The band of the peak is that of its node, as a size.
            let of_size = |i: usize, [low, high]: [f64; 2]| match y[i] < 0.0 {
                true => [-high, -low],
                false => [low, high],
            };
            let band = band.as_ref();
            FreeSummary {
                summary: predicted.summary.clone(),
                largest_95: band.zip(peak).map(|(band, i)| of_size(i, band[i])),
                last_95: band.and_then(|band| band.last().copied()),
            }
        };
        pairs.map(summary).collect()
    }

    /// The key numbers as a table, and below it their bands.
    pub fn table(&self) -> String {
        let summaries = self.summaries();
        let plain: Vec<PredictionSummary> = summaries.iter().map(|s| s.summary.clone()).collect();
        let mut text = prediction_table(&plain, self.is_rotation);
        let unit = if self.is_rotation { "rad" } else { "m" };
        for s in &summaries {
            let (Some([low, high]), Some([from, to])) = (s.largest_95, s.last_95) else {
                continue;
            };
            let [y, v, low, high, from, to] = [
                s.summary.displacement,
                s.summary.velocity,
                low,
                high,
                from,
                to,
            ]
            .map(|x| significant(x, 5));
            text += &format!(
                "95 % band from y = {y}, v = {v}: peak |y| {low} to {high} {unit}, y at end {from} to {to} {unit}\n"
            );
        }
        text
    }

    /// All curves: times, displacements, bands and true displacements of each initial state.
    pub fn csv(&self) -> CsvTable {
        let unit = if self.is_rotation { "rad" } else { "m" };
        let mut table = CsvTable::new().column("t_s", self.times.clone());
        for (i, (predicted, band)) in self.responses.iter().zip(&self.bands).enumerate() {
            let name = |part: &str, more: &str| format!("{part}y_{more}{unit}_{}", i + 1);
            let displacement = predicted.response.displacement(0);
            table = table.column(name("", ""), displacement.to_vec());
            for (end, side) in ["low_95_", "high_95_"].into_iter().enumerate() {
                if let Some(band) = band {
                    let ends = band.iter().map(|ends| ends[end]).collect();
                    table = table.column(name("", side), ends);
                }
            }
            if let Some(truth) = &predicted.truth {
                table = table.column(name("true_", ""), truth.displacement(0).to_vec());
            }
        }
        table
    }

    /// The figure: a panel for each initial state.
    pub fn figure(&self) -> Figure {
        figures::predictions(&self.times, &self.responses)
    }
}

/// The 95 % bands of the displacements at the nodes.
fn bands(run: &Run, states: &[State]) -> Vec<Option<Vec<[f64; 2]>>> {
    // A run without readable parameters has no bands, but a response.
    let Ok(system) = system_of(run, &[]) else {
        return vec![None; states.len()];
    };
    let identified = &system.identified;
    if identified.covariance.is_none() {
        return vec![None; states.len()];
    }
    let grid = identified.system.grid;
    let nodes = grid.nodes();
    let band = |state: &State| {
        let channel = Channel::new(
            ChannelKind::Displacement,
            grid.times(),
            vec![0.0; nodes],
            Weighting::Sigma(1.0),
            &grid,
            nodes,
        )?;
        let mut experiment = Experiment::free("prediction", state.clone(), nodes);
        experiment.channels.push(channel);
        let problem = identified.problem(grid, experiment)?;
        let predicted = identified.predict(&problem, &[None]).ok()?;
        predicted.first()?.band()
    };
    states.iter().map(band).collect()
}
