//! Symmetric sparse matrices whose pattern is given once and whose values are refilled.

use super::{
    PetscError, Session, Vector, check, raw,
    session::{Live, world},
    vec::same_size,
};
use std::{mem::MaybeUninit, ptr};

/// A square sparse matrix, rows distributed by ownership, filled through a COO pattern.
pub struct Matrix {
    pub(super) raw: raw::Mat,
    owned: usize,
    entries: usize,
    _live: Live,
}

impl Matrix {
    /// A symmetric matrix with `owned` rows on this rank and entries at the global positions
    /// (`rows[k]`, `columns[k]`), repeated ones to be summed; negative ones are left out
    /// (MatSetPreallocationCOO).
    ///
    /// # Errors
    /// An index is outside the matrix, or PETSc fails.
    pub fn with_pattern(
        _session: &Session,
        owned: usize,
        block: usize,
        mut rows: Vec<i32>,
        mut columns: Vec<i32>,
    ) -> Result<Self, PetscError> {
        same_size(rows.len(), columns.len())?;
        let local = i32::try_from(owned)
            .map_err(|_| PetscError::ours(format!("{owned} rows exceed 32-bit indices")))?;
        let entries = rows.len();
        let mut matrix = Self { raw: ptr::null_mut(), owned, entries, _live: Live::new() };
        // SAFETY: a fresh handle; the index arrays have `entries` values each (PETSc may reorder
        // them, they are ours) and PETSc checks them against the sizes here.
        unsafe {
            check(raw::MatCreate(world(), &mut matrix.raw))?;
            check(raw::MatSetSizes(matrix.raw, local, local, -1, -1))?;
            check(raw::MatSetBlockSize(matrix.raw, block as i32))?;
            check(raw::MatSetType(matrix.raw, c"aij".as_ptr()))?;
            check(raw::MatSetPreallocationCOO(
                matrix.raw,
                entries as isize,
                rows.as_mut_ptr(),
                columns.as_mut_ptr(),
            ))?;
            for option in [raw::MatOption::MAT_SYMMETRIC, raw::MatOption::MAT_SYMMETRY_ETERNAL] {
                check(raw::MatSetOption(matrix.raw, option, raw::PetscBool::PETSC_TRUE))?;
            }
        }
        Ok(matrix)
    }

    /// Replaces all values: `values[k]` belongs to the pattern's k-th position (MatSetValuesCOO).
    pub fn set_values(&mut self, values: &[f64]) -> Result<(), PetscError> {
        same_size(self.entries, values.len())?;
        // SAFETY: PETSc reads `entries` values.
        check(unsafe {
            raw::MatSetValuesCOO(self.raw, values.as_ptr(), raw::InsertMode::INSERT_VALUES)
        })
    }

    /// `y` ← this · `x`.
    pub fn multiply(&self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        same_size(self.owned, x.owned())?;
        same_size(self.owned, y.owned())?;
        // SAFETY: three live handles of matching layout, `x` and `y` distinct by borrowing.
        check(unsafe { raw::MatMult(self.raw, x.raw, y.raw) })
    }

    /// A copy scaled by `factor`, then with `shift` added to its diagonal.
    pub fn scaled(&self, factor: f64, shift: f64) -> Result<Self, PetscError> {
        let copy = self.duplicate()?;
        // SAFETY: a live handle of our own.
        unsafe {
            check(raw::MatScale(copy.raw, factor))?;
            check(raw::MatShift(copy.raw, shift))?;
        }
        Ok(copy)
    }

    /// Takes over the values of `other`, which has the same pattern.
    pub fn copy(&mut self, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares the patterns' sizes.
        check(unsafe { raw::MatCopy(other.raw, self.raw, pattern) })
    }

    /// this ← this + `factor` · `other`, which has the same pattern.
    pub fn add(&mut self, factor: f64, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares the patterns' sizes.
        check(unsafe { raw::MatAXPY(self.raw, factor, other.raw, pattern) })
    }

    /// Adds `diagonal` (owned entries) to the diagonal.
    pub fn add_diagonal(&mut self, diagonal: &Vector) -> Result<(), PetscError> {
        same_size(self.owned, diagonal.owned())?;
        let add = raw::InsertMode::ADD_VALUES;
        // SAFETY: live handles of matching layout.
        check(unsafe { raw::MatDiagonalSet(self.raw, diagonal.raw, add) })
    }

