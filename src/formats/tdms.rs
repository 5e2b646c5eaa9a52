//! Files of LabVIEW: TDMS, versions 1 and 2.
//!
//! A file is a sequence of segments, each with descriptions of objects and chunks of raw data; what a segment does not describe again
//! is as in the segment before. Reference: National Instruments, "TDMS File Format Internal Structure".

use std::collections::BTreeMap;
use std::path::Path;

use super::budget::Budget;
use super::bytes::Bytes;
use super::number::ByteOrder;
use super::tdms_meta::{
    Properties, Property, RawData, RawIndex, SampleType, dotted, object, statements,
};
use super::{Channels, tdms_scales as scales};
use crate::error::InputError;

/// First bytes of a segment.
pub(super) const MAGIC: &[u8] = b"TDSm";
/// Flags of a segment.
const HAS_META: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const HAS_RAW: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const HAS_DAQMX: u32 = 1 << 7;
/// Bytes before a segment.
const LEAD: u64 = 28;

/// A channel over all segments.
struct Track {
    name: String,
    /// Path of its group.
    group: String,
    properties: Properties,
    index: Option<RawIndex>,
    values: Vec<f64>,
    /// Content, unless numbers.
    other: Option<&'static str>,
    /// Seconds of the first timestamp.
    epoch: Option<u64>,
    /// True with raw data in the current segment.
    is_active: bool,
}

#[derive(Default)]
struct Tracks {
    all: Vec<Track>,
    by_path: BTreeMap<String, usize>,
    /// Properties of the file and of groups.
    outer: BTreeMap<String, Properties>,
    /// Channels with raw data in the current segment.
    active: Vec<usize>,
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let mut file = Bytes::new(path, bytes, ByteOrder::Little);
    let mut tracks = Tracks::default();
    let mut unread = None;
    while !file.is_empty() && unread.is_none() {
        unread = match file.left() < LEAD as usize {
            true => Some(file.left()),
            false => segment(path, &mut file, &mut tracks, budget)?,
        };
    }
    let mut channels = Channels::default();
    if let Some(unread) = unread {
        channels.notes.push(format!(
            "the writing of the last segment was interrupted: its whole chunks are read, and not the last {unread} bytes"
        ));
    }
    let starts = tracks.all.iter().filter_map(Track::start);
    let first = starts.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let first = first.unwrap_or_default();
    let none = Properties::new();
    for (path, properties) in &tracks.outer {
        let (group, _) = dotted(path).unwrap_or_default();
        for (name, value) in statements(properties, first) {
            channels.state_group(&group, name, value);
        }
    }
    for track in tracks.all {
        let outer = |path: &str| tracks.outer.get(path).unwrap_or(&none);
        let outer = [outer(&track.group), outer("/")];
        track.finish(outer, first, &mut channels);
    }
    Ok(channels)
}

/// Reads a segment and returns the number of bytes at its end that are not read, where it is unfinished.
fn segment(
    path: &Path,
    file: &mut Bytes,
    tracks: &mut Tracks,
    budget: &mut Budget,
) -> Result<Option<usize>, InputError> {
    let what = "the beginning of a segment";
    let mut lead = file.part(LEAD, what)?;
    if lead.take(4, what)? != MAGIC {
        return Err(budget.damaged(what).expected("the letters `TDSm`"));
    }
    let flags = lead.u32(what)?;
    if flags & BIG_ENDIAN != 0 {
        lead.order = ByteOrder::Big;
    }
    lead.take(4, what)?;
    let (length, raw_at) = (lead.u64(what)?, lead.u64(what)?);
    // The end of a segment is missing where its writing or a copy was interrupted.
    let left = file.left() as u64;
    let is_unfinished = length > left;
    let stated = length.min(left);
    if is_unfinished && raw_at > left {
        return Ok(Some(file.left()));
    }
    let mut segment = file.part(stated, "a segment")?;
    segment.order = lead.order;
    if flags & HAS_META != 0 {
        let mut meta = segment.part(raw_at, "the descriptions of a segment")?;
        tracks.describe(path, &mut meta, flags & NEW_LIST != 0, budget)?;
    } else {
        segment.take(raw_at, "the descriptions of a segment")?;
    }
    if flags & HAS_DAQMX != 0 {
        return Err(daqmx(path));
    }
    let left = match flags & HAS_RAW != 0 {
        true => tracks.raw(&mut segment, flags & INTERLEAVED != 0, budget)?,
        false => 0,
    };
    match left > 0 && !is_unfinished {
        true => Err(budget
            .damaged("a segment")
            .found(format!("{left} bytes after its last chunk of samples"))),
        false => Ok(is_unfinished.then_some(left)),
    }
}

