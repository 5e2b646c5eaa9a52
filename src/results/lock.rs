//! Lock on an output folder, held by one run at a time.

use super::system;
use std::fs::{File, TryLockError};
use std::path::Path;

/// File that is locked on systems without locks on folders.
const LOCK: &str = ".kmcfit.lock";

/// The lock. The operating system releases it when the process ends, so a killed run does not block others.
#[derive(Debug)]
pub(super) struct Lock {
    held: File,
}

impl Drop for Lock {
    /// Unlocks also for copies of the file descriptor: a process that another thread forks at this moment has one until it
    /// starts its program.
    fn drop(&mut self) {
        let _ = self.held.unlock();
    }
}

/// Another process holds the lock.
#[derive(Debug)]
pub(super) struct Taken;

impl Lock {
    /// Locks a folder, or a file in it on systems without locks on folders. `None` on a file system without locks,
    /// where runs are possible unlocked.
    pub fn take(folder: &Path) -> Result<Option<Self>, Taken> {
        let on_folder = File::open(folder).ok().map(locked);
        match on_folder {
            Some(Ok(lock)) => Ok(Some(lock)),
            Some(Err(TryLockError::WouldBlock)) => Err(Taken),
            Some(Err(TryLockError::Error(_))) | None => Self::by_file(&folder.join(LOCK)),
        }
    }

    fn by_file(path: &Path) -> Result<Option<Self>, Taken> {
        // A link could lead out of the folder.
        let file = match path.is_symlink() {
            true => None,
            false => system::open_lock(path).ok(),
        };
        match file.map(locked) {
            Some(Ok(lock)) => Ok(Some(lock)),
            Some(Err(TryLockError::WouldBlock)) => Err(Taken),
            Some(Err(TryLockError::Error(_))) => {
                // A file system without locks: the lock file has no effect.
                let _ = system::remove_file(path);
                Ok(None)
            }
            None => Ok(None),
        }
    }
}

fn locked(file: File) -> Result<Lock, TryLockError> {
    file.try_lock()?;
    Ok(Lock { held: file })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A copy of the descriptor, as a forked process has it, does not keep the lock.
    #[test]
    fn released_for_copies_too() {
        let place = tempfile::tempdir().expect("a folder");
        let first = Lock::take(place.path()).expect("free").expect("a lock");
        let copy = first.held.try_clone().expect("a copy");
        drop(first);
        assert!(Lock::take(place.path()).expect("free").is_some());
        drop(copy);
    }

    #[test]
    fn one_at_a_time() {
        let place = tempfile::tempdir().expect("a folder");
        for take in [Lock::take, |folder: &Path| {
            Lock::by_file(&folder.join(LOCK))
        }] {
            let first = take(place.path()).expect("free").expect("a lock");
            assert!(take(place.path()).is_err());
            drop(first);
            assert!(take(place.path()).expect("free again").is_some());
        }
    }
}
