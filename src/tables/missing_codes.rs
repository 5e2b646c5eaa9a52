//! Codes that stand for missing samples in a file: -9999, 9999, -7999, and values that repeat far outside all others.

use super::Table;
use kmcfit_core::signal::median;

/// Sizes that loggers and archives write for missing samples.
const KNOWN: [f64; 11] = [
    999.0, 999.9, 999.99, 7999.0, 8888.0, 9999.0, 9999.9, 9999.99, 99_999.0, 999_999.0, 1e20,
];
/// Distance of a code from the median, relative to the largest one of other values: of a known code, of another value that repeats, and of
/// a single one. Below three decades a single one is a spike, which a robust loss takes.
const FAR: [f64; 3] = [3.0, 10.0, 1000.0];
/// Fewest repetitions of another value.
const REPEATED: usize = 2;
/// Most distinct codes in a column.
const MOST: usize = 4;

/// Codes in the columns of a table with these indices, in the unit of the file, with their numbers.
///
/// A column of an input, as the bool says, can hold a single large value: a blow between quiet samples.
pub fn codes(table: &Table, columns: impl Iterator<Item = (usize, bool)>) -> Vec<(f64, usize)> {
    let mut found: Vec<(f64, usize)> = Vec::new();
    for (index, is_input) in columns {
        // A column that cannot be read has its own message.
        let values = table.samples(index).unwrap_or_default();
        for (code, count) in codes_of_column(values, is_input) {
            match found.iter_mut().find(|(known, _)| *known == code) {
                Some((_, all)) => *all += count,
                None => found.push((code, count)),
            }
        }
    }
    found
}

/// Codes in a column, in the unit of the file, with their numbers.
pub fn codes_of_column(values: &[f64], is_input: bool) -> Vec<(f64, usize)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if sorted.is_empty() {
        return Vec::new();
    }
    let middle = median(&*sorted);
    sorted.sort_by(f64::total_cmp);
    let groups = sorted.chunk_by(|a, b| a == b);
    let mut groups: Vec<(f64, usize)> = groups.map(|group| (group[0], group.len())).collect();
    let distance = |x: f64| (x - middle).abs();
    groups.sort_by(|a, b| distance(b.0).total_cmp(&distance(a.0)));
    let is_known = |x: f64| KNOWN.contains(&x.abs());
    let kind = |(x, count): &(f64, usize)| match is_known(*x) {
        true => 0,
        false if *count >= REPEATED => 1,
        false => 2,
    };
    let is_possible = |group: &&(f64, usize)| kind(group) < 2 || !is_input;
    let possible: Vec<(f64, usize)> = (groups.iter().take(MOST))
        .take_while(is_possible)
        .copied()
        .collect();
    // From all of them to the farthest alone: each is far from what is left.
    (1..=possible.len())
        .rev()
        .find(|count| {
            let rest = groups.get(*count).map_or(0.0, |(x, _)| distance(*x));
            let is_far =
                |group: &(f64, usize)| distance(group.0) > FAR[kind(group)] * rest && rest > 0.0;
            possible[..*count].iter().all(is_far)
        })
        .map_or_else(Vec::new, |count| possible[..count].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(size: f64) -> Vec<f64> {
        (0..200)
            .map(|i| size * (0.3 * f64::from(i)).sin())
            .collect()
    }

    #[test]
    fn codes_far_outside_are_found() {
        let with = |size: f64, codes: &[f64]| {
            let mut values = wave(size);
            for (i, code) in codes.iter().enumerate() {
                values[17 * i] = *code;
            }
            codes_of_column(&values, false)
        };
        assert_eq!(with(2.0, &[-9999.0]), [(-9999.0, 1)]);
        assert_eq!(
            with(2.0, &[-9999.0, 9999.0, 9999.0]),
            [(-9999.0, 1), (9999.0, 2)]
        );
        assert_eq!(with(2.0, &[-7999.0, -7999.0]), [(-7999.0, 2)]);
        // No known code, but equal values far outside.
        assert_eq!(with(2.0, &[1234.5, 1234.5]), [(1234.5, 2)]);
        assert_eq!(with(2.0, &[1e30]), [(1e30, 1)]);
        assert_eq!(with(2.0, &[32767.0]), [(32767.0, 1)]);
        let mut blow = wave(1e-3);
        blow[20] = 500.0;
        assert_eq!(codes_of_column(&blow, true), []);
        // A single spike is none, nor is a code within the range of the samples.
        assert_eq!(with(2.0, &[1234.5]), []);
        assert_eq!(with(5000.0, &[9999.0]), []);
        assert_eq!(with(2.0, &[]), []);
        assert_eq!(codes_of_column(&[f64::NAN; 3], false), []);
    }
}
