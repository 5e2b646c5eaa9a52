//! States and inputs of records as measured, estimated from the samples without a simulation.

use crate::signal::SecondOrder;
use crate::system::TimePoint;
use std::sync::OnceLock;

/// Responses of all experiments, estimated from their samples.
///
/// For a single channel of equally spaced accelerations the response is integrated in a band around its dominant frequency,
/// and force and base pass the same filter. For other channels a smooth curve through all samples is differentiated.
#[derive(Debug, Default)]
pub struct Measurements {
    /// One entry per experiment; `None` for an experiment without samples.
    pub(crate) experiments: Vec<Option<Measured>>,
    /// Halvings of the width of the bump functions of the weak form, once they are chosen for a problem with these records.
    pub(crate) halvings: OnceLock<i32>,
}

/// State of an experiment at some times, with force and base acceleration.
#[derive(Debug)]
pub struct Measured {
    pub positions: Vec<TimePoint>,
    /// Index of the first time among the samples, if the times are those of one channel.
    pub first: usize,
    /// Displacement, m.
    pub y: Vec<f64>,
    /// Velocity, m/s.
    pub v: Vec<f64>,
    /// Acceleration `y''`, m/s^2.
    pub a: Vec<f64>,
    /// Force, N.
    pub force: Vec<f64>,
    /// Acceleration `b''` of the base, m/s^2.
    pub base: Vec<f64>,
    /// Weight of each time in the integral of the error, s.
    pub weight: f64,
    /// Dominant frequency, rad/s.
    pub frequency: f64,
    /// Corner of the filter that all series have passed, rad/s, if any.
    pub corner: Option<f64>,
    /// State and inputs at the same times without smoothing, for the linear terms of the weak form; `None` where only the smoothed
    /// ones exist.
    pub unsmoothed: Option<Unsmoothed>,
    /// Filter of the channels, which each term of the equation of motion passes; empty without one, and where all series have passed it.
    pub filter: Vec<SecondOrder>,
    /// Weight of the smoothing of the state, where it is that of a series at these times.
    pub smoothing: Option<f64>,
    /// The same at the common times of several channels, with the state without smoothing, for the weak form; `None` where the times are
    /// these, or no such state exists.
    pub at_samples: Option<Box<Measured>>,
}

/// State and inputs without smoothing.
#[derive(Debug)]
pub struct Unsmoothed {
    /// Displacement (m), velocity (m/s) and acceleration (m/s^2) by differences of the samples, or of means of groups of them.
    pub state: Differences,
    /// Force, N, or its means over the groups.
    pub force: Vec<f64>,
    /// Acceleration of the base, m/s^2, or its means over the groups.
    pub base: Vec<f64>,
}

/// A series and its derivatives at all values but two at each end.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    /// The series.
    pub y: Vec<f64>,
    /// First derivative.
    pub v: Vec<f64>,
    /// Second derivative.
    pub a: Vec<f64>,
}
