//! Vectors distributed by owned entries.

use super::{
    PetscError, Session, check, raw,
    session::{Live, world},
};
use std::{ptr, slice};

/// A PETSc vector; this rank owns a contiguous part of it.
pub struct Vector {
    pub(super) raw: raw::Vec,
    owned: usize,
    _live: Live,
}

impl Vector {
    /// A zero vector with `owned` entries on this rank (VecCreateMPI).
    pub fn zeros(_session: &Session, owned: usize) -> Result<Self, PetscError> {
        let mut raw = ptr::null_mut();
        let local = i32::try_from(owned)
            .map_err(|_| PetscError::ours(format!("{owned} entries exceed 32-bit indices")))?;
        // SAFETY: a fresh handle on the world communicator; -1 (PETSC_DETERMINE) sums the sizes.
        check(unsafe { raw::VecCreateMPI(world(), local, -1, &mut raw) })?;
        Ok(Self { raw, owned, _live: Live::new() })
    }

    /// The owned entries.
    pub fn read<R>(&self, reader: impl FnOnce(&[f64]) -> R) -> Result<R, PetscError> {
        let mut data = ptr::null();
        // SAFETY: PETSc lends `owned` values until they are given back below.
        unsafe {
            check(raw::VecGetArrayRead(self.raw, &mut data))?;
            let result = reader(slice::from_raw_parts(data, self.owned));
            check(raw::VecRestoreArrayRead(self.raw, &mut data))?;
            Ok(result)
        }
    }

    /// The owned entries, to be changed.
    pub fn write<R>(&mut self, writer: impl FnOnce(&mut [f64]) -> R) -> Result<R, PetscError> {
        let mut data = ptr::null_mut();
        // SAFETY: as in `read`, and `&mut self` keeps other readers away.
        unsafe {
            check(raw::VecGetArray(self.raw, &mut data))?;
            let result = writer(slice::from_raw_parts_mut(data, self.owned));
            check(raw::VecRestoreArray(self.raw, &mut data))?;
            Ok(result)
        }
    }

    /// Copies `values` (the owned entries) into the vector.
    pub fn set(&mut self, values: &[f64]) -> Result<(), PetscError> {
        same_size(self.owned, values.len())?;
        self.write(|data| data.copy_from_slice(values))
    }

    /// Copies the owned entries out into `values`.
    pub fn get(&self, values: &mut [f64]) -> Result<(), PetscError> {
        same_size(self.owned, values.len())?;
        self.read(|data| values.copy_from_slice(data))
    }

    /// ‖·‖₂ over all ranks.
    pub fn norm(&self) -> Result<f64, PetscError> {
        let mut norm = 0.0;
        // SAFETY: a live handle.
        check(unsafe { raw::VecNorm(self.raw, raw::NormType::NORM_2, &mut norm) })?;
        Ok(norm)
    }

    /// Inner product over all ranks.
    pub fn dot(&self, other: &Self) -> Result<f64, PetscError> {
        same_size(self.owned, other.owned)?;
        let mut product = 0.0;
        // SAFETY: live handles of matching layout.
        check(unsafe { raw::VecDot(self.raw, other.raw, &mut product) })?;
        Ok(product)
    }

    /// this ← this + `factor` · `other`.
    pub fn add(&mut self, factor: f64, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        // SAFETY: live handles of matching layout, distinct by borrowing.
        check(unsafe { raw::VecAXPY(self.raw, factor, other.raw) })
    }

    /// this ← `factor` · this + `other`.
    pub fn scale_add(&mut self, factor: f64, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        // SAFETY: live handles of matching layout, distinct by borrowing.
        check(unsafe { raw::VecAYPX(self.raw, factor, other.raw) })
    }

    /// this ← `other`.
    pub fn copy(&mut self, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        // SAFETY: live handles of matching layout, distinct by borrowing.
        check(unsafe { raw::VecCopy(other.raw, self.raw) })
    }

    /// Number of entries this rank owns.
    pub fn owned(&self) -> usize {
        self.owned
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and not used afterwards; an error cannot be acted on here.
        unsafe { raw::VecDestroy(&mut self.raw) };
    }
}

pub(super) fn same_size(expected: usize, found: usize) -> Result<(), PetscError> {
    match expected == found {
        true => Ok(()),
        false => Err(PetscError::ours(format!("{found} values where {expected} are owned"))),
    }
}
