//! What the library for HDF5 leaves to its callers: soft links in old groups, and chunks that were never written.

use memchr::memmem;
use std::collections::BTreeSet;

/// Removes the soft links from the leaves of groups with symbol tables: the library takes them for damage of the group.
pub(super) fn remove_soft_links(bytes: &mut [u8]) {
    /// Length of a member: place of its name, address, type, four bytes, and sixteen of another use.
    const MEMBER: usize = 40;
    let leaves: Vec<usize> = memmem::find_iter(bytes, b"SNOD\x01\0").collect();
    for at in leaves {
        let Some(&[low, high]) = bytes.get(at + 6..at + 8) else {
            return;
        };
        let mut kept = 0u16;
        for i in 0..u16::from_le_bytes([low, high]) {
            let from = at + 8 + MEMBER * usize::from(i);
            let Some(member) = bytes.get(from..from + MEMBER) else {
                break;
            };
            let is_soft = member[8..16] == [0xff; 8] && member[16..20] == [2, 0, 0, 0];
            if !is_soft {
                bytes.copy_within(from..from + MEMBER, at + 8 + MEMBER * usize::from(kept));
                kept += 1;
            }
        }
        bytes[at + 6..at + 8].copy_from_slice(&kept.to_le_bytes());
    }
}

/// Chunks that were never written.
#[derive(Default)]
pub(super) struct Missing {
    /// Row and column of those that were, among the chunks; `None` for all.
    pub written: Option<BTreeSet<[usize; 2]>>,
    /// Rows and columns of a chunk.
    pub chunk: [usize; 2],
}

impl Missing {
    /// True for an element of such a chunk, by its row and column.
    pub fn contains(&self, [row, column]: [usize; 2]) -> bool {
        let [rows, columns] = self.chunk;
        let location = || [row / rows.max(1), column / columns.max(1)];
        (self.written.as_ref()).is_some_and(|written| !written.contains(&location()))
    }
}
