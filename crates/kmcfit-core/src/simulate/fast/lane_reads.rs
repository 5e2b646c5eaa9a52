//! Reads eight consecutive nodal values, or the stage values of eight consecutive steps, into the SIMD lanes; past the end
//! of the data the last value is repeated.

use crate::simd::{Arithmetic, Eight, LANES, window};
use crate::system::StageSamples;

/// Returns the values `i` to `i + 7`; lanes past the end repeat the last value.
#[inline(always)]
pub(crate) fn eight<A: Arithmetic>(arithmetic: A, values: &[f64], i: usize) -> Eight<A> {
    let inside = values.get(i..).and_then(<[f64]>::first_chunk::<LANES>);
    match inside {
        Some(row) => Eight::load(arithmetic, row),
        None => Eight::load(arithmetic, &window(values, i)),
    }
}

/// Returns nodal values at the left end, middle (mean of both ends) and right end of steps `i` to `i + 7`, one step per lane.
#[inline(always)]
pub(crate) fn stage_values<A: Arithmetic>(
    arithmetic: A,
    values: &[f64],
    i: usize,
) -> [Eight<A>; 3] {
    let left = eight(arithmetic, values, i);
    let right = eight(arithmetic, values, i + 1);
    [left, (right + left) * Eight::splat(arithmetic, 0.5), right]
}

/// Returns 1/m (1/kg) at the left end, middle and right end of steps `i` to `i + 7`; the middle is the inverse of the mean
/// mass. If the mass is constant over these steps, 1/m is computed once.
#[inline(always)]
pub(crate) fn inverse_mass<A: Arithmetic>(arithmetic: A, mass: &[f64], i: usize) -> [Eight<A>; 3] {
    let steps = &mass[i..mass.len().min(i + LANES + 1)];
    if is_constant(steps) {
        return [Eight::splat(arithmetic, 1.0 / steps[0]); 3];
    }
    let mut stages = stage_values(arithmetic, mass, i);
    for stage in &mut stages {
        *stage = Eight::splat(arithmetic, 1.0) / *stage;
    }
    stages
}

/// Returns true if all values are equal.
#[inline(always)]
pub(crate) fn is_constant(values: &[f64]) -> bool {
    values.iter().fold(true, |same, x| same & (*x == values[0]))
}

/// Returns force (N) or base acceleration (m/s²) at the left end, middle and right end of steps `i` to `i + 7`; zero if
/// there is none. Lanes past the end have a value near it.
#[inline(always)]
pub(crate) fn stage_samples<A: Arithmetic>(
    arithmetic: A,
    samples: Option<&StageSamples>,
    i: usize,
) -> [Eight<A>; 3] {
    match samples.filter(|samples| samples.steps() > 0) {
        Some(samples) => (samples.stages()).map(|values| eight(arithmetic, values, i)),
        None => [Eight::splat(arithmetic, 0.0); 3],
    }
}
