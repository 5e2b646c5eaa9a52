//! Signals over time: interpolation, excitation shapes, filters, decimation, spectra, and checks of samples.
//!
//! ```
//! use kmcfit_core::signal::{Interpolation, Signal};
//! let times: Vec<f64> = (0..11).map(|i| 0.1 * f64::from(i)).collect();
//! let values = times.iter().map(|t| t * t * t).collect();
//! let signal = Signal::new(times, values, Interpolation::Cubic).expect("increasing times");
//! assert!((signal.value(0.25) - 0.25_f64.powi(3)).abs() < 1e-15);
//! assert!((signal.second_derivative(0.25) - 6.0 * 0.25).abs() < 1e-12);
//! ```

mod clipping;
mod decimate;
mod extremes;
mod faults;
mod filter;
mod fourier;
mod frequency_response;
mod interpolate;
mod jumps;
mod modes;
mod onset;
mod shape;
mod spacing;
mod spectrum;
mod spline;

pub(crate) use clipping::clipped;
pub use clipping::cut_off;
pub use decimate::decimate;
pub use extremes::Extremes;
pub use faults::{dropouts, quantisation, spikes};
pub use filter::{SecondOrder, band_pass, high_pass, low_pass};
pub(crate) use filter::{zero_phase, zero_phase_transpose};
pub(crate) use fourier::RealTransform;
pub use frequency_response::{Mobility, driven_oscillator, two_forced_modes};
pub use interpolate::{Interpolation, Signal};
pub use jumps::jumps;
pub use modes::{is_kept_up, two_modes};
pub use onset::onset;
pub use shape::{ExcitationShape, SweepLaw};
pub use spacing::{even_spacing, median, median_spacing};
pub use spectrum::Spectrum;
