//! Fourier transforms of complex series, with plans that are kept.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};
use std::cell::RefCell;
use std::sync::Arc;

/// Longest transform whose plan is kept: its factors take about as much memory as the series.
const MOST_KEPT: usize = 1 << 20;

thread_local! {
    static PLANNER: RefCell<FftPlannerScalar<f64>> = RefCell::new(FftPlannerScalar::new());
}

/// The transform `X_k = sum_j x_j exp(-2 pi i j k / n)` of series of `length` values. It does not depend on the instruction set of the
/// processor.
pub(crate) fn forward_transform(length: usize) -> Arc<dyn Fft<f64>> {
    match length <= MOST_KEPT {
        true => PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(length)),
        false => FftPlannerScalar::new().plan_fft_forward(length),
    }
}

/// Transforms of two real series, the real and imaginary part of `series`, at the frequency `k` of its transform.
pub(crate) fn of_pair(transform: &[Complex<f64>], k: usize) -> [Complex<f64>; 2] {
    let mirrored = match k {
        0 => transform[0],
        k => transform[transform.len() - k],
    };
    let (z, mirrored) = (transform[k], mirrored.conj());
    [
        0.5 * (z + mirrored),
        Complex::new(0.0, -0.5) * (z - mirrored),
    ]
}