fn daqmx(path: &Path) -> InputError {
    InputError::file(path, "raw samples of NI-DAQmx are not supported")
        .found("a TDMS file logged by NI-DAQmx itself")
        .expected("samples with their scale applied")
        .hint("in Python: `nptdms.TdmsFile.read(file).as_dataframe().to_csv(...)`; or open and save it in DIAdem")
}

impl Tracks {
    /// Reads the descriptions of a segment.
    fn describe(
        &mut self,
        path: &Path,
        meta: &mut Bytes,
        is_new: bool,
        budget: &mut Budget,
    ) -> Result<(), InputError> {
        if is_new {
            for location in self.active.drain(..) {
                if let Some(track) = self.all.get_mut(location) {
                    track.is_active = false;
                }
            }
        }
        for _ in 0..meta.u32("the descriptions of a segment")? {
            let object = object(meta)?;
            if matches!(object.raw, RawData::Daqmx) {
                return Err(daqmx(path));
            }
            let Some((name, true)) = dotted(&object.path) else {
                let outer = self.outer.entry(object.path).or_default();
                outer.extend(object.properties);
                continue;
            };
            let location = match self.by_path.get(&object.path) {
                Some(location) => *location,
                None => {
                    budget.name(&name)?;
                    let group = object.path.rsplit_once("'/'").unwrap_or_default().0;
                    self.all.push(Track::new(name, format!("{group}'")));
                    self.by_path.insert(object.path, self.all.len() - 1);
                    self.all.len() - 1
                }
            };
            let Some(track) = self.all.get_mut(location) else {
                continue;
            };
            track.properties.extend(object.properties);
            match object.raw {
                RawData::New(index) => track.index = Some(index),
                RawData::Same | RawData::None | RawData::Daqmx => {}
            }
            let has_raw = !matches!(object.raw, RawData::None);
            if has_raw && !track.is_active {
                self.active.push(location);
            } else if !has_raw && track.is_active {
                self.active.retain(|active| *active != location);
            }
            track.is_active = has_raw;
        }
        Ok(())
    }

    /// Reads the chunks of a segment and returns the number of bytes that make no whole chunk.
    fn raw(
        &mut self,
        raw: &mut Bytes,
        interleaved: bool,
        budget: &mut Budget,
    ) -> Result<usize, InputError> {
        let indices: Vec<(usize, RawIndex)> = (self.active.iter())
            .filter_map(|location| Some((*location, self.all.get(*location)?.index?)))
            .filter(|(_, index)| index.size > 0)
            .collect();
        let sizes = indices.iter().map(|(_, index)| index.size);
        let chunk = sizes.fold(0, u64::saturating_add);
        if chunk == 0 {
            return Ok(raw.left());
        }
        let chunks = raw.left() as u64 / chunk;
        if interleaved {
            let count = indices.first().map_or(0, |(_, index)| index.count);
            if indices.iter().any(|(_, index)| index.count != count) {
                return Err(budget
                    .damaged("a segment")
                    .found("interleaved channels of different length"));
            }
            let data = raw.take(chunks * chunk, "the samples of a segment")?;
            let stride = chunk / count.max(1);
            let mut offset = 0;
            for (location, index) in indices {
                if let Some(track) = self.all.get_mut(location) {
                    track.add(
                        data,
                        raw.order,
                        offset as usize,
                        stride as usize,
                        index.kind,
                        budget,
                    )?;
                }
                offset += index.kind.size();
            }
            return Ok(raw.left());
        }
        for _ in 0..chunks {
            for (location, index) in &indices {
                let data = raw.take(index.size, "the samples of a segment")?;
                if let Some(track) = self.all.get_mut(*location) {
                    let stride = index.kind.size() as usize;
                    track.add(data, raw.order, 0, stride, index.kind, budget)?;
                }
            }
        }
        Ok(raw.left())
    }
}

