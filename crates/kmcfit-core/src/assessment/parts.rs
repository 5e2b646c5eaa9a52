//! Parts of an assessment, which a request to end leaves out.

use crate::threads::is_stopped;

/// Does parts of an assessment one after the other, and has the names of those that a request to end left out.
#[derive(Debug, Default)]
pub struct Parts {
    /// Names of the parts without a result.
    pub not_done: Vec<&'static str>,
}

impl Parts {
    /// Result of a part; `None` once there is a request to end. One that comes while the part is done may have ended its searches, so that
    /// its result is not that of the whole.
    pub fn part<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> Option<T> {
        let found = (!is_stopped()).then(work).filter(|_| !is_stopped());
        if found.is_none() {
            self.not_done.push(name);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::interruptible;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// The request comes within the second of three parts.
    #[test]
    fn parts_after_a_request_to_end_are_named() {
        let flag = Arc::new(AtomicBool::new(false));
        let mut parts = Parts::default();
        let mut begun = Vec::new();
        let found = interruptible(&flag, || {
            ["first", "second", "third"].map(|name| {
                parts.part(name, || {
                    begun.push(name);
                    flag.store(name == "second", Ordering::Relaxed);
                    name
                })
            })
        });
        assert_eq!(found, [Some("first"), None, None]);
        assert_eq!(begun, ["first", "second"]);
        assert_eq!(parts.not_done, ["second", "third"]);
    }
}
