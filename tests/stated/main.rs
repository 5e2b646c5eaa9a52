//! What a file states is applied, or named by `init` and by a reason of the verdict.
#![allow(dead_code)]

mod clocks;
mod files;
mod headings;
mod kinds;
mod many_variables;
#[path = "../common/program.rs"]
mod program;
mod properties;
mod sets;
mod texts;
#[path = "../cli/workbench.rs"]
mod workbench;
