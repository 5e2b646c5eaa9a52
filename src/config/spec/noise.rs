//! Keys of the correlation of noise and of the errors of inputs.

use crate::config::alternatives::ScalarOr;
use crate::config::choice::choice;
use crate::config::map::keys;
use crate::config::values::{Count, Number};

keys! {
    /// Correlation of the noise of each channel.
    pub struct NoisesSpec (Default) = "noises", expecting "a map such as {displacement: auto}" {
        /// Noise of the displacement.
        displacement: Option<ScalarOr<CorrelationName, CorrelationSpec>>, example "white", default "auto";
        /// Noise of the velocity.
        velocity: Option<ScalarOr<CorrelationName, CorrelationSpec>>, example "auto", default "auto";
        /// Noise of the acceleration.
        acceleration: Option<ScalarOr<CorrelationName, CorrelationSpec>>, example "{ar: 2}", default "auto";
    }
}

keys! {
    /// Autoregressive noise of a given order.
    pub struct CorrelationSpec = "correlation", expecting "a map such as {ar: 2}" {
        /// Order of the autoregressive process.
        ar: Count, example "2", range "1 to 12", needs "equally spaced samples, with or without gaps";
    }
}

choice! {
    /// Correlation of noise in time.
    pub enum CorrelationName {
        /// Autoregressive, of the order that the residuals show.
        Auto = "auto",
        /// Uncorrelated.
        White = "white",
    }
}

keys! {
    /// Independent errors of the samples of an input.
    pub struct InputSigmaSpec = "input-sigma", expecting "a map such as {value: 0.5, kind: sensor}" {
        /// Standard deviation, in N or m/s^2.
        value: Number, example "0.5", range "greater than 0";
        /// What the errors are errors of.
        kind: InputErrorName, example "sensor";
    }
}

choice! {
    /// What the errors of an input are errors of.
    pub enum InputErrorName {
        /// Noise of the sensor of the input: the system received the true input, which differs from the samples.
        Sensor = "sensor",
        /// Unmeasured part of the drive: the system received the samples and further, independent input.
        Drive = "drive",
    }
}
