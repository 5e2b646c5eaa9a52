//! Allocators that reserve no more address space than they use, where the address space is limited.

#[cfg(target_os = "linux")]
use super::sources::has_process_limit;

/// Settings of the allocators of the C library and of Rust: one arena of the C library for all
/// threads in place of 64 MB of addresses each, and no reservation of 1 GB ahead.
#[cfg(target_os = "linux")]
const SETTINGS: [(&str, &str); 2] = [("MALLOC_ARENA_MAX", "1"), ("MIMALLOC_ARENA_RESERVE", "0")];

/// Starts the program again, in its place, with allocators that reserve nothing ahead, where its
/// address space or data are limited: what they reserve counts against these limits, so that threads
/// could not be started although memory is left. Allocators read their settings at the start only.
///
/// Does nothing where there is no limit, or the settings were given.
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
        // It returns only where it fails; then the program goes on as it is.
        let _ = command.args(arguments).envs(SETTINGS).exec();
    }
}
