//! Ctrl-C: the first one ends a run in order, the second one at once.

use super::INTERRUPTED;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that Ctrl-C sets.
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    let handler = move || {
        if seen.swap(true, Ordering::Relaxed) {
            eprintln!(
                "stopped at once; `kmcfit resume FOLDER` goes on from what was kept on the way, if anything was"
            );
            std::process::exit(INTERRUPTED.into());
        }
    };
    // Without a handler Ctrl-C still ends the program, only not in order.
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("warning: Ctrl-C will end the run without results: {error}");
    }
    flag
}
