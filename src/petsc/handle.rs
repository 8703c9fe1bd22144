//! PETSc's objects and their owners.

use super::{PetscError, check, raw, session::Turn};
use std::{ptr, rc::Rc};

/// PETSc's function that releases one reference to an object and sets the pointer to null.
type Destroy<T> = unsafe extern "C" fn(*mut *mut T) -> raw::PetscErrorCode;

/// A reference to a PETSc object, released on drop.
#[derive(Debug)]
pub(super) struct Handle<T> {
    raw: *mut T,
    /// `None` if PETSc keeps the reference. An owner keeps the turn of its thread: no other thread calls PETSc, and PETSc does not
    /// end, while the object exists.
    destroy: Option<(Destroy<T>, Rc<Turn>)>,
}

impl<T> Handle<T> {
    /// The object that `create` makes. `destroy` releases it.
    pub(super) fn new(
        destroy: Destroy<T>,
        create: impl FnOnce(*mut *mut T) -> raw::PetscErrorCode,
    ) -> Result<Self, PetscError> {
        let (mut raw, turn) = (ptr::null_mut(), Turn::of_this_thread()?);
        check(create(&mut raw))?;
        Ok(Self { raw, destroy: Some((destroy, turn)) })
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
        if let Some((destroy, _)) = &self.destroy {
            // SAFETY: the reference is ours and not used afterwards; an error cannot be acted on here.
            unsafe { destroy(&mut self.raw) };
        }
    }
}
