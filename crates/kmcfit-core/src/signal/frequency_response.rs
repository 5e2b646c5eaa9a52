//! Modes of vibration in a forced response, from its frequency response.
//!
//! With the averaged periodograms (Welch 1967) of force `x` and response `y` and their cross-spectrum, the frequency response and the
//! coherence are
//!
//! ```text
//! H = S_xy / S_xx,    gamma^2 = |S_xy|^2 / (S_xx S_yy)
//! ```
//!
//! Where noise, leakage, a nonlinear term or a coefficient that varies in time contribute to the response, the coherence is below 1. Peaks
//! are those of the mobility `|y'/x|`, in which the stiffness does not hide the mode of the higher frequency.

use super::fourier::{forward_transform, of_pair};
use super::spacing::median;
use super::spectrum::hann_window;
use nalgebra::{Matrix3, Vector3};
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Number of segments, which overlap by half.
const SEGMENTS: usize = 9;
/// Number of independent segments: Hann windows that overlap by half leave 0.6 of them.
const INDEPENDENT: f64 = 0.6 * SEGMENTS as f64;
/// Fewest samples of a segment.
const FEWEST: usize = 64;
/// Smallest coherence at which the frequency response is used.
const COHERENT: f64 = 0.7;
/// Smallest density of the force, relative to its median and to its mean over the frequencies, at which the response is used. Between the
/// frequencies of a periodic force are only rounding and leakage; a converter of 12 bits leaves `2e-7` of the mean.
const DRIVEN: f64 = 0.01;
const DRIVEN_OF_MEAN: f64 = 1e-6;
/// Rounds of the weighted least squares of an oscillator.
const ROUNDS: usize = 6;
/// Fewest frequency spacings below the lower peak, between the two, and on either side of a peak.
const APART: usize = 4;
/// Half the width of a peak, relative to its frequency.
const WIDTH: f64 = 0.1;
/// Smallest density of the force at the weaker mode, relative to that at the stronger one: the noise of a force sensor is below it.
const DRIVEN_OF_FIRST: f64 = 1e-3;
/// Smallest squared mobility of the weaker mode, relative to that of the stronger one.
const WEAKEST: f64 = 0.02;
/// Largest squared mobility at the lowest place between two modes, the mean of three neighbours, relative to the lower peak.
const DEEPEST: f64 = 0.1;

/// Frequencies (Hz) of two modes in a response to a force, samples `spacing` seconds apart, the stronger one first; `None` where there
/// is one mode, or the record is too short to resolve them. `derivatives` is the order of the derivative of the displacement that the
/// response is: 0, 1 or 2.
pub fn two_forced_modes(
    force: &[f64],
    response: &[f64],
    spacing: f64,
    derivatives: i32,
) -> Option<[f64; 2]> {
    let found = Mobility::of(force, response, spacing, derivatives)?;
    let peak = |bins: &mut dyn Iterator<Item = usize>| {
        let usable = bins.filter(|k| found.is_usable(*k));
        usable.max_by(|a, b| found.squares[*a].total_cmp(&found.squares[*b]))
    };
    let bins = APART..found.squares.len() - APART;
    let first = peak(&mut bins.clone())?;
    let width = ((WIDTH * first as f64) as usize).max(APART);
    let second = peak(&mut bins.filter(|k| k.abs_diff(first) > width))?;
    let [low, high] = [first.min(second), first.max(second)];
    let means = found.squares[low..=high].windows(3);
    let between = means.map(|w| w.iter().sum::<f64>() / 3.0);
    let lowest = between.fold(f64::INFINITY, f64::min);
    let of_second = found.squares[second];
    let around = second - APART / 2..=second + APART / 2;
    let is_peak = around.into_iter().all(|k| found.squares[k] <= of_second);
    // Beyond the band of a sweep the force is the noise of its sensor, which is coherent with the response by chance.
    let is_driven = found.drive[second] > DRIVEN_OF_FIRST * found.drive[first];
    let is_mode = is_peak
        && is_driven
        && of_second > WEAKEST * found.squares[first]
        && lowest < DEEPEST * of_second;
    is_mode.then(|| [first, second].map(|k| k as f64 * found.resolution))
}

