//! Residual of the equation of motion beside its forces, in words.

use super::answer::in_words;
use kmcfit_core::number_format::significant;
use kmcfit_core::solvers::{EquationBalance, EquationForm};

/// The residual and its share of each force, the largest force first; per unit of an unknown mass they are accelerations.
pub(super) fn equation_residual(
    balance: &EquationBalance,
    is_rotation: bool,
    mass_unknown: bool,
) -> String {
    let unit = match (is_rotation, mass_unknown) {
        (false, false) => "N",
        (true, false) => "N m",
        (false, true) => "m/s^2",
        (true, true) => "rad/s^2",
    };
    let averaged = match balance.form {
        EquationForm::Weak => ", averaged by bump functions",
        EquationForm::Pointwise => "",
    };
    let mut parts = balance.parts.clone();
    parts.sort_by(|a, b| b.rms.total_cmp(&a.rms));
    let shares = parts.iter().map(|share| {
        let size = significant(share.rms, 3);
        let beside = match share.residual_share {
            // As a percentage it would only be a large number.
            share if share > 1.0 => "more than the".to_owned(),
            share => format!("{} % of", significant(100.0 * share, 2)),
        };
        format!("{beside} {} ({size} {unit})", in_words(&share.part))
    });
    let residual = significant(balance.residual_rms, 3);
    format!(
        "residual of the equation of motion {residual} {unit} rms{averaged}: {}",
        shares.collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use kmcfit_core::solvers::EquationShare;

    #[test]
    fn the_residual_is_a_share_of_each_force() {
        let share = |part: &str, rms| EquationShare {
            part: part.to_owned(),
            rms,
            residual_share: 3.1 / rms,
        };
        let balance = EquationBalance {
            form: EquationForm::Pointwise,
            bump_lengths: Vec::new(),
            residual_rms: 3.1,
            parts: vec![share("damping", 6.9), share("inertia", 310.0)],
        };
        assert_eq!(
            equation_residual(&balance, false, false),
            "residual of the equation of motion 3.1 N rms: 1 % of inertia (310 N), 45 % of damping (6.9 N)"
        );
    }
}
