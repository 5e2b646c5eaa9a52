//! Messages about files that hold no record that can be read.

use std::path::Path;

use super::{Format, Unusable};
use crate::error::InputError;
use crate::text_io::quote;

/// Content that is expected of a data file.
const EXPECTED: &str = "a text table, or a file of NumPy, MATLAB, HDF5, LabVIEW (TDMS), WAV or UFF";

/// The error for a format that is refused as a whole.
pub(super) fn whole(path: &Path, format: Format) -> InputError {
    let hint = match format {
        Format::Parquet => {
            "export it as CSV from pandas: `pandas.read_parquet(file).to_csv('record.csv', index=False)`"
        }
        Format::NetCdf3 => {
            "write it as netCDF 4: `nccopy -k nc4 record.nc record4.nc`, or in Python `xarray.open_dataset(file).to_netcdf('record4.nc')`"
        }
        Format::Mat4 => "save it with `save('record.mat', '-v7')` in MATLAB",
        Format::TdmsIndex => "read the file with the ending .tdms beside it",
        Format::Gzip => "decompress it twice: `gunzip FILE`",
        Format::Pickle => {
            "a pickle can run code: save the numbers with `numpy.savez(file, t=t, y=y)`"
        }
        _ => "save the sheet as CSV",
    };
    InputError::file(path, format!("this is a {format}, which is not read"))
        .expected(EXPECTED)
        .hint(hint)
}

/// The error for members of a file that are nested too deeply.
pub(super) fn nested(path: &Path, name: &str, deepest: usize) -> InputError {
    InputError::file(path, "groups, structs or cells are nested too deeply")
        .found(quote(name))
        .expected(format!("at most {deepest} levels"))
}

/// The error for a file without a usable channel.
pub(super) fn nothing(path: &Path, format: Format, unusable: &[Unusable]) -> InputError {
    let error = InputError::file(
        path,
        format!("the {format} has no samples that can be used"),
    )
    .expected("arrays or channels of real numbers");
    match unusable.first() {
        None => error.found("no variable or channel"),
        Some(first) => {
            let more = match unusable.len() {
                1 => String::new(),
                count => format!("; {} more", count - 1),
            };
            let found = format!("{}: {}{more}", quote(&first.name), first.content);
            error.found(found).hint_if(first.hint.clone())
        }
    }
}
