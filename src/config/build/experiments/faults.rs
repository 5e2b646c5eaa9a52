//! Faults of the samples of a column, found before the fit: gaps, dropouts, spikes, saturation and quantisation.

use super::column_samples::{ColumnSamples, PresentRows};
use super::data_facts::{DataAction, DataFact, GapPlace, MOST_PLACES, RecordNotes};
use super::warning::DataWarning;
use crate::config::ModelFile;
use crate::config::spec::{ExperimentSpec, FaultName};
use kmcfit_core::internals::signal::{cut_off, dropouts, median, quantisation, spikes};
use kmcfit_core::internals::system::round_time;
use kmcfit_core::internals::threads::{available_for, both};

/// Spacing, in median spacings, above which samples are missing.
const GAP: f64 = 1.5;
/// Share of the spacings within a tenth of the median for which a larger one is a gap.
const REGULAR: f64 = 0.8;
/// Quantisation step relative to the range of the samples below which it is not stated: that of 12 bits.
const FINE: f64 = 1.0 / 4096.0;
/// Share of the distance of a spike that the input must have elsewhere, as its root mean square: a single pulse of an impact has less.
const SUSTAINED: f64 = 0.05;

/// A column with its place in the model.
pub struct Column<'a> {
    pub file: &'a ModelFile,
    pub experiment: usize,
    pub spec: &'a ExperimentSpec,
    /// Name of the channel in sentences.
    pub name: &'a str,
    /// True for a force or a motion of the base.
    pub is_input: bool,
    /// True if spikes are treated by a robust loss.
    pub is_robust: bool,
}

/// Samples of a fault, by their indices.
struct Faulty {
    fault: FaultName,
    samples: Vec<usize>,
}

