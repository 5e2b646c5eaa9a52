//! Formats of files.

use std::fmt;

/// Format of a binary file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Array of NumPy.
    Npy,
    /// Zip archive, of arrays of NumPy unless it holds one other file.
    Npz,
    /// Sound file.
    Wav,
    /// Universal file.
    Uff,
    /// MATLAB, version 4; refused.
    Mat4,
    /// MATLAB, versions 5 to 7.
    Mat5,
    /// MATLAB, version 7.3.
    Mat73,
    /// LabVIEW.
    Tdms,
    /// Measurement file of LabVIEW, a text.
    Lvm,
    /// One series in rows of several numbers, a text.
    Series,
    /// Index file of LabVIEW; refused.
    TdmsIndex,
    /// HDF5.
    Hdf5,
    /// NetCDF before version 4; refused.
    NetCdf3,
    /// Apache Parquet; refused.
    Parquet,
    /// Compressed by gzip; refused inside another one.
    Gzip,
    /// Pickle of Python; refused.
    Pickle,
    /// Workbook of Excel before 2007; refused.
    Workbook,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Npy => "NumPy array",
            Self::Npz => "NumPy archive",
            Self::Wav => "WAV file",
            Self::Uff => "universal file",
            Self::Mat4 => "MATLAB file (version 4)",
            Self::Mat5 => "MATLAB file (version 5 to 7)",
            Self::Mat73 => "MATLAB file (version 7.3)",
            Self::Tdms => "TDMS file",
            Self::Lvm => "LabVIEW measurement file",
            Self::Series => "text with one series in rows",
            Self::TdmsIndex => "index of a TDMS file",
            Self::Hdf5 => "HDF5 file",
            Self::NetCdf3 => "netCDF file of version 3",
            Self::Parquet => "Parquet file",
            Self::Gzip => "file compressed by gzip",
            Self::Pickle => "pickle of Python",
            Self::Workbook => "workbook of a spreadsheet",
        })
    }
}

impl Format {
    /// True for a text, which a stated format of text reads as a table.
    pub fn is_text(self) -> bool {
        matches!(self, Self::Lvm | Self::Series)
    }
}
