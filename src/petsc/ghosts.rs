//! Ghost values: copies of values that other ranks own
//! (<https://petsc.org/release/manualpages/PetscSF/>).

use super::{PetscError, Session, check, handle::Handle, raw, session::world, vector::same_size};
use std::ffi::c_void;

/// Fetches ghost values from their owners (PetscSF, a star forest: one owner, many ghosts).
#[derive(Debug)]
pub(crate) struct Ghosts {
    handle: Handle<raw::_p_PetscSF>,
    /// The number of values of a field: owned ones, then ghosts.
    length: usize,
}

impl Ghosts {
    /// For fields of `owned` values followed by ghosts. Per ghost: its owner, and its index among the
    /// owner's values (PetscSFSetGraph). Collective.
    pub(crate) fn new(
        _session: &Session,
        owned: usize,
        ghosts: &[(usize, usize)],
    ) -> Result<Self, PetscError> {
        let length = owned + ghosts.len();
        let mut leaves: Vec<i32> = (owned..length).map(|i| i as i32).collect();
        let root = |&(rank, index): &(usize, usize)| raw::PetscSFNode {
            rank: rank as i32,
            index: index as i32,
        };
        let mut roots: Vec<raw::PetscSFNode> = ghosts.iter().map(root).collect();
        let (owned, count) = (owned as i32, ghosts.len() as i32);
        let (leaves, roots) = (leaves.as_mut_ptr(), roots.as_mut_ptr());
        let copy = raw::PetscCopyMode::PETSC_COPY_VALUES;
        // SAFETY: a fresh handle; both arrays have `count` values, which PETSc copies.
        unsafe {
            let create = |handle| raw::PetscSFCreate(world(), handle);
            let handle = Handle::new(raw::PetscSFDestroy, create)?;
            let sf = handle.raw();
            check(raw::PetscSFSetGraph(sf, owned, count, leaves, copy, roots, copy))?;
            Ok(Self { handle, length })
        }
    }

    /// Replaces the ghosts of `field`, which has `block` numbers for each value (PetscSFBcastBegin).
    /// Collective.
    pub(crate) fn update(&self, field: &mut [f64], block: usize) -> Result<(), PetscError> {
        same_size(block * self.length, field.len())?;
        let mut unit = raw::MPI_DOUBLE;
        let (sf, data) = (self.handle.raw(), field.as_mut_ptr().cast::<c_void>());
        // SAFETY: the field has `block` numbers per value of the graph. PETSc reads the owned ones and
        // writes the ghosts, which do not overlap. It copies the data type if it keeps it.
        unsafe {
            raw::MPI_Type_contiguous(block as i32, raw::MPI_DOUBLE, &mut unit);
            raw::MPI_Type_commit(&mut unit);
            let updated = check(raw::PetscSFBcastBegin(sf, unit, data, data, raw::MPI_REPLACE))
                .and_then(|()| check(raw::PetscSFBcastEnd(sf, unit, data, data, raw::MPI_REPLACE)));
            raw::MPI_Type_free(&mut unit);
            updated
        }
    }
}
