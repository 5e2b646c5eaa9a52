//! Columns of a text table after its rows are read: names in a comment, footers, units of clocks, and runs side by side.

use super::Table;
use super::detect::DELIMITERS;
use super::origin::ColumnValues;
use crate::formats::{FileChannel, align, own_times};
use crate::headings::split_unit;
use crate::quantity_names::quantity_of;
use crate::text_io::quote;
use crate::units::{Measurand, Unit};
use kmcfit_core::number_format::significant;
use kmcfit_core::signal::median;

/// Times since 1970 and their units: milliseconds, microseconds and nanoseconds of the years from 1973 to 2286.
const SINCE_1970: [(f64, &str); 3] = [(1e11, "ms"), (1e14, "µs"), (1e17, "ns")];
/// Days of the years from 1982 to 2076, as spreadsheets and modified Julian days, MATLAB, and Julian days count them; and the spacing (s)
/// below which these are no seconds.
const DAYS: [std::ops::Range<f64>; 3] = [3e4..8e4, 7.2e5..7.6e5, 2.44e6..2.48e6];
const DENSE: f64 = 1e-4;
/// Relative difference below which two rates are the same.
const SAME_RATE: f64 = 0.02;
/// Names of times that state their unit.
const NAMED: [(&str, &str); 3] = [("millis", "ms"), ("micros", "µs"), ("nanos", "ns")];

impl Table {
    /// Takes the names, and a row of units after them, from the comments before the rows, where there are as many as columns.
    pub(super) fn name_by_comments(&mut self, text: &str, delimiter: char) {
        let before = self.lines.first().map_or(0, |line| line.saturating_sub(1));
        let comments = text.lines().take(before).filter_map(|line| {
            let line = line.trim_start().strip_prefix('#')?;
            Some(line.trim_start_matches('#').trim())
        });
        let mut comments: Vec<&str> = comments.filter(|line| !line.is_empty()).collect();
        let width = self.columns.len();
        let fields = |line: &str| {
            let mut signs = std::iter::once(delimiter).chain(DELIMITERS);
            signs.find_map(|sign| {
                let fields = split(line, sign);
                (fields.len() == width
                    && !fields
                        .iter()
                        .any(|f| f.is_empty() || f.parse::<f64>().is_ok()))
                .then_some(fields)
            })
        };
        let Some(last) = comments.pop().and_then(fields) else {
            return;
        };
        let is_units = last.iter().all(|text| Unit::looks_like(text));
        let names = comments.pop().filter(|_| is_units).and_then(fields);
        let (names, units) = match names {
            Some(names) => (names, last),
            None => (last, Vec::new()),
        };
        // A sentence is no name.
        let is_name = |name: &String| {
            name.chars().count() <= 40 && names.iter().filter(|n| *n == name).count() == 1
        };
        if names.iter().all(is_name) {
            self.headers = names;
            self.units = units;
        }
    }

    /// Longest span of dates with slashes, s; infinite where they decrease or have the other order.
    pub(super) fn span_of_dates(&self) -> f64 {
        let span = |column: &ColumnValues| {
            let samples = &column.samples;
            let is_back = || samples.windows(2).any(|pair| pair[1] < pair[0]);
            match column.clock.filter(|clock| clock.order.is_some()) {
                _ if column.has_other_dates => f64::INFINITY,
                Some(_) if is_back() => f64::INFINITY,
                Some(_) => samples.last().unwrap_or(&0.0) - samples[0],
                None => 0.0,
            }
        };
        self.columns.iter().map(span).fold(0.0, f64::max)
    }

    /// States the units of times that follow from their form or magnitude, and where these follow from.
    pub(super) fn state_clocks(&mut self) {
        for index in 0..self.width() {
            let Some(column) = self.columns.get_mut(index) else {
                continue;
            };
            if let Some(clock) = column.clock.filter(|_| column.unreadable.is_none()) {
                clock.over_midnights(&mut column.samples);
                self.state_unit(index, "s");
                let order = clock.order.map(|order| format!(", {order} first"));
                self.notes.push(format!(
                    "the times of day in {} are read as seconds since the first{}",
                    quote(&self.label(index)),
                    order.unwrap_or_default()
                ));
            } else if let Some(unit) = self.unit_of_magnitude(index) {
                self.state_unit(index, unit);
                self.notes.push(format!(
                    "the times in {} are read in {unit}",
                    quote(&self.label(index))
                ));
            }
            self.compare_rates(index);
        }
        if let Some(rate) = self.stated_rate()
            && !(0..self.width()).any(|index| self.unit_of_times(index).is_some())
        {
            let rate = significant(rate, 6);
            self.notes
                .push(format!("sampling rate of the header: {rate} Hz"));
        }
    }

