//! Limits from files as Linux writes them.

use super::*;
use tempfile::TempDir;

const LIMITS: &str = "\
Limit                     Soft Limit           Hard Limit           Units     
Max cpu time              unlimited            unlimited            seconds   
Max data size             unlimited            unlimited            bytes     
Max stack size            8388608              unlimited            bytes     
Max address space         4096000000           unlimited            bytes     
";
const STATUS: &str = "Name:\tkmcfit\nVmPeak:\t 2000 kB\nVmSize:\t 1000 kB\nVmData:\t 500 kB\n";
const MEMINFO: &str = "MemTotal: 24596268 kB\nMemFree: 1 kB\nMemAvailable:   20000000 kB\n";
/// Both versions at once, as systemd mounts them.
const MOUNTS: &str = "\
22 1 8:1 / / rw,relatime shared:1 - ext4 /dev/sda1 rw
32 31 0:29 / /sys/fs/cgroup/cpu rw,relatime - cgroup cgroup rw,cpu
35 31 0:32 / /sys/fs/cgroup/memory rw,relatime shared:9 - cgroup cgroup rw,memory
41 31 0:38 / /sys/fs/cgroup/unified rw,relatime - cgroup2 cgroup2 rw,nsdelegate
";

/// A folder with files.
fn root(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("room");
        fs::write(path, text).expect("room");
    }
    folder
}

fn found(files: &[(&str, &str)]) -> Option<(u64, Limit)> {
    let available = Available::under(root(files).path())?;
    Some((available.bytes, available.limit))
}

#[test]
fn nothing_is_found_where_there_are_no_files() {
    assert_eq!(found(&[]), None);
    let odd = [
        ("proc/meminfo", "MemAvailable: much\n"),
        ("proc/self/limits", "Max address space\nMax data size   x\n"),
        ("proc/self/cgroup", "\n::\n0::\n1:memory\nx"),
        ("proc/self/mountinfo", "\n - \n1 2 3 - cgroup2\n"),
    ];
    assert_eq!(found(&odd), None);
}

#[test]
fn the_machine_and_the_limits_of_the_process() {
    let mut files = vec![("proc/meminfo", MEMINFO), ("proc/self/status", STATUS)];
    let machine = Some((20_000_000 * 1024, Limit::Machine));
    assert_eq!(found(&files), machine);
    let unlimited = LIMITS.replace("4096000000", "unlimited ");
    files.push(("proc/self/limits", &unlimited));
    assert_eq!(found(&files), machine);
    assert!(!has_process_limit(root(&files).path()));
    files[2].1 = LIMITS;
    assert!(has_process_limit(root(&files).path()));
    let expected = (4_096_000_000 - 1000 * 1024, Limit::AddressSpace);
    assert_eq!(found(&files), Some(expected));
    let data = LIMITS.replacen(
        "unlimited            unlimited            bytes",
        "1000000 2000000 bytes",
        1,
    );
    files[2].1 = &data;
    let expected = (1_000_000 - 500 * 1024, Limit::Data);
    assert_eq!(found(&files), Some(expected));
    // More is mapped than the limit allows, which was lowered later.
    let less = LIMITS.replace("4096000000", "1000      ");
    files[2].1 = &less;
    assert_eq!(found(&files), Some((0, Limit::AddressSpace)));
}

#[test]
fn a_group_of_version_1_and_those_that_contain_it() {
    let group = "sys/fs/cgroup/memory/jobs/seven";
    let file = |folder: &str, name: &str| format!("{folder}/{name}");
    let names = [
        file(group, "memory.limit_in_bytes"),
        file(group, "memory.usage_in_bytes"),
        file("sys/fs/cgroup/memory/jobs", "memory.limit_in_bytes"),
        file("sys/fs/cgroup/memory/jobs", "memory.usage_in_bytes"),
        file("sys/fs/cgroup/memory/jobs", "memory.stat"),
        file("sys/fs/cgroup/memory", "memory.limit_in_bytes"),
        file("sys/fs/cgroup/memory", "memory.usage_in_bytes"),
    ];
    let texts = [
        "9223372036854771712\n",
        "1000000\n",
        "3000000\n",
        "2500000\n",
        "cache 1\ninactive_file 7\ntotal_inactive_file 400000\n",
        "9223372036854771712\n",
        "90000000\n",
    ];
    let mut files: Vec<(&str, &str)> = names.iter().map(String::as_str).zip(texts).collect();
    files.push(("proc/meminfo", MEMINFO));
    files.push(("proc/self/mountinfo", MOUNTS));
    files.push(("proc/self/cgroup", "4:memory:/jobs/seven\n1:cpu:/\n0::/\n"));
    assert_eq!(found(&files), Some((900_000, Limit::ControlGroup)));
    // Together with another controller, as `5:memory,hugetlb:`.
    let last = files.len() - 1;
    files[last].1 = "4:hugetlb,memory:/jobs/seven\n0::/\n";
    assert_eq!(found(&files), Some((900_000, Limit::ControlGroup)));
}

#[test]
fn a_nested_group_of_version_2() {
    let mount = "1 2 0:1 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n";
    let files = [
        ("proc/meminfo", MEMINFO),
        ("proc/self/mountinfo", mount),
        ("proc/self/cgroup", "0::/user.slice/job.scope/part\n"),
        ("sys/fs/cgroup/user.slice/memory.max", "5000000\n"),
        ("sys/fs/cgroup/user.slice/memory.current", "1000000\n"),
        ("sys/fs/cgroup/user.slice/job.scope/memory.max", "3000000\n"),
        (
            "sys/fs/cgroup/user.slice/job.scope/memory.current",
            "2000000\n",
        ),
        (
            "sys/fs/cgroup/user.slice/job.scope/memory.stat",
            "anon 5\ninactive_file 300000\n",
        ),
        (
            "sys/fs/cgroup/user.slice/job.scope/part/memory.max",
            "max\n",
        ),
        (
            "sys/fs/cgroup/user.slice/job.scope/part/memory.current",
            "7\n",
        ),
    ];
    assert_eq!(found(&files), Some((1_300_000, Limit::ControlGroup)));
}

#[test]
fn a_container_sees_its_own_group_as_the_root() {
    // A namespace: the path is that of the host, the mount shows the group itself.
    let mount = "1 2 0:1 /docker/abc /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n";
    let mut files = [
        ("proc/self/mountinfo", mount),
        ("proc/self/cgroup", "0::/docker/abc\n"),
        ("sys/fs/cgroup/memory.max", "5000000\n"),
        ("sys/fs/cgroup/memory.current", "1000000\n"),
    ];
    assert_eq!(found(&files), Some((4_000_000, Limit::ControlGroup)));
    files[1].1 = "0::/elsewhere\n";
    assert_eq!(found(&files), Some((4_000_000, Limit::ControlGroup)));
}

#[test]
fn the_words_of_a_limit() {
    let said = |limit| {
        Available {
            bytes: 1_234_567_890,
            limit,
        }
        .to_string()
    };
    assert_eq!(said(Limit::Machine), "1.23 GB, which are available");
    assert_eq!(
        said(Limit::AddressSpace),
        "1.23 GB, which the limit on the address space (`ulimit -v`) leaves"
    );
}
