//! Large pages of memory (<https://docs.kernel.org/admin-guide/mm/transhuge.html>).

use super::raw;
use std::ffi::c_int;

/// The size of a large page, bytes: a multiple of all others.
const LARGE: usize = 2 << 20;

/// Asks Linux for large pages under an array that is yet to be written, and then read from end to end again
/// and again (madvise(2)): across pages of 4 kB a processor does not fetch ahead. Where there are none, all
/// stays as it is.
pub(crate) fn use_large_pages<T>(values: &[T]) {
    let range = values.as_ptr_range();
    let begin = (range.start as usize).next_multiple_of(LARGE);
    let size = (range.end as usize / LARGE * LARGE).saturating_sub(begin);
    if size > 0 {
        // SAFETY: whole pages of a live array, which keep their contents.
        unsafe { raw::madvise(begin as *mut _, size, raw::MADV_HUGEPAGE as c_int) };
    }
}
