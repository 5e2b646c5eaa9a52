//! Archives of arrays of NumPy, `.npz`: a zip file with one `.npy` for each array, stored or deflated.
//!
//! Reference: APPNOTE.TXT of PKWARE, version 6.3; sizes of 64 bits as in its extra field 1.

use std::path::Path;

use super::budget::{Budget, Stream};
use super::bytes::Bytes;
use super::number::ByteOrder;
use super::{Channels, Format, npy, refused};
use crate::error::InputError;
use crate::text_io::quote;

const CENTRAL: &[u8] = b"PK\x01\x02";
const END: &[u8] = b"PK\x05\x06";
const END_64: &[u8] = b"PK\x06\x06";
/// Length of the end record without its comment, and of a local header without name and extra field.
const END_LENGTH: usize = 22;
const LOCAL_LENGTH: u64 = 30;
/// Longest comment of an archive.
const LONGEST_COMMENT: usize = 0xffff;
/// A size that stands in the extra field.
const IN_EXTRA: u64 = 0xffff_ffff;

/// A file of the archive.
struct Entry {
    name: String,
    is_encrypted: bool,
    method: u16,
    checksum: u32,
    compressed: u64,
    length: u64,
    header: u64,
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let mut channels = Channels::default();
    let entries = entries(path, bytes, budget)?;
    if entries.iter().any(|entry| entry.name == "xl/workbook.xml") {
        return Err(refused::whole(path, Format::Workbook));
    }
    for entry in &entries {
        let Some(name) = entry.name.strip_suffix(".npy") else {
            channels.refuse(&entry.name, "no array of NumPy", None);
            continue;
        };
        let data = data(path, bytes, entry, budget)?;
        npy::add(path, &data, name, budget, &mut channels)?;
    }
    Ok(channels)
}

/// The central directory.
fn entries(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Vec<Entry>, InputError> {
    let damaged = || {
        InputError::file(
            path,
            "the file is truncated in the list of the archive's files",
        )
        .found("no end record of a zip archive")
        .expected("a list of its files at the end of the archive")
        .hint("copy or export the file again")
    };
    let tail = bytes.len().saturating_sub(END_LENGTH + LONGEST_COMMENT);
    let last = bytes.get(tail..).unwrap_or_default();
    let end = last.windows(END.len()).rposition(|mark| mark == END);
    let end = tail + end.ok_or_else(damaged)?;
    let what = "the list of the archive's files";
    let at = |from: usize| {
        Bytes::new(
            path,
            bytes.get(from..).unwrap_or_default(),
            ByteOrder::Little,
        )
    };
    let mut record = at(end);
    record.skip(10);
    let mut count = u64::from(record.u16(what)?);
    record.skip(4);
    let mut start = u64::from(record.u32(what)?);
    if start == IN_EXTRA || count == 0xffff {
        let before = bytes.get(..end).unwrap_or_default();
        let from = before
            .windows(END_64.len())
            .rposition(|mark| mark == END_64);
        let mut record = at(from.ok_or_else(damaged)?);
        record.skip(32);
        count = record.u64(what)?;
        record.skip(8);
        start = record.u64(what)?;
    }
    let mut list = at(usize::try_from(start).unwrap_or(usize::MAX));
    let mut found = Vec::new();
    for _ in 0..count {
        let entry = entry(&mut list, what)?.ok_or_else(damaged)?;
        budget.name(&entry.name)?;
        found.push(entry);
    }
    Ok(found)
}

/// The next entry of the central directory; `None` without its mark.
fn entry(list: &mut Bytes, what: &str) -> Result<Option<Entry>, InputError> {
    if list.take(4, what)? != CENTRAL {
        return Ok(None);
    }
    list.take(4, what)?;
    let flags = list.u16(what)?;
    let method = list.u16(what)?;
    list.take(4, what)?;
    let checksum = list.u32(what)?;
    let [mut compressed, mut length] = [list.u32(what)?, list.u32(what)?].map(u64::from);
    let [name, extra, comment] = [list.u16(what)?, list.u16(what)?, list.u16(what)?].map(u64::from);
    list.take(8, what)?;
    let mut header = u64::from(list.u32(what)?);
    let name = String::from_utf8_lossy(list.take(name, what)?).into_owned();
    let mut extra = list.part(extra, what)?;
    while extra.left() >= 4 {
        let id = extra.u16(what)?;
        let size = u64::from(extra.u16(what)?);
        let mut field = extra.part(size, what)?;
        if id == 1 {
            for value in [&mut length, &mut compressed, &mut header] {
                if *value == IN_EXTRA {
                    *value = field.u64(what)?;
                }
            }
        }
    }
    list.take(comment, what)?;
    Ok(Some(Entry {
        name,
        is_encrypted: flags & 1 != 0,
        method,
        checksum,
        compressed,
        length,
        header,
    }))
}

/// The content of a file of the archive, with its checksum verified.
fn data(
    path: &Path,
    bytes: &[u8],
    entry: &Entry,
    budget: &mut Budget,
) -> Result<Vec<u8>, InputError> {
    let what = format!("the file {}", quote(&entry.name));
    if entry.is_encrypted {
        return Err(InputError::file(path, "an encrypted file of the archive")
            .found(quote(&entry.name))
            .expected("files without a password, as `numpy.savez` writes them"));
    }
    let from = usize::try_from(entry.header).unwrap_or(usize::MAX);
    let mut local = Bytes::new(
        path,
        bytes.get(from..).unwrap_or_default(),
        ByteOrder::Little,
    );
    let mut fields = local.part(LOCAL_LENGTH, &what)?;
    fields.skip(26);
    let skipped = u64::from(fields.u16(&what)?) + u64::from(fields.u16(&what)?);
    local.take(skipped, &what)?;
    let stored = local.take(entry.compressed, &what)?;
    let content = match entry.method {
        0 => stored.to_vec(),
        8 => budget.inflate(stored, Stream::Deflate, Some(entry.length), &what)?,
        method => {
            return Err(InputError::file(path, "a compression method that is not supported")
                .found(format!("method {method} of {}", quote(&entry.name)))
                .expected("stored or deflated files, as `numpy.savez` and `numpy.savez_compressed` write them"));
        }
    };
    match crc32(&content) == entry.checksum {
        true => Ok(content),
        false => Err(budget
            .damaged(&what)
            .found("another checksum than the archive states")),
    }
}

/// Cyclic redundancy check of zip files (polynomial 0xEDB88320).
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let mut value = i as u32;
            let mut bit = 0;
            while bit < 8 {
                value = (value >> 1) ^ (0xedb8_8320 * (value & 1));
                bit += 1;
            }
            table[i] = value;
            i += 1;
        }
        table
    };
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (sum >> 8) ^ TABLE[usize::from((sum as u8) ^ byte)]
    })
}

#[cfg(test)]
mod tests {
    use super::crc32;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
    }
}
