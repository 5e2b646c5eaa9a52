//! Predictions of a fitted system under a new excitation: table, figure, CSV and JSON.

mod free;
mod identified;
mod record;

use super::chart::{Colour, Figure, Mark, Panel, Style};
use super::csv::CsvTable;
use super::run_reader::Run;
use super::text::aligned_to;
use crate::config::{NewRecord, RunSensor};
use crate::error::InputError;
pub use free::FreePredictions;
use identified::system_of;
use kmcfit_core::diagnostics::{rms, standard_deviation};
use kmcfit_core::number_format::significant;
use kmcfit_core::record::ChannelKind;
use kmcfit_core::study::PredictedChannel;
use kmcfit_core::system::State;
use record::{experiment, grid};
use serde::Serialize;

/// Responses to one excitation from several initial states.
pub struct ForcedPredictions {
    cases: Vec<Case>,
    is_rotation: bool,
}

/// Response from one initial state.
struct Case {
    initial: State,
    channels: Vec<PredictedChannel>,
    is_measured: Vec<bool>,
}

/// Key numbers of one predicted channel; for a rotation in rad in place of m.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForcedSummary {
    /// Initial displacement, m.
    pub displacement: f64,
    /// Initial velocity, m/s.
    pub velocity: f64,
    /// `displacement` or `velocity`, relative to the base, or the absolute `acceleration`.
    pub channel: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Number of predicted samples.
    pub samples: usize,
    /// Largest absolute value.
    pub largest: f64,
    /// Largest half-width of the 95 % band by the errors of the parameters; `null` without a covariance.
    pub half_width: Option<f64>,
    /// Standard deviation of the noise of a sample, where the run has this channel with a sigma.
    pub sigma: Option<f64>,
    /// Comparison with the measurements of the file, if any.
    pub score: Option<Score>,
}

/// Comparison of a prediction with measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Root-mean-square residual.
    pub rms_residual: f64,
    /// `100 (1 - |residual| / |sample - mean|)`.
    pub fit_percent: f64,
    /// Share of the samples within their 95 % band, noise included; `null` without covariance or sigma.
    pub within_band: Option<f64>,
}

impl ForcedPredictions {
    /// Predicts the channels `kinds` (those measured in the files, or the first of the run, where empty) of a run under the inputs of
    /// `record` from each of the states.
    ///
    /// # Errors
    /// If `parameters.json` is missing or damaged, the coefficients are not identified over the times of the inputs, or the grid is too
    /// long; a numerical failure of the simulation is the inner result.
    pub fn of(
        run: &Run,
        record: &NewRecord,
        states: &[State],
        kinds: &[ChannelKind],
    ) -> Result<Result<Self, String>, InputError> {
        let sensors: Vec<&RunSensor> = record.measured.iter().map(|m| &m.sensor).collect();
        let system = system_of(run, &sensors)?;
        let grid = grid(run, &system, record)?;
        let mut cases = Vec::new();
        for state in states {
            let (experiment, is_measured) =
                experiment(&system, record, state.clone(), kinds, &grid)?;
            let sigmas: Vec<Option<f64>> = (experiment.channels.iter())
                .map(|channel| system.sigma(channel.kind()))
                .collect();
            let scalars = system.scalars.clone();
            let identified = &system.identified;
            let problem = identified.problem_with_sensors(grid, experiment, scalars);
            let Some(problem) = problem else {
                return Err(InputError::file(
                    run.folder.join("parameters.json"),
                    "the parameters do not describe the system of the run",
                )
                .found("other functions than terms")
                .expected("the parameters of this run"));
            };
            match system.identified.predict(&problem, &sigmas) {
                Err(breakdown) => return Ok(Err(format!("no response: {breakdown}"))),
                Ok(channels) => cases.push(Case {
                    initial: state.clone(),
                    channels,
                    is_measured,
                }),
            }
        }
        Ok(Ok(Self {
            cases,
            is_rotation: run.document.is_rotation(),
        }))
    }

    /// Key numbers of all channels.
    pub fn summaries(&self) -> Vec<ForcedSummary> {
        self.of_channels(|initial, channel, is_measured| {
            self.summary(initial, channel, is_measured)
        })
    }

    /// Something of each channel of each case: its initial state, the channel, and whether it was measured.
    fn of_channels<T>(&self, of: impl Fn(&State, &PredictedChannel, bool) -> T) -> Vec<T> {
        let each = self.cases.iter().flat_map(|case| {
            let channels = case.channels.iter().zip(&case.is_measured);
            channels.map(|(channel, is_measured)| of(&case.initial, channel, *is_measured))
        });
        each.collect()
    }

