//! Matrices of 64-bit numbers in NumPy's format `.npy`, version 1.0.

use nalgebra::DMatrix;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_read_as_it_was_written() {
        let matrix = DMatrix::from_fn(3, 2, |i, j| 1.0 / (1.0 + i as f64) - j as f64);
        let bytes = npy(&matrix);
        assert_eq!(bytes.len(), 128 + 48);
        let numbers = bytes[128..].chunks_exact(8);
        let numbers = numbers.map(|eight| f64::from_le_bytes(eight.try_into().unwrap()));
        assert_eq!(DMatrix::from_iterator(3, 2, numbers), matrix);
    }
}
