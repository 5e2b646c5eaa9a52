//! Quantities of a fit outside the range of mechanical systems: a unit may be wrong.

use serde::Serialize;

/// A quantity outside the range of mechanical systems, which points to a wrong unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "quantity", rename_all = "snake_case")]
pub enum Implausible {
    /// Natural frequency, Hz, outside [`Implausible::FREQUENCIES`].
    NaturalFrequency {
        /// Its mean, Hz.
        value: f64,
    },
    /// Largest velocity of the fitted response, m/s, above [`Implausible::VELOCITY`].
    Velocity {
        /// The velocity, m/s.
        value: f64,
    },
    /// Largest displacement of the fitted response, m, above [`Implausible::DISPLACEMENT`].
    Displacement {
        /// The displacement, m.
        value: f64,
    },
}

impl Implausible {
    /// Natural frequencies of mechanical systems, Hz: from moored platforms and long bridges (0.01 to 0.1 Hz) to small resonators.
    pub const FREQUENCIES: [f64; 2] = [0.005, 1e6];
    /// Largest velocity of a vibration, m/s: above those of strong earthquakes (3 m/s) and of shock tests (10 m/s).
    pub const VELOCITY: f64 = 30.0;
    /// Largest displacement of a vibration, m.
    pub const DISPLACEMENT: f64 = 10.0;

    /// The first implausible quantity of a response with the mean natural frequency `frequency` (Hz) and these largest displacement (m) and
    /// velocity (m/s); of a rotation only the frequency is judged.
    pub fn of(frequency: f64, response: Option<[f64; 2]>) -> Option<Self> {
        let [least, most] = Self::FREQUENCIES;
        if frequency.is_finite() && !(least..=most).contains(&frequency) {
            return Some(Self::NaturalFrequency { value: frequency });
        }
        let [displacement, velocity] = response?;
        match () {
            () if velocity > Self::VELOCITY => Some(Self::Velocity { value: velocity }),
            () if displacement > Self::DISPLACEMENT => Some(Self::Displacement {
                value: displacement,
            }),
            () => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Milliseconds read as seconds, and millimetres as metres: 2 Hz and 4 mm become 0.002 Hz, or 4 m with 50 m/s.
    #[test]
    fn wrong_units_of_a_record_are_implausible() {
        let slow = Implausible::NaturalFrequency { value: 0.002 };
        assert_eq!(Implausible::of(0.002, Some([0.004, 5e-5])), Some(slow));
        let fast = Implausible::Velocity { value: 50.0 };
        assert_eq!(Implausible::of(2.0, Some([4.0, 50.0])), Some(fast));
        let far = Implausible::Displacement { value: 40.0 };
        assert_eq!(Implausible::of(0.02, Some([40.0, 5.0])), Some(far));
        // In the right units, for a rotation, and without a natural frequency.
        assert_eq!(Implausible::of(2.0, Some([0.004, 0.05])), None);
        assert_eq!(Implausible::of(2.0, None), None);
        assert_eq!(Implausible::of(f64::NAN, Some([0.004, 0.05])), None);
    }
}
