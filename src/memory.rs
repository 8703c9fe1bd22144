//! The memory of this process and of the machine, from Linux (proc(5)).

use std::fs;

/// The peak memory of this process, bytes; 0 where the system does not tell it.
pub fn peak() -> f64 {
    entry("/proc/self/status", "VmHWM:").unwrap_or(0.0)
}

/// The memory that processes may still take, bytes; infinite where the system does not tell it.
pub fn available() -> f64 {
    entry("/proc/meminfo", "MemAvailable:").unwrap_or(f64::INFINITY)
}

/// The number of bytes after a name.
fn entry(file: &str, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024.0 * kilobytes)
}
