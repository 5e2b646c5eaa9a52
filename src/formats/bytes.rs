//! Reading of fields one after the other, with the length of each checked.

use std::path::Path;

use super::number::{ByteOrder, NumberType};
use crate::error::InputError;

/// Bytes of a file, or of a decompressed part of it, from the current position.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    pub order: ByteOrder,
}

impl<'a> Bytes<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8], order: ByteOrder) -> Self {
        Self {
            path,
            bytes,
            at: 0,
            order,
        }
    }

    /// Number of bytes that are left.
    pub fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    pub fn is_empty(&self) -> bool {
        self.left() == 0
    }

    /// All bytes that are left.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The next `count` bytes, which are `what`.
    ///
    /// # Errors
    /// When fewer are left.
    pub fn take(&mut self, count: u64, what: &str) -> Result<&'a [u8], InputError> {
        let taken = usize::try_from(count).ok();
        match taken.and_then(|count| self.rest().get(..count)) {
            Some(taken) => {
                self.at += taken.len();
                Ok(taken)
            }
            None => Err(
                InputError::file(self.path, format!("the file is truncated in {what}"))
                    .found(format!("{} bytes from byte {} on", self.left(), self.at))
                    .expected(format!("{count} bytes"))
                    .hint("copy or export the file again"),
            ),
        }
    }

    /// An error about the file.
    pub fn error(&self, problem: &str) -> InputError {
        InputError::file(self.path, problem)
    }

    /// The next fields as [`Bytes`].
    ///
    /// # Errors
    /// When fewer bytes are left.
    pub fn part(&mut self, count: u64, what: &str) -> Result<Bytes<'a>, InputError> {
        Ok(Self::new(self.path, self.take(count, what)?, self.order))
    }

    /// Skips up to `count` bytes: padding, which may be missing at the end of a file.
    pub fn skip(&mut self, count: usize) {
        self.at += count.min(self.left());
    }

    /// Unsigned integer of up to 8 bytes.
    ///
    /// # Errors
    /// When fewer bytes are left.
    pub fn uint(&mut self, size: u64, what: &str) -> Result<u64, InputError> {
        let order = self.order;
        let bytes = self.take(size, what)?;
        let join = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
        Ok(match order {
            ByteOrder::Big => bytes.iter().fold(0, join),
            ByteOrder::Little => bytes.iter().rev().fold(0, join),
        })
    }

    pub fn u16(&mut self, what: &str) -> Result<u16, InputError> {
        Ok(self.uint(2, what)? as u16)
    }

    pub fn u32(&mut self, what: &str) -> Result<u32, InputError> {
        Ok(self.uint(4, what)? as u32)
    }

    pub fn u64(&mut self, what: &str) -> Result<u64, InputError> {
        self.uint(8, what)
    }

    /// A number of any type.
    pub fn number(&mut self, kind: NumberType, what: &str) -> Result<f64, InputError> {
        let order = self.order;
        Ok(kind.value(self.take(kind.size() as u64, what)?, order))
    }
}
