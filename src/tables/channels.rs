//! Tables from the channels of a binary file: one for each set of channels with the same times.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::origin::{ChannelFile, ChannelOrigin, ColumnValues, Origin};
use super::{ColumnName, Table, TableFormat, field};
use crate::error::{InputError, Location};
use crate::formats::{self, Channels, FileChannel, Format, Sampling, Unusable, last_part};
use crate::memory;
use crate::quantity_names::quantity_of;
use crate::text_io::{listed, quote};
use crate::units::Measurand;
use kmcfit_core::number_format::significant;

/// Names of the column of times that is made from a sampling rate or interval; the second where a channel has the first.
const TIME: [&str; 2] = ["time", "sampling time"];
/// Numbers stored for each sample beside the columns, as for text.
const NUMBERS_PER_SAMPLE: usize = 14;

impl Table {
    /// Tables of a binary file.
    pub(super) fn from_binary(
        path: &Path,
        bytes: Vec<u8>,
        binary: Format,
        format: &TableFormat,
    ) -> Result<Vec<Self>, InputError> {
        if let Some(given) = format.first_given() {
            return Err(InputError::argument(
                given,
                "a format of text is stated for a binary file",
            )
            .found(format!("{}, a {binary}", path.display()))
            .expected("a text table, or no `format`"));
        }
        let Channels {
            channels,
            unusable,
            notes,
            ..
        } = formats::read(path, &bytes, binary)?;
        // The numbers take as much again.
        drop(bytes);
        let mut keys = BTreeMap::new();
        let mut file = ChannelFile {
            format: binary,
            names: Vec::new(),
            sets: Vec::new(),
            unusable,
            notes,
        };
        let mut members: Vec<Vec<(usize, FileChannel)>> = Vec::new();
        for (i, channel) in channels.into_iter().enumerate() {
            let length = channel.values.len();
            let key = (length, channel.sampling.map(Sampling::key));
            let set = *keys.entry(key).or_insert(members.len());
            if set == members.len() {
                members.push(Vec::new());
                file.sets.push((length, channel.sampling));
            }
            file.names.push((channel.name.clone(), set));
            if let Some(members) = members.get_mut(set) {
                members.push((i + 1, channel));
            }
        }
        let file = Arc::new(file);
        let tables = members.into_iter().enumerate();
        tables
            .map(|(set, members)| Self::of_set(path, &file, set, members))
            .collect()
    }

    fn of_set(
        path: &Path,
        file: &Arc<ChannelFile>,
        set: usize,
        members: Vec<(usize, FileChannel)>,
    ) -> Result<Self, InputError> {
        let (rows, sampling) = file.sets.get(set).copied().unwrap_or_default();
        let numbers = rows.saturating_mul(members.len() + NUMBERS_PER_SAMPLE);
        memory::check_file(path, numbers.saturating_mul(size_of::<f64>()) as u64)?;
        let origin = Origin::Channels(ChannelOrigin {
            file: Arc::clone(file),
            set,
            numbers: members.iter().map(|(number, _)| *number).collect(),
        });
        let mut table = Self::empty(path, origin);
        table.lines = (1..=rows).collect();
        table.notes.clone_from(&file.notes);
        table.stated_step = members.iter().find_map(|(_, own)| own.stated_step);
        for (_, channel) in members {
            table.push_channel(channel);
        }
        if let Some(sampling) = sampling {
            let is_taken = |name: &&&str| table.headers.iter().any(|header| header == **name);
            let name = TIME.iter().find(|name| !is_taken(name)).unwrap_or(&TIME[1]);
            table.push_channel(FileChannel {
                name: (*name).to_owned(),
                unit: Some("s".to_owned()),
                values: (0..rows).map(|i| sampling.time(i)).collect(),
                ..FileChannel::default()
            });
            if let Origin::Channels(origin) = &mut table.origin {
                origin.numbers.push(0);
            }
        }
        table.state_clocks();
        Ok(table)
    }

