//! Mutations: random changes of the inputs of the corpus, reproducible by a seed.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// Longest mutated input, bytes.
const LONGEST: usize = 1 << 15;
/// Longer seeds are run without mutations.
const LONGEST_SEED: usize = 1 << 14;
/// Seeds longer than this take most of the time and add little besides their length: one input in [`RARE`] is made from
/// them.
const SHORT_SEED: usize = 1 << 11;
const RARE: usize = 50;
/// Most changes of one input.
const CHANGES: usize = 6;

/// Numbers at the limits of number formats.
const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "1e18",
    "1e-18",
    "1e999",
    "-1e999",
    "1e308",
    "1e-308",
    "5e-324",
    ".nan",
    ".inf",
    "-.inf",
    "NaN",
    "inf",
    "null",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "4294967296",
    "1000000000000",
    "400",
    "0x10",
    "1_0",
    "2e3",
    "1,5",
    "1.",
    ".5",
    "0.1",
    "1e",
    "--",
    "",
];

/// Fragments of the syntax of the formats.
const PIECES: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ":",
    ": ",
    "- ",
    ",",
    ";",
    "\n",
    "\r",
    "\r\n",
    "\t",
    " ",
    "  ",
    "\"",
    "'",
    "&a ",
    "*a",
    "!t ",
    "!!float ",
    "#",
    "---\n",
    "...\n",
    "|\n",
    ">\n",
    "? ",
    "<<: ",
    "<<: *a",
    "&b ",
    "*b",
    "[*a, *a]",
    "~",
    "\u{feff}",
    "\0",
    "%",
    "@",
    "\\",
    "`",
    "é",
    "../../..",
    "/dev/zero",
    "estimate",
    "auto",
    "[[[[",
    "]]]]",
    "true",
    "nan",
];

/// Generator of inputs.
pub struct Mutator {
    random: ChaCha8Rng,
    short: Vec<Vec<u8>>,
    long: Vec<Vec<u8>>,
    words: Vec<Vec<u8>>,
}

impl Mutator {
    pub fn new(mut seeds: Vec<Vec<u8>>, seed: u64) -> Self {
        seeds.retain(|seed| seed.len() <= LONGEST_SEED);
        let is_word = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-');
        let words = seeds.iter().flat_map(|seed| seed.split(|b| !is_word(b)));
        let words: BTreeSet<&[u8]> = words.filter(|w| (2..30).contains(&w.len())).collect();
        let words = words.into_iter().map(<[u8]>::to_vec).collect();
        let (short, long) = seeds.into_iter().partition(|s| s.len() <= SHORT_SEED);
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            short,
            long,
            words,
        }
    }

    /// The next input.
    pub fn next(&mut self) -> Vec<u8> {
        let mut bytes = self.seed().clone();
        for _ in 0..=self.below(CHANGES) {
            self.change(&mut bytes);
        }
        bytes.truncate(LONGEST);
        bytes
    }

    /// A short seed, rarely a long one.
    fn seed(&mut self) -> &Vec<u8> {
        let is_long = self.below(RARE) == 0;
        let is_long = (is_long || self.short.is_empty()) && !self.long.is_empty();
        let count = if is_long { &self.long } else { &self.short }.len();
        let which = self.below(count);
        if is_long {
            &self.long[which]
        } else {
            &self.short[which]
        }
    }

    fn below(&mut self, end: usize) -> usize {
        self.random.random_range(0..end.max(1))
    }

    fn change(&mut self, bytes: &mut Vec<u8>) {
        let at = self.below(bytes.len() + 1);
        let length = 1 + self.below(8);
        let end = (at + length).min(bytes.len());
        match self.below(9) {
            0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
            1 if at < bytes.len() => bytes[at] = self.random.next_u32() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = PIECES[self.below(PIECES.len())];
                bytes.splice(at..at, piece.bytes());
            }
            4 => self.other_number(bytes, at),
            5 => self.other_word(bytes, at),
            6 => self.splice(bytes, at),
            7 => self.twice(bytes, at),
            _ => bytes.truncate(at),
        }
    }

    /// Replaces the next number by another one.
    fn other_number(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let number = NUMBERS[self.below(NUMBERS.len())];
        let is_part = |b: &u8| b.is_ascii_digit() || b".+-e".contains(b);
        let Some(begin) = bytes[at..].iter().position(u8::is_ascii_digit) else {
            return;
        };
        let begin = at + begin;
        let length = bytes[begin..].iter().position(|b| !is_part(b));
        let end = length.map_or(bytes.len(), |length| begin + length);
        bytes.splice(begin..end, number.bytes());
    }

    /// Replaces the next word by another one of the corpus.
    fn other_word(&mut self, bytes: &mut Vec<u8>, at: usize) {
        if self.words.is_empty() {
            return;
        }
        let which = self.below(self.words.len());
        let Some(begin) = bytes[at..].iter().position(u8::is_ascii_alphabetic) else {
            return;
        };
        let begin = at + begin;
        let length = bytes[begin..]
            .iter()
            .position(|b| !b.is_ascii_alphanumeric());
        let end = length.map_or(bytes.len(), |length| begin + length);
        bytes.splice(begin..end, self.words[which].iter().copied());
    }

    /// Some lines of another input.
    fn splice(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let other = self.seed().clone();
        let (from, length) = (self.below(other.len()), 1 + self.below(200));
        let piece = other[from..(from + length).min(other.len())].to_vec();
        bytes.splice(at..at, piece);
    }

    /// Repeats a fragment.
    fn twice(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let end = (at + 1 + self.below(60)).min(bytes.len());
        let times = 1 + self.below(20);
        let piece = bytes[at..end].repeat(times);
        bytes.splice(at..at, piece);
    }
}
