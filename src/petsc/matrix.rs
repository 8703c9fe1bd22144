//! Symmetric sparse matrices with a fixed pattern, whose values can be refilled
//! (<https://petsc.org/release/manualpages/Mat/>).

mod entries;
mod operator;
mod pattern;

pub(crate) use operator::Operator;
pub use pattern::Pattern;

use super::{
    PetscError, Session, Vector, check,
    handle::Handle,
    options::petsc_bool,
    raw,
    session::world,
    vector::{index, lent, same_size},
};
use operator::Shell;
use std::{ops::Range, ptr};

/// A square sparse matrix. Each rank owns a contiguous range of rows.
pub struct Matrix {
    handle: Handle<raw::_p_Mat>,
    /// The global indices of the owned rows.
    rows: Range<i32>,
    /// The operator that multiplies in place of the entries.
    shell: Option<Shell>,
}

impl Matrix {
    /// A symmetric matrix from the `pattern` and the `values` of this rank's rows; `block` is PETSc's block
    /// size (MatSeqAIJSetPreallocationCSR, MatMPIAIJSetPreallocationCSR).
    ///
    /// # Errors
    /// There are more or fewer values than entries, a column is outside the matrix, or PETSc fails.
    pub fn with_pattern(
        _session: &Session,
        block: usize,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<Self, PetscError> {
        same_size(index(pattern.entries())? as usize, values.len())?;
        let (local, block) = (index(pattern.starts.len() - 1)?, block as i32);
        let (starts, columns) = (pattern.starts.as_ptr(), pattern.columns.as_ptr());
        // SAFETY: a fresh handle; the lengths of the arrays fit the pattern, and PETSc checks the columns.
        // MatSeqAIJ… does nothing to a matrix of several ranks, MatMPIAIJ… nothing to a matrix of one.
        unsafe {
            let handle = Handle::new(raw::MatDestroy, |handle| raw::MatCreate(world(), handle))?;
            let (matrix, values) = (handle.raw(), values.as_ptr());
            check(raw::MatSetSizes(matrix, local, local, -1, -1))?;
            check(raw::MatSetBlockSize(matrix, block))?;
            check(raw::MatSetType(matrix, c"aij".as_ptr()))?;
            check(raw::MatSeqAIJSetPreallocationCSR(matrix, starts, columns, values))?;
            check(raw::MatMPIAIJSetPreallocationCSR(matrix, starts, columns, values))?;
            for option in [raw::MatOption::MAT_SYMMETRIC, raw::MatOption::MAT_SYMMETRY_ETERNAL] {
                check(raw::MatSetOption(matrix, option, petsc_bool(true)))?;
            }
            // Inodes (products by groups of rows with equal columns) are slower than products by rows here.
            let inodes = raw::MatOption::MAT_USE_INODES;
            check(raw::MatSetOption(matrix, inodes, petsc_bool(false)))?;
            Self::new(handle)
        }
    }

    /// Asks PETSc for the owned rows (MatGetOwnershipRange).
    fn new(handle: Handle<raw::_p_Mat>) -> Result<Self, PetscError> {
        let mut rows = 0..0;
        // SAFETY: a live handle.
        check(unsafe { raw::MatGetOwnershipRange(handle.raw(), &mut rows.start, &mut rows.end) })?;
        Ok(Self { handle, rows, shell: None })
    }

    /// A matrix that PETSc passes to a callback. It is read-only.
    ///
    /// # Safety
    /// `raw` is alive as long as this matrix.
    pub(super) unsafe fn borrowed(raw: raw::Mat) -> Result<Self, PetscError> {
        Self::new(Handle::borrowed(raw))
    }

    /// The stored matrix; with an operator its entries may be those of an earlier state.
    pub(super) fn stored(&self) -> raw::Mat {
        self.handle.raw()
    }

    /// `y` ← this · `x` (MatMult).
    ///
    /// # Errors
    /// Sizes differ.
    pub fn multiply(&self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        // SAFETY: live handles, `x` and `y` distinct by borrowing; PETSc compares their sizes.
        check(unsafe { raw::MatMult(self.product(), x.raw(), y.raw()) })
    }

    /// A copy with its near-null space (MatDuplicate).
    ///
    /// # Errors
    /// The memory does not suffice.
    pub fn duplicate(&self) -> Result<Self, PetscError> {
        let values = raw::MatDuplicateOption::MAT_COPY_VALUES;
        let matrix = self.assembled()?;
        let handle = Handle::new(raw::MatDestroy, |copy| {
            // SAFETY: a live handle, a fresh one.
            unsafe { raw::MatDuplicate(matrix, values, copy) }
        })?;
        let mut space = ptr::null_mut();
        // SAFETY: live handles; PETSc keeps a reference to the space.
        unsafe {
            check(raw::MatGetNearNullSpace(self.stored(), &mut space))?;
            if !space.is_null() {
                check(raw::MatSetNearNullSpace(handle.raw(), space))?;
            }
        }
        Self::new(handle)
    }

    /// A copy scaled by `factor`, then with `shift` added to its diagonal (MatScale, MatShift).
    pub(crate) fn scaled(&self, factor: f64, shift: f64) -> Result<Self, PetscError> {
        let copy = self.duplicate()?;
        // SAFETY: a live handle of our own.
        unsafe {
            check(raw::MatScale(copy.stored(), factor))?;
            check(raw::MatShift(copy.stored(), shift))?;
        }
        Ok(copy)
    }

    /// this ← `other`, which has the same pattern (MatCopy).
    ///
    /// # Errors
    /// Sizes differ.
    pub fn copy(&mut self, other: &Self) -> Result<(), PetscError> {
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares their sizes and patterns.
        check(unsafe { raw::MatCopy(other.assembled()?, self.stored(), pattern) })
    }

    /// this ← this + `factor` · `other`, which has the same pattern (MatAXPY).
    pub(crate) fn add(&mut self, factor: f64, other: &Self) -> Result<(), PetscError> {
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares their sizes and patterns.
        check(unsafe { raw::MatAXPY(self.stored(), factor, other.assembled()?, pattern) })
    }

    /// The owned entries of its diagonal (MatGetDiagonal).
    pub(crate) fn diagonal(&self) -> Result<Vec<f64>, PetscError> {
        if let Some(operator) = self.operator() {
            return Ok(operator.diagonal());
        }
        let handle = Handle::new(raw::VecDestroy, |diagonal| {
            // SAFETY: a live handle and a fresh one; null means that the other vector is not wanted.
            unsafe { raw::MatCreateVecs(self.stored(), ptr::null_mut(), diagonal) }
        })?;
        // SAFETY: live handles of one size.
        check(unsafe { raw::MatGetDiagonal(self.stored(), handle.raw()) })?;
        // SAFETY: the vector lives as long as its handle.
        unsafe { Vector::borrowed(handle.raw()) }?.read(<[f64]>::to_vec)
    }

    /// Adds `diagonal` (owned entries) to the diagonal (MatDiagonalSet).
    pub(crate) fn add_diagonal(&mut self, diagonal: &Vector) -> Result<(), PetscError> {
        let add = raw::InsertMode::ADD_VALUES;
        // SAFETY: live handles; PETSc compares their sizes.
        check(unsafe { raw::MatDiagonalSet(self.stored(), diagonal.raw(), add) })
    }

    /// Replaces the rows and columns of some owned unknowns by `diagonal` on the diagonal, as for
    /// Dirichlet conditions (MatZeroRowsColumns). Collective.
    ///
    /// # Errors
    /// An unknown is not owned, or PETSc fails.
    pub fn zero_rows_columns(
        &mut self,
        unknowns: &[usize],
        diagonal: f64,
    ) -> Result<(), PetscError> {
        let row = |&unknown| self.rows.start + unknown as i32;
        let rows: Vec<i32> = unknowns.iter().map(row).collect();
        let (count, unused) = (rows.len() as i32, ptr::null_mut());
        // SAFETY: a live handle and `count` global indices; null means that no right-hand side is adapted.
        check(unsafe {
            raw::MatZeroRowsColumns(self.stored(), count, rows.as_ptr(), diagonal, unused, unused)
        })
    }

    /// Gives multigrid the fields that the matrix without boundary conditions maps to zero
    /// (MatSetNearNullSpace). Makes them orthonormal for PETSc and drops dependent ones.
    pub(crate) fn set_near_null_space(&mut self, fields: Vec<Vector>) -> Result<(), PetscError> {
        let mut basis: Vec<Vector> = Vec::new();
        for mut field in fields {
            let size = field.norm()?;
            for earlier in &basis {
                field.axpby(-field.dot(earlier)?, earlier, 1.0)?;
            }
            let norm = field.norm()?;
            if norm > 1e-8 * size {
                field.write(|v| v.iter_mut().for_each(|v| *v /= norm))?;
                basis.push(field);
            }
        }
        let vectors: Vec<raw::Vec> = basis.iter().map(Vector::raw).collect();
        let (count, constant) = (vectors.len() as i32, petsc_bool(false));
        let space = Handle::new(raw::MatNullSpaceDestroy, |space| {
            // SAFETY: `count` live vectors, to which PETSc keeps references.
            unsafe { raw::MatNullSpaceCreate(world(), constant, count, vectors.as_ptr(), space) }
        })?;
        // SAFETY: live handles; PETSc keeps a reference to the space.
        check(unsafe { raw::MatSetNearNullSpace(self.stored(), space.raw()) })
    }

    /// The global indices of the owned rows.
    pub(crate) fn rows(&self) -> Range<i32> {
        self.rows.clone()
    }

    /// The number of rows of all ranks together (MatGetSize).
    pub(crate) fn size(&self) -> Result<usize, PetscError> {
        let mut rows = 0;
        // SAFETY: a live handle; null means that the number of columns is not wanted.
        check(unsafe { raw::MatGetSize(self.stored(), &mut rows, ptr::null_mut()) })?;
        Ok(rows as usize)
    }

    /// The owned rows with their present entries. Collective, as the entries may have to be written first; a rank
    /// without rows calls it too.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn assembled_rows(&self) -> Result<AssembledRows<'_>, PetscError> {
        self.assembled()?;
        Ok(AssembledRows(self))
    }

