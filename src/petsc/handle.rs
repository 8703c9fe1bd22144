//! PETSc's objects and their owners.

use super::{PetscError, check, raw};
use std::{
    ptr,
    sync::atomic::{AtomicUsize, Ordering},
};

/// The number of handles that are not yet dropped.
static OPEN_HANDLES: AtomicUsize = AtomicUsize::new(0);

/// The number of PETSc's objects that still have an owner.
pub(super) fn open_handles() -> usize {
    OPEN_HANDLES.load(Ordering::Relaxed)
}

/// PETSc's function that gives up one reference to an object and sets the pointer to null.
pub(super) type Destroy<T> = unsafe extern "C" fn(*mut *mut T) -> raw::PetscErrorCode;

/// One reference to a PETSc object, given up when this is dropped.
pub(super) struct Handle<T> {
    raw: *mut T,
    destroy: Destroy<T>,
}

impl<T> Handle<T> {
    /// The object that `create` makes and `destroy` destroys.
    pub(super) fn new(
        destroy: Destroy<T>,
        create: impl FnOnce(*mut *mut T) -> raw::PetscErrorCode,
    ) -> Result<Self, PetscError> {
        let mut raw = ptr::null_mut();
        check(create(&mut raw))?;
        OPEN_HANDLES.fetch_add(1, Ordering::Relaxed);
        Ok(Self { raw, destroy })
    }

    /// A further reference to an object that PETSc passes to a callback (PetscObjectReference).
    ///
    /// # Safety
    /// `raw` is a live object of the kind that `destroy` destroys.
    pub(super) unsafe fn shared(raw: *mut T, destroy: Destroy<T>) -> Result<Self, PetscError> {
        Self::new(destroy, |handle| {
            // SAFETY: the caller's promise; every PETSc object begins with a PetscObject.
            unsafe {
                *handle = raw;
                raw::PetscObjectReference(raw.cast())
            }
        })
    }

    /// The pointer that PETSc's functions take.
    pub(super) fn raw(&self) -> *mut T {
        self.raw
    }
}

impl<T> Drop for Handle<T> {
    fn drop(&mut self) {
        // SAFETY: the reference is ours and not used afterwards; an error cannot be acted on here.
        unsafe { (self.destroy)(&mut self.raw) };
        OPEN_HANDLES.fetch_sub(1, Ordering::Relaxed);
    }
}
