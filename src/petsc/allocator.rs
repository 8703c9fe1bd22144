//! An allocator for programs: the system's, with a reaction if it has no memory. Rust alone would abort.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator. A program that installs it says how it ends without memory; a library sets no allocator.
pub struct Allocator {
    /// Called after a failed allocation. It must allocate nothing.
    pub out_of_memory: fn() -> !,
}

impl Allocator {
    fn checked(&self, block: *mut u8) -> *mut u8 {
        if block.is_null() { (self.out_of_memory)() } else { block }
    }
}

// SAFETY: every call is the same call of the system's allocator.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        self.checked(unsafe { System.alloc(layout) })
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        self.checked(unsafe { System.alloc_zeroed(layout) })
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        self.checked(unsafe { System.realloc(block, layout, size) })
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}
