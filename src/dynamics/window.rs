//! Eight neighbouring values of what is known at the nodes or over the steps.

use super::Stepwise;
use crate::lanes::{LANES, Row};

/// Values `i`, `i + 1`, ...; beyond the end the last one, for lanes that nobody asks.
#[inline(always)]
pub(crate) fn row(values: &[f64], i: usize) -> Row {
    let inside = values.get(i..).and_then(<[f64]>::first_chunk::<LANES>);
    match inside {
        Some(row) => *row,
        None => padded(values, i),
    }
}

#[cold]
#[inline(never)]
fn padded(values: &[f64], i: usize) -> Row {
    let last = values.len() - 1;
    std::array::from_fn(|l| values[(i + l).min(last)])
}

/// The steps `i`, `i + 1`, ... at their left ends, middles and right ends; zero for `None`.
#[inline(always)]
pub(crate) fn stepwise(part: Option<&Stepwise>, i: usize) -> [Row; 3] {
    let mut rows = [[0.0; LANES]; 3];
    if let Some(steps) = part.map(Stepwise::values) {
        let last = steps.len().saturating_sub(1);
        for l in 0..LANES {
            let at = (i + l).min(last);
            for (row, value) in rows.iter_mut().zip(&steps[at]) {
                row[l] = *value;
            }
        }
    }
    rows
}
