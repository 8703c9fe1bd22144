//! Vectors distributed by owned entries (<https://petsc.org/release/manualpages/Vec/>).

use super::{Communicator, PetscError, Session, check, handle::Handle, raw, session::world};
use std::{mem, ptr, slice};

/// A PETSc vector; this rank owns a contiguous part of it.
pub struct Vector {
    handle: Handle<raw::_p_Vec>,
    owned: usize,
}

impl Vector {
    /// A zero vector with `owned` entries on this rank (VecCreateMPI).
    ///
    /// # Errors
    /// There are too many entries for 32-bit indices, or the memory does not suffice.
    pub fn zeros(_session: &Session, owned: usize) -> Result<Self, PetscError> {
        let local = index(owned)?;
        let handle = Handle::new(raw::VecDestroy, |handle| {
            // SAFETY: a fresh handle; -1 (PETSC_DETERMINE) sums the sizes of the ranks.
            unsafe { raw::VecCreateMPI(world(), local, -1, handle) }
        })?;
        Ok(Self { handle, owned })
    }

    /// A vector that PETSc passes to a callback.
    ///
    /// # Safety
    /// `raw` is alive as long as this vector.
    pub(super) unsafe fn borrowed(raw: raw::Vec) -> Result<Self, PetscError> {
        let mut owned = 0;
        // SAFETY: the caller's promise.
        check(unsafe { raw::VecGetLocalSize(raw, &mut owned) })?;
        Ok(Self { handle: Handle::borrowed(raw), owned: owned as usize })
    }

    pub(super) fn raw(&self) -> raw::Vec {
        self.handle.raw()
    }

    /// Calls `reader` with the owned entries (VecGetArrayRead).
    ///
    /// # Errors
    /// PETSc failed.
    pub fn read<R>(&self, reader: impl FnOnce(&[f64]) -> R) -> Result<R, PetscError> {
        let mut data = ptr::null();
        // SAFETY: PETSc lends `owned` values until they are restored below.
        unsafe {
            check(raw::VecGetArrayRead(self.raw(), &mut data))?;
            let result = reader(lent(data, self.owned));
            check(raw::VecRestoreArrayRead(self.raw(), &mut data))?;
            Ok(result)
        }
    }

    /// Calls `writer` with the owned entries, which it may change (VecGetArray).
    ///
    /// # Errors
    /// PETSc failed.
    pub fn write<R>(&mut self, writer: impl FnOnce(&mut [f64]) -> R) -> Result<R, PetscError> {
        let mut data = ptr::null_mut();
        // SAFETY: as in `read`; `&mut self` excludes other readers.
        unsafe {
            check(raw::VecGetArray(self.raw(), &mut data))?;
            let result = writer(lent_mut(data, self.owned));
            check(raw::VecRestoreArray(self.raw(), &mut data))?;
            Ok(result)
        }
    }

    /// Copies `values` (the owned entries) into the vector.
    ///
    /// # Errors
    /// The number of values differs.
    pub fn set(&mut self, values: &[f64]) -> Result<(), PetscError> {
        same_size(self.owned, values.len())?;
        self.write(|data| data.copy_from_slice(values))
    }

    /// ‖·‖₂ over all ranks (VecNorm).
    pub(crate) fn norm(&self) -> Result<f64, PetscError> {
        let mut norm = 0.0;
        // SAFETY: a live handle.
        check(unsafe { raw::VecNorm(self.raw(), raw::NormType::NORM_2, &mut norm) })?;
        Ok(norm)
    }

    /// ‖·‖₂ over all ranks, without the entries of the owned unknowns that are `prescribed` (increasing); `None` if
    /// no rank prescribes any.
    pub(crate) fn free_norm(&self, prescribed: Option<&[usize]>) -> Result<f64, PetscError> {
        let Some(prescribed) = prescribed else { return self.norm() };
        let squares = self.read(|v| {
            let mut start = 0;
            let squares = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
            let mut before = |end: usize| squares(&v[mem::replace(&mut start, end + 1)..end]);
            prescribed.iter().map(|&unknown| before(unknown)).sum::<f64>() + before(v.len())
        })?;
        Ok(Communicator::of_world().total(squares).sqrt())
    }

    /// Inner product over all ranks (VecDot).
    pub(crate) fn dot(&self, other: &Self) -> Result<f64, PetscError> {
        let mut product = 0.0;
        // SAFETY: live handles; PETSc compares their sizes.
        check(unsafe { raw::VecDot(self.raw(), other.raw(), &mut product) })?;
        Ok(product)
    }

    /// this ← `a` `x` + `b` this; for `b` = 0 the old values do not matter (VecAXPBY).
    pub(crate) fn axpby(&mut self, a: f64, x: &Self, b: f64) -> Result<(), PetscError> {
        // SAFETY: live handles, distinct by borrowing; PETSc compares their sizes.
        check(unsafe { raw::VecAXPBY(self.raw(), a, b, x.raw()) })
    }

    /// Number of entries this rank owns.
    pub fn owned(&self) -> usize {
        self.owned
    }
}

/// The `count` values that PETSc lends; it may lend null for none, which is no slice.
///
/// # Safety
/// `data` has `count` values during the life of the slice.
pub(super) unsafe fn lent<'a, T>(data: *const T, count: usize) -> &'a [T] {
    // SAFETY: the caller's promise.
    if count == 0 { &[] } else { unsafe { slice::from_raw_parts(data, count) } }
}

/// As [`lent`], for writing.
///
/// # Safety
/// As of [`lent`], and there is no other reference to the values.
pub(super) unsafe fn lent_mut<'a, T>(data: *mut T, count: usize) -> &'a mut [T] {
    // SAFETY: the caller's promise.
    if count == 0 { &mut [] } else { unsafe { slice::from_raw_parts_mut(data, count) } }
}

/// A number of entries in PETSc's integer type.
pub(super) fn index(owned: usize) -> Result<i32, PetscError> {
    i32::try_from(owned)
        .map_err(|_| PetscError::ours(format!("{owned} entries exceed 32-bit indices")))
}

/// An error if an array has not the expected length: PETSc would read or write beyond its end.
pub(super) fn same_size(expected: usize, found: usize) -> Result<(), PetscError> {
    match expected == found {
        true => Ok(()),
        false => Err(PetscError::ours(format!("{found} values where {expected} are owned"))),
    }
}
