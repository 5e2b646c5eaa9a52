//! Data sets in chunks, which a B-tree of version 1 lists.

use super::super::budget::Budget;
use super::super::bytes::Bytes;
use super::file::File;
use super::filters::{self, Filter};
use crate::error::InputError;

/// A data set in chunks; one with a single dimension is a row.
pub(super) struct Chunked<'a> {
    /// Address of the B-tree.
    pub tree: u64,
    /// Numbers of rows and columns of the data set, and of a chunk.
    pub dims: [usize; 2],
    pub chunk: [usize; 2],
    /// Number of dimensions in the file.
    pub rank: usize,
    /// Bytes of an element.
    pub size: usize,
    pub filters: &'a [Filter],
    /// The data set, for messages.
    pub what: &'a str,
}

/// Elements so far.
struct Assembly {
    bytes: Vec<u8>,
    /// Number of chunks that are left.
    chunks: usize,
}

impl Chunked<'_> {
    /// All elements in the order of rows; `None` if a chunk was never written.
    ///
    /// # Errors
    /// When the list of chunks or a chunk is damaged, or the elements exceed the budget.
    pub fn read(&self, file: &File, budget: &mut Budget) -> Result<Option<Vec<u8>>, InputError> {
        let [rows, columns] = self.dims;
        let length = rows.saturating_mul(columns).saturating_mul(self.size);
        let bytes = budget.buffer(length, self.what)?;
        let along = |i: usize| match self.chunk[i] {
            0 => Err(file.damaged(self.what).found("chunks without elements")),
            chunk => Ok(self.dims[i].div_ceil(chunk)),
        };
        let chunks = along(0)?.saturating_mul(along(1)?);
        let mut assembly = Assembly { bytes, chunks };
        if file.is_undefined(self.tree) {
            return Ok(None);
        }
        self.node(file, self.tree, None, &mut assembly, budget)?;
        Ok((assembly.chunks == 0).then_some(assembly.bytes))
    }

    /// A node of the B-tree, and all below it; levels decrease by one from the given one.
    fn node(
        &self,
        file: &File,
        address: u64,
        level: Option<u64>,
        assembly: &mut Assembly,
        budget: &mut Budget,
    ) -> Result<(), InputError> {
        let what = self.what;
        let mut node = file.node(address, b"TREE", what)?;
        let kind = node.uint(1, what)?;
        let own = node.uint(1, what)?;
        if kind != 1 || level.is_some_and(|level| own != level) {
            let found = format!("a node of type {kind} at level {own}");
            return Err(file.damaged(what).found(found));
        }
        let count = node.uint(2, what)?;
        file.work(16 * count, what)?;
        file.address(&mut node, what)?;
        file.address(&mut node, what)?;
        for _ in 0..count {
            let length = node.uint(4, what)?;
            let mask = node.uint(4, what)?;
            let from = self.position(&mut node)?;
            let child = file.address(&mut node, what)?;
            if own > 0 {
                self.node(file, child, Some(own - 1), assembly, budget)?;
                continue;
            }
            let left = assembly.chunks.checked_sub(1);
            assembly.chunks =
                left.ok_or_else(|| file.damaged(what).found("more chunks than the array has"))?;
            let raw = file.at(child, what)?.take(length, what)?;
            let [rows, columns] = self.chunk;
            let stated = rows.saturating_mul(columns).saturating_mul(self.size);
            let sizes = [stated, self.size];
            let data = filters::undo(raw, self.filters, mask, sizes, budget, what)?;
            self.place(&data, from, &mut assembly.bytes);
        }
        Ok(())
    }

    /// Row and column of the first element of a chunk.
    fn position(&self, node: &mut Bytes) -> Result<[usize; 2], InputError> {
        let mut from = [0; 2];
        for at in from.iter_mut().skip(2 - self.rank.min(2)) {
            *at = usize::try_from(node.uint(8, self.what)?).unwrap_or(usize::MAX);
        }
        // The position within an element.
        node.uint(8, self.what)?;
        Ok(from)
    }

    /// Copies the elements of a chunk that lie within the array.
    fn place(&self, data: &[u8], from: [usize; 2], bytes: &mut [u8]) {
        let [rows, columns] = self.dims;
        let width = self.chunk[1].saturating_mul(self.size);
        let count = self.chunk[1].min(columns.saturating_sub(from[1])) * self.size;
        let inside = rows.saturating_sub(from[0]);
        for (i, row) in data.chunks_exact(width.max(1)).take(inside).enumerate() {
            let begin = ((from[0] + i) * columns)
                .saturating_add(from[1])
                .saturating_mul(self.size);
            let to = bytes.get_mut(begin..begin.saturating_add(count));
            if let (Some(to), Some(row)) = (to, row.get(..count)) {
                to.copy_from_slice(row);
            }
        }
    }
}
