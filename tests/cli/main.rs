//! The program as a program: arguments in; exit code, text and files out.

mod arithmetic;
mod bad_input;
mod check;
mod compare;
mod data_files;
mod durable;
mod ending;
mod front;
mod measured_input;
mod models;
mod predict;
mod reading_back;
mod regressions;
mod results;
mod sequence;
mod simulate;
mod study;
mod warnings;
mod workbench;
