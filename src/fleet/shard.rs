//! One of N parts of a fleet.

use crate::error::InputError;
use crate::text_io::quote;
use std::fmt;
use std::str::FromStr;

/// Shard I of N, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number, from 1.
    pub number: usize,
    /// Number of shards.
    pub of: usize,
}

impl Shard {
    /// All of a fleet.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// True if the job with this index belongs to the shard.
    pub fn has(self, job: usize) -> bool {
        job % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = InputError;

    /// Reads `I/N`.
    fn from_str(text: &str) -> Result<Self, InputError> {
        let wrong = || {
            InputError::argument("--shard", "no such shard")
                .found(quote(text))
                .expected("I/N with I from 1 to N, as 2/10 for the second of ten shards")
        };
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let number: usize = number.trim().parse().map_err(|_| wrong())?;
        let of: usize = of.trim().parse().map_err(|_| wrong())?;
        match (1..=of).contains(&number) && of <= MOST {
            true => Ok(Self { number, of }),
            false => Err(wrong()),
        }
    }
}

/// Most shards: each has files of its own.
const MOST: usize = 100_000;

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-of-{}", self.number, self.of)
    }
}
