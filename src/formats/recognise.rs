//! Recognition of the format of a file by its first bytes.

use std::path::Path;

use super::{Format, hdf5, lvm, mat5, npy, series, tdms, uff};
use crate::error::InputError;

/// Extensions of binary files, in lower case, and the formats that they stand for.
const EXTENSIONS: [(&str, &[Format]); 11] = [
    ("npy", &[Format::Npy]),
    ("npz", &[Format::Npz]),
    ("wav", &[Format::Wav]),
    ("uff", &[Format::Uff]),
    ("unv", &[Format::Uff]),
    (
        "mat",
        &[Format::Mat5, Format::Mat4, Format::Mat73, Format::Hdf5],
    ),
    ("h5", &[Format::Hdf5, Format::Mat73]),
    ("nc", &[Format::Hdf5, Format::NetCdf3]),
    ("hdf5", &[Format::Hdf5, Format::Mat73]),
    ("tdms", &[Format::Tdms]),
    ("parquet", &[Format::Parquet]),
];

/// Extensions of text tables and of binary files, in lower case.
pub const DATA_EXTENSIONS: [&str; 16] = [
    "csv", "tsv", "txt", "dat", "asc", "npy", "npz", "wav", "uff", "unv", "mat", "h5", "hdf5",
    "nc", "tdms", "parquet",
];

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// True for the extension of a data file, text or binary.
pub fn has_data_extension(path: &Path) -> bool {
    extension(path).is_some_and(|own| DATA_EXTENSIONS.contains(&own.as_str()))
}

/// The format of a file that begins with `bytes`, or `None` for text.
///
/// # Errors
/// When its extension is that of another format.
pub fn recognise(path: &Path, bytes: &[u8]) -> Result<Option<Format>, InputError> {
    let extension = extension(path).unwrap_or_default();
    let stated = EXTENSIONS.iter().find(|(own, _)| *own == extension);
    let mut found = by_content(bytes);
    // Version 4 of MATLAB has no magic; text does not begin with its zeros.
    if found.is_none() && extension == "mat" && begins_as_mat4(bytes) {
        found = Some(Format::Mat4);
    }
    let Some((_, formats)) = stated else {
        return Ok(found);
    };
    if found.is_some_and(|found| formats.contains(&found)) {
        return Ok(found);
    }
    let expected = formats.first().map(ToString::to_string).unwrap_or_default();
    let problem = format!("the file is no {expected}, although its name ends with .{extension}");
    let error =
        InputError::file(path, problem).expected(format!("the first bytes of a {expected}"));
    Err(match found {
        Some(found) => error
            .found(format!("a {found}"))
            .hint("rename the file to its format"),
        None if bytes.is_empty() => error.found("an empty file"),
        None => error
            .found(match bytes.iter().take(1000).all(|byte| *byte >= b'\t') {
                true => "text".to_owned(),
                false => format!("the bytes {}", hexadecimal(bytes)),
            })
            .hint("if it is a text table, rename it to .txt"),
    })
}

/// True for the type of a first matrix of version 4: 1000 M + 10 P + T with M the byte order, P the precision and T the kind.
fn begins_as_mat4(bytes: &[u8]) -> bool {
    let Some(Ok(first)) = bytes.get(..4).map(<[u8; 4]>::try_from) else {
        return false;
    };
    let is_type =
        |code: u32, order: u32| code / 1000 == order && code % 1000 / 10 <= 5 && code % 10 <= 2;
    is_type(u32::from_le_bytes(first), 0) || is_type(u32::from_be_bytes(first), 1)
}

/// The first bytes, as `50 4b 03 04`.
fn hexadecimal(bytes: &[u8]) -> String {
    let bytes = bytes.iter().take(8).map(|byte| format!("{byte:02x}"));
    bytes.collect::<Vec<_>>().join(" ")
}

fn by_content(bytes: &[u8]) -> Option<Format> {
    let magic: [(&[u8], Format); 17] = [
        (lvm::MAGIC, Format::Lvm),
        (npy::MAGIC, Format::Npy),
        (b"PK\x03\x04", Format::Npz),
        (b"PK\x05\x06", Format::Npz),
        (tdms::MAGIC, Format::Tdms),
        (b"TDSh", Format::TdmsIndex),
        (b"MATLAB 7.3 MAT-file", Format::Mat73),
        (b"MATLAB 5.0 MAT-file", Format::Mat5),
        (hdf5::SIGNATURE, Format::Hdf5),
        (b"CDF\x01", Format::NetCdf3),
        (b"CDF\x02", Format::NetCdf3),
        (b"CDF\x05", Format::NetCdf3),
        (b"PAR1", Format::Parquet),
        (b"\x1f\x8b\x08", Format::Gzip),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", Format::Workbook),
        (b"\x80\x04\x95", Format::Pickle),
        (b"\x80\x05\x95", Format::Pickle),
    ];
    let found = magic.iter().find(|(magic, _)| bytes.starts_with(magic));
    if let Some((_, format)) = found {
        return Some(*format);
    }
    let form = bytes.get(8..12);
    let kinds: [&[u8]; 3] = [b"RIFF", b"RIFX", b"RF64"];
    if form == Some(b"WAVE") && kinds.iter().any(|kind| bytes.starts_with(kind)) {
        return Some(Format::Wav);
    }
    // Programs other than MATLAB write another text before version and byte order.
    let version = bytes.get(mat5::HEADER - 4..mat5::HEADER);
    if matches!(version, Some(b"\x00\x01IM" | b"\x01\x00MI")) {
        return Some(Format::Mat5);
    }
    match uff::begins_so(bytes) {
        true => Some(Format::Uff),
        false => series::begins_so(bytes).then_some(Format::Series),
    }
}
