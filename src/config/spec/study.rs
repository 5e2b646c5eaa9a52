//! Keys of a study.

use crate::config::map::keys;

use super::{ForceSpec, StateSpec};
use crate::config::alternatives::OneOrList;
use crate::config::choice::choice;
use crate::config::values::{Count, Number, NumberOrColumn, Text};
use kmcfit_core::internals::functions::CoefficientKind;

keys! {
    /// Analyses of `kmcfit study`.
    pub struct StudySpec (Default) = "study", expecting "a map such as {profiles: [{function: mass, at: 0.0}], starts: 20}" {
        /// Confidence level of bands, profiles and extremes.
        confidence: Option<Number>,
            example "0.95",
            default "0.95",
            range "between 0 and 1";
        /// Seed of all random numbers.
        seed: Option<Count>, example "1", default "1";
        /// Quantities for which a likelihood profile is computed.
        profiles: Option<Vec<ProfileSpec>>, example "[{function: mass, at: 0.0}]", default "none";
        /// Times at which the data-consistent extremes are computed.
        extremes: Option<OneOrList<Number>>,
            example "[0.0, 12.5, 25.0]",
            unit "s",
            default "five over the record",
            range "within the record";
        /// Largest misfit (J without penalties) of a system that is consistent with the data.
        misfit_limit: Option<Number>,
            example "2010.0",
            unit "that of J",
            default "from the confidence level",
            range "greater than 0";
        /// Number of fits from random starting points.
        starts: Option<Count>,
            example "20",
            default "none",
            range "1 to 100000";
        /// Range of the random starting points: factor by which they differ from the start values.
        spread: Option<Number>,
            example "3.0",
            default "3",
            range "greater than 1, at most 1e6",
            needs "`starts`";
        /// Relative difference of k/m, c/m and response below which two minima count as one.
        merge_tolerance: Option<Number>,
            example "1e-3",
            default "1e-3",
            range "greater than 0",
            needs "`starts`";
        /// Masses for which equivalent systems, with the same response, are computed.
        equivalent_systems: Option<Vec<EquivalentSpec>>,
            example "[{name: constant mass, mass: 1.0}]",
            default "increasing, decreasing and oscillating masses";
        /// Candidate experiments, ranked by their information.
        candidates: Option<Vec<CandidateSpec>>,
            example "[{name: again, initial: {displacement: 3.3, velocity: 1.0}}]",
            default "none";
    }
}

keys! {
    /// A quantity: value or mean of a function, a constant, or a nuisance parameter.
    pub struct ProfileSpec = "profile", expecting "a map such as {function: mass, at: 0.0}" {
        /// Function.
        function: Option<CoefficientKind>,
            example "mass",
            needs "an estimated function; excludes `scalar`";
        /// Time of the value.
        at: Option<Number>,
            example "0.0",
            unit "s",
            range "within the record",
            needs "`function`";
        /// Mean over the record in place of a value.
        mean: Option<bool>,
            example "true",
            needs "`function`";
        /// Name of a nuisance parameter, in place of a function.
        parameter: Option<Text>,
            example "initial velocity",
            needs "an estimated nuisance parameter of this name";
    }
}

keys! {
    /// An equivalent system with a given mass.
    pub struct EquivalentSpec = "equivalent", expecting "a map such as {name: constant mass, mass: 1.0}" {
        /// Name for reports.
        name: Text, example "constant mass";
        /// Mass.
        mass: NumberOrColumn,
            example "1.0",
            unit "kg",
            range "greater than 0";
        /// Damping to which the system is as close as possible.
        damping: Option<NumberOrColumn>, example "0.0", unit "N s/m", default "that of the fit";
    }
}

keys! {
    /// A candidate experiment.
    pub struct CandidateSpec = "candidate", expecting "a map such as {name: second release, initial: {displacement: 0.0, velocity: 3.0}}" {
        /// Name for reports.
        name: Text, example "a blow";
        /// Initial state.
        initial: StateSpec, example "{displacement: 0.0, velocity: 3.0}";
        /// Waveform of the force.
        force: Option<ForceSpec>, example "{shape: sine, amplitude: 1.0, frequency: 0.2}", default "none";
        /// Measured channel, sampled at every node.
        channel: Option<ChannelName>, example "acceleration", default "displacement";
        /// Standard deviation of a sample.
        sigma: Option<Number>,
            example "0.1",
            unit "SI unit of the channel",
            default "that of the first channel of the model",
            range "greater than 0";
    }
}

choice! {
    /// Kind of a channel.
    pub type ChannelName = kmcfit_core::internals::record::ChannelKind {
        /// Displacement.
        Displacement = "displacement",
        /// Velocity.
        Velocity = "velocity",
        /// Acceleration.
        Acceleration = "acceleration",
    }
}
