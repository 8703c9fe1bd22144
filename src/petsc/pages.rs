//! Large pages of memory (<https://docs.kernel.org/admin-guide/mm/transhuge.html>).

use super::raw;
use std::{ffi::c_int, fs};

/// The size of a large page, bytes: a multiple of all others.
const LARGE: usize = 2 << 20;
/// Large pages in place of those in use already (Linux 6.1, later than Debian 12's headers).
const MADV_COLLAPSE: c_int = 25;

/// Asks Linux for large pages under all memory in use (madvise(2)): across pages of 4 kB a processor does not
/// fetch ahead, and arrays larger than its caches are read at half the speed. Where there are none, all stays
/// as it is.
pub(crate) fn use_large_pages() {
    // A line for each range of addresses: range, rights, offset, device, inode, name (proc_pid_maps(5)).
    for line in fs::read_to_string("/proc/self/maps").unwrap_or_default().lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let ([range, "rw-p", .., "0"] | [range, "rw-p", .., "[heap]"]) = fields[..] else {
            continue;
        };
        let address = |hexadecimal| usize::from_str_radix(hexadecimal, 16).unwrap_or(0);
        let (begin, end) = range.split_once('-').unwrap_or_default();
        let begin = address(begin).next_multiple_of(LARGE);
        let size = (address(end) / LARGE * LARGE).saturating_sub(begin);
        for advice in [raw::MADV_HUGEPAGE as c_int, MADV_COLLAPSE] {
            // SAFETY: memory keeps its contents; of what is not this process' own the kernel knows.
            unsafe { raw::madvise(begin as *mut _, size, advice) };
        }
    }
}
