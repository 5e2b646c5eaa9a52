//! Sound files: WAV with samples as integers or floating-point numbers, and its variants of 64 bits (RF64) and of the other byte order
//! (RIFX).
//!
//! Integers are divided by their full scale, so that samples are fractions from -1 to 1. References: Microsoft,
//! "Multiple Channel Audio Data and WAVE Files"; EBU Tech 3306 for RF64.

use std::path::Path;

use super::budget::Budget;
use super::bytes::Bytes;
use super::number::{ByteOrder, NumberType};
use super::{Channels, Sampling};
use crate::error::InputError;

/// Codes of encodings.
const INTEGER: u16 = 1;
const FLOAT: u16 = 3;
const EXTENSIBLE: u16 = 0xfffe;
/// A length that stands in the chunk `ds64`, or nowhere.
const NOT_HERE: u32 = u32::MAX;

/// Form of the samples.
struct Encoding {
    code: u16,
    channels: u16,
    rate: u32,
    bits: u16,
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let order = match bytes.starts_with(b"RIFX") {
        true => ByteOrder::Big,
        false => ByteOrder::Little,
    };
    let mut file = Bytes::new(path, bytes, order);
    file.take(12, "the header")?;
    let (mut encoding, mut long) = (None, None);
    while file.left() >= 8 {
        let id = file.take(4, "a chunk")?;
        let size = file.u32("a chunk")?;
        match id {
            b"fmt " => {
                let mut chunk = file.part(u64::from(size), "the chunk `fmt `")?;
                encoding = Some(encoding_of(&mut chunk)?);
            }
            b"ds64" => {
                let mut chunk = file.part(u64::from(size), "the chunk `ds64`")?;
                chunk.skip(8);
                long = Some(chunk.u64("the chunk `ds64`")?);
            }
            b"data" => {
                // Programs that write into a pipe state no length.
                let size = match (size, long) {
                    (NOT_HERE, long) => long.unwrap_or(file.left() as u64),
                    _ => u64::from(size),
                };
                let Some(encoding) = encoding else { break };
                let data = file.take(size, "the samples")?;
                return samples(path, &encoding, data, order, budget);
            }
            _ => {
                file.take(
                    u64::from(size),
                    &format!("the chunk `{}`", String::from_utf8_lossy(id)),
                )?;
            }
        }
        // Chunks begin at even places.
        file.skip((size & 1) as usize);
    }
    Err(InputError::file(path, "the file has no samples")
        .found("a WAV file without the chunks `fmt ` and `data`")
        .expected("both, in this order"))
}

fn encoding_of(chunk: &mut Bytes) -> Result<Encoding, InputError> {
    let what = "the chunk `fmt `";
    let mut encoding = Encoding {
        code: chunk.u16(what)?,
        channels: chunk.u16(what)?,
        rate: chunk.u32(what)?,
        bits: 0,
    };
    chunk.take(6, what)?;
    encoding.bits = chunk.u16(what)?;
    if encoding.code == EXTENSIBLE {
        chunk.take(8, what)?;
        encoding.code = chunk.u16(what)?;
    }
    Ok(encoding)
}

fn samples(
    path: &Path,
    encoding: &Encoding,
    bytes: &[u8],
    order: ByteOrder,
    budget: &mut Budget,
) -> Result<Channels, InputError> {
    let kind = match (encoding.code, encoding.bits) {
        (INTEGER, 8) => NumberType::U8,
        (INTEGER, 16) => NumberType::I16,
        (INTEGER, 24) => NumberType::I24,
        (INTEGER, 32) => NumberType::I32,
        (FLOAT, 32) => NumberType::F32,
        (FLOAT, 64) => NumberType::F64,
        (code, bits) => {
            return Err(InputError::file(path, "an encoding of samples that is not supported")
                .found(format!("{bits} bits of {}", encoding_name(code)))
                .expected("8, 16, 24 or 32 bits of integers, or 32 or 64 bits of floating-point numbers")
                .hint("export the samples without compression"));
        }
    };
    let channels = usize::from(encoding.channels);
    if channels == 0 || encoding.rate == 0 {
        return Err(InputError::file(path, "invalid header of a WAV file")
            .found(format!("{channels} channels at {} Hz", encoding.rate))
            .expected("at least 1 channel, and a sampling rate greater than 0"));
    }
    let (zero, full_scale) = match kind {
        NumberType::U8 => (128.0, 128.0),
        NumberType::F32 | NumberType::F64 => (0.0, 1.0),
        _ => (0.0, 2f64.powi(i32::from(encoding.bits) - 1)),
    };
    let stride = kind.size() * channels;
    let sampling = Some(Sampling::Rate(f64::from(encoding.rate)));
    let mut found = Channels::default();
    for i in 0..channels {
        let name = format!("channel {}", i + 1);
        budget.name(&name)?;
        let mut values = budget.list(bytes.len() / stride)?;
        let numbers = kind.values(bytes, order, i * kind.size(), stride);
        values.extend(numbers.map(|x| (x - zero) / full_scale));
        match values.is_empty() {
            true => found.refuse(&name, "no samples", None),
            false => found.push(&name, None, sampling, values),
        }
    }
    Ok(found)
}

fn encoding_name(code: u16) -> String {
    match code {
        INTEGER => "integers".into(),
        FLOAT => "floating-point numbers".into(),
        2 | 17 => "ADPCM".into(),
        6 => "A-law".into(),
        7 => "mu-law".into(),
        0x55 => "MP3".into(),
        code => format!("encoding {code}"),
    }
}
