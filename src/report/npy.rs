//! Matrices of 64-bit numbers in NumPy's format `.npy`, version 1.0.

use crate::error::InputError;
use crate::text_io::quote;
use nalgebra::DMatrix;
use std::path::Path;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// Header and magic have a multiple of this length.
const ALIGNMENT: usize = 64;

/// The header of a matrix with these numbers of rows and columns, column by column.
fn header(rows: usize, columns: usize) -> Vec<u8> {
    let mut text =
        format!("{{'descr': '<f8', 'fortran_order': True, 'shape': ({rows}, {columns}), }}");
    let length = MAGIC.len() + 2 + text.len() + 1;
    text += &" ".repeat(length.next_multiple_of(ALIGNMENT) - length);
    text.push('\n');
    let length = text.len() as u16;
    [MAGIC, &length.to_le_bytes(), text.as_bytes()].concat()
}

/// The file of a matrix.
pub(super) fn npy(matrix: &DMatrix<f64>) -> Vec<u8> {
    let mut bytes = header(matrix.nrows(), matrix.ncols());
    bytes.extend(matrix.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// Reads a matrix of this size as [`npy`] writes it.
///
/// # Errors
/// If the file is missing or not such a matrix.
pub(super) fn read_npy(
    path: &Path,
    rows: usize,
    columns: usize,
) -> Result<DMatrix<f64>, InputError> {
    let expected = format!("a matrix of {rows} x {columns} numbers, as written by `kmcfit fit`");
    let bytes = std::fs::read(path).map_err(|error| {
        InputError::file(path, "cannot be read")
            .found(error)
            .expected(&expected)
    })?;
    let header = header(rows, columns);
    let numbers = bytes.strip_prefix(header.as_slice());
    let numbers = numbers.filter(|numbers| numbers.len() == 8 * rows * columns);
    let numbers = numbers.ok_or_else(|| {
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(ALIGNMENT)]);
        InputError::file(path, "the matrix is damaged")
            .found(format!(
                "{} bytes that start with {}",
                bytes.len(),
                quote(&start)
            ))
            .expected(&expected)
    })?;
    let values = numbers.chunks_exact(8).map(|chunk| {
        let mut eight = [0; 8];
        eight.copy_from_slice(chunk);
        f64::from_le_bytes(eight)
    });
    Ok(DMatrix::from_iterator(rows, columns, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matrix.npy");
        let matrix = DMatrix::from_fn(3, 2, |i, j| 1.0 / (1.0 + i as f64) - j as f64);
        std::fs::write(&path, npy(&matrix)).unwrap();
        assert_eq!(read_npy(&path, 3, 2).unwrap(), matrix);
        assert_eq!(npy(&matrix).len(), 128 + 48);
        let error = read_npy(&path, 2, 3).unwrap_err().to_string();
        assert!(error.contains("a matrix of 2 x 3 numbers"), "{error}");
    }
}
