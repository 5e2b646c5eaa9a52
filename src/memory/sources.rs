//! The limits of Linux on the memory of a process, from the files of `/proc` and `/sys/fs/cgroup`.

use super::in_words;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

/// Limit on the memory of the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Memory of the machine that is available without swapping.
    Machine,
    /// The limit on the address space (`RLIMIT_AS`, `ulimit -v`).
    AddressSpace,
    /// The limit on data (`RLIMIT_DATA`, `ulimit -d`).
    Data,
    /// The control group of the process, or one that contains it.
    ControlGroup,
    /// The system states no limit.
    Assumed,
}

/// Available memory and its limit; `Display` states both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Available {
    /// Bytes.
    pub bytes: u64,
    /// The limit that leaves the least.
    pub limit: Limit,
}

impl fmt::Display for Available {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = in_words(self.bytes as f64);
        match self.limit {
            Limit::Machine => write!(f, "{bytes}, which are available"),
            Limit::AddressSpace => {
                write!(
                    f,
                    "{bytes}, which the limit on the address space (`ulimit -v`) leaves"
                )
            }
            Limit::Data => write!(f, "{bytes}, which the limit on data (`ulimit -d`) leaves"),
            Limit::ControlGroup => write!(f, "{bytes}, which the control group leaves"),
            Limit::Assumed => write!(f, "{bytes}, assumed, as the system does not say"),
        }
    }
}

impl Available {
    /// The least memory that any limit leaves, by the files under a root; `None` without such files.
    pub(super) fn under(root: &Path) -> Option<Self> {
        let read = |name: &str| fs::read_to_string(root.join(name)).unwrap_or_default();
        let (limits, status) = (read("proc/self/limits"), read("proc/self/status"));
        let of_process = |limit: &str, size: &str| {
            let used = kilobytes(&status, size).unwrap_or(0);
            Some(soft_limit(&limits, limit)?.saturating_sub(used))
        };
        let groups = directories(&read("proc/self/cgroup"), &read("proc/self/mountinfo"));
        let left = groups.iter().filter_map(|group| left(root, group));
        [
            (
                kilobytes(&read("proc/meminfo"), "MemAvailable:"),
                Limit::Machine,
            ),
            (
                of_process("Max address space", "VmSize:"),
                Limit::AddressSpace,
            ),
            (of_process("Max data size", "VmData:"), Limit::Data),
            (left.min(), Limit::ControlGroup),
        ]
        .into_iter()
        .filter_map(|(bytes, limit)| {
            Some(Self {
                bytes: bytes?,
                limit,
            })
        })
        .min_by_key(|available| available.bytes)
    }
}

/// True if the process has a limit on its address space or data.
pub(super) fn has_process_limit(root: &Path) -> bool {
    let limits = fs::read_to_string(root.join("proc/self/limits")).unwrap_or_default();
    let names = ["Max address space", "Max data size"];
    names.iter().any(|name| soft_limit(&limits, name).is_some())
}

/// The bytes behind a name such as `MemAvailable:` or `VmSize:`, given in kB.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}

/// A soft limit of `/proc/self/limits`, bytes; `None` where there is none.
fn soft_limit(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// A folder of the memory controller, its mount point, and the version of the interface.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ControlGroup {
    folder: PathBuf,
    mount: PathBuf,
    version: u8,
}

/// The folders of the process's control groups that may limit memory, by `/proc/self/cgroup` and
/// `/proc/self/mountinfo`.
fn directories(cgroup: &str, mountinfo: &str) -> Vec<ControlGroup> {
    let mut groups = Vec::new();
    for line in cgroup.lines() {
        let mut parts = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (parts.next(), parts.next(), parts.next())
        else {
            continue;
        };
        let version = match controllers {
            "" => 2,
            list if list.split(',').any(|name| name == "memory") => 1,
            _ => continue,
        };
        for (root, mount) in mounts(mountinfo, version) {
            // A path outside the mount's root belongs to another namespace, so the root is used.
            let inside = Path::new(path).strip_prefix(&root).unwrap_or(Path::new(""));
            groups.push(ControlGroup {
                folder: mount.join(inside),
                mount,
                version,
            });
        }
    }
    groups
}

/// Root and mount point of the mounts of the memory controller.
fn mounts(mountinfo: &str, version: u8) -> Vec<(PathBuf, PathBuf)> {
    let mount = |line: &str| {
        let (mount, system) = line.split_once(" - ")?;
        let mut system = system.split(' ');
        let (kind, _, options) = (system.next()?, system.next()?, system.next()?);
        let fits = match version {
            2 => kind == "cgroup2",
            _ => kind == "cgroup" && options.split(',').any(|name| name == "memory"),
        };
        let mut mount = mount.split(' ').skip(3);
        let (root, point) = (mount.next()?, mount.next()?);
        fits.then(|| (PathBuf::from(root), PathBuf::from(point)))
    };
    mountinfo.lines().filter_map(mount).collect()
}

/// The least that a control group and those that contain it leave, bytes.
fn left(root: &Path, group: &ControlGroup) -> Option<u64> {
    let levels = group.folder.ancestors();
    let levels = levels.take_while(|folder| folder.starts_with(&group.mount));
    let (limit, usage, reclaimable) = match group.version {
        2 => ("memory.max", "memory.current", "inactive_file"),
        _ => (
            "memory.limit_in_bytes",
            "memory.usage_in_bytes",
            "total_inactive_file",
        ),
    };
    let of_level = |folder: &Path| {
        let folder = root.join(folder.strip_prefix("/").unwrap_or(folder));
        let read = |name: &str| fs::read_to_string(folder.join(name)).ok();
        let number = |name: &str| read(name)?.trim().parse::<u64>().ok();
        // Cached file pages count as used, but the system reclaims them when necessary.
        let stat = read("memory.stat").unwrap_or_default();
        let cached = stat.lines().find_map(|line| {
            let (name, bytes) = line.split_once(' ')?;
            (name == reclaimable).then(|| bytes.trim().parse::<u64>().ok())?
        });
        let used = number(usage)?.saturating_sub(cached.unwrap_or(0));
        Some(number(limit)?.saturating_sub(used))
    };
    levels.filter_map(of_level).min()
}

#[cfg(test)]
mod tests;
