//! Memory that would not fit, said before it is asked for.

use crate::{Error, ErrorKind, Result};
use std::fs::read_to_string;
use std::path::Path;

/// Memory that this process can still get \[bytes\], where the system tells (Linux): what is free or can be freed, and no
/// more than its control groups (versions 2 and 1: containers, batch systems) and its own limit (`ulimit -v`) leave it.
pub fn available() -> Option<u64> {
    let free = read_to_string("/proc/meminfo").ok().as_deref().and_then(parse_available);
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let limits = read_to_string("/proc/self/limits").unwrap_or_default();
    let status = read_to_string("/proc/self/status").unwrap_or_default();
    let own = left_by_limit(&limits, &status);
    free.into_iter().chain(left_by_groups(&groups, Path::new("/sys/fs/cgroup"))).chain(own).min()
}

/// The most memory that this process had at any time \[bytes\], where the system tells (Linux).
pub fn peak() -> Option<u64> {
    let status = read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// What the limit on addresses leaves; `None` without one.
fn left_by_limit(limits: &str, status: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit = line.split_whitespace().next()?.parse::<u64>().ok()?;
    let used = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?.trim().strip_suffix("kB")?.trim();
    Some(limit.saturating_sub(used.parse::<u64>().ok()? * 1024))
}

fn parse_available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// The files of one version of control groups.
struct Version {
    /// Folder of the hierarchy below the mount point.
    root: &'static str,
    limit: &'static str,
    usage: &'static str,
    /// Line of `memory.stat` with page cache that goes when it is needed.
    cache: &'static str,
}

const VERSIONS: [Version; 3] = [
    Version { root: "", limit: "memory.max", usage: "memory.current", cache: "inactive_file" },
    Version { root: "unified", limit: "memory.max", usage: "memory.current", cache: "inactive_file" },
    Version {
        root: "memory",
        limit: "memory.limit_in_bytes",
        usage: "memory.usage_in_bytes",
        cache: "total_inactive_file",
    },
];

/// The least that any group above this process leaves [bytes]; `groups` is `/proc/self/cgroup`.
fn left_by_groups(groups: &str, mount: &Path) -> Option<u64> {
    let mut least = None;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':');
        let (Some(_), Some(kinds), Some(path)) = (parts.next(), parts.next(), parts.next()) else { continue };
        let versions = match kinds {
            "" => &VERSIONS[..2],
            kinds if kinds.split(',').any(|kind| kind == "memory") => &VERSIONS[2..],
            _ => continue,
        };
        for version in versions {
            let root = mount.join(version.root);
            // In a container the path may be the host's: then only the root is there, and is the container's own.
            let mut folder = root.join(path.trim_start_matches('/'));
            loop {
                least = least.into_iter().chain(left_by(&folder, version)).min();
                if folder == root || !folder.pop() {
                    break;
                }
            }
        }
    }
    least
}

/// Limit less usage of one group.
fn left_by(folder: &Path, version: &Version) -> Option<u64> {
    let number = |name: &str| read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    let limit = number(version.limit)?;
    let stat = read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let cache = stat.lines().find_map(|line| line.strip_prefix(version.cache)?.trim().parse::<u64>().ok());
    let used = number(version.usage).unwrap_or(0).saturating_sub(cache.unwrap_or(0));
    Some(limit.saturating_sub(used))
}

/// A Memory error if `needed` bytes are more than `available`; `what` starts the message, `remedy` ends it.
///
/// # Errors
/// Only that.
pub fn require(needed: u128, available: Option<u64>, what: &str, remedy: &str) -> Result<()> {
    match available {
        Some(available) if needed > u128::from(available) => Err(Error::new(
            ErrorKind::Memory,
            format!("{what} needs {}, {} is available; {remedy}", gigabytes(needed), gigabytes(available.into())),
        )),
        _ => Ok(()),
    }
}

/// For instance `1.50 GB` (10^9 bytes).
pub fn gigabytes(bytes: u128) -> String {
    format!("{:.2} GB", bytes as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_need_above_what_is_there_names_both_numbers() {
        let error = require(2_500_000_000, Some(1_000_000_000), "the film", "use --crop").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Memory);
        assert_eq!(error.to_string(), "the film needs 2.50 GB, 1.00 GB is available; use --crop");
        assert!(require(1_000_000_000, Some(1_000_000_000), "", "").is_ok());
        assert!(require(u128::MAX, None, "", "").is_ok());
    }

    #[test]
    fn meminfo_counts_in_units_of_1024_bytes() {
        let text = "MemTotal:       100 kB\nMemAvailable:   12345 kB\n";
        assert_eq!(parse_available(text), Some(12345 * 1024));
        assert_eq!(parse_available("nothing of the kind"), None);
    }

    #[test]
    fn a_limit_on_addresses_counts_what_is_used() {
        let limits = "Limit  Soft Limit  Hard Limit  Units\nMax address space         2048000  unlimited  bytes\n";
        assert_eq!(left_by_limit(limits, "VmPeak: 9 kB\nVmSize:\t    1000 kB\n"), Some(1_024_000));
        assert_eq!(left_by_limit(&limits.replace("2048000", "unlimited"), "VmSize: 1000 kB"), None);
    }

    /// Folders as the kernel has them; a group may not leave more than the one above it.
    #[test]
    fn control_groups_of_both_versions_are_heeded_up_to_the_root() {
        let mount = tempfile::tempdir().unwrap();
        let put = |path: &str, text: &str| {
            let path = mount.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let left = |groups: &str| left_by_groups(groups, mount.path());
        assert_eq!(left("0::/a/b\n"), None);
        put("a/b/memory.max", "max\n");
        put("a/memory.max", "5000\n");
        put("a/memory.current", "1200\n");
        put("a/memory.stat", "anon 3\ninactive_file 200\nactive_file 9\n");
        assert_eq!(left("0::/a/b\n"), Some(4000));
        put("a/b/memory.max", "3000\n");
        assert_eq!(left("0::/a/b\n"), Some(3000));
        assert_eq!(left("0::/\n"), None);
        put("memory/job/memory.limit_in_bytes", "900");
        put("memory/job/memory.usage_in_bytes", "950");
        assert_eq!(left("9:cpu:/x\n4:memory,hugetlb:/job/step\n0::/a/b\n"), Some(0), "over its limit: nothing is left");
        put("memory/memory.limit_in_bytes", "700");
        assert_eq!(left("4:memory:/host/path/that/is/not/here\n"), Some(700));
    }
}