    /// As [`AssembledRows::read`], with the stored entries: the columns are right, the values may be those of an earlier
    /// state.
    pub(crate) fn read_stored<R>(
        &self,
        row: i32,
        reader: impl FnOnce(&[i32], &[f64]) -> R,
    ) -> Result<R, PetscError> {
        let (mut count, mut columns, mut values) = (0, ptr::null(), ptr::null());
        // SAFETY: a live handle; PETSc checks the row and lends `count` entries of it.
        unsafe {
            check(raw::MatGetRow(self.stored(), row, &mut count, &mut columns, &mut values))?;
            let count_of_row = count as usize;
            let result = reader(lent(columns, count_of_row), lent(values, count_of_row));
            check(raw::MatRestoreRow(self.stored(), row, &mut count, &mut columns, &mut values))?;
            Ok(result)
        }
    }

    /// Number of rows this rank owns.
    pub fn owned(&self) -> usize {
        self.rows.len()
    }
}

/// The owned rows of a matrix with its present entries.
#[derive(Clone, Copy)]
pub struct AssembledRows<'a>(&'a Matrix);

impl AssembledRows<'_> {
    /// Calls `reader` with the columns (increasing) and the values of an owned row (MatGetRow).
    ///
    /// # Errors
    /// The row is not owned.
    pub fn read<R>(
        self,
        row: i32,
        reader: impl FnOnce(&[i32], &[f64]) -> R,
    ) -> Result<R, PetscError> {
        self.0.read_stored(row, reader)
    }
}
