//! Constraints of a model file, with their columns at the nodes.

use super::ModelKey;
use super::functions::read_column;
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::model::ConstraintSpec;
use kmcfit_core::system::Grid;

/// The constraints of the model; bounds of a function are part of its specification.
pub(super) fn all(
    file: &ModelFile,
    grid: &Grid,
) -> Result<Option<Vec<ConstraintSpec>>, InputError> {
    let mut list = file.spec.constraints.clone();
    for (i, spec) in list.iter_mut().flatten().enumerate() {
        for (name, bound) in [("min", &mut spec.min), ("max", &mut spec.max)] {
            let at = ModelKey::new(file, format!("constraints[{i}].{name}"));
            bound
                .iter_mut()
                .try_for_each(|bound| read_column(&at, grid, bound))?;
        }
    }
    Ok(list)
}
