//! Tests of the application, its models and its pages: one program, so that the tests share the processors.

#[path = "../common/mod.rs"]
mod common;

mod automatic_grid;
mod bases_input;
mod book;
mod bounded_fits;
mod builder;
mod certified;
mod equation_error_fit;
mod examples;
mod figures;
mod friction_width;
mod guide;
mod measured;
mod pages;
mod paper;
mod readme;
mod records;
mod stops;
