//! How many nodes the data ask for.
//!
//! The readings' spectrum says how fast the motion is, the stepper's order what a step of a given
//! length costs: over a time `T` the motion of angular frequency `w` arrives with a phase error of
//! about `w T (w h)^p / C`, `C` = 6 for the midpoint rule (p = 2) and 120 for the classical
//! Runge-Kutta method (p = 4). The step is chosen for the frequency below which nearly all energy
//! lies, then shortened so that samples of the force fall on nodes. Readings without a spectrum (too few, or
//! all the same) say nothing of a frequency: no step is then longer than from one to the next.

use crate::config::build::experiments::Record;
use crate::digits::significant;
use kmcfit_core::internals::signal::Spectrum;
use kmcfit_core::internals::system::Method;
use std::f64::consts::TAU;

/// Phase error at the end of the record that is aimed at, rad: as a share of the amplitude the
/// largest error of the motion.
const ACCURACY: f64 = 1e-4;
/// Share of the energy below the frequency that the accuracy is meant for, and below that which
/// must at least be resolved.
const ENERGY: f64 = 0.9;
const ALL_ENERGY: f64 = 0.999;
/// Fewest steps in a period of the latter.
const STEPS_PER_PERIOD: f64 = 10.0;
/// Readings have come to rest where the later half has this share of the energy of the earlier one.
const AT_REST: f64 = 0.01;
/// Fewest readings that are halved.
const FEWEST_LIVELY: usize = 128;
/// More nodes than so many per reading only make a coarse record slow.
const MOST_PER_READING: usize = 64;

/// The number of nodes over `duration` s; what was chosen and why goes into `remarks`.
pub fn nodes(
    method: Method,
    records: &[Option<Record>],
    duration: f64,
    most: usize,
    remarks: &mut Vec<String>,
) -> usize {
    let mut longest = f64::INFINITY;
    let mut fastest = 0.0f64;
    let mut readings = 2;
    for channel in records.iter().flatten().flat_map(|r| &r.channels) {
        readings = readings.max(channel.times.len());
        let spectrum = Spectrum::of(lively(&channel.values), channel.median_spacing);
        let spectrum = spectrum.map(|s| s.without_noise());
        let frequency = spectrum.as_ref().map(|s| s.energy_quantile(ENERGY));
        let (Some(spectrum), Some(frequency)) = (spectrum, frequency.filter(|f| *f > 0.0)) else {
            if channel.median_spacing > 0.0 {
                longest = longest.min(channel.median_spacing);
            }
            continue;
        };
        fastest = fastest.max(frequency);
        let omega = TAU * frequency;
        let (order, constant) = error_constant(method);
        longest = longest
            .min((ACCURACY * constant / (omega * duration)).powf(1.0 / order) / omega)
            .min(1.0 / (STEPS_PER_PERIOD * spectrum.energy_quantile(ALL_ENERGY)));
    }
    let shortest = duration / (most.min(MOST_PER_READING * readings) - 1) as f64;
    let mut step = longest.clamp(shortest, duration / 8.0);
    let drives = records.iter().flatten().filter_map(Record::drive_spacing);
    if let Some(spacing) = drives.reduce(f64::min) {
        // Samples on nodes: no step crosses a kink of the force.
        step = spacing / (spacing / step).ceil();
    }
    let nodes = (duration / step).round() as usize + 1;
    let step = duration / (nodes - 1) as f64;
    let (order, constant) = error_constant(method);
    let omega = TAU * fastest;
    if fastest == 0.0 {
        remarks.push(format!(
            "grid: {nodes} nodes were chosen: the readings show no frequency, so no step is longer than from one \
             to the next"
        ));
        return nodes;
    }
    remarks.push(format!(
        "grid: {nodes} nodes were chosen: {:.0} steps in a period at {} Hz, below which \
         {:.0} % of the readings' energy lies, for a phase error of about {:.0e} rad at the end of \
         the record",
        1.0 / (fastest * step),
        significant(fastest, 4),
        100.0 * ENERGY,
        omega * duration * (omega * step).powf(order) / constant,
    ));
    nodes
}

/// The beginning of readings that come to rest: halved as long as the later half has next to none of the energy.
/// What is left of the motion there is noise, and a window would leave little else.
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
        Method::Rk4 => (4.0, 120.0),
    }
}