    /// The unit of times that a column states; of a name of times also that at its end, else that of SI.
    pub(crate) fn unit_of_times(&self, index: usize) -> Option<Unit> {
        let (stated, kind) = (self.stated_unit(index), Measurand::Time);
        stated.explicit(kind).or_else(|| {
            let is_named = quantity_of(self.quantity_name(index)) == Some(kind);
            (is_named && stated.text().is_none()).then_some(())?;
            let end = stated.suffix(kind).or(stated.last_word(kind));
            Some(end.unwrap_or(Unit::si(kind)))
        })
    }

    /// States a sampling rate beside the samples that the times in a column contradict.
    fn compare_rates(&mut self, index: usize) {
        let (Some(step), Some(unit)) = (self.stated_step, self.unit_of_times(index)) else {
            return;
        };
        let Some(column) = self.columns.get_mut(index) else {
            return;
        };
        let times: Vec<f64> = (column.samples.iter().copied())
            .filter(|t| t.is_finite())
            .collect();
        let (&[first, .., last], None) = (&*times, &column.unreadable) else {
            return;
        };
        let spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // The mean does not change by rounding, the median not by gaps.
        let mean = (last - first) / spacings.len() as f64;
        let found = [mean, median(&*spacings)].map(|spacing| spacing * unit.factor());
        if found.iter().all(|own| (own / step - 1.0).abs() > SAME_RATE) {
            let [stated, own] = [step, found[0]].map(|step| significant(1.0 / step, 6));
            column.unapplied.push(format!(
                "a sampling rate of {stated} Hz (by its times: {own} Hz)"
            ));
        }
    }

