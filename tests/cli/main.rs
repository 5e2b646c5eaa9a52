//! The program as a process: exit code, output and files for given arguments.

mod advice;
mod arithmetic;
mod bad_input;
mod check;
mod command_line;
mod compare;
mod corruptions;
mod data_files;
mod durable;
mod ending;
mod faulty_records;
mod fleet;
mod formats;
mod golden;
mod init;
mod known_parts;
mod measured_input;
mod models;
mod new_user;
mod oscillator;
mod predict;
#[path = "../common/program.rs"]
mod program;
mod reading_back;
mod regressions;
mod report;
mod results;
mod sequence;
mod simulate;
mod study;
mod terminal;
mod uncommon_input;
mod units;
mod verify;
mod warnings;
mod workbench;
