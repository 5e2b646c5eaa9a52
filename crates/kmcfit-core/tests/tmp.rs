#![allow(unused)]
#[path = "common/mod.rs"]
mod common;
#[path = "suite/structures.rs"]
mod structures;
#[path = "suite/input_errors.rs"]
mod input_errors;