impl Track {
    fn new(name: String, group: String) -> Self {
        Self {
            name,
            group,
            properties: Properties::new(),
            index: None,
            values: Vec::new(),
            other: None,
            epoch: None,
            is_active: false,
        }
    }

    fn add(
        &mut self,
        data: &[u8],
        order: ByteOrder,
        offset: usize,
        stride: usize,
        kind: SampleType,
        budget: &mut Budget,
    ) -> Result<(), InputError> {
        match kind {
            SampleType::Number(kind) => {
                budget.grow(&mut self.values, data.len() / stride.max(1))?;
                self.values.extend(kind.values(data, order, offset, stride));
            }
            SampleType::Timestamp => {
                budget.grow(&mut self.values, data.len() / stride.max(1))?;
                for record in data.chunks_exact(stride.max(1)) {
                    let time = record.get(offset..).unwrap_or_default();
                    let time = self.seconds(time, order);
                    self.values.push(time);
                }
            }
            SampleType::Other(content, _) => self.other = Some(content),
        }
        Ok(())
    }

    /// Seconds of a timestamp since the whole second of the first one.
    fn seconds(&mut self, bytes: &[u8], order: ByteOrder) -> f64 {
        let half = |at: usize| {
            let half: [u8; 8] = bytes.get(at..at + 8)?.try_into().ok()?;
            Some(match order {
                ByteOrder::Little => u64::from_le_bytes(half),
                ByteOrder::Big => u64::from_be_bytes(half),
            })
        };
        let (low, high) = (half(0).unwrap_or(0), half(8).unwrap_or(0));
        let (fraction, seconds) = match order {
            ByteOrder::Little => (low, high),
            ByteOrder::Big => (high, low),
        };
        let epoch = *self.epoch.get_or_insert(seconds);
        seconds.wrapping_sub(epoch) as i64 as f64 + fraction as f64 / 2f64.powi(64)
    }

    /// Time of the first sample, where the channel has an interval of samples.
    fn start(&self) -> Option<(i64, f64)> {
        self.properties.get("wf_increment")?;
        match self.properties.get("wf_start_time")? {
            Property::Time(seconds, fraction) => Some((*seconds, *fraction)),
            _ => None,
        }
    }

    /// Adds the channel to those of the file, with its scales applied: its own, else those of its group, else those of the file. `first` is
    /// the earliest start of a channel.
    fn finish(mut self, outer: [&Properties; 2], first: (i64, f64), channels: &mut Channels) {
        if let Some(other) = self.other {
            return channels.refuse(&self.name, other, None);
        }
        if self.values.is_empty() {
            return channels.refuse(&self.name, "no samples", None);
        }
        let [group, file] = outer;
        let mut of = [&self.properties, group, file].into_iter();
        let mut unknown = None;
        if let Some(scaled) = of.find(|properties| scales::count(properties) > 0) {
            match scales::of(scaled) {
                Ok(scales) => scales::apply(&scales, &mut self.values),
                Err(content) => unknown = Some(content),
            }
        }
        let unit = self.epoch.map(|_| "s".to_owned());
        let from = channels.channels.len();
        channels.push(&self.name, unit, None, self.values);
        if let Some(last) = channels.channels.last_mut() {
            last.unapplied.extend(unknown);
        }
        for (name, value) in statements(&self.properties, first) {
            channels.state(from, name, value);
        }
    }
}
