//! Fourier transforms of complex series, with plans that are kept.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};
use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// Longest transform whose plan is kept: its factors take about as much memory as the series.
const MOST_KEPT: usize = 1 << 20;

/// One for all threads, most of which end after a few transforms.
static PLANNER: LazyLock<Mutex<FftPlannerScalar<f64>>> =
    LazyLock::new(|| Mutex::new(FftPlannerScalar::new()));

/// The transform `X_k = sum_j x_j exp(-2 pi i j k / n)` of series of `length` values. It does not depend on the instruction set of the
/// processor.
pub(crate) fn forward_transform(length: usize) -> Arc<dyn Fft<f64>> {
    match length <= MOST_KEPT {
        true => {
            let mut planner = PLANNER.lock().unwrap_or_else(PoisonError::into_inner);
            planner.plan_fft_forward(length)
        }
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

/// Number of frequencies from one whose turn is computed exactly to the next.
const FINE: usize = 256;

/// The numbers `exp(-2 pi i k/n)`, as products of two.
pub(crate) struct Turns {
    coarse: Vec<Complex<f64>>,
    fine: Vec<Complex<f64>>,
}

impl Turns {
    /// Of `k` below `count`.
    pub(crate) fn new(n: usize, count: usize) -> Self {
        let turn = |k: usize| Complex::from_polar(1.0, -TAU * k as f64 / n as f64);
        Self {
            coarse: (0..count.div_ceil(FINE)).map(|k| turn(k * FINE)).collect(),
            fine: (0..FINE.min(count)).map(turn).collect(),
        }
    }

    #[inline]
    pub(crate) fn at(&self, k: usize) -> Complex<f64> {
        self.coarse[k / FINE] * self.fine[k % FINE]
    }
}

/// Transform of real series: `X_k = sum_j x_j exp(-2 pi i j k/n)` for `k` below a number of frequencies, at most `n/2 + 1`.
pub(crate) struct RealTransform {
    n: usize,
    frequencies: usize,
    turns: Turns,
    transform: Arc<dyn Fft<f64>>,
    scratch: Vec<Complex<f64>>,
    buffer: Vec<Complex<f64>>,
}

impl RealTransform {
    /// For the length `n` and this number of frequencies.
    pub(crate) fn new(n: usize, frequencies: usize) -> Self {
        // An even series is a complex one of half its length.
        let length = if n.is_multiple_of(2) { n / 2 } else { n };
        let transform = forward_transform(length);
        Self {
            n,
            frequencies,
            turns: Turns::new(n, frequencies),
            scratch: vec![Complex::default(); transform.get_inplace_scratch_len()],
            buffer: Vec::with_capacity(length),
            transform,
        }
    }

    /// Transforms a series, which ends with zeros where it is shorter; passes each frequency and its value to `take`.
    pub(crate) fn process(
        &mut self,
        mut series: impl Iterator<Item = f64>,
        mut take: impl FnMut(usize, Complex<f64>),
    ) {
        let length = self.transform.len();
        let is_even = length < self.n;
        self.buffer.clear();
        while let Some(x) = series.next() {
            let y = if is_even { series.next() } else { None };
            self.buffer.push(Complex::new(x, y.unwrap_or(0.0)));
        }
        self.buffer.resize(length, Complex::default());
        (self.transform).process_with_scratch(&mut self.buffer, &mut self.scratch);
        for k in 0..self.frequencies {
            take(
                k,
                match is_even {
                    true => {
                        let [even, odd] = of_pair(&self.buffer, k % length);
                        even + self.turns.at(k) * odd
                    }
                    false => self.buffer[k],
                },
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums of their definition, for even and odd lengths and series with zeros at their end.
    #[test]
    fn transforms_of_real_series_are_their_sums() {
        for (n, count) in [(4, 4), (5, 5), (600, 600), (601, 350), (1024, 511)] {
            let series: Vec<f64> = (0..count).map(|i| f64::from(i * i % 101) - 40.0).collect();
            let frequencies = n as usize / 2 + 1;
            let mut found = Vec::new();
            let mut transform = RealTransform::new(n as usize, frequencies);
            transform.process(series.iter().copied(), |_, x| found.push(x));
            for (k, found) in found.into_iter().enumerate() {
                let terms = series.iter().enumerate().map(|(j, x)| {
                    let phase = -TAU * (j * k % n as usize) as f64 / f64::from(n);
                    x * Complex::from_polar(1.0, phase)
                });
                let expected: Complex<f64> = terms.sum();
                // Rounding of a thousand terms below 60.
                assert!((found - expected).norm() < 1e-10, "{n} {k}");
            }
        }
    }
}
