//! Pages of a column: dictionaries, and values with their missing ones.

use std::path::Path;

use super::super::budget::{Budget, Stream, damaged};
use super::super::bytes::Bytes;
use super::super::number::{ByteOrder, NumberType};
use super::metadata::{Chunk, Column};
use super::snappy;
use super::thrift::{self, Value, varint};
use crate::error::InputError;

/// Types of pages.
const DATA: i64 = 0;
const DICTIONARY: i64 = 2;
const DATA_2: i64 = 3;
/// Encodings of values.
const PLAIN: i64 = 0;
const BY_DICTIONARY: [i64; 2] = [2, 8];
/// Bytes of a header of gzip without further fields, and of its checksum and length at the end.
const GZIP: [usize; 2] = [10, 8];

/// A page without its compression.
struct Page {
    /// Number of values, with the missing ones.
    count: usize,
    /// Levels and values.
    bytes: Vec<u8>,
    /// Bytes of the levels in front; `None` where they state their length themselves.
    levels: Option<usize>,
    encoding: i64,
}

/// Appends the values of a column in one row group; the content of one that is not read.
///
/// # Errors
/// When a page is damaged, or the values exceed the budget.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    chunk: &Chunk,
    column: &Column,
    what: &str,
    values: &mut Vec<f64>,
    budget: &mut Budget,
) -> Result<Option<String>, InputError> {
    let Ok(kind) = column.kind else {
        return Ok(None);
    };
    if !(0..=2).contains(&chunk.codec) {
        let names = ["LZO", "Brotli", "LZ4", "Zstandard", "LZ4"];
        let name = usize::try_from(chunk.codec - 3)
            .ok()
            .and_then(|i| names.get(i));
        let name = name.copied().unwrap_or("an unknown method");
        return Ok(Some(format!("data compressed by {name}")));
    }
    let mut pages = Bytes::new(path, bytes, ByteOrder::Little);
    pages.take(chunk.begin as u64, what)?;
    let mut pages = pages.part(chunk.length as u64, what)?;
    let mut dictionary: Vec<f64> = Vec::new();
    let mut left = chunk.values;
    while left > 0 {
        let header = thrift::read(&mut pages, what)?;
        let body = pages.part(header.count(3).unwrap_or(0) as u64, what)?;
        let kind_of_page = header.integer(1).unwrap_or(-1);
        if ![DATA, DICTIONARY, DATA_2].contains(&kind_of_page) {
            continue;
        }
        let page = decompressed(path, &header, kind_of_page, body, chunk.codec, what, budget)?;
        if kind_of_page == DICTIONARY {
            dictionary.clear();
            budget.grow(&mut dictionary, page.count)?;
            let values = kind.values(&page.bytes, ByteOrder::Little, 0, kind.size());
            dictionary.extend(values.take(page.count));
            continue;
        }
        left = left
            .checked_sub(page.count)
            .filter(|_| page.count > 0)
            .ok_or_else(|| {
                let found = format!("a page of {} values, where {left} are left", page.count);
                damaged(path, what).found(found)
            })?;
        if page.encoding != PLAIN && !BY_DICTIONARY.contains(&page.encoding) {
            return Ok(Some(format!(
                "data with the encoding {} of Parquet",
                page.encoding
            )));
        }
        budget.grow(values, page.count)?;
        append(
            path,
            &page,
            kind,
            column.is_optional,
            &dictionary,
            what,
            values,
        )?;
    }
    Ok(None)
}

/// A page with its values decompressed.
fn decompressed(
    path: &Path,
    header: &Value,
    kind: i64,
    mut body: Bytes,
    codec: i64,
    what: &str,
    budget: &mut Budget,
) -> Result<Page, InputError> {
    let stated = header.count(2).unwrap_or(0);
    let field = match kind {
        DATA => 5,
        DICTIONARY => 7,
        _ => 8,
    };
    let own = header.field(field).unwrap_or(&Value::Other);
    let is_second = kind == DATA_2;
    let levels = match is_second {
        true => own
            .count(5)
            .unwrap_or(0)
            .saturating_add(own.count(6).unwrap_or(0)),
        false => 0,
    };
    let codec = match own.integer(7) {
        Some(0) if is_second => 0,
        _ => codec,
    };
    let front = body.take(levels as u64, what)?;
    let mut bytes = front.to_vec();
    let length = stated.saturating_sub(levels);
    bytes.extend(expanded(path, body, codec, length, what, budget)?);
    Ok(Page {
        count: own.count(1).unwrap_or(0),
        bytes,
        levels: is_second.then_some(levels),
        encoding: own.integer(if is_second { 4 } else { 2 }).unwrap_or(-1),
    })
}

