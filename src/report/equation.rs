//! Residual of the equation of motion beside its forces, in words.

use crate::number_format::significant;
use kmcfit_core::internals::solvers::{EquationBalance, EquationForm};

/// The residual and its share of each force, the largest force first.
pub(super) fn equation_residual(balance: &EquationBalance, is_rotation: bool) -> String {
    let unit = if is_rotation { "N m" } else { "N" };
    let averaged = match balance.form {
        EquationForm::Weak => ", averaged by bump functions",
        EquationForm::Pointwise => "",
    };
    let mut parts = balance.parts.clone();
    parts.sort_by(|a, b| b.rms.total_cmp(&a.rms));
    let shares = parts.iter().map(|share| {
        let percent = significant(100.0 * share.residual_share, 2);
        let size = significant(share.rms, 3);
        format!("{percent} % of {} ({size} {unit})", share.part.name())
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
    use kmcfit_core::internals::solvers::{EquationPart, EquationShare};

    #[test]
    fn the_residual_is_a_share_of_each_force() {
        let share = |part, rms| EquationShare {
            part,
            rms,
            residual_share: 3.1 / rms,
        };
        let balance = EquationBalance {
            form: EquationForm::Pointwise,
            bump_lengths: Vec::new(),
            residual_rms: 3.1,
            parts: vec![
                share(EquationPart::Damping, 6.9),
                share(EquationPart::Inertia, 310.0),
            ],
        };
        assert_eq!(
            equation_residual(&balance, false),
            "residual of the equation of motion 3.1 N rms: 1 % of inertia (310 N), 45 % of damping (6.9 N)"
        );
    }
}
