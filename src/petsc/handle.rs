//! PETSc's objects and their owners.

use super::{PetscError, check, raw};
use std::{
    ptr,
    sync::atomic::{AtomicUsize, Ordering},
};

/// The number of PETSc's objects that still have an owner.
pub(super) static OPEN_HANDLES: AtomicUsize = AtomicUsize::new(0);

/// PETSc's function that releases one reference to an object and sets the pointer to null.
type Destroy<T> = unsafe extern "C" fn(*mut *mut T) -> raw::PetscErrorCode;

/// A reference to a PETSc object, released on drop.
#[derive(Debug)]
pub(super) struct Handle<T> {
    raw: *mut T,
    /// `None` if PETSc keeps the reference.
    destroy: Option<Destroy<T>>,
}

impl<T> Handle<T> {
    /// The object that `create` makes. `destroy` releases it.
    pub(super) fn new(
        destroy: Destroy<T>,
        create: impl FnOnce(*mut *mut T) -> raw::PetscErrorCode,
    ) -> Result<Self, PetscError> {
        let mut raw = ptr::null_mut();
        check(create(&mut raw))?;
        OPEN_HANDLES.fetch_add(1, Ordering::Relaxed);
        Ok(Self { raw, destroy: Some(destroy) })
    }

    /// An object that PETSc lends to a callback.
    pub(super) fn borrowed(raw: *mut T) -> Self {
        Self { raw, destroy: None }
    }

    /// The pointer that PETSc's functions take.
    pub(super) fn raw(&self) -> *mut T {
        self.raw
    }
}

impl<T> Drop for Handle<T> {
    fn drop(&mut self) {
        if let Some(destroy) = self.destroy {
            // SAFETY: the reference is ours and not used afterwards; an error cannot be acted on here.
            unsafe { destroy(&mut self.raw) };
            OPEN_HANDLES.fetch_sub(1, Ordering::Relaxed);
        }
    }
}
