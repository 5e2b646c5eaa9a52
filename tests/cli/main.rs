//! The program as a process: exit code, output and files for given arguments.

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
mod formats;
mod known_parts;
mod measured_input;
mod models;
mod predict;
mod reading_back;
mod regressions;
mod results;
mod sequence;
mod simulate;
mod study;
mod uncommon_input;
mod verify;
mod warnings;
mod workbench;
