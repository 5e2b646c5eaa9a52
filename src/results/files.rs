//! Single files, each written beside its place and renamed to it.

use std::io::{self, Write};
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// Writes a file; a reader gets the complete old or the complete new one.
///
/// # Errors
/// Errors of the file system; the old file is then unchanged.
pub fn write_whole(path: &Path, contents: &str) -> io::Result<()> {
    write_together(&[(path, contents)])
}

/// Writes files in their order: none appears before all are written.
///
/// # Errors
/// Errors of the file system.
pub fn write_together(files: &[(&Path, &str)]) -> io::Result<()> {
    let written = files.iter().map(|(path, contents)| {
        let folder = folder_of(path);
        std::fs::create_dir_all(folder)?;
        let mut file = temporary_in(folder)?;
        file.write_all(contents.as_bytes())?;
        file.as_file().sync_data()?;
        Ok((file, *path))
    });
    for (file, path) in written.collect::<io::Result<Vec<_>>>()? {
        file.persist(path)?;
    }
    Ok(())
}

/// A file that others may read, as far as the process creates such files.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.prefix(".kmcfit-").tempfile_in(folder)
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
