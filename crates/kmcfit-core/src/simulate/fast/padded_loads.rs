//! Loads of eight neighbouring nodal or stage values into SIMD lanes, padded at the end of the data.

use crate::simd::{Arithmetic, Eight, LANES, Row, window};
use crate::system::StageSamples;

/// Values `i` to `i + 7`; lanes beyond the end repeat the last value.
#[inline(always)]
pub(crate) fn eight<A: Arithmetic>(arithmetic: A, values: &[f64], i: usize) -> Eight<A> {
    let inside = values.get(i..).and_then(<[f64]>::first_chunk::<LANES>);
    match inside {
        Some(row) => Eight::load(arithmetic, row),
        None => Eight::load(arithmetic, &window(values, i)),
    }
}

/// Values of a function at the left ends, middles and right ends of the steps `i` to `i + 7`.
#[inline(always)]
pub(crate) fn places<A: Arithmetic>(arithmetic: A, values: &[f64], i: usize) -> [Eight<A>; 3] {
    let left = eight(arithmetic, values, i);
    let right = eight(arithmetic, values, i + 1);
    [left, (right + left) * Eight::splat(arithmetic, 0.5), right]
}

/// Inverse mass at the stages of [`places`]; by a single division where the mass is constant.
#[inline(always)]
pub(crate) fn per_mass<A: Arithmetic>(arithmetic: A, mass: &[f64], i: usize) -> [Eight<A>; 3] {
    let steps = &mass[i..mass.len().min(i + LANES + 1)];
    if is_constant(steps) {
        return [Eight::splat(arithmetic, 1.0 / steps[0]); 3];
    }
    let mut places = places(arithmetic, mass, i);
    for place in &mut places {
        *place = Eight::splat(arithmetic, 1.0) / *place;
    }
    places
}

/// True if all values are equal.
#[inline(always)]
pub(crate) fn is_constant(values: &[f64]) -> bool {
    values.iter().fold(true, |same, x| same & (*x == values[0]))
}

/// Stage values of the steps `i` to `i + 7` at left ends, middles and right ends; zero for `None`. Lanes beyond the end
/// repeat the last step.
#[inline(always)]
pub(crate) fn stepwise<A: Arithmetic>(
    arithmetic: A,
    part: Option<&StageSamples>,
    i: usize,
) -> [Eight<A>; 3] {
    let Some(steps) = part.map(StageSamples::values) else {
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