/// Sums over the segments of `|X|^2`, `|Y|^2` and `conj(X) Y` of force and response at the frequencies of a segment.
struct CrossSpectra {
    /// Frequency spacing, Hz.
    resolution: f64,
    sums: Vec<(f64, f64, Complex<f64>)>,
}

impl CrossSpectra {
    /// `None` for too few samples.
    fn of(force: &[f64], response: &[f64], spacing: f64) -> Option<Self> {
        let length = 2 * force.len().min(response.len()) / (SEGMENTS + 1);
        let is_finite = force.iter().chain(response).all(|x| x.is_finite());
        if length < FEWEST || !is_finite {
            return None;
        }
        let half = length / 2;
        let transform = forward_transform(length);
        let window = hann_window(length);
        let mut sums = vec![(0.0, 0.0, Complex::default()); half];
        let mut both = Vec::with_capacity(length);
        let mut scratch = vec![Complex::default(); transform.get_inplace_scratch_len()];
        for s in 0..SEGMENTS {
            let part = s * half..s * half + length;
            let [x, y] = [force, response].map(|series| &series[part.clone()]);
            let mean = |series: &[f64]| series.iter().sum::<f64>() / length as f64;
            let [mean_x, mean_y] = [x, y].map(mean);
            // Two real series by one complex transform.
            let pairs = window.iter().zip(x.iter().zip(y));
            both.clear();
            both.extend(pairs.map(|(w, (x, y))| *w * Complex::new(x - mean_x, y - mean_y)));
            transform.process_with_scratch(&mut both, &mut scratch);
            for (k, (xx, yy, xy)) in sums.iter_mut().enumerate().skip(1) {
                let [x, y] = of_pair(&both, k);
                *xx += x.norm_sqr();
                *yy += y.norm_sqr();
                *xy += x.conj() * y;
            }
        }
        Some(Self {
            resolution: 1.0 / (length as f64 * spacing),
            sums,
        })
    }

    /// Smallest sum of `|X|^2` of a driven response.
    fn least_drive(&self) -> f64 {
        let drive: Vec<f64> = self.sums.iter().skip(1).map(|(xx, ..)| *xx).collect();
        let mean = drive.iter().sum::<f64>() / drive.len() as f64;
        (DRIVEN * median(drive)).max(DRIVEN_OF_MEAN * mean)
    }
}

