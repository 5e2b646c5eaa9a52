//! Column headers of functions, ratios and parameters in the tables of a run: name and unit, and `_lo95` and `_hi95` for the ends of a
//! 95 % interval.

use kmcfit_core::functions::{CoefficientFunction, Ratio};
use kmcfit_core::structure::CoefficientKind;

/// Headers of the lower and the upper end of the 95 % interval of a column.
pub(super) fn interval_columns(column: &str) -> [String; 2] {
    ["lo95", "hi95"].map(|end| format!("{column}_{end}"))
}

/// Header of a function; that of an experiment's own has its name.
pub(super) fn function_column(function: &CoefficientFunction, is_rotation: bool) -> String {
    let column = function.quantity.column(is_rotation);
    let owner = function.owner.as_deref();
    column_of_part(&column, function.is_known_part, owner)
}

fn column_of_part(column: &str, is_known_part: bool, owner: Option<&str>) -> String {
    let part = if is_known_part { "known_part_of_" } else { "" };
    match owner {
        None => format!("{part}{column}"),
        // A comma would end the header.
        Some(owner) => format!("{part}{column} of {}", owner.replace([',', '"', '\n'], " ")),
    }
}

/// Header of a function or ratio by its name in reports: `mass`, `k/m`, `damping of shaker`; `None` for other names.
pub(super) fn named_column(name: &str, is_rotation: bool) -> Option<String> {
    if let Some(ratio) = Ratio::named(name) {
        return Some(ratio.column().to_owned());
    }
    let part = name.strip_prefix("known part of ");
    let whole = part.unwrap_or(name);
    let (kind, owner) = match whole.split_once(" of ") {
        Some((kind, owner)) => (kind, Some(owner)),
        None => (whole, None),
    };
    let column = CoefficientKind::named(kind)?.column(is_rotation);
    Some(column_of_part(&column, part.is_some(), owner))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_functions_have_the_columns_of_the_functions() {
        for (quantity, column) in [
            (CoefficientKind::MASS, "mass_kg"),
            (CoefficientKind::CUBIC_STIFFNESS, "cubic_stiffness_N_per_m3"),
        ] {
            let function = CoefficientFunction::fixed(quantity, vec![1.0]);
            assert_eq!(function_column(&function, false), column);
            let owned = CoefficientFunction {
                owner: Some("block, A".into()),
                is_known_part: true,
                ..function
            };
            let header = function_column(&owned, false);
            assert_eq!(header, format!("known_part_of_{column} of block  A"));
            assert_eq!(named_column(&owned.name(), false), Some(header));
        }
        assert_eq!(
            named_column("damping ratio", true).as_deref(),
            Some("damping_ratio")
        );
        assert_eq!(named_column("friction", false), None);
    }
}
