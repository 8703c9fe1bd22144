//! Large memory pages (<https://docs.kernel.org/admin-guide/mm/transhuge.html>).

use super::raw;
use std::ffi::c_int;

/// The size of a large page, bytes; a multiple of all other page sizes.
const LARGE: usize = 2 << 20;

/// Asks Linux for large pages under an array that will be read from end to end many times (madvise(2)). Call
/// this before the array is written. A processor does not prefetch across the borders of small pages. If the
/// system has no large pages, the call has no effect.
pub(crate) fn use_large_pages<T>(values: &[T]) {
    let range = values.as_ptr_range();
    let begin = (range.start as usize).next_multiple_of(LARGE);
    let size = (range.end as usize / LARGE * LARGE).saturating_sub(begin);
    if size > 0 {
        // SAFETY: the range has whole pages of a live array; their contents do not change.
        unsafe { raw::madvise(begin as *mut _, size, raw::MADV_HUGEPAGE as c_int) };
    }
}
