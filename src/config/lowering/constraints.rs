//! Constraints of a model file, as constraints of the builder.

mod entry;

use super::Place;
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::internals::builder::Builder;
use kmcfit_core::internals::system::Grid;

/// Adds the constraints of the model to the builder. Bounds of a function are part of its specification.
pub(super) fn add(
    file: &ModelFile,
    grid: &Grid,
    mut builder: Builder,
) -> Result<Builder, InputError> {
    let Some(list) = &file.spec.constraints else {
        return Ok(builder);
    };
    if list.is_empty() {
        return Err(file
            .error_at("constraints", "there is no constraint")
            .found("an empty list")
            .expected("at least one constraint, or no `constraints`"));
    }
    for (i, spec) in list.iter().enumerate() {
        let soft = spec.soft;
        for (key, constraint) in
            entry::read(Place::new(file, format!("constraints[{i}]")), grid, spec)?
        {
            builder = builder.constraint(key, constraint, soft);
        }
    }
    Ok(builder)
}
