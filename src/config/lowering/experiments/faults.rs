//! Faults of the samples of a column, found before the fit: gaps, dropouts, spikes, saturation and quantisation.

use super::Entry;
use super::column_samples::{ColumnSamples, PresentRows};
use super::data_facts::{
    Action, EXCLUDED, GapLocation, INTERPOLATED, MISSING, MOST_PATHS, RecordNotes, USED, fact,
    gaps_in_words, spans_in_words, time, times_in_words,
};
use crate::units::Unit;
use kmcfit_core::assessment::Doubt;
use kmcfit_core::diagnostics::standard_deviation;
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::model::FaultName;
use kmcfit_core::number_format::{count as counted, significant};
use kmcfit_core::signal::{cut_off, dropouts, median, quantisation, spikes};
use kmcfit_core::system::round_time;
use kmcfit_core::threads::{available_for, both};
use serde_json::json;

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
    pub entry: &'a Entry<'a>,
    /// Name of the channel in sentences.
    pub name: &'a str,
    /// True for a force or a motion of the base.
    pub is_input: bool,
    /// True if spikes are treated by a robust loss.
    pub is_robust: bool,
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
        for (fault, samples) in self.faulty(&times, &values, step) {
            let excludes = self.excludes(fault);
            let action = if excludes { EXCLUDED } else { USED };
            let level = values[samples[0]];
            let [fact, warning] = self.found(fault, &samples, &times, action, level, source.unit);
            notes.state(&self.entry.name(), fact);
            if excludes {
                emptied.extend(samples.iter().map(|i| rows.row(*i)));
                excluded.push((samples.len(), fault.reason().to_owned()));
            } else if !(self.is_robust && fault == FaultName::Spikes) {
                notes.warnings.push(self.entry.placed(warning));
            }
        }
        for row in emptied {
            source.values[row] = f64::NAN;
        }
        excluded
    }

    /// States the quantisation step of the samples, SI, and what was done about its error.
    pub fn state_quantisation(
        &self,
        step: f64,
        values: &[f64],
        unit: Unit,
        action: Action,
        notes: &mut RecordNotes,
    ) {
        let share = step / (12.0f64.sqrt() * standard_deviation(values));
        let (channel, step, unit) = (self.name, step / unit.factor(), unit.symbol());
        let text = format!(
            "{channel} quantised in steps of {} {unit}",
            significant(step, 3)
        );
        // The share is the standard deviation of the error, step/sqrt(12), relative to that of the samples.
        let found = json!({"channel": channel, "step": step, "unit": unit, "share": share});
        let fact = Finding {
            severity: Severity::Detail,
            doubt: (self.is_input && action == USED).then(|| Doubt::CoarseInput {
                experiment: self.entry.name(),
                channel: channel.to_owned(),
                share,
            }),
            ..fact("quantisation", &text, action, found)
        };
        notes.state(&self.entry.name(), fact);
    }

    fn excludes(&self, fault: FaultName) -> bool {
        let given = self.entry.spec.exclude.as_ref();
        !self.is_input && given.is_some_and(|list| list.values().contains(&fault))
    }

    /// Time on the axis of the file, s.
    fn in_file(&self, times: &[f64], i: usize) -> f64 {
        let zero = self.entry.spec.time_zero.unwrap_or(0.0);
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
        let positions = all.iter().take(MOST_PATHS).map(|i| GapLocation {
            from: self.in_file(times, *i),
            to: self.in_file(times, i + 1),
            samples: (spacings[*i] / usual - 1.0).round().max(1.0) as usize,
        });
        let positions: Vec<GapLocation> = positions.collect();
        let longest = positions
            .iter()
            .copied()
            .max_by(|a, b| (a.to - a.from).total_cmp(&(b.to - b.from)));
        let (channel, gaps) = (self.name, counted(all.len(), "gap"));
        let text = format!(
            "{gaps} in the {channel}, {}",
            gaps_in_words(&positions, all.len())
        );
        let action = if self.is_input { INTERPOLATED } else { MISSING };
        let found = json!({"channel": channel, "count": all.len(), "places": positions});
        let fact = fact("gaps", &text, action, found);
        notes.state(&self.entry.name(), fact);
        if let (true, Some(GapLocation { from, to, .. })) = (self.is_input, longest) {
            let text = format!(
                "the {channel} has {}, across which it is interpolated, the longest from {} to {} s; keep a part without them by \
                 `window`",
                gaps.replace("1 gap", "a gap"),
                time(from),
                time(to)
            );
            let found = json!({"channel": channel, "count": all.len(), "longest": [from, to]});
            let warning = Finding::having("input_gaps", text, found).rated(Severity::Check);
            notes.warnings.push(self.entry.placed(warning));
        }
    }

    /// The faulty samples of each kind.
    fn faulty(
        &self,
        times: &[f64],
        values: &[f64],
        step: f64,
    ) -> impl Iterator<Item = (FaultName, Vec<usize>)> {
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
        let all = all.into_iter();
        all.filter(|(_, samples)| !samples.is_empty())
    }

    /// The fact about faulty samples, and the warning where they are used; `level` is the value of the first one, SI.
    fn found(
        &self,
        fault: FaultName,
        samples: &[usize],
        times: &[f64],
        action: Action,
        level: f64,
        unit: Unit,
    ) -> [Finding; 2] {
        let (channel, kind, count) = (self.name, fault.name(), samples.len());
        let at = |i: &usize| self.in_file(times, *i);
        let of_samples = counted(count, "sample");
        let way_out = match (self.is_input, fault) {
            (true, FaultName::Spikes) => {
                "correct the file, or keep a part without spikes by `window`".to_owned()
            }
            (true, _) => "keep a part without them by `window`".to_owned(),
            (false, FaultName::Spikes) => "leave spikes out: `exclude: [spikes]`".to_owned(),
            (false, _) => format!("leave them out: `exclude: [{kind}]`"),
        };
        let (text, found, warning, of_warning) = match fault {
            FaultName::Dropouts => {
                let rows = samples.chunk_by(|a, b| a + 1 == *b).take(MOST_PATHS);
                let positions = rows.map(|row| [row[0], row[row.len() - 1]].map(|i| at(&i)));
                let positions: Vec<[f64; 2]> = positions.collect();
                let [from, to] = positions[0];
                (
                    format!(
                        "{of_samples} of the {channel} held at a constant value, {}",
                        spans_in_words(&positions)
                    ),
                    json!({"places": positions}),
                    format!(
                        "{count} samples of the {channel} are held at a constant value, from {} to {} s at first, as by a dropout; {way_out}",
                        time(from),
                        time(to)
                    ),
                    json!({"first": [from, to]}),
                )
            }
            FaultName::Spikes => {
                let positions: Vec<f64> = samples.iter().take(MOST_PATHS).map(at).collect();
                let (spikes, all) = (counted(count, "spike"), times_in_words(&positions, count));
                (
                    format!("{spikes} in the {channel}, at {all} s"),
                    json!({"places": positions}),
                    format!(
                        "{of_samples} of the {channel} {} far from the neighbours, the first at {} s; {way_out}",
                        if count == 1 { "is" } else { "are" },
                        time(positions[0])
                    ),
                    json!({"first": positions[0]}),
                )
            }
            FaultName::Saturation => {
                let (level, unit) = (level / unit.factor(), unit.symbol());
                let value = format!("{} {unit}", significant(level, 4));
                let found = json!({"level": level, "unit": unit});
                (
                    format!("{of_samples} of the {channel} at its extreme value {value}"),
                    found.clone(),
                    format!(
                        "{count} samples of the {channel} equal its extreme value {value}; if the sensor saturates there, {way_out}"
                    ),
                    found,
                )
            }
        };
        let fact = fact(kind, &text, action, found).with("count", count);
        let warning = Finding::having(kind, warning, of_warning)
            .rated(Severity::Check)
            .with("samples", count);
        let of = channel.to_owned();
        let warning = match fault {
            FaultName::Saturation => warning.about(Doubt::Saturation { channel: of }),
            FaultName::Spikes => warning.about(Doubt::Outliers {
                experiment: self.entry.name(),
                channel: of,
            }),
            FaultName::Dropouts => warning,
        };
        [fact, warning].map(|finding| finding.with("channel", channel))
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
