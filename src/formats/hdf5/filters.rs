//! Filters of the chunks of a data set: deflate, shuffle and checksums.

use super::super::budget::{Budget, Stream};
use super::super::bytes::Bytes;
use crate::error::InputError;

const FILTERS: &str = "the filters of an array";
/// Length of a checksum by the method of Fletcher, behind the data.
const CHECKSUM: u64 = 4;
/// Numbers of filters from here on have names in the message.
const NAMED: u64 = 256;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    Deflate,
    Shuffle,
    Fletcher,
    /// Any other, by its number.
    Other(u64),
}

/// Reads the list of filters, in the order of writing.
///
/// # Errors
/// When it is truncated.
pub(super) fn list(mut bytes: Bytes) -> Result<Vec<Filter>, InputError> {
    let version = bytes.uint(1, FILTERS)?;
    let count = bytes.uint(1, FILTERS)?;
    bytes.skip(if version == 1 { 6 } else { 0 });
    let mut filters = Vec::new();
    for _ in 0..count {
        let number = bytes.uint(2, FILTERS)?;
        let length = match version == 1 || number >= NAMED {
            true => bytes.uint(2, FILTERS)?,
            false => 0,
        };
        bytes.skip(2);
        let parameters = bytes.uint(2, FILTERS)?;
        bytes.take(length, FILTERS)?;
        bytes.take(4 * parameters, FILTERS)?;
        bytes.skip(if version == 1 {
            4 * (parameters as usize % 2)
        } else {
            0
        });
        filters.push(match number {
            1 => Filter::Deflate,
            2 => Filter::Shuffle,
            3 => Filter::Fletcher,
            number => Filter::Other(number),
        });
    }
    Ok(filters)
}

/// The name of a filter that is not read.
pub(super) fn refused(filters: &[Filter]) -> Option<String> {
    filters.iter().find_map(|filter| match filter {
        Filter::Other(4) => Some("data compressed by SZIP".to_owned()),
        Filter::Other(32000) => Some("data compressed by LZF".to_owned()),
        Filter::Other(32001) => Some("data compressed by Blosc".to_owned()),
        Filter::Other(32015) => Some("data compressed by Zstandard".to_owned()),
        Filter::Other(number) => Some(format!("data with the filter {number} of HDF5")),
        _ => None,
    })
}

/// The `stated` bytes of a chunk; `mask` has a bit for each filter that was left out, `size` is that of an element.
///
/// # Errors
/// When they are damaged, or have another length.
pub(super) fn undo(
    raw: &[u8],
    filters: &[Filter],
    mask: u64,
    [stated, size]: [usize; 2],
    budget: &mut Budget,
    what: &str,
) -> Result<Vec<u8>, InputError> {
    let applied = |i: usize| mask.checked_shr(i as u32).unwrap_or(0) & 1 == 0;
    let mut data = raw.to_vec();
    for (i, filter) in filters
        .iter()
        .enumerate()
        .rev()
        .filter(|(i, _)| applied(*i))
    {
        match filter {
            Filter::Deflate => {
                let inner = filters.iter().take(i).enumerate();
                let sums = inner.filter(|(j, f)| **f == Filter::Fletcher && applied(*j));
                let length = stated as u64 + CHECKSUM * sums.count() as u64;
                data = budget.inflate(&data, Stream::Zlib, Some(length), what)?;
            }
            Filter::Fletcher => data.truncate(data.len().saturating_sub(CHECKSUM as usize)),
            Filter::Shuffle => data = unshuffled(&data, size),
            Filter::Other(_) => {}
        }
    }
    if data.len() == stated {
        return Ok(data);
    }
    let found = format!("a chunk of {} bytes", data.len());
    let error = budget.damaged(what).found(found);
    Err(error.expected(format!("{stated} bytes")))
}

/// Elements from a list of their first bytes, of their second bytes, and so on; bytes beyond whole elements stay.
fn unshuffled(data: &[u8], size: usize) -> Vec<u8> {
    let count = data.len() / size.max(1);
    let mut elements = data.to_vec();
    for (i, byte) in data.iter().take(count * size).enumerate() {
        if let Some(to) = elements.get_mut(i % count.max(1) * size + i / count.max(1)) {
            *to = *byte;
        }
    }
    elements
}
