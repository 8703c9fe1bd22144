//! Reading and writing the stored entries of a matrix in place.

use super::{Matrix, Pattern};
use crate::petsc::{
    PetscError, Session, check, options, raw,
    vector::{lent, lent_mut, same_size},
};
use std::ptr;

impl Matrix {
    /// A matrix without values, otherwise as by [`Self::with_pattern`], and per entry of the pattern its
    /// index among the entries of `read_entries`.
    ///
    /// # Errors
    /// As [`Self::with_pattern`].
    pub fn with_places(
        session: &Session,
        block: usize,
        pattern: &Pattern,
    ) -> Result<(Self, Vec<u32>), PetscError> {
        let numbers: Vec<f64> = (0..pattern.entries()).map(|position| position as f64).collect();
        let matrix = Self::with_pattern(session, block, pattern, &numbers)?;
        let (mut positions, mut places) = (Vec::new(), vec![0; numbers.len()]);
        matrix.read_entries(&mut positions)?;
        for (place, position) in positions.into_iter().enumerate() {
            places[position as usize] = place as u32;
        }
        Ok((matrix, places))
    }

    /// Replaces the stored entries of this rank, in the order of `read_entries`. `writer` gets zeros and adds
    /// to them. Collective.
    pub(super) fn write(&self, writer: impl FnOnce(&mut [f64])) -> Result<(), PetscError> {
        let blocks = self.blocks()?;
        if let [block] = blocks[..] {
            return self.write_block(block, |entries| {
                entries.fill(0.0);
                writer(entries);
            });
        }
        let mut values = vec![0.0; self.entries()];
        writer(&mut values);
        let mut others = &values[..];
        for block in blocks {
            let own = others.split_off(..block.1).unwrap_or_default();
            self.write_block(block, |entries| entries.copy_from_slice(own))?;
        }
        let done = raw::MatAssemblyType::MAT_FINAL_ASSEMBLY;
        // SAFETY: a live handle. The assembly informs PETSc that the blocks have changed.
        unsafe {
            check(raw::MatAssemblyBegin(self.stored(), done))?;
            check(raw::MatAssemblyEnd(self.stored(), done))
        }
    }

    /// Calls `writer` with the entries of one of `blocks` (MatSeqAIJGetArray).
    fn write_block(
        &self,
        (block, count): (raw::Mat, usize),
        writer: impl FnOnce(&mut [f64]),
    ) -> Result<(), PetscError> {
        let mut data = ptr::null_mut();
        // SAFETY: a live block, which lends `count` values until they are restored. Readers borrow them only
        // within their own calls.
        unsafe {
            check(raw::MatSeqAIJGetArray(block, &mut data))?;
            writer(lent_mut(data, count));
            check(raw::MatSeqAIJRestoreArray(block, &mut data))
        }
    }

    /// Copies the stored entries of this rank into `values` (MatSeqAIJGetArrayRead).
    pub(crate) fn read_entries(&self, values: &mut Vec<f64>) -> Result<(), PetscError> {
        values.clear();
        self.assembled()?;
        for (block, count) in self.blocks()? {
            let mut data = ptr::null();
            // SAFETY: a live block, which lends `count` values until they are restored.
            unsafe {
                check(raw::MatSeqAIJGetArrayRead(block, &mut data))?;
                values.extend(lent(data, count));
                check(raw::MatSeqAIJRestoreArrayRead(block, &mut data))?;
            }
        }
        Ok(())
    }

    /// Replaces the stored entries of this rank by `values`, which [`Self::read_entries`] has copied from a
    /// matrix with the same pattern. Collective.
    pub(crate) fn set_entries(&mut self, values: &[f64]) -> Result<(), PetscError> {
        same_size(self.entries(), values.len())?;
        self.write(|entries| entries.copy_from_slice(values))
    }

    /// The blocks of this rank's rows, each with the number of its stored entries (MatMPIAIJGetSeqAIJ). On
    /// several ranks the first block has the columns that this rank owns, the second the other columns.
    fn blocks(&self) -> Result<Vec<(raw::Mat, usize)>, PetscError> {
        let (mut own, mut others) = (self.stored(), ptr::null_mut());
        let (mut parallel, columns) = (options::petsc_bool(false), ptr::null_mut());
        let (object, kind) = (self.stored().cast(), c"mpiaij".as_ptr());
        // SAFETY: a live handle, which keeps its blocks.
        unsafe {
            check(raw::PetscObjectTypeCompare(object, kind, &mut parallel))?;
            if options::is_true(parallel) {
                check(raw::MatMPIAIJGetSeqAIJ(self.stored(), &mut own, &mut others, columns))?;
            }
        }
        let mut blocks = Vec::new();
        for block in [own, others].into_iter().filter(|block| !block.is_null()) {
            // SAFETY: a live block.
            blocks.push((block, unsafe { stored(block) }?));
        }
        Ok(blocks)
    }

    /// The number of stored entries of this rank; 0 if PETSc fails.
    pub fn entries(&self) -> usize {
        // SAFETY: a live handle.
        unsafe { stored(self.stored()) }.unwrap_or(0)
    }
}

/// The number of entries of a matrix that this rank stores (MatGetInfo).
///
/// # Safety
/// The matrix is live.
unsafe fn stored(matrix: raw::Mat) -> Result<usize, PetscError> {
    let (local, mut info) = (raw::MatInfoType::MAT_LOCAL, raw::MatInfo::default());
    // SAFETY: as above.
    check(unsafe { raw::MatGetInfo(matrix, local, &mut info) })?;
    Ok(info.nz_used as usize)
}