impl Column<'_> {
    /// States the faults of the samples, with the quantisation step `step`, sets those that the model excludes to NaN, and returns the
    /// number of each.
    pub fn check(
        &self,
        source: &mut ColumnSamples,
        step: Option<f64>,
        notes: &mut RecordNotes,
    ) -> Vec<(usize, String)> {
        let rows = PresentRows::of(&source.values);
        let [times, values] = [&source.times, &source.values].map(|column| rows.pick(column));
        if times.len() < 2 {
            return Vec::new();
        }
        self.gaps(&times, notes);
        let step = step.unwrap_or(0.0);
        let (mut excluded, mut emptied) = (Vec::new(), Vec::new());
        for Faulty { fault, samples } in self.faulty(&times, &values, step) {
            let excludes = self.excludes(fault);
            let action = if excludes {
                DataAction::Excluded
            } else {
                DataAction::Used
            };
            let first = samples.first().copied().unwrap_or_default();
            let level = values[first] / source.unit.factor();
            let unit = source.unit.symbol().to_owned();
            let fact = self.fact(fault, &samples, &times, action, level, unit);
            notes.state(&self.experiment_name(), &fact);
            if excludes {
                emptied.extend(samples.iter().map(|i| rows.row(*i)));
                excluded.push((samples.len(), fault.reason().to_owned()));
            } else {
                let is_robust = self.is_robust && fault == FaultName::Spikes;
                let warning = (!is_robust).then(|| self.warning(&fact)).flatten();
                notes.warnings.extend(warning.map(|w| self.placed(&w)));
            }
        }
        for row in emptied {
            source.values[row] = f64::NAN;
        }
        excluded
    }

    fn experiment_name(&self) -> String {
        self.file.experiment_name(self.experiment)
    }

    fn placed(&self, warning: &DataWarning) -> crate::finding::Finding {
        let (i, name) = (self.experiment, self.experiment_name());
        let finding = warning.at(&format!("experiments[{i}] ({name})"));
        finding.with("experiment", name)
    }

    fn excludes(&self, fault: FaultName) -> bool {
        let given = self.spec.exclude.as_ref();
        !self.is_input && given.is_some_and(|list| list.values().contains(&fault))
    }

    /// Time on the axis of the file, s.
    fn in_file(&self, times: &[f64], i: usize) -> f64 {
        let zero = self.spec.time_zero.map_or(0.0, |t| t.0);
        let spacing = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        round_time(times[i] + zero, spacing)
    }

    /// Gaps of otherwise regular times.
    fn gaps(&self, times: &[f64], notes: &mut RecordNotes) {
        let spacings: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        let usual = median(&*spacings);
        let regular = spacings
            .iter()
            .filter(|s| (*s - usual).abs() <= 0.1 * usual);
        if (regular.count() as f64) < REGULAR * spacings.len() as f64 {
            return;
        }
        let is_gap = |i: &usize| spacings[*i] > GAP * usual;
        let all: Vec<usize> = (0..spacings.len()).filter(is_gap).collect();
        if all.is_empty() {
            return;
        }
        let places = all.iter().take(MOST_PLACES).map(|i| GapPlace {
            from: self.in_file(times, *i),
            to: self.in_file(times, i + 1),
            samples: (spacings[*i] / usual - 1.0).round().max(1.0) as usize,
        });
        let places: Vec<GapPlace> = places.collect();
        let longest = places
            .iter()
            .copied()
            .max_by(|a, b| (a.to - a.from).total_cmp(&(b.to - b.from)));
        let action = match self.is_input {
            true => DataAction::Interpolated,
            false => DataAction::Missing,
        };
        let fact = DataFact::Gaps {
            channel: self.name.to_owned(),
            count: all.len(),
            places,
            action,
        };
        notes.state(&self.experiment_name(), &fact);
        if let (true, Some(longest)) = (self.is_input, longest) {
            let warning = DataWarning::InputGaps {
                channel: self.name.to_owned(),
                count: all.len(),
                longest: [longest.from, longest.to],
            };
            notes.warnings.push(self.placed(&warning));
        }
    }

    /// The faulty samples of each kind.
    fn faulty(&self, times: &[f64], values: &[f64], step: f64) -> Vec<Faulty> {
        let levels = || (dropouts(values, step), cut_off(values, step));
        let ((mut rows, mut limits), mut single) = match available_for(values.len()) {
            1 => (levels(), spikes(times, values)),
            _ => both(levels, || spikes(times, values)),
        };
        if self.is_input {
            // A force that ends stays at a constant value.
            rows.retain(|row| row.end < values.len());
        }
        // A sine has its peak value once in a period.
        limits.retain(|level| values.windows(2).any(|pair| pair == [*level; 2]));
        let cut = (0..values.len()).filter(|i| limits.contains(&values[*i]));
        let cut: Vec<usize> = cut.collect();
        rows.retain(|row| cut.binary_search(&row.start).is_err());
        let held: Vec<usize> = rows.into_iter().flatten().collect();
        single.retain(|i| cut.binary_search(i).is_err() && !is_beside(&held, *i));
        if self.is_input && !is_sustained(values, &single) {
            single.clear();
        }
        let all = [
            (FaultName::Dropouts, held),
            (FaultName::Spikes, single),
            (FaultName::Saturation, cut),
        ];
        let all = all.into_iter().filter(|(_, samples)| !samples.is_empty());
        all.map(|(fault, samples)| Faulty { fault, samples })
            .collect()
    }

    fn fact(
        &self,
        fault: FaultName,
        samples: &[usize],
        times: &[f64],
        action: DataAction,
        level: f64,
        unit: String,
    ) -> DataFact {
        let (channel, count) = (self.name.to_owned(), samples.len());
        match fault {
            FaultName::Dropouts => DataFact::Dropouts {
                channel,
                count,
                places: samples
                    .chunk_by(|a, b| a + 1 == *b)
                    .take(MOST_PLACES)
                    .map(|row| [row[0], row[row.len() - 1]].map(|i| self.in_file(times, i)))
                    .collect(),
                action,
            },
            FaultName::Spikes => DataFact::Spikes {
                channel,
                count,
                places: (samples.iter().take(MOST_PLACES))
                    .map(|i| self.in_file(times, *i))
                    .collect(),
                action,
            },
            FaultName::Saturation => DataFact::Saturation {
                channel,
                count,
                level,
                unit,
                action,
            },
        }
    }

    /// The warning about samples that are used.
    fn warning(&self, fact: &DataFact) -> Option<DataWarning> {
        let is_input = self.is_input;
        match fact {
            DataFact::Saturation {
                channel,
                count,
                level,
                unit,
                ..
            } => Some(DataWarning::Saturation {
                channel: channel.clone(),
                samples: *count,
                level: *level,
                unit: unit.clone(),
                is_input,
            }),
            DataFact::Dropouts {
                channel,
                count,
                places,
                ..
            } => Some(DataWarning::Dropouts {
                channel: channel.clone(),
                samples: *count,
                first: places.first().copied()?,
                is_input,
            }),
            DataFact::Spikes {
                channel,
                count,
                places,
                ..
            } => Some(DataWarning::Spikes {
                channel: channel.clone(),
                samples: *count,
                first: places.first().copied()?,
                is_input,
            }),
            _ => None,
        }
    }
}

/// True for a sample next to a held row.
fn is_beside(held: &[usize], i: usize) -> bool {
    (i.saturating_sub(2)..=i + 2).any(|i| held.binary_search(&i).is_ok())
}

/// True for an input with a root mean square, without its spikes, of a share of the largest of them.
fn is_sustained(values: &[f64], spikes: &[usize]) -> bool {
    let others = (0..values.len()).filter(|i| spikes.binary_search(i).is_err());
    let others: Vec<f64> = others.map(|i| values[i]).collect();
    let squares = others.iter().map(|y| y * y).sum::<f64>();
    let rms = (squares / others.len().max(1) as f64).sqrt();
    let largest = spikes.iter().map(|i| values[*i].abs()).fold(0.0, f64::max);
    rms > SUSTAINED * largest
}

/// Quantisation step of the samples, SI.
pub fn quantisation_step(values: &[f64]) -> Option<f64> {
    quantisation(&PresentRows::of(values).pick(values))
}

/// True for a quantisation step that is worth stating.
pub fn is_coarse(step: f64, values: &[f64]) -> bool {
    let range = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |r, y| {
            [r[0].min(*y), r[1].max(*y)]
        });
    step > FINE * (range[1] - range[0])
}