/// Mass, damping and stiffness of the linear oscillator that fits the frequency response of samples `spacing` seconds apart, by least squares
/// over the frequencies of a coherent response (Levy 1959, with the weights of Sanathanan and Koerner 1963):
///
/// ```text
/// S_xx = (-omega^2 m + i omega c + k) S_xy / (i omega)^p
/// ```
///
/// `derivatives` is p, the order of the derivative of the displacement that the response is. The mass is in the unit of the force per unit of
/// the acceleration. Leakage of short segments raises the damping: these are start values. `None` for too few samples or frequencies, and
/// where mass or stiffness are not positive.
pub fn driven_oscillator(
    force: &[f64],
    response: &[f64],
    spacing: f64,
    derivatives: i32,
) -> Option<[f64; 3]> {
    let found = CrossSpectra::of(force, response, spacing)?;
    let least = found.least_drive();
    let usable = found.sums.iter().enumerate().skip(APART).filter(|(_, s)| {
        let (xx, yy, xy) = s;
        *xx >= least && xy.norm_sqr() >= COHERENT * xx * yy
    });
    // Frequency response to the displacement.
    let points = usable.map(|(k, (xx, _, xy))| {
        let omega = TAU * found.resolution * k as f64;
        (omega, xy / xx / Complex::new(0.0, omega).powi(derivatives))
    });
    let points: Vec<(f64, Complex<f64>)> = points.collect();
    let middle = points.get(points.len() / 2)?.0;
    let mut scaled: Option<[f64; 3]> = None;
    for _ in 0..ROUNDS {
        let stiffness = |omega: f64, [m, c, k]: [f64; 3]| {
            let x = omega / middle;
            Complex::new(k - x * x * m, x * c)
        };
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (omega, response) in &points {
            let weight = scaled.map_or(1.0, |s| 1.0 / stiffness(*omega, s).norm_sqr());
            let x = omega / middle;
            let columns = [
                -x * x * response,
                Complex::new(0.0, x) * response,
                *response,
            ];
            for (i, a) in columns.iter().enumerate() {
                right[i] += weight * a.re;
                for (j, b) in columns.iter().enumerate() {
                    normal[(i, j)] += weight * (a.re * b.re + a.im * b.im);
                }
            }
        }
        let solved = normal.lu().solve(&right)?;
        scaled = Some([solved[0], solved[1], solved[2]]);
    }
    let [m, c, k] = scaled?;
    let found = [m / (middle * middle), c / middle, k];
    (found.iter().all(|x| x.is_finite()) && m > 0.0 && k > 0.0).then_some(found)
}

/// Mobility `y'/x` of a response at the frequencies of a segment.
pub struct Mobility {
    /// Frequency spacing, Hz.
    pub resolution: f64,
    /// Squared mobility; NaN at frequency zero.
    pub squares: Vec<f64>,
    /// Coherence of response and force, 0 to 1; NaN at frequency zero.
    pub coherence: Vec<f64>,
    /// Sum over the segments of `|X|^2`.
    drive: Vec<f64>,
    /// Smallest such sum where the force drives the response.
    least_drive: f64,
}

impl Mobility {
    /// Mobility of the response to a force; `derivatives` is the order of the derivative of the displacement that the response is; 1 gives the
    /// squared ratio of the response to the input itself. `None` for too few samples.
    pub fn of(force: &[f64], response: &[f64], spacing: f64, derivatives: i32) -> Option<Self> {
        let spectra = CrossSpectra::of(force, response, spacing)?;
        let least = spectra.least_drive();
        let CrossSpectra { resolution, sums } = spectra;
        let squared = |(k, (xx, _, xy)): (usize, &(f64, f64, Complex<f64>))| {
            let omega = TAU * resolution * k as f64;
            xy.norm_sqr() / (xx * xx) * omega.powi(2 - 2 * derivatives)
        };
        Some(Self {
            resolution,
            squares: sums.iter().enumerate().map(squared).collect(),
            coherence: (sums.iter())
                .map(|(xx, yy, xy)| xy.norm_sqr() / (xx * yy))
                .collect(),
            drive: sums.iter().map(|(xx, ..)| *xx).collect(),
            least_drive: least,
        })
    }

    /// Frequency of the largest mobility among those at which the force drives the response and the coherence is high.
    pub fn peak(&self) -> Option<usize> {
        let usable = (APART..self.squares.len() - APART).filter(|k| self.is_usable(*k));
        usable.max_by(|a, b| self.squares[*a].total_cmp(&self.squares[*b]))
    }

    /// Relative standard deviation of the squared mobility by noise and leakage (Bendat and Piersol 2010, Table 9.6).
    pub fn scatter(&self, k: usize) -> f64 {
        let coherence = self.coherence[k].clamp(f64::MIN_POSITIVE, 1.0);
        2.0 * ((1.0 - coherence) / (2.0 * INDEPENDENT * coherence)).sqrt()
    }

