//! Tests of the library of the application: one program, so that the tests share the processors.

#[path = "../common/mod.rs"]
mod common;

mod automatic_grid;
mod bases_input;
mod bounded_fits;
mod builder;
mod combinations;
mod equation_error_fit;
mod figures;
mod friction_width;
mod measured;
mod records;
mod tables;