/// Bytes without their compression, `length` of them.
fn expanded(
    path: &Path,
    mut bytes: Bytes,
    codec: i64,
    length: usize,
    what: &str,
    budget: &mut Budget,
) -> Result<Vec<u8>, InputError> {
    let unreadable = || damaged(path, what).found("data that cannot be decompressed");
    match codec {
        0 => Ok(bytes.rest().to_vec()),
        1 => {
            let mut target = budget.buffer(length, what)?;
            snappy::decompress(&mut bytes, &mut target, what)?.ok_or_else(unreadable)?;
            Ok(target)
        }
        _ => {
            let data = bytes.rest();
            let end = data.len().saturating_sub(GZIP[1]);
            let is_plain = data.starts_with(&[0x1f, 0x8b, 8, 0]);
            let inner = data.get(GZIP[0]..end).filter(|_| is_plain);
            let inner = inner.ok_or_else(unreadable)?;
            budget.inflate(inner, Stream::Deflate, Some(length as u64), what)
        }
    }
}

/// Appends the values of a page, NaN for missing ones.
fn append(
    path: &Path,
    page: &Page,
    kind: NumberType,
    is_optional: bool,
    dictionary: &[f64],
    what: &str,
    values: &mut Vec<f64>,
) -> Result<(), InputError> {
    let mut bytes = Bytes::new(path, &page.bytes, ByteOrder::Little);
    let levels = match (page.levels, is_optional) {
        (Some(length), _) => bytes.take(length as u64, what)?,
        (None, true) => {
            let length = bytes.u32(what)?;
            bytes.take(u64::from(length), what)?
        }
        (None, false) => &[],
    };
    let present = match is_optional {
        true => {
            let mut levels = Bytes::new(path, levels, ByteOrder::Little);
            let levels = hybrid(&mut levels, 1, page.count, what)?;
            levels.iter().map(|level| *level == 1).collect()
        }
        false => vec![true; page.count],
    };
    let count = present.iter().filter(|is| **is).count();
    let found: Vec<f64> = match page.encoding {
        PLAIN => kind
            .values(bytes.rest(), ByteOrder::Little, 0, kind.size())
            .take(count)
            .collect(),
        _ if count == 0 => Vec::new(),
        _ => {
            let width = bytes.uint(1, what)?;
            let indices = hybrid(&mut bytes, width, count, what)?;
            let each = indices.iter().map(|i| dictionary.get(*i as usize).copied());
            each.collect::<Option<_>>().unwrap_or_default()
        }
    };
    if found.len() != count {
        let found = format!("a page with {} values", found.len());
        let error = damaged(path, what).found(found);
        return Err(error.expected(format!("{count}")));
    }
    let mut found = found.into_iter();
    values.extend(present.iter().map(|is| match is {
        true => found.next().unwrap_or(f64::NAN),
        false => f64::NAN,
    }));
    Ok(())
}

/// `count` integers of `width` bits, in runs of equal ones and packed groups of eight.
fn hybrid(bytes: &mut Bytes, width: u64, count: usize, what: &str) -> Result<Vec<u32>, InputError> {
    let width = width.min(32);
    let mut found = Vec::with_capacity(count);
    while found.len() < count {
        let left = count - found.len();
        if width == 0 {
            found.resize(count, 0);
            break;
        }
        let head = varint(bytes, what)?;
        let run = usize::try_from(head >> 1).unwrap_or(usize::MAX);
        if head & 1 == 0 {
            if run == 0 {
                return Err(bytes
                    .error(&format!("the file is damaged: {what}"))
                    .found("a run of no values"));
            }
            let value = bytes.uint(width.div_ceil(8), what)? as u32;
            found.resize(found.len() + run.min(left), value);
            continue;
        }
        // Padding of the last group may be left out.
        let least = (left.min(run.saturating_mul(8)) as u64)
            .saturating_mul(width)
            .div_ceil(8);
        let full = (run as u64)
            .saturating_mul(width)
            .min(bytes.left() as u64)
            .max(least);
        let packed = bytes.take(full, what)?;
        if full == 0 {
            return Err(bytes
                .error(&format!("the file is damaged: {what}"))
                .found("a group of no values"));
        }
        for i in 0..left.min(run.saturating_mul(8)) {
            let bit = i * width as usize;
            let window = packed.iter().skip(bit / 8).take(5).rev();
            let window = window.fold(0u64, |sum, byte| (sum << 8) | u64::from(*byte));
            found.push(((window >> (bit % 8)) & ((1 << width) - 1)) as u32);
        }
    }
    Ok(found)
}
