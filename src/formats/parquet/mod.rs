//! Files of Apache Parquet, with the feature `parquet`: flat columns of numbers, in pages that are plain or by dictionary, uncompressed or
//! compressed by Snappy or gzip. Missing values become NaN. Reference: Apache Software Foundation, "Apache Parquet File Format", version 2.

mod metadata;
mod page;
mod snappy;
mod thrift;

use std::path::Path;

use super::Channels;
use super::budget::{Budget, damaged};
use super::bytes::Bytes;
use super::number::ByteOrder;
use crate::error::InputError;
use metadata::{Chunk, Column};
use thrift::Value;

/// Last bytes of a file, behind the length of the metadata.
const MAGIC: &[u8] = b"PAR1";
const METADATA: &str = "the metadata";

pub(super) fn read<'a>(
    path: &'a Path,
    bytes: &[u8],
    budget: &mut Budget<'a>,
) -> Result<Channels, InputError> {
    let footer = bytes.strip_suffix(MAGIC).and_then(|b| b.split_last_chunk());
    let Some((before, length)) = footer else {
        return Err(
            InputError::file(path, "the file is truncated in the metadata")
                .found("no `PAR1` at the end of the file")
                .hint("copy or export the file again"),
        );
    };
    let length = u32::from_le_bytes(*length) as usize;
    let begin = before.len().checked_sub(length);
    let metadata = begin.and_then(|begin| before.get(begin..)).ok_or_else(|| {
        let found = format!(
            "metadata of {length} bytes in a file of {} bytes",
            bytes.len()
        );
        damaged(path, METADATA).found(found)
    })?;
    let metadata = thrift::read(&mut Bytes::new(path, metadata, ByteOrder::Little), METADATA)?;
    let mut channels = Channels::default();
    for column in metadata::columns(&metadata) {
        budget.name(&column.name)?;
        match column.kind {
            Err((content, hint)) => channels.refuse(&column.name, content, hint),
            Ok(_) => read_column(path, bytes, &metadata, &column, &mut channels, budget)?,
        }
    }
    Ok(channels)
}

/// One column from all row groups.
fn read_column(
    path: &Path,
    bytes: &[u8],
    metadata: &Value,
    column: &Column,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let what = format!("the column {}", crate::text_io::quote(&column.name));
    let mut values = Vec::new();
    for chunk in metadata::chunks(metadata, column.index) {
        let chunk: Chunk =
            chunk.ok_or_else(|| damaged(path, METADATA).found(format!("no place of {what}")))?;
        let refused = page::read(path, bytes, &chunk, column, &what, &mut values, budget)?;
        if let Some(content) = refused {
            let hint = "in Python: `pandas.read_parquet(file).to_parquet(file)`";
            channels.refuse(&column.name, content, Some(hint));
            return Ok(());
        }
    }
    match values.is_empty() {
        true => channels.refuse(&column.name, "an empty array", None),
        false => channels.push(&column.name, None, None, values),
    }
    Ok(())
}
