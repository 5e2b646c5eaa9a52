//! The superblock, and positions in the file.

use std::cell::Cell;
use std::path::Path;

use super::super::budget::damaged;
use super::super::bytes::Bytes;
use super::super::number::ByteOrder;
use crate::error::InputError;

/// First bytes of the superblock.
pub(in super::super) const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Smallest length of a user block before the superblock; it may be doubled any number of times.
const USER_BLOCK: usize = 512;
/// Bytes of headers and nodes that are read: so many for each byte of the file and so many besides. A node is read once where nothing
/// refers to it twice; the limit ends circles.
const WORK_PER_BYTE: u64 = 16;
const WORK_BESIDES: u64 = 1 << 20;

const SUPERBLOCK: &str = "the superblock";

/// A file of HDF5.
pub(super) struct File<'a> {
    path: &'a Path,
    /// From the superblock on, which addresses count from.
    bytes: &'a [u8],
    /// Bytes of an address and of a length.
    offset_size: u64,
    length_size: u64,
    /// Address of the header of the root group.
    pub root: u64,
    work: Cell<u64>,
}

impl<'a> File<'a> {
    /// Reads the superblock.
    ///
    /// # Errors
    /// When there is none, or it is of another version, or the file ends before the length that it states.
    pub fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self, InputError> {
        let doubled = std::iter::successors(Some(USER_BLOCK), |at| at.checked_mul(2));
        let mut positions = std::iter::once(0).chain(doubled.take_while(|at| *at < bytes.len()));
        let bytes = positions.find_map(|at| bytes.get(at..).filter(|b| b.starts_with(SIGNATURE)));
        let bytes = bytes.ok_or_else(|| {
            damaged(path, SUPERBLOCK)
                .found("no signature of HDF5")
                .expected("one at byte 0, 512, 1024, ...")
        })?;
        let work = (bytes.len() as u64).saturating_mul(WORK_PER_BYTE);
        let mut file = Self {
            path,
            bytes,
            offset_size: 8,
            length_size: 8,
            root: 0,
            work: Cell::new(work.saturating_add(WORK_BESIDES)),
        };
        file.superblock()?;
        Ok(file)
    }

    fn superblock(&mut self) -> Result<(), InputError> {
        let mut head = self.at(SIGNATURE.len() as u64, SUPERBLOCK)?;
        let version = head.uint(1, SUPERBLOCK)?;
        // Versions of parts of the file.
        head.skip(if version < 2 { 4 } else { 0 });
        self.offset_size = head.uint(1, SUPERBLOCK)?;
        self.length_size = head.uint(1, SUPERBLOCK)?;
        let sizes = [self.offset_size, self.length_size];
        if version > 3 || sizes.iter().any(|size| ![2, 4, 8].contains(size)) {
            let [offset, length] = sizes;
            let found =
                format!("version {version}, addresses of {offset} and lengths of {length} bytes");
            return Err(self
                .damaged(SUPERBLOCK)
                .found(found)
                .expected("version 0 to 3, and 2, 4 or 8 bytes"));
        }
        // A reserved byte or flags; in old versions also sizes of nodes and flags.
        head.skip([9, 13, 1, 1][version as usize % 4]);
        let base = self.address(&mut head, SUPERBLOCK)?;
        self.address(&mut head, SUPERBLOCK)?;
        let end = self.address(&mut head, SUPERBLOCK)?.saturating_sub(base);
        if end > self.bytes.len() as u64 {
            return Err(
                InputError::file(self.path, "the file is truncated in its data")
                    .found(format!("{} bytes", self.bytes.len()))
                    .expected(format!("{end} bytes, as the file states"))
                    .hint("copy or export the file again"),
            );
        }
        if version < 2 {
            // Address of the driver, offset of the name.
            self.address(&mut head, SUPERBLOCK)?;
            self.address(&mut head, SUPERBLOCK)?;
        }
        self.root = self.address(&mut head, SUPERBLOCK)?;
        Ok(())
    }

    /// All bytes from an address on, where `what` begins.
    ///
    /// # Errors
    /// When the file ends before.
    pub fn at(&self, address: u64, what: &str) -> Result<Bytes<'a>, InputError> {
        let rest = usize::try_from(address)
            .ok()
            .and_then(|at| self.bytes.get(at..));
        let rest = rest.ok_or_else(|| {
            let found = format!("address {address} in a file of {} bytes", self.bytes.len());
            self.damaged(what).found(found)
        })?;
        Ok(Bytes::new(self.path, rest, ByteOrder::Little))
    }

    /// A node with its four letters.
    ///
    /// # Errors
    /// When it begins with others.
    pub fn node(&self, address: u64, letters: &[u8], what: &str) -> Result<Bytes<'a>, InputError> {
        let mut node = self.at(address, what)?;
        if node.take(4, what)? == letters {
            return Ok(node);
        }
        let letters = String::from_utf8_lossy(letters);
        Err(self
            .damaged(what)
            .found(format!("other bytes at address {address}"))
            .expected(format!("`{letters}`")))
    }

    /// The next address.
    pub fn address(&self, bytes: &mut Bytes, what: &str) -> Result<u64, InputError> {
        bytes.uint(self.offset_size, what)
    }

    /// The next length.
    pub fn length(&self, bytes: &mut Bytes, what: &str) -> Result<u64, InputError> {
        bytes.uint(self.length_size, what)
    }

    /// True for an address that stands for none: all bits are set.
    pub fn is_undefined(&self, address: u64) -> bool {
        address == u64::MAX >> (64 - 8 * self.offset_size.clamp(1, 8))
    }

    /// Counts bytes of headers and nodes.
    ///
    /// # Errors
    /// When there are too many, as in a circle.
    pub fn work(&self, bytes: u64, what: &str) -> Result<(), InputError> {
        let left = self.work.get().checked_sub(bytes.max(1));
        let left = left.ok_or_else(|| {
            self.damaged(what)
                .found("parts of the file that refer to each other in a circle")
        })?;
        self.work.set(left);
        Ok(())
    }

    /// The error for damaged data of `what`.
    pub fn damaged(&self, what: &str) -> InputError {
        damaged(self.path, what)
    }
}