    fn summary(
        &self,
        initial: &State,
        channel: &PredictedChannel,
        is_measured: bool,
    ) -> ForcedSummary {
        let largest = |values: &[f64]| values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let halves = channel.band().map(|band| {
            let halves: Vec<f64> = band.iter().map(|[low, high]| 0.5 * (high - low)).collect();
            largest(&halves)
        });
        ForcedSummary {
            displacement: initial.displacement(0),
            velocity: initial.velocity(0),
            channel: channel.channel.kind().name(),
            unit: channel.channel.kind().unit_of(self.is_rotation),
            samples: channel.values.len(),
            largest: largest(&channel.values),
            half_width: halves,
            sigma: channel.sigma,
            score: is_measured.then(|| {
                let residuals: Vec<f64> = channel.channel.residuals(&channel.values).collect();
                let spread = standard_deviation(channel.channel.observed());
                Score {
                    rms_residual: rms(&residuals),
                    fit_percent: 100.0 * (1.0 - rms(&residuals) / spread),
                    within_band: channel.share_within(),
                }
            }),
        }
    }

    /// The key numbers as a table.
    pub fn table(&self) -> String {
        let summaries = self.summaries();
        let has_score = summaries.iter().any(|s| s.score.is_some());
        let mut rows = vec![
            [
                "y(0)",
                "v(0)",
                "channel",
                "unit",
                "peak",
                "95 % band",
                "sigma",
            ]
            .map(String::from)
            .to_vec(),
        ];
        if has_score {
            rows[0].extend(["rms residual", "fit", "within band"].map(String::from));
        }
        let shown = |x: Option<f64>| x.map_or("unknown".to_owned(), |x| significant(x, 4));
        for s in &summaries {
            let mut row = vec![
                significant(s.displacement, 6),
                significant(s.velocity, 6),
                s.channel.to_owned(),
                s.unit.to_owned(),
                significant(s.largest, 4),
                s.half_width
                    .map_or("unknown".into(), |x| format!("+- {}", significant(x, 2))),
                shown(s.sigma),
            ];
            if let Some(score) = &s.score {
                row.push(significant(score.rms_residual, 4));
                row.push(format!("{:.1} %", score.fit_percent));
                let within = score
                    .within_band
                    .map(|share| format!("{:.1} %", 100.0 * share));
                row.push(within.unwrap_or_else(|| "unknown".into()));
            }
            rows.push(row);
        }
        aligned_to(&rows, |_| true)
    }

    /// All curves: times, predictions, bands and measurements of each channel and initial state.
    pub fn csv(&self) -> CsvTable {
        let mut table = CsvTable::new();
        let mut times: Option<&[f64]> = None;
        for (i, case) in self.cases.iter().enumerate() {
            for (channel, is_measured) in case.channels.iter().zip(&case.is_measured) {
                let kind = channel.channel.kind();
                let number = match self.cases.len() {
                    1 => String::new(),
                    _ => format!("_{}", i + 1),
                };
                let own = channel.channel.times();
                if times != Some(own) {
                    let name = match times {
                        None => "t_s".to_owned(),
                        Some(_) => format!("{}_t_s{number}", kind.name()),
                    };
                    table = table.column(name, own.to_vec());
                    times = Some(own);
                }
                let unit = kind
                    .unit_of(self.is_rotation)
                    .replace('/', "_per_")
                    .replace('^', "");
                let name = |part: &str| format!("{}{part}_{unit}{number}", kind.name());
                table = table.column(name(""), channel.values.clone());
                for (part, band) in [("", channel.band()), ("_sample", channel.sample_band())] {
                    for (side, end) in ["low", "high"].iter().zip(0..2) {
                        let values = band.iter().flatten().map(|ends| ends[end]).collect();
                        if band.is_some() {
                            table = table.column(name(&format!("{part}_{side}_95")), values);
                        }
                    }
                }
                if *is_measured {
                    table = table.column(name("_measured"), channel.channel.observed().to_vec());
                }
            }
        }
        table
    }

    /// The figure: a panel for each channel and initial state.
    pub fn figure(&self) -> Figure {
        let panels = self
            .of_channels(|initial, channel, is_measured| self.panel(initial, channel, is_measured));
        Figure::new(
            "predictions",
            "Predictions",
            "Predicted response against time with 95 % bands: parameters, and a sample with noise.",
        )
        .panels(panels)
    }

    fn panel(&self, initial: &State, channel: &PredictedChannel, is_measured: bool) -> Panel {
        let kind = channel.channel.kind();
        let t = channel.channel.times();
        let mut panel = Panel::of_time(
            format!("{} {}", kind.name(), kind.symbol()),
            kind.unit_of(self.is_rotation),
        )
        .title(format!(
            "from y = {}, v = {}",
            initial.displacement(0),
            initial.velocity(0)
        ));
        let bands = [
            ("95 % of samples", channel.sample_band(), Colour::Grey),
            ("95 % band", channel.band(), Colour::Sky),
        ];
        for (label, band, colour) in bands {
            if let Some(band) = band {
                panel = panel.mark(Mark::band_of(label, t, &band, colour));
            }
        }
        if is_measured {
            let style = Style::new(Colour::Black);
            panel = panel.mark(Mark::line("measured", t, channel.channel.observed(), style));
        }
        panel.mark(Mark::line(
            "predicted",
            t,
            &channel.values,
            Style::new(Colour::Vermillion),
        ))
    }
}
