//! Keys of a study.

use crate::config::map::keys;

use super::{ForceSpec, FunctionName, StateSpec};
use crate::config::choice::choice;
use crate::config::scalar::{Count, Number, NumberOrColumn, OneOrList, Text};

keys! {
    /// What `kmcfit study` looks into besides what it always does.
    pub struct StudySpec (Default) = "study", expecting "a map such as {profiles: [{function: mass, at: 0.0}], starts: 20}" {
        /// Confidence of drawn bands, profiles, extremes and refits.
        confidence: Option<Number>, example "0.95", default "0.95";
        /// Seed of everything random.
        seed: Option<Count>, example "1", default "1";
        /// Numbers whose profile is drawn: the least cost with the number held.
        profiles: Option<Vec<ProfileSpec>>, example "[{function: mass, at: 0.0}]", default "none";
        /// Times at which the smallest and largest compatible values are computed.
        extremes: Option<OneOrList<Number>>, example "[0.0, 12.5, 25.0]", unit "s", default "five over the record";
        /// Largest J of a system that counts as compatible with the data.
        misfit_limit: Option<Number>, example "2010.0", unit "that of J", default "what the confidence allows";
        /// Fits from scattered starts.
        starts: Option<Count>, example "20", default "none";
        /// The starts lie within this factor of the start values.
        spread: Option<Number>, example "3.0", default "3";
        /// Optima whose k/m, c/m and motions agree to this are one.
        merge_tolerance: Option<Number>, example "1e-3", default "1e-3";
        /// Refits to simulated readings.
        bootstrap: Option<Count>, example "200", default "none";
        /// Where the noise of the refits comes from.
        noise: Option<NoiseName>, example "residual", default "parametric";
        /// Masses for which systems with the same response are computed.
        equivalent_systems: Option<Vec<EquivalentSpec>>,
            example "[{name: constant mass, mass: 1.0}]",
            default "masses that grow, fall and swing away from the fit's";
        /// Whether each function is tested against a constant.
        constancy_test: Option<bool>, example "true", default "false";
        /// Experiments that might be made next.
        candidates: Option<Vec<CandidateSpec>>,
            example "[{name: again, initial: {displacement: 3.3, velocity: 1.0}}]",
            default "none";
    }
}

keys! {
    /// A number: a function's value at a time, its mean, a constant, or a scalar.
    pub struct ProfileSpec = "profile", expecting "a map such as {function: mass, at: 0.0}" {
        /// Which function.
        function: Option<FunctionName>, example "mass";
        /// At which time.
        at: Option<Number>, example "0.0", unit "s";
        /// Its mean in place of a value.
        mean: Option<bool>, example "true";
        /// An estimated number, as the report calls it, in place of a function.
        scalar: Option<Text>, example "initial velocity";
    }
}

choice! {
    /// Noise of the replicates of a bootstrap.
    pub enum NoiseName {
        /// Gaussian, of the readings' sigma.
        Parametric = "parametric",
        /// The residuals of the fit, drawn with replacement.
        Residual = "residual",
    }
}

keys! {
    /// A device to be sought with the motion of the fit.
    pub struct EquivalentSpec = "equivalent", expecting "a map such as {name: constant mass, mass: 1.0}" {
        /// What the report calls it.
        name: Text, example "constant mass";
        /// Its mass.
        mass: NumberOrColumn, example "1.0", unit "kg";
        /// The damping that it should be near to.
        damping: Option<NumberOrColumn>, example "0.0", unit "N s/m", default "that of the fit";
    }
}

keys! {
    /// An experiment that might be made.
    pub struct CandidateSpec = "candidate", expecting "a map such as {name: second release, initial: {displacement: 0.0, velocity: 3.0}}" {
        /// What the report calls it.
        name: Text, example "a blow";
        /// State at its beginning.
        initial: StateSpec, example "{displacement: 0.0, velocity: 3.0}";
        /// Force on the mass, as a shape.
        force: Option<ForceSpec>, example "{shape: sine, amplitude: 1.0, frequency: 0.2}", default "none";
        /// What is measured, at every node.
        channel: Option<ChannelName>, example "acceleration", default "displacement";
        /// Standard deviation of a reading.
        sigma: Option<Number>,
            example "0.1",
            unit "SI unit of the channel",
            default "that of the first channel of the model";
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
