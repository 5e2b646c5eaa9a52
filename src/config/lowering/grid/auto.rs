//! Automatic number of nodes.
//!
//! A response of angular frequency `w`, integrated over the time `T` with the step `h`, has a phase error of about
//! `w T (w h)^p / C` at the end, with `p = 2`, `C = 6` for the midpoint rule and `p = 4`, `C = 120` for the classical
//! Runge-Kutta method. A fit determines the phase of `n` samples at the end of a record to about `3 q / sqrt(n)`, with the noise `q`
//! relative to the root-mean-square response. The first grid has an error of that size, within limits; refinement after the fit
//! makes it as small as needed. The step is chosen for the frequency below which 90 % of the energy of the records lies. Samples of
//! force and base, or equally spaced ones, fall on nodes: their interval has the nearest whole number of steps, with a phase error of at most `2^(p/2)` times
//! the target. For records without a spectrum (too few or equal samples) the step is the sampling interval.

use super::FinerNodes;
use crate::config::lowering::experiments::RawRecord;
use kmcfit_core::finding::Finding;
use kmcfit_core::number_format::significant;
use kmcfit_core::signal::Spectrum;
use kmcfit_core::system::Method;
use std::f64::consts::TAU;

/// Smallest and largest target of the phase error at the end of the record, rad: the largest error of the response relative to its
/// amplitude.
const ACCURACY: [f64; 2] = [1e-4, 1e-2];
/// Standard error of the phase at the end of a record, in `q / sqrt(n)`: that of a frequency, `sqrt(12)`, rounded down.
const PHASE_ERROR: f64 = 3.0;
/// Most cycles over which the phase error accumulates: a response with a damping ratio of 1 % forgets its phase in 16. The
/// refinement after a fit corrects the grid of a system with less damping.
const MOST_CYCLES: f64 = 100.0;
/// Share of the energy below the frequency for which the accuracy holds, and below the frequency that must be resolved
/// with [`STEPS_PER_PERIOD`].
const ENERGY: f64 = 0.9;
const ALL_ENERGY: f64 = 0.999;
/// Fewest steps per period of the frequency of [`ALL_ENERGY`].
const STEPS_PER_PERIOD: f64 = 10.0;
/// A response has decayed if the later half of its samples has less than this share of the energy of the earlier half.
const AT_REST: f64 = 0.01;
/// Fewest samples for a comparison of halves.
const FEWEST_LIVELY: usize = 128;
/// Most nodes per sample: more only slow down the fit of a coarse record.
const MOST_PER_SAMPLE: usize = 64;

/// Number of nodes over `duration` s; a finding in `notes` states the choice.
pub fn nodes(
    method: Method,
    records: &[Option<RawRecord>],
    duration: f64,
    most: usize,
    finer: &FinerNodes,
    notes: &mut Vec<Finding>,
) -> usize {
    // Longest steps for the accuracy and for the resolution of all frequencies.
    let [mut accurate, mut resolved] = [f64::INFINITY; 2];
    let mut fastest = 0.0f64;
    let mut samples = 2;
    for channel in records.iter().flatten().flat_map(|r| &r.channels) {
        samples = samples.max(channel.times.len());
        let lively = lively(&channel.values);
        let whole = Spectrum::of(lively, channel.median_spacing);
        let spectrum = whole.as_ref().map(Spectrum::without_noise);
        let frequency = spectrum.as_ref().map(|s| s.energy_quantile(ENERGY));
        let (Some(whole), Some(spectrum), Some(frequency)) =
            (whole, spectrum, frequency.filter(|f| *f > 0.0))
        else {
            if channel.median_spacing > 0.0 {
                resolved = resolved.min(channel.median_spacing);
            }
            continue;
        };
        fastest = fastest.max(frequency);
        let omega = TAU * frequency;
        let (order, constant) = error_constant(method);
        let accuracy = accuracy(&whole, &spectrum, lively.len());
        let cycles = (frequency * duration).min(MOST_CYCLES);
        accurate = accurate.min((accuracy * constant / (TAU * cycles)).powf(1.0 / order) / omega);
        resolved = resolved.min(1.0 / (STEPS_PER_PERIOD * spectrum.energy_quantile(ALL_ENERGY)));
    }
    let shortest = duration / (most.min(MOST_PER_SAMPLE * samples) - 1) as f64;
    let nodes_of =
        |step: f64| (duration / step.clamp(shortest, duration / 8.0)).round() as usize + 1;
    // No step crosses a kink of the force.
    let nodes = finer
        .nearest(nodes_of(accurate))
        .max(finer.at_least(nodes_of(resolved)));
    let step = duration / (nodes - 1) as f64;
    let (order, constant) = error_constant(method);
    if fastest == 0.0 {
        let text = format!(
            "grid: {nodes} nodes; the record has no dominant frequency, so the step is the sampling interval"
        );
        notes.push(Finding::new("nodes_from_sampling", text).with("nodes", nodes));
        return nodes;
    }
    let steps_per_period = 1.0 / (fastest * step);
    let cycles = (fastest * duration).min(MOST_CYCLES);
    let phase_error = TAU * cycles * (TAU * fastest * step).powf(order) / constant;
    let text = format!(
        "grid: {nodes} nodes, {steps_per_period:.0} steps per period at {} Hz, the frequency below which {:.0} % of the record's \
         energy lies; phase error about {phase_error:.0e} rad after {cycles:.0} cycles",
        significant(fastest, 4),
        100.0 * ENERGY,
    );
    let note = Finding::new("nodes_from_spectrum", text).with("nodes", nodes);
    let note = note
        .with("steps_per_period", steps_per_period)
        .with("frequency", fastest);
    notes.push(note.with("phase_error", phase_error));
    nodes
}

/// Target phase error for a spectrum of `samples` samples, with and without noise; the geometric mean of the limits where noise
/// and response do not differ.
fn accuracy(whole: &Spectrum, quiet: &Spectrum, samples: usize) -> f64 {
    let [least, most] = ACCURACY;
    if quiet == whole {
        return (least * most).sqrt();
    }
    let energy = |spectrum: &Spectrum| spectrum.density().iter().sum::<f64>();
    let noise = (1.0 - energy(quiet) / energy(whole)).max(0.0).sqrt();
    (PHASE_ERROR * noise / (samples.max(1) as f64).sqrt()).clamp(least, most)
}

/// First part of a decaying response: halved as long as the later half has next to no energy, where noise dominates the
/// spectrum.
fn lively(values: &[f64]) -> &[f64] {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let energy = |part: &[f64]| part.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>();
    let mut part = values;
    while part.len() >= FEWEST_LIVELY {
        let (earlier, later) = part.split_at(part.len() / 2);
        if energy(later) > AT_REST * energy(earlier) {
            break;
        }
        part = earlier;
    }
    part
}

/// Order of a method and the constant of its phase error.
fn error_constant(method: Method) -> (f64, f64) {
    match method {
        Method::Midpoint => (2.0, 6.0),
        Method::ImplicitMidpoint => (2.0, 12.0),
        Method::Rk4 => (4.0, 120.0),
    }
}
