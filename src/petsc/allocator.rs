//! The allocator of all Rust code: the system's, with a message if it has no memory. Rust alone would abort.

use crate::memory::end_process;
use std::alloc::{GlobalAlloc, Layout, System};

struct Allocator;
#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

fn checked(block: *mut u8) -> *mut u8 {
    if block.is_null() { end_process() } else { block }
}

// SAFETY: every call is the same call of the system's allocator.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        checked(unsafe { System.alloc(layout) })
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        checked(unsafe { System.alloc_zeroed(layout) })
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        checked(unsafe { System.realloc(block, layout, size) })
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}
