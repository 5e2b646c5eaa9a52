//! What a file states is applied, or named by `init` and by a reason of the verdict.
#![allow(dead_code)]

mod files;
mod headings;
#[path = "../common/program.rs"]
mod program;
mod properties;
mod texts;
#[path = "../cli/workbench.rs"]
mod workbench;
