//! Names and units of the coefficients of a system of unknown mass: their ratios to it.

use kmcfit_core::structure::CoefficientKind;

/// End of the name of a ratio.
const OVER_MASS: &str = "_over_m";

/// SI unit of the ratio of a coefficient to the mass.
pub(super) fn unit(kind: CoefficientKind, is_rotation: bool) -> &'static str {
    kind.row().units_over_mass[usize::from(is_rotation)]
}

/// Name of the estimate of a function as its ratio to the unknown mass: `cubic_stiffness_over_m`, `damping_over_m of shaker`; `None` for the
/// shared mass, damping and stiffness, whose ratios have names of their own.
pub(super) fn name(function: &str) -> Option<String> {
    match function.split_once(" of ") {
        _ if ["mass", "damping", "stiffness"].contains(&function) => None,
        Some((kind, owner)) => Some(format!("{kind}{OVER_MASS} of {owner}")),
        None => Some(format!("{function}{OVER_MASS}")),
    }
}

/// Name of the function of an estimate, which for a ratio of [`name`] is that of its coefficient.
pub(super) fn function_of(estimate: &str) -> String {
    estimate.replacen(OVER_MASS, "", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_the_function() {
        for function in ["cubic_stiffness", "damping of shaker", "static_force"] {
            let ratio = name(function).expect("a ratio");
            assert_ne!(ratio, function);
            assert_eq!(function_of(&ratio), function);
        }
        assert_eq!(name("stiffness"), None);
        assert_eq!(
            name("damping of shaker").as_deref(),
            Some("damping_over_m of shaker")
        );
    }

    /// The unit of the function is that of its ratio times kg: N = kg m/s^2.
    #[test]
    fn units_are_those_of_the_functions_per_mass() {
        for (kind, product) in [
            (CoefficientKind::DAMPING, "N s/m"),
            (CoefficientKind::STIFFNESS, "N/m"),
            (CoefficientKind::CUBIC_STIFFNESS, "N/m^3"),
            (CoefficientKind::QUADRATIC_DAMPING, "N s^2/m^2"),
            (CoefficientKind::STATIC_FORCE, "N"),
        ] {
            assert_eq!(kind.unit(), product);
        }
        assert_eq!(unit(CoefficientKind::DAMPING, false), "1/s");
        assert_eq!(unit(CoefficientKind::CUBIC_STIFFNESS, false), "1/(m^2 s^2)");
        assert_eq!(unit(CoefficientKind::QUADRATIC_DAMPING, true), "1/rad");
    }
}
