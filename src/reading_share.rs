//! Share of a text table that has been read, for displays of progress.

use std::sync::atomic::{AtomicUsize, Ordering};

static READ: AtomicUsize = AtomicUsize::new(0);
static ALL: AtomicUsize = AtomicUsize::new(0);

/// States that `read` of `all` bytes of the current table have been read.
pub fn set(read: usize, all: usize) {
    READ.store(read, Ordering::Relaxed);
    ALL.store(all, Ordering::Relaxed);
}

/// Bytes read and bytes of the current table; `None` while none is read.
pub fn get() -> Option<[u64; 2]> {
    let [read, all] = [&READ, &ALL].map(|bytes| bytes.load(Ordering::Relaxed) as u64);
    (all > 0).then_some([read.min(all), all])
}