    /// Replaces the rows and columns of some owned unknowns by `diagonal` (MatZeroRowsColumns).
    pub fn hold(&mut self, unknowns: &[usize], diagonal: f64) -> Result<(), PetscError> {
        let (mut first, mut end) = (0, 0);
        let unused = ptr::null_mut();
        // SAFETY: a live handle; the rows are global numbers of owned ones.
        unsafe {
            check(raw::MatGetOwnershipRange(self.raw, &mut first, &mut end))?;
            let rows: Vec<i32> = unknowns.iter().map(|&dof| first + dof as i32).collect();
            let count = rows.len() as i32;
            check(raw::MatZeroRowsColumns(self.raw, count, rows.as_ptr(), diagonal, unused, unused))
        }
    }

    /// Tells multigrid the fields that the matrix without boundary conditions maps to zero
    /// (MatSetNearNullSpace).
    pub fn set_near_null_space(&mut self, mut fields: Vec<Vector>) -> Result<(), PetscError> {
        // PETSc wants them orthonormal.
        let mut basis: Vec<Vector> = Vec::new();
        for mut field in fields.drain(..) {
            same_size(self.owned, field.owned())?;
            let size = field.norm()?;
            for earlier in &basis {
                field.add(-field.dot(earlier)?, earlier)?;
            }
            let norm = field.norm()?;
            if norm > 1e-8 * size {
                field.write(|v| v.iter_mut().for_each(|v| *v /= norm))?;
                basis.push(field);
            }
        }
        let raw: Vec<raw::Vec> = basis.iter().map(|vector| vector.raw).collect();
        let mut space = ptr::null_mut();
        // SAFETY: live handles; PETSc keeps references to the vectors and the space.
        unsafe {
            let constant = raw::PetscBool::PETSC_FALSE;
            let count = raw.len() as i32;
            check(raw::MatNullSpaceCreate(world(), constant, count, raw.as_ptr(), &mut space))?;
            check(raw::MatSetNearNullSpace(self.raw, space))?;
            check(raw::MatNullSpaceDestroy(&mut space))
        }
    }

    /// A copy; its values can no longer be set through the pattern.
    pub fn duplicate(&self) -> Result<Self, PetscError> {
        let mut copy =
            Self { raw: ptr::null_mut(), owned: self.owned, entries: 0, _live: Live::new() };
        let (values, mut space) = (raw::MatDuplicateOption::MAT_COPY_VALUES, ptr::null_mut());
        // SAFETY: a live handle, a fresh one. The copy has no COO pattern: `entries` is 0.
        unsafe {
            check(raw::MatDuplicate(self.raw, values, &mut copy.raw))?;
            check(raw::MatGetNearNullSpace(self.raw, &mut space))?;
            if !space.is_null() {
                check(raw::MatSetNearNullSpace(copy.raw, space))?;
            }
        }
        Ok(copy)
    }

    /// Bytes that a product moves on this rank: 12 per entry (value, column), 20 per row (its
    /// beginning, x, y).
    pub fn traffic(&self) -> f64 {
        // SAFETY: a live handle.
        12.0 * unsafe { entries(self.raw) } + 20.0 * self.owned as f64
    }

    /// Bytes of the values of this rank.
    pub fn values_traffic(&self) -> f64 {
        // SAFETY: a live handle.
        8.0 * unsafe { entries(self.raw) }
    }

    /// Number of rows this rank owns.
    pub fn owned(&self) -> usize {
        self.owned
    }
}

/// Entries that a matrix or a factor stores on this rank; 0 if its package does not tell.
///
/// # Safety
/// `matrix` is a live handle.
pub(super) unsafe fn entries(matrix: raw::Mat) -> f64 {
    let mut info = MaybeUninit::<raw::MatInfo>::zeroed();
    let kind = raw::MatInfoType::MAT_LOCAL;
    // SAFETY: the caller's promise; zeros are numbers, and PETSc fills them.
    unsafe {
        match check(raw::MatGetInfo(matrix, kind, info.as_mut_ptr())) {
            Ok(()) => info.assume_init().nz_used.max(0.0),
            Err(_) => 0.0,
        }
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        // SAFETY: the handle is ours; solvers that still use the matrix hold a reference of their own.
        unsafe { raw::MatDestroy(&mut self.raw) };
    }
}
