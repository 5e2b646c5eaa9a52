//! Archives of arrays of NumPy, `.npz`: a zip file with one `.npy` for each array.

use std::io::{Cursor, Read as _};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;

use super::budget::{Budget, damaged};
use super::{Channels, Format, npy, refused};
use crate::error::InputError;
use crate::text_io::{quote, read_bytes_from};

/// The content of a file of gzip, and of an archive of one file that is no array; `None` for others.
///
/// # Errors
/// When it is damaged, or expands to far more than a table of text.
pub fn unpacked(
    path: &Path,
    bytes: &[u8],
    format: Option<Format>,
) -> Result<Option<Vec<u8>>, InputError> {
    let unpack = |error: InputError| error.hint("unpack the file, and name the table in it");
    let most = (bytes.len() as u64).saturating_mul(64) + (1 << 24);
    if format == Some(Format::Gzip) {
        let text = read_bytes_from(path, MultiGzDecoder::new(bytes), most);
        return text.map(Some).map_err(unpack);
    }
    let is_archive = format == Some(Format::Npz);
    let archive = is_archive.then(|| ZipArchive::new(Cursor::new(bytes)).ok());
    let Some(mut archive) = archive.flatten().filter(|archive| archive.len() == 1) else {
        return Ok(None);
    };
    let name = archive.name_for_index(0).and_then(Result::ok);
    if name.is_none_or(|name| name.ends_with(".npy") || name.ends_with(".xml")) {
        return Ok(None);
    }
    match archive.by_index(0) {
        Ok(file) => read_bytes_from(path, file, most).map(Some).map_err(unpack),
        Err(_) => Ok(None),
    }
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
        damaged(path, "the list of the archive's files").found(error.to_string())
    })?;
    if archive.index_for_name("xl/workbook.xml").is_some() {
        return Err(refused::whole(path, Format::Workbook));
    }
    let mut channels = Channels::default();
    for i in 0..archive.len() {
        let found = archive.name_for_index(i).and_then(Result::ok);
        let found = found.unwrap_or_default().into_owned();
        budget.name(&found)?;
        let Some(name) = found.strip_suffix(".npy") else {
            let hint = "unpack the archive, and name one of its files";
            channels.refuse(&found, "no array of NumPy", Some(hint));
            continue;
        };
        let what = format!("the file {}", quote(&found));
        let file = archive.by_index(i).map_err(|error| {
            InputError::file(path, format!("{what} of the archive cannot be read"))
                .found(error.to_string())
                .expected("files as `numpy.savez` and `numpy.savez_compressed` write them")
        })?;
        let length = usize::try_from(file.size()).unwrap_or(usize::MAX);
        let mut data = budget.buffer(length, &what)?;
        // One byte beyond the stated length shows that there are more; the checksum is compared at the end.
        let read = file.take(length as u64 + 1).read_to_end(&mut data);
        read.map_err(|error| damaged(path, &what).found(error.to_string()))?;
        if data.len() != length {
            return Err(damaged(path, &what)
                .found("another length than the archive states")
                .expected(format!("{length} bytes")));
        }
        npy::add(path, &data, name, budget, &mut channels)?;
    }
    Ok(channels)
}