    fn unit_of_magnitude(&self, index: usize) -> Option<&'static str> {
        let name = self.quantity_name(index);
        let stated = self.stated_unit(index);
        let kind = Measurand::Time;
        let is_stated =
            stated.text().is_some() || stated.suffix(kind).or(stated.last_word(kind)).is_some();
        (quantity_of(name) == Some(kind) && !is_stated).then_some(())?;
        let small = name.to_lowercase();
        if let Some((_, unit)) = NAMED.iter().find(|(word, _)| small.contains(word)) {
            return Some(unit);
        }
        let times = &self.columns.get(index)?.samples;
        let first = *times.first()?;
        let since = SINCE_1970
            .iter()
            .find(|(least, _)| (*least..1e2 * least).contains(&first));
        if let Some((_, unit)) = since {
            return Some(unit);
        }
        let spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_dense = !spacings.is_empty() && (0.0..DENSE).contains(&median(&*spacings));
        let is_day = DAYS.iter().any(|days| days.contains(&first));
        (is_day && is_dense).then_some("day")
    }

    pub(super) fn state_unit(&mut self, index: usize, unit: &str) {
        self.units.resize(self.width(), String::new());
        if let Some(own) = self.units.get_mut(index) {
            unit.clone_into(own);
        }
    }

    /// The runs of a table that stand side by side, each with its own times in its first column; columns of other quantities with times of
    /// their own at common times; else the table.
    pub(super) fn runs(mut self) -> Vec<Self> {
        let is_time = |i: &usize| self.unit_of_times(*i).is_some();
        let mut begins: Vec<usize> = (0..self.headers.len()).filter(is_time).collect();
        let is_same = |i: &usize| {
            let samples = |i: usize| self.columns[i].samples.iter().map(|x| x.to_bits());
            samples(*i).eq(samples(begins[0]))
        };
        if begins.len() < 2 || begins[0] != 0 || begins.iter().all(is_same) {
            return vec![self];
        }
        if self.align_columns(&begins) {
            return vec![self];
        }
        begins.push(self.width());
        if begins.windows(2).any(|pair| pair[1] - pair[0] < 2) {
            return vec![self];
        }
        let runs = begins.windows(2).map(|pair| self.part(pair[0]..pair[1]));
        runs.collect()
    }

    /// Brings columns with times of their own to common times, or names these; false for runs of the same quantities.
    fn align_columns(&mut self, timers: &[usize]) -> bool {
        let mut block = 0;
        let mut channels = Vec::new();
        let mut rows = self.rows();
        for i in 0..self.width() {
            let is_timer = timers.contains(&i);
            let samples = &self.columns[i].samples;
            if is_timer {
                block += usize::from(!timers.contains(&i.wrapping_sub(1)));
                rows = samples
                    .iter()
                    .rposition(|t| t.is_finite())
                    .map_or(0, |last| last + 1);
            }
            let stated = self.stated_unit(i);
            let name = split_unit(self.quantity_name(i)).0.replace('.', " ");
            channels.push(FileChannel {
                name: format!("{block}.{name}"),
                unit: stated.text().map(str::to_owned).filter(|_| is_timer),
                values: samples.iter().take(rows).copied().collect(),
                ..FileChannel::default()
            });
        }
        if own_times(&mut channels) == 0 {
            return false;
        }
        let Some(note) = align(&mut channels) else {
            for (column, channel) in self.columns.iter_mut().zip(&channels) {
                let is_other =
                    channel.sampling.is_some() && channel.sampling != channels[1].sampling;
                column
                    .unapplied
                    .extend(is_other.then(|| "times of its own".to_owned()));
            }
            return true;
        };
        let factor = self
            .unit_of_times(timers[0])
            .map_or(1.0, |unit| unit.factor());
        let first = channels.iter().find(|channel| channel.sampling.is_some());
        let (count, sampling) = first.map_or((0, None), |channel| {
            (channel.values.len(), channel.sampling)
        });
        let mut index = 0;
        for (i, channel) in channels.into_iter().enumerate() {
            if timers.contains(&i) && i != timers[0] {
                // Its times are those of the first column now.
                self.columns.remove(index);
                self.headers.remove(index);
                if index < self.units.len() {
                    self.units.remove(index);
                }
                continue;
            }
            let column = &mut self.columns[index];
            column.samples = match sampling.filter(|_| i == timers[0]) {
                Some(sampling) => (0..count).map(|row| sampling.time(row) / factor).collect(),
                None => channel.values,
            };
            column.samples.resize(count, f64::NAN);
            column.unapplied.extend(channel.unapplied);
            column.late = channel.late;
            index += 1;
        }
        self.lines.truncate(count);
        self.notes.push(note);
        true
    }

    /// The columns of a run, as long as it has times.
    fn part(&self, range: std::ops::Range<usize>) -> Self {
        let times = &self.columns[range.start].samples;
        let rows = times
            .iter()
            .rposition(|t| t.is_finite())
            .map_or(0, |last| last + 1);
        let column = |own: &ColumnValues| {
            let samples = own.samples[..rows.min(own.samples.len())].to_vec();
            let unnumbered = own
                .unnumbered
                .clone()
                .filter(|_| samples.iter().any(|x| x.is_nan()) || own.unreadable.is_some());
            ColumnValues {
                samples,
                unnumbered,
                ..own.clone()
            }
        };
        Self {
            headers: self.headers[range.clone()].to_vec(),
            units: self
                .units
                .get(range.clone())
                .map_or_else(Vec::new, <[String]>::to_vec),
            lines: self.lines[..rows].to_vec(),
            columns: self.columns[range.clone()].iter().map(column).collect(),
            first: range.start,
            path: self.path.clone(),
            origin: self.origin.clone(),
            notes: self.notes.clone(),
            stated_step: self.stated_step,
        }
    }
}

/// Fields of a line of names; blanks do not part a name from its unit in brackets.
fn split(line: &str, sign: char) -> Vec<String> {
    if sign != ' ' {
        return line
            .split(sign)
            .map(|f| f.trim().trim_matches('"').to_owned())
            .collect();
    }
    let mut fields: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match fields.last_mut() {
            Some(last) if word.starts_with(['(', '[']) => *last = format!("{last} {word}"),
            _ => fields.push(word.to_owned()),
        }
    }
    fields
}