    fn push_channel(&mut self, channel: FileChannel) {
        let location = |row: usize| Location::Sample {
            file: self.path.clone(),
            sample: row + 1,
            channel: Some(channel.name.clone()),
        };
        let samples = channel.values;
        let unnumbered = samples.iter().position(|x| !x.is_finite());
        let unreadable = samples.iter().position(|x| x.is_infinite());
        let text = |row: usize| {
            samples
                .get(row)
                .map(ToString::to_string)
                .unwrap_or_default()
        };
        self.columns.push(ColumnValues {
            unnumbered: unnumbered.map(|row| field::not_a_number(location(row), &text(row), '.')),
            unreadable: unreadable.map(|row| {
                InputError::new(location(row), "not a finite number")
                    .found(quote(&text(row)))
                    .expected("a finite number, or NaN for a missing sample")
            }),
            samples,
            unapplied: channel.unapplied,
            late: channel.late,
            ..ColumnValues::default()
        });
        self.headers.push(channel.name);
        self.units.push(channel.unit.unwrap_or_default());
    }

    /// The table of a file that has the columns.
    ///
    /// A binary file can have several sets of channels with different times; the one with the most of these columns is taken, so
    /// that [`find`](Self::find) reports those that it lacks.
    ///
    /// # Errors
    /// When the file has no table.
    pub fn with_columns<'a>(
        tables: &'a [Self],
        columns: &[ColumnName],
    ) -> Result<&'a Self, InputError> {
        let mut best: Option<(usize, &Self)> = None;
        for table in tables {
            let count = columns.iter().filter(|c| table.has(c)).count();
            if best.is_none_or(|(most, _)| count > most) {
                best = Some((count, table));
            }
        }
        best.map(|(_, table)| table)
            .ok_or_else(|| Self::several(&[]))
    }

    /// The only table of a file, apart from single numbers beside it.
    pub(crate) fn only(tables: Vec<Self>) -> Result<Self, InputError> {
        let has_samples = tables.iter().any(|table| table.rows() > 1);
        let mut found = tables;
        found.retain(|table| !has_samples || table.rows() > 1);
        match (found.pop(), found.first()) {
            (Some(only), None) => Ok(only),
            (Some(last), Some(_)) => {
                found.push(last);
                Err(Self::several(&found))
            }
            (None, _) => Err(Self::several(&[])),
        }
    }

    /// The error for a file with several sets of channels, none of which is named.
    pub fn several(tables: &[Self]) -> InputError {
        let sets = tables.iter().map(|table| {
            let names = (0..table.width()).filter(|i| Some(*i) != table.time_column());
            let names: Vec<String> = names.map(|i| quote(&table.label(i))).collect();
            format!(
                "{} ({})",
                listed(names.iter().map(String::as_str)),
                table.set_in_words()
            )
        });
        let found = sets.collect::<Vec<_>>().join("; ");
        let path = tables.first().map_or(Path::new(""), Self::path);
        InputError::file(
            path,
            "the file has several sets of channels with different times",
        )
        .found(found)
        .expected("columns of one of them, named in a model file")
        .hint("`kmcfit check FILE` lists them; `columns: {time: …, displacement: …}` names them")
    }

    /// Number of samples and sampling rate, in words.
    pub fn set_in_words(&self) -> String {
        let rate = match self.sampling() {
            Some(sampling) => {
                let rate = 1.0 / (sampling.time(1) - sampling.time(0));
                format!(" at {} Hz", significant(rate, 6))
            }
            None => String::new(),
        };
        match self.rows() {
            1 => "1 sample".to_owned(),
            rows => format!("{rows} samples{rate}"),
        }
    }

    fn channel_origin(&self) -> Option<&ChannelOrigin> {
        match &self.origin {
            Origin::Text(_) => None,
            Origin::Channels(origin) => Some(origin),
        }
    }

    fn sampling(&self) -> Option<Sampling> {
        let origin = self.channel_origin()?;
        origin.file.sets.get(origin.set)?.1
    }

    /// Index of the column of times that was made from the sampling rate or interval of the file.
    pub fn time_column(&self) -> Option<usize> {
        self.sampling()?;
        self.width().checked_sub(1)
    }

    /// Names of the channels of the file with other times.
    pub fn channels_of_other_times(&self) -> impl Iterator<Item = &str> + Clone {
        self.channel_origin().into_iter().flat_map(|origin| {
            let others = origin.file.names.iter();
            let others = others.filter(|(_, set)| *set != origin.set);
            others.map(|(name, _)| name.as_str())
        })
    }

    /// Variables of the file that hold no samples in time.
    pub fn unusable(&self) -> &[Unusable] {
        self.channel_origin()
            .map_or(&[], |origin| &origin.file.unusable)
    }

    /// Name by which the quantity of a column is recognised: the last part of the path in a binary file; of three axes `x`, `y` and `z` that of
    /// the file, as in `Gyroscope.csv`.
    pub fn quantity_name(&self, index: usize) -> &str {
        let header = self.headers().get(index).map_or("", String::as_str);
        if self.channel_origin().is_some() {
            return last_part(header);
        }
        let axes = ["x", "y", "z"];
        let has = |axis: &&str| self.headers.iter().any(|name| name == *axis);
        let file = self.path.file_stem().and_then(|stem| stem.to_str());
        let is_motion = |file: &&str| {
            let quantity = quantity_of(file);
            matches!(
                quantity,
                Some(Measurand::Acceleration | Measurand::Velocity)
            )
        };
        let is_axis = axes.contains(&header) && axes.iter().all(has);
        file.filter(is_motion).filter(|_| is_axis).unwrap_or(header)
    }

    /// Number of a column in the file, from 1; `None` for times made from a sampling rate or interval.
    pub fn number(&self, index: usize) -> Option<usize> {
        match self.channel_origin() {
            Some(origin) => origin.numbers.get(index).copied().filter(|n| *n > 0),
            None => Some(self.first + index + 1),
        }
    }

    /// Index of the column with this number in the file, from 1.
    pub(super) fn index_of(&self, number: usize) -> Option<usize> {
        let index = number.checked_sub(1)?;
        match self.channel_origin() {
            Some(origin) => origin.numbers.iter().position(|own| *own == number),
            None => index.checked_sub(self.first),
        }
    }

    /// Number of columns that have a number in the file.
    pub(super) fn numbered(&self) -> usize {
        self.channel_origin()
            .map_or(self.first + self.width(), |origin| origin.file.names.len())
    }

    /// Names of all columns; of a binary file those of all sets of channels.
    pub(super) fn all_names(&self) -> impl Iterator<Item = &str> + Clone {
        let own = self.headers().iter().map(String::as_str);
        own.chain(self.channels_of_other_times())
    }

    /// The name of the channel whose path ends with `name`, as a remedy.
    pub(super) fn by_last_part(&self, name: &str) -> Option<String> {
        self.channel_origin()?;
        let mut found = self.all_names().filter(|path| last_part(path) == name);
        let first = found.next()?;
        Some(format!("did you mean `{first}`?"))
    }

    /// The error for a channel of another set.
    pub(super) fn of_other_times(&self, column: &ColumnName) -> Option<InputError> {
        let origin = self.channel_origin()?;
        let names = &origin.file.names;
        let (name, set) = match column {
            ColumnName::Name(wanted) => names.iter().find(|(name, _)| name == wanted),
            ColumnName::Number(number) => names.get(number.checked_sub(1)?),
        }?;
        let (length, sampling) = origin.file.sets.get(*set)?;
        let rate = match sampling {
            Some(_) => ", at times of its own",
            None => "",
        };
        let samples = if *length == 1 { "sample" } else { "samples" };
        let own = self.headers().first().map_or("", String::as_str);
        Some(
            InputError::file(self.path(), "the columns have different times")
                .found(format!("{}: {length} {samples}{rate}", quote(name)))
                .expected(format!("{}, as {}", self.set_in_words(), quote(own)))
                .hint("name columns of the same length and rate; another channel can have its own `data` and `time`"),
        )
    }

    /// The error for a variable that holds no samples.
    pub(super) fn unusable_error(&self, name: &str) -> Option<InputError> {
        let found = self.unusable().iter().find(|other| other.name == name)?;
        Some(
            InputError::file(
                self.path(),
                format!("{} holds no samples in time", quote(name)),
            )
            .found(&found.content)
            .expected("real numbers")
            .hint_if(found.hint.clone()),
        )
    }
}