    fn is_usable(&self, k: usize) -> bool {
        self.coherence[k] >= COHERENT
            && self.drive[k] >= self.least_drive
            && self.squares[k].is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::{auto_regression, white};

    const SPACING: f64 = 0.05;
    const SAMPLES: usize = 4000;
    /// Steps of the integrator per sample.
    const SUBSTEPS: usize = 10;

    /// A mode: frequency (Hz), damping ratio and participation factor.
    type Mode = [f64; 3];

    /// Factor of the stiffness at a share of the record.
    type Variation = fn(f64) -> f64;

    /// Broadband force, or a sweep from 0.3 to 5 Hz.
    fn force(seed: u64) -> Vec<f64> {
        let duration = SPACING * SAMPLES as f64;
        let sweep = |i: usize| {
            let t = SPACING * i as f64;
            (TAU * (0.3 * t + 0.5 * 4.7 / duration * t * t)).sin()
        };
        match seed % 2 {
            0 => auto_regression(2 * seed + 1, SAMPLES, 0.5),
            _ => (0..SAMPLES).map(sweep).collect(),
        }
    }

    /// Displacement with noise of 2 or 10 %, by the fourth-order method of Runge and Kutta; `stiffness` is the factor of the square of the
    /// first frequency at a share of the record, and `cubic` the factor of the cube of the displacement beside it.
    fn response(
        seed: u64,
        force: &[f64],
        modes: &[Mode],
        stiffness: Variation,
        cubic: f64,
    ) -> Vec<f64> {
        let h = SPACING / SUBSTEPS as f64;
        let mut states = vec![[0.0f64; 2]; modes.len()];
        let mut samples = vec![0.0];
        for (i, pair) in force.windows(2).enumerate() {
            for s in 0..SUBSTEPS {
                for (j, ([frequency, ratio, factor], state)) in
                    modes.iter().zip(&mut states).enumerate()
                {
                    let omega = TAU * frequency;
                    let slope = |part: f64, [y, v]: [f64; 2]| {
                        let share = (s as f64 + part) / SUBSTEPS as f64;
                        let f = pair[0] + share * (pair[1] - pair[0]);
                        let varies = if j == 0 {
                            stiffness((i as f64 + share) / SAMPLES as f64)
                        } else {
                            1.0
                        };
                        let spring = omega * omega * (varies * y + cubic * y.powi(3));
                        [v, factor * f - 2.0 * ratio * omega * v - spring]
                    };
                    let moved = |by: f64, k: [f64; 2]| [state[0] + by * k[0], state[1] + by * k[1]];
                    let a = slope(0.0, *state);
                    let b = slope(0.5, moved(0.5 * h, a));
                    let c = slope(0.5, moved(0.5 * h, b));
                    let d = slope(1.0, moved(h, c));
                    for q in 0..2 {
                        state[q] += h / 6.0 * (a[q] + 2.0 * b[q] + 2.0 * c[q] + d[q]);
                    }
                }
            }
            samples.push(states.iter().map(|state| state[0]).sum());
        }
        let squares: f64 = samples.iter().map(|y| y * y).sum();
        let noise = [0.02, 0.1][seed as usize / 2 % 2] * (squares / SAMPLES as f64).sqrt();
        let errors = white(1000 + seed, SAMPLES);
        samples
            .iter()
            .zip(errors)
            .map(|(y, e)| y + noise * e)
            .collect()
    }

    /// 40 records of one mode, linear, with a stiffness that varies smoothly by a third or jumps by a half, or with a cubic spring: none has
    /// two.
    #[test]
    fn one_mode_is_one_mode() {
        let kinds: [(Variation, f64); 4] = [
            (|_| 1.0, 0.0),
            (|x| 1.0 + 0.3 * (TAU * x).sin(), 0.0),
            (|x| if x < 0.5 { 1.0 } else { 1.5 }, 0.0),
            (|_| 1.0, 20.0),
        ];
        for (name, (stiffness, cubic)) in kinds.into_iter().enumerate() {
            let alarms = (0..40).filter(|seed| {
                let ratio = [0.01, 0.03, 0.06][*seed as usize % 3];
                let force = force(*seed);
                let y = response(*seed, &force, &[[1.0, ratio, 1.0]], stiffness, cubic);
                let found = two_forced_modes(&force, &y, SPACING, 0);
                if let Some(modes) = found {
                    println!("{name} {seed}: {modes:?}");
                }
                found.is_some()
            });
            assert_eq!(alarms.count(), 0, "{name}");
        }
    }

    /// One mode under a force of six sines, recorded with 16 bits: between its frequencies the coherence is high by chance in some records.
    #[test]
    fn a_periodic_force_shows_one_mode() {
        for seed in 0..20u64 {
            let sines = |i: usize| -> f64 {
                let sine = |j: usize| {
                    let phase = (seed as usize * 6 + j * j) as f64;
                    (TAU * (0.37 + 0.41 * j as f64) * SPACING * i as f64 + phase).sin()
                };
                (0..6).map(sine).sum()
            };
            let recorded = |x: f64| (x * 5000.0).round() / 5000.0;
            let force: Vec<f64> = (0..SAMPLES).map(|i| recorded(sines(i))).collect();
            let y = response(seed, &force, &[[1.0, 0.03, 1.0]], |_| 1.0, 0.0);
            assert_eq!(two_forced_modes(&force, &y, SPACING, 0), None, "{seed}");
        }
    }

    /// Displacement with 2 or 10 % noise: mass and stiffness within a tenth, damping of the right size; leakage widens the peak of a light damping.
    #[test]
    fn an_oscillator_is_found() {
        for seed in 0..12 {
            let ratio = [0.02, 0.03, 0.06][seed as usize % 3];
            let force = force(seed);
            // A participation factor of 1/2 is a mass of 2.
            let y = response(seed, &force, &[[1.0, ratio, 0.5]], |_| 1.0, 0.0);
            let [m, c, k] = driven_oscillator(&force, &y, SPACING, 0).expect("a response");
            println!(
                "{seed}: {m} {} {}",
                c / (2.0 * (k * m).sqrt()),
                k / (TAU * TAU)
            );
            assert!((m / 2.0 - 1.0).abs() < 0.1, "{seed}: {m}");
            assert!((k / (2.0 * TAU * TAU) - 1.0).abs() < 0.1, "{seed}: {k}");
            let found = c / (2.0 * (k * m).sqrt());
            assert!(
                (0.5 * ratio..3.0 * ratio + 0.02).contains(&found),
                "{seed}: {found}"
            );
        }
        assert_eq!(
            driven_oscillator(&[1.0; 100], &[1.0; 100], SPACING, 0),
            None
        );
    }

    /// Two modes of comparable mobility, in phase and out of phase, with damping ratios of 2 to 5 %: found in 12 of 20 records, with
    /// frequencies within two spacings. In the others the coherence at a peak is low, or the place between the peaks not deep.
    #[test]
    fn two_modes_are_found() {
        let mut named = 0;
        for seed in 0..20 {
            let second = [1.4, 1.9, 2.6][seed as usize % 3];
            let ratio = [0.02, 0.03, 0.05][seed as usize / 3 % 3];
            let factor = [0.7, -1.0, 1.6, -2.0][seed as usize % 4];
            let force = force(seed);
            let modes = [[1.0, ratio, 1.0], [second, ratio, factor]];
            let y = response(seed, &force, &modes, |_| 1.0, 0.0);
            let found = two_forced_modes(&force, &y, SPACING, 0);
            println!("{seed}: {found:?} of 1, {second}");
            let Some([a, b]) = found else { continue };
            let resolution = 5.0 / (SPACING * SAMPLES as f64);
            let is_near = |x: f64, f: f64| (x - f).abs() < 2.0 * resolution;
            assert!(
                is_near(a.min(b), 1.0) && is_near(a.max(b), second),
                "{seed}"
            );
            named += 1;
        }
        assert!(named >= 11, "{named}");
    }
}
