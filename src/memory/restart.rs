//! Restart of the program with allocators that reserve no address space in advance, for processes with a limited
//! address space.

#[cfg(target_os = "linux")]
use super::sources::has_process_limit;

/// Settings of the allocators of the C library and of Rust: one arena of the C library for all
/// threads in place of 64 MB of addresses each, and no reservation of 1 GB ahead.
#[cfg(target_os = "linux")]
const SETTINGS: [(&str, &str); 2] = [("MALLOC_ARENA_MAX", "1"), ("MIMALLOC_ARENA_RESERVE", "0")];

/// Restarts the program in the same process with allocators that reserve nothing in advance, if its address space or
/// data are limited: reserved addresses count against these limits and can prevent thread starts although memory is
/// available. Allocators read their settings only at the start.
///
/// Does nothing without a limit, or if the settings were given.
pub fn restart_with_plain_allocators() {
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::process::CommandExt;
        let is_set = |(name, _): &(&str, &str)| std::env::var_os(name).is_some();
        if SETTINGS.iter().any(is_set) || !has_process_limit(std::path::Path::new("/")) {
            return;
        }
        let Ok(program) = std::env::current_exe() else {
            return;
        };
        let mut arguments = std::env::args_os();
        let mut command = std::process::Command::new(program);
        if let Some(name) = arguments.next() {
            command.arg0(name);
        }
        // `exec` returns only on failure; the program then continues unchanged.
        let _ = command.args(arguments).envs(SETTINGS).exec();
    }
}
