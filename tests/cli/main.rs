//! The program as a process: exit code, output and files for given arguments.

mod advice;
mod arithmetic;
mod bad_input;
mod check;
mod command_line;
mod compare;
mod corruptions;
mod data_files;
mod ending;
mod faulty_records;
mod fleet;
mod followed_advice;
mod formats;
mod golden;
mod init;
mod known_parts;
mod measured_input;
mod misleading;
mod models;
mod oscillator;
mod predict;
#[path = "../common/program.rs"]
mod program;
mod reading_back;
mod regressions;
mod results;
mod right_answers;
mod run_folder;
mod sequence;
mod simulate;
mod study;
mod terminal;
mod uncommon_input;
mod units;
mod warnings;
mod workbench;
