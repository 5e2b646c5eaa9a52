//! Keys of the correlation of noise.

use crate::config::alternatives::ScalarOr;
use crate::config::choice::choice;
use crate::config::map::keys;
use crate::config::values::Count;

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
