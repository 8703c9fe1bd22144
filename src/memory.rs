//! The memory of this process and of the machine, from Linux (proc(5), cgroups(7)).

use std::{env, fs, path::Path};

/// Advice for a run without enough memory.
pub const REMEDY: &str = "take larger triangles, several processes (mpiexec), or multigrid \
                                 (-- -elastic_pc_type gamg -damage_pc_type gamg)";

/// The peak memory of this process, bytes; 0 where the system does not report it.
pub fn peak() -> f64 {
    1024.0 * number("/proc/self/status", "VmHWM:").unwrap_or(0.0)
}

/// The memory that this process may still take, bytes; infinite where the system does not report it. The ranks on
/// a machine and the runs of a study have equal parts of its memory.
pub fn available() -> f64 {
    left(&["MemAvailable:", "SwapFree:"])
}

/// The same without swapping.
pub(crate) fn free() -> f64 {
    left(&["MemAvailable:"])
}

fn left(kinds: &[&str]) -> f64 {
    let free = kinds.iter().map(|name| number("/proc/meminfo", name));
    let free = free.sum::<Option<f64>>().map_or(f64::INFINITY, |free| 1024.0 * free);
    let machine = left_by_groups().map_or(free, |left| left.min(free));
    let sharing = ["OMPI_COMM_WORLD_LOCAL_SIZE", "SIGNORINI_RUNS"];
    let sharing = sharing.iter().filter_map(|name| env::var(name).ok()?.parse::<f64>().ok());
    address_space().min(machine / sharing.product::<f64>())
}

/// The address space that the limit of this process leaves it (`ulimit -v`), bytes.
pub(crate) fn address_space() -> f64 {
    let limit = number("/proc/self/limits", "Max address space").unwrap_or(f64::INFINITY);
    limit - 1024.0 * number("/proc/self/status", "VmSize:").unwrap_or(0.0)
}

/// The memory that the control groups of this process leave it, bytes. Cached files do not count as used.
fn left_by_groups() -> Option<f64> {
    let left = |group: &Path| {
        // The names of version 2 and of version 1.
        let of = |names: [&str; 2]| names.iter().find_map(|name| number(group.join(name), ""));
        let limit = of(["memory.max", "memory.limit_in_bytes"])?;
        let usage = of(["memory.current", "memory.usage_in_bytes"])?;
        let cached = |kind| number(group.join("memory.stat"), kind).unwrap_or(0.0);
        Some(limit - usage + cached("active_file ") + cached("inactive_file "))
    };
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    // A line is NUMBER:CONTROLLERS:/PATH; version 2 names no controllers.
    let paths = groups.lines().filter_map(|line| line.split_once(':')?.1.split_once(":/"));
    let folders = paths.map(|(of, path)| Path::new("/sys/fs/cgroup").join(of).join(path));
    folders.flat_map(|at| Vec::from_iter(at.ancestors().filter_map(left))).reduce(f64::min)
}

/// The number after `name` in the last line that begins with it or with "total_" and it.
fn number(file: impl AsRef<Path>, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    let mut lines = text.lines().rev().map(|line| line.strip_prefix("total_").unwrap_or(line));
    lines.find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}
