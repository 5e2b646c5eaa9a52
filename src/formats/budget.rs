//! Limits on what a file may expand to.

use std::io::Read as _;
use std::path::Path;

use flate2::bufread::ZlibDecoder;

use crate::error::InputError;
use crate::memory;
use crate::text_io::quote;

/// Most channels and variables of a file.
const MOST_CHANNELS: usize = 10_000;
/// Longest name of a channel, bytes.
const LONGEST_NAME: usize = 1000;
/// Most numbers of a file: so many for each of its bytes and so many besides. Deflate expands zeros to 1032 times their
/// compressed length; samples of a sensor are seldom compressed to less than half of theirs.
const VALUES_PER_BYTE: u64 = 8;
const VALUES_BESIDES: u64 = 1 << 21;

/// What a file may still expand to.
pub(super) struct Budget<'a> {
    path: &'a Path,
    length: u64,
    values: u64,
    inflated: u64,
    names: usize,
}

impl<'a> Budget<'a> {
    /// The budget of a file of `length` bytes.
    pub fn new(path: &'a Path, length: usize) -> Self {
        let length = length as u64;
        let values = length
            .saturating_mul(VALUES_PER_BYTE)
            .saturating_add(VALUES_BESIDES);
        Self {
            path,
            length,
            values,
            inflated: values.saturating_mul(size_of::<f64>() as u64),
            names: MOST_CHANNELS,
        }
    }

    /// An empty list with capacity for `count` numbers of a channel.
    ///
    /// # Errors
    /// When the file has more numbers than it may, or they do not fit into memory.
    pub fn list(&mut self, count: usize) -> Result<Vec<f64>, InputError> {
        let mut list = Vec::new();
        self.grow(&mut list, count)?;
        Ok(list)
    }

    /// Capacity in a list for `count` further numbers of a channel.
    ///
    /// # Errors
    /// As [`list`](Self::list).
    pub fn grow(&mut self, list: &mut Vec<f64>, count: usize) -> Result<(), InputError> {
        let left = self.values.checked_sub(count as u64);
        let error = || {
            self.too_much(format!(
                "a channel of {} samples",
                list.len().saturating_add(count)
            ))
        };
        let left = left.ok_or_else(error)?;
        memory::check_file(self.path, (count as u64).saturating_mul(8))?;
        let reserved = match list.is_empty() {
            true => list.try_reserve_exact(count),
            false => list.try_reserve(count),
        };
        reserved.map_err(|_| self.too_much(format!("a channel of {count} samples")))?;
        self.values = left;
        Ok(())
    }

    /// Counts a channel or variable.
    ///
    /// # Errors
    /// When the file has too many of them, or the name is too long.
    pub fn name(&mut self, name: &str) -> Result<(), InputError> {
        if name.len() > LONGEST_NAME {
            return Err(
                InputError::file(self.path, "the name of a variable is too long")
                    .found(format!("{} bytes: {}", name.len(), quote(name)))
                    .expected(format!("at most {LONGEST_NAME} bytes")),
            );
        }
        match self.names.checked_sub(1) {
            Some(left) => {
                self.names = left;
                Ok(())
            }
            None => Err(
                InputError::file(self.path, "the file has too many variables")
                    .found(format!("more than {MOST_CHANNELS}"))
                    .expected(format!("at most {MOST_CHANNELS}")),
            ),
        }
    }

    /// Decompresses the data of `what` by zlib.
    ///
    /// # Errors
    /// When the data are damaged, or expand to more than the file may.
    pub fn inflate(&mut self, bytes: &[u8], what: &str) -> Result<Vec<u8>, InputError> {
        let most = self.inflated;
        // Doubling takes up to three times the length.
        memory::check_file(self.path, (bytes.len() as u64).saturating_mul(3))?;
        let mut inflated = Vec::new();
        ZlibDecoder::new(bytes)
            .take(most.saturating_add(1))
            .read_to_end(&mut inflated)
            .map_err(|_| self.damaged(what).found("data that cannot be decompressed"))?;
        self.inflated = most.checked_sub(inflated.len() as u64).ok_or_else(|| {
            self.too_much(format!("{what}, which expands to more than {most} bytes"))
        })?;
        Ok(inflated)
    }

    /// Counts `length` bytes that `what` expands to.
    ///
    /// # Errors
    /// When the file expands to more than it may, or they do not fit into memory.
    pub fn expand(&mut self, length: usize, what: &str) -> Result<(), InputError> {
        let error = || self.too_much(format!("{what}, which expands to {length} bytes"));
        self.inflated = self.inflated.checked_sub(length as u64).ok_or_else(error)?;
        memory::check_file(self.path, length as u64)
    }

    /// An empty buffer with capacity for `length` decompressed bytes of `what`.
    ///
    /// # Errors
    /// As [`expand`](Self::expand).
    pub fn buffer(&mut self, length: usize, what: &str) -> Result<Vec<u8>, InputError> {
        self.expand(length, what)?;
        let mut buffer = Vec::new();
        let reserved = buffer.try_reserve_exact(length);
        reserved.map_err(|_| self.too_much(format!("{what}, which expands to {length} bytes")))?;
        Ok(buffer)
    }

    /// The error for damaged data of `what`.
    pub fn damaged(&self, what: &str) -> InputError {
        damaged(self.path, what)
    }

    fn too_much(&self, found: String) -> InputError {
        InputError::file(self.path, "the file expands to more than a file of its length may")
            .found(found)
            .expected(format!(
                "at most {} numbers: {VALUES_PER_BYTE} for each of the {} bytes of the file and {VALUES_BESIDES} besides",
                self.length.saturating_mul(VALUES_PER_BYTE).saturating_add(VALUES_BESIDES),
                self.length
            ))
    }
}

/// The error for damaged data of `what`.
pub(super) fn damaged(path: &Path, what: &str) -> InputError {
    InputError::file(path, format!("the file is damaged: {what}"))
        .hint("export or copy the file again")
}
