//! A compared run, read from its folder.

use crate::config::{DataFile, ModelFile, ModelSource, Override};
use crate::error::InputError;
use crate::report::{ResultTable, Run};
use std::path::Path;

/// A finished run with the data of its figures.
#[derive(Debug, Clone)]
pub struct ComparedRun {
    /// Its name in the comparison, unique.
    pub name: String,
    /// Document, estimated coefficients and true system.
    pub finished: Run,
    /// Largest violation of a constraint relative to its scale, if the document has it.
    pub max_violation: Option<f64>,
    /// The iterations, from 1.
    pub iterations: Vec<f64>,
    /// `J/J0` after each iteration.
    pub cost_ratio: Vec<f64>,
    /// Fitted responses.
    pub responses: Vec<MatchedResponse>,
    /// Data files of its model file; none where that file or its text cannot be read any more.
    pub(super) data: Vec<DataFile>,
    /// Channels of the validation records.
    pub(super) validation: Vec<ValidationChannel>,
}

/// A channel of a validation record with its prediction, in the unit of its file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ValidationChannel {
    /// Name of the record.
    pub record: String,
    /// Kind of the channel.
    pub kind: String,
    /// Unit.
    pub unit: String,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// Samples.
    pub measured: Vec<f64>,
    /// Predictions.
    pub predicted: Vec<f64>,
}

/// A measured response and its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedResponse {
    /// Name of the experiment.
    pub experiment: String,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// Samples `y_obs`, m.
    pub observed: Vec<f64>,
    /// `y - y_obs`, m.
    pub residual: Vec<f64>,
}

impl ComparedRun {
    /// Reads the folder of a finished run.
    ///
    /// # Errors
    /// If there is no complete run in the folder.
    pub fn read(name: &str, folder: &Path) -> Result<Self, InputError> {
        let finished = Run::open(folder)?;
        let names = finished.document.experiments.iter().map(|e| e.name.clone());
        let violation = finished.value.pointer("/constraints/max_violation");
        Ok(Self {
            name: name.into(),
            // Documents of earlier versions have no such field.
            max_violation: violation.and_then(serde_json::Value::as_f64),
            iterations: finished
                .history
                .iter()
                .map(|r| r.iteration as f64)
                .collect(),
            cost_ratio: finished.history.iter().map(|r| r.cost_ratio).collect(),
            validation: validation(&finished),
            data: data(&finished),
            responses: responses(&finished.trajectory, names),
            finished,
        })
    }

    /// True if another run has the same records: channels, numbers of samples, measured displacements.
    pub(super) fn has_records_of(&self, other: &Self) -> bool {
        let channels = |run: &Self| -> Vec<(String, usize)> {
            let experiments = run.finished.document.experiments.iter();
            let channels = experiments.flat_map(|e| &e.channels);
            channels.map(|c| (c.kind.clone(), c.samples)).collect()
        };
        let displacements = |run: &Self| -> Vec<f64> {
            let responses = run.responses.iter();
            responses.flat_map(|r| r.observed.clone()).collect()
        };
        channels(self) == channels(other) && displacements(self) == displacements(other)
    }

    /// Times of the nodes, s.
    pub fn times(&self) -> Vec<f64> {
        self.finished.system.grid.times()
    }
}

/// The data files of the model file of a run.
fn data(run: &Run) -> Vec<DataFile> {
    let model = &run.document.model;
    let overrides = Override::parse_all(&model.overrides);
    let file = overrides.and_then(|set| ModelFile::read_with_overrides(&model.file, &set));
    file.map_or_else(|_| Vec::new(), |file| ModelSource::of(&file).data)
}

/// Channels of the validation records from their tables; none without such a table.
fn validation(run: &Run) -> Vec<ValidationChannel> {
    let records = run.document.validation.iter().enumerate();
    let channels =
        records.flat_map(|(i, record)| record.channels.iter().map(move |c| (i, record, c)));
    let read = channels.filter_map(|(i, record, channel)| {
        let name = format!("channels/validation-{}-{}.csv", i + 1, channel.kind);
        let table = ResultTable::read(&run.folder.join(name)).ok()?;
        Some(ValidationChannel {
            record: record.name.clone(),
            kind: channel.kind.clone(),
            unit: channel.unit.clone(),
            times: table.column("t_s")?,
            measured: table.column("measured")?,
            predicted: table.column("predicted")?,
        })
    });
    read.collect()
}

/// The responses that have samples: `y_m` and `observed_y_m`, or with the number of the experiment
/// where there are several. `names` are those of the experiments with samples, in order.
fn responses(
    trajectory: &ResultTable,
    mut names: impl Iterator<Item = String>,
) -> Vec<MatchedResponse> {
    let numbered = (1..=trajectory.headers().len()).map(|i| format!("_{i}"));
    let suffixes = std::iter::once(String::new()).chain(numbered);
    let Some(times) = trajectory.column("t_s") else {
        return Vec::new();
    };
    suffixes
        .filter_map(|suffix| {
            let found = trajectory.column(&format!("y_m{suffix}"))?;
            let observed = trajectory.column(&format!("observed_y_m{suffix}"))?;
            let read = |i: &usize| observed[*i].is_finite() && found[*i].is_finite();
            let kept: Vec<usize> = (0..observed.len()).filter(read).collect();
            let at = |f: &dyn Fn(usize) -> f64| kept.iter().map(|&i| f(i)).collect();
            Some(MatchedResponse {
                experiment: names.next().unwrap_or_else(|| "motion".into()),
                times: at(&|i| times[i]),
                observed: at(&|i| observed[i]),
                residual: at(&|i| found[i] - observed[i]),
            })
        })
        .collect()
}
