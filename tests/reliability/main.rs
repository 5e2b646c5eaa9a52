//! Reliability under external failures: files in the way, faults of the system, kills, full disks, closed pipes, edited
//! journals. In every case no file of the user changes, and either the old or the new results of a run are complete.

mod faults;
mod journals;
mod outputs;
#[path = "../common/program.rs"]
mod program;
mod random_folders;
mod signals;
mod streams;
mod tree;
#[cfg(target_os = "linux")]
mod unprivileged;
#[allow(dead_code, reason = "shared with the tests of the command line")]
#[path = "../cli/workbench.rs"]
mod workbench;
