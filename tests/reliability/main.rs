//! What the program does when something around it fails: files in the way, faults of the system, kills, full disks,
//! closed pipes, edited journals. In every case no file of the user changes, and of an older run the old or the
//! new results are whole.

mod faults;
mod journals;
mod outputs;
mod random_folders;
mod signals;
mod streams;
mod tree;
#[cfg(target_os = "linux")]
mod unprivileged;
#[allow(dead_code, reason = "shared with the tests of the command line")]
#[path = "../cli/workbench.rs"]
mod workbench;
