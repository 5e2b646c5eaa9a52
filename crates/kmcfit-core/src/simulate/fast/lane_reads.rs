//! Reads eight consecutive nodal values, or the stage values of eight consecutive steps, into the SIMD lanes; past the end
//! of the data the last value is repeated.

use crate::simd::{Arithmetic, Eight, LANES, Row, window};
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
/// there is none. Lanes past the end repeat the last step.
#[inline(always)]
pub(crate) fn stage_samples<A: Arithmetic>(
    arithmetic: A,
    samples: Option<&StageSamples>,
    i: usize,
) -> [Eight<A>; 3] {
    let Some(steps) = samples.map(StageSamples::values) else {
        return [Eight::splat(arithmetic, 0.0); 3];
    };
    let inside = steps.get(i..).and_then(<[_]>::first_chunk::<LANES>);
    let [left, middle, right] = match inside {
        Some(steps) => columns(steps),
        None => padded_steps(steps, i),
    };
    [
        Eight::load(arithmetic, &left),
        Eight::load(arithmetic, &middle),
        Eight::load(arithmetic, &right),
    ]
}

#[inline(always)]
fn columns(steps: &[[f64; 3]; LANES]) -> [Row; 3] {
    std::array::from_fn(|q| std::array::from_fn(|l| steps[l][q]))
}

#[cold]
#[inline(never)]
fn padded_steps(steps: &[[f64; 3]], i: usize) -> [Row; 3] {
    match steps.len().checked_sub(1) {
        Some(last) => columns(&std::array::from_fn(|l| steps[(i + l).min(last)])),
        None => [[0.0; LANES]; 3],
    }
}
