//! Decompression of Snappy. Reference: Google, "Snappy compressed format description".

use super::super::bytes::Bytes;
use super::thrift::varint;
use crate::error::InputError;

/// Decompresses into `target`, whose length is that of the data; `None` for damaged data.
///
/// # Errors
/// When the data are truncated.
pub(super) fn decompress(
    bytes: &mut Bytes,
    target: &mut [u8],
    what: &str,
) -> Result<Option<()>, InputError> {
    if varint(bytes, what)? != target.len() as u64 {
        return Ok(None);
    }
    let mut at = 0;
    while !bytes.is_empty() {
        let tag = bytes.uint(1, what)?;
        let done = match tag & 3 {
            0 => {
                let length = match tag >> 2 {
                    short @ 0..60 => short,
                    long => bytes.uint(long - 59, what)?,
                };
                let literal = bytes.take(length.saturating_add(1), what)?;
                let to = target
                    .get_mut(at..)
                    .and_then(|to| to.get_mut(..literal.len()));
                to.map(|to| {
                    to.copy_from_slice(literal);
                    literal.len()
                })
            }
            1 => {
                let back = ((tag >> 5) << 8) | bytes.uint(1, what)?;
                repeat(target, at, back, 4 + ((tag >> 2) & 7))
            }
            kind => {
                let back = bytes.uint(if kind == 2 { 2 } else { 4 }, what)?;
                repeat(target, at, back, 1 + (tag >> 2))
            }
        };
        match done {
            Some(count) => at += count,
            None => return Ok(None),
        }
    }
    Ok((at == target.len()).then_some(()))
}

/// Repeats `length` bytes from `back` bytes before; these may overlap.
fn repeat(target: &mut [u8], at: usize, back: u64, length: u64) -> Option<usize> {
    let (back, length) = (usize::try_from(back).ok()?, usize::try_from(length).ok()?);
    let from = at.checked_sub(back).filter(|_| back > 0)?;
    target.get(at..at.checked_add(length)?)?;
    for i in 0..length {
        let byte = *target.get(from + i)?;
        *target.get_mut(at + i)? = byte;
    }
    Some(length)
}
