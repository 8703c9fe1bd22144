//! Symmetric sparse matrices whose pattern is given once and whose values are refilled
//! (<https://petsc.org/release/manualpages/Mat/>).

use super::{
    PetscError, Session, Vector, check, handle::Handle, raw, session::world, vector::same_size,
};
use std::{mem::MaybeUninit, ops::Range, ptr, slice};

/// A square sparse matrix, rows distributed by ownership, filled through a COO pattern.
pub struct Matrix {
    handle: Handle<raw::_p_Mat>,
    owned: usize,
    /// Positions in the COO pattern; 0 for a copy, which has none.
    positions: usize,
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
        let positions = rows.len();
        // SAFETY: a fresh handle.
        let create = |handle| unsafe { raw::MatCreate(world(), handle) };
        let matrix = Self { handle: Handle::new(raw::MatDestroy, create)?, owned, positions };
        // SAFETY: the index arrays have `positions` values each (PETSc may reorder them, they are
        // ours) and PETSc checks them against the sizes here.
        unsafe {
            check(raw::MatSetSizes(matrix.raw(), local, local, -1, -1))?;
            check(raw::MatSetBlockSize(matrix.raw(), block as i32))?;
            check(raw::MatSetType(matrix.raw(), c"aij".as_ptr()))?;
            check(raw::MatSetPreallocationCOO(
                matrix.raw(),
                positions as isize,
                rows.as_mut_ptr(),
                columns.as_mut_ptr(),
            ))?;
            for option in [raw::MatOption::MAT_SYMMETRIC, raw::MatOption::MAT_SYMMETRY_ETERNAL] {
                check(raw::MatSetOption(matrix.raw(), option, raw::PetscBool::PETSC_TRUE))?;
            }
        }
        Ok(matrix)
    }

    /// A matrix that PETSc passes to a callback; its values cannot be set.
    ///
    /// # Safety
    /// `raw` is a live matrix.
    pub(super) unsafe fn shared(raw: raw::Mat) -> Result<Self, PetscError> {
        // SAFETY: the caller's promise.
        let handle = unsafe { Handle::shared(raw, raw::MatDestroy)? };
        let mut matrix = Self { handle, owned: 0, positions: 0 };
        matrix.owned = matrix.rows()?.len();
        Ok(matrix)
    }

    pub(super) fn raw(&self) -> raw::Mat {
        self.handle.raw()
    }

    /// Replaces all values: `values[k]` belongs to the pattern's k-th position (MatSetValuesCOO).
    ///
    /// # Errors
    /// Their number is not that of the pattern.
    pub fn set_values(&mut self, values: &[f64]) -> Result<(), PetscError> {
        same_size(self.positions, values.len())?;
        // SAFETY: PETSc reads as many values as the pattern has positions.
        check(unsafe {
            raw::MatSetValuesCOO(self.raw(), values.as_ptr(), raw::InsertMode::INSERT_VALUES)
        })
    }

    /// `y` ← this · `x` (MatMult).
    ///
    /// # Errors
    /// Sizes differ.
    pub fn multiply(&self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        same_size(self.owned, x.owned())?;
        same_size(self.owned, y.owned())?;
        // SAFETY: three live handles of matching layout, `x` and `y` distinct by borrowing.
        check(unsafe { raw::MatMult(self.raw(), x.raw(), y.raw()) })
    }

    /// A copy with its near-null space (MatDuplicate); its values cannot be set through the pattern.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn duplicate(&self) -> Result<Self, PetscError> {
        let values = raw::MatDuplicateOption::MAT_COPY_VALUES;
        let handle = Handle::new(raw::MatDestroy, |copy| {
            // SAFETY: a live handle, a fresh one.
            unsafe { raw::MatDuplicate(self.raw(), values, copy) }
        })?;
        let mut space = ptr::null_mut();
        // SAFETY: live handles; PETSc keeps a reference to the space.
        unsafe {
            check(raw::MatGetNearNullSpace(self.raw(), &mut space))?;
            if !space.is_null() {
                check(raw::MatSetNearNullSpace(handle.raw(), space))?;
            }
        }
        Ok(Self { handle, owned: self.owned, positions: 0 })
    }

    /// A copy scaled by `factor`, then with `shift` added to its diagonal (MatScale, MatShift).
    pub(crate) fn scaled(&self, factor: f64, shift: f64) -> Result<Self, PetscError> {
        let copy = self.duplicate()?;
        // SAFETY: a live handle of our own.
        unsafe {
            check(raw::MatScale(copy.raw(), factor))?;
            check(raw::MatShift(copy.raw(), shift))?;
        }
        Ok(copy)
    }

    /// this ← `other`, which has the same pattern (MatCopy).
    ///
    /// # Errors
    /// Sizes differ.
    pub fn copy(&mut self, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares the patterns' sizes.
        check(unsafe { raw::MatCopy(other.raw(), self.raw(), pattern) })
    }

    /// this ← this + `factor` · `other`, which has the same pattern (MatAXPY).
    pub(crate) fn add(&mut self, factor: f64, other: &Self) -> Result<(), PetscError> {
        same_size(self.owned, other.owned)?;
        let pattern = raw::MatStructure::SAME_NONZERO_PATTERN;
        // SAFETY: live handles, distinct by borrowing; PETSc compares the patterns' sizes.
        check(unsafe { raw::MatAXPY(self.raw(), factor, other.raw(), pattern) })
    }

    /// Adds `diagonal` (owned entries) to the diagonal (MatDiagonalSet).
    pub(crate) fn add_diagonal(&mut self, diagonal: &Vector) -> Result<(), PetscError> {
        same_size(self.owned, diagonal.owned())?;
        let add = raw::InsertMode::ADD_VALUES;
        // SAFETY: live handles of matching layout.
        check(unsafe { raw::MatDiagonalSet(self.raw(), diagonal.raw(), add) })
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
        let first = self.rows()?.start;
        let rows: Vec<i32> = unknowns.iter().map(|&unknown| first + unknown as i32).collect();
        let (count, unused) = (rows.len() as i32, ptr::null_mut());
        // SAFETY: a live handle and `count` global indices; no right-hand side is to be adapted.
        check(unsafe {
            raw::MatZeroRowsColumns(self.raw(), count, rows.as_ptr(), diagonal, unused, unused)
        })
    }

    /// Tells multigrid the fields that the matrix without boundary conditions maps to zero
    /// (MatSetNearNullSpace). PETSc wants them orthonormal; dependent ones are left out.
    pub(crate) fn set_near_null_space(&mut self, fields: Vec<Vector>) -> Result<(), PetscError> {
        let mut basis: Vec<Vector> = Vec::new();
        for mut field in fields {
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
        let vectors: Vec<raw::Vec> = basis.iter().map(Vector::raw).collect();
        let (count, constant) = (vectors.len() as i32, raw::PetscBool::PETSC_FALSE);
        let space = Handle::new(raw::MatNullSpaceDestroy, |space| {
            // SAFETY: `count` live vectors, to which PETSc keeps references.
            unsafe { raw::MatNullSpaceCreate(world(), constant, count, vectors.as_ptr(), space) }
        })?;
        // SAFETY: live handles; PETSc keeps a reference to the space.
        check(unsafe { raw::MatSetNearNullSpace(self.raw(), space.raw()) })
    }

    /// The global indices of the owned rows (MatGetOwnershipRange).
    pub(crate) fn rows(&self) -> Result<Range<i32>, PetscError> {
        let mut rows = 0..0;
        // SAFETY: a live handle.
        check(unsafe { raw::MatGetOwnershipRange(self.raw(), &mut rows.start, &mut rows.end) })?;
        Ok(rows)
    }

    /// The number of rows of all ranks together (MatGetSize).
    pub(crate) fn size(&self) -> Result<usize, PetscError> {
        let mut rows = 0;
        // SAFETY: a live handle; the number of columns is not asked for.
        check(unsafe { raw::MatGetSize(self.raw(), &mut rows, ptr::null_mut()) })?;
        Ok(rows as usize)
    }

    /// Lends the columns, increasing, and the values of an owned row (MatGetRow).
    pub(crate) fn read_row<R>(
        &self,
        row: i32,
        reader: impl FnOnce(&[i32], &[f64]) -> R,
    ) -> Result<R, PetscError> {
        let (mut count, mut columns, mut values) = (0, ptr::null(), ptr::null());
        // SAFETY: a live handle; PETSc checks the row and lends `count` entries of it.
        unsafe {
            check(raw::MatGetRow(self.raw(), row, &mut count, &mut columns, &mut values))?;
            let result = match count as usize {
                0 => reader(&[], &[]),
                count => reader(
                    slice::from_raw_parts(columns, count),
                    slice::from_raw_parts(values, count),
                ),
            };
            check(raw::MatRestoreRow(self.raw(), row, &mut count, &mut columns, &mut values))?;
            Ok(result)
        }
    }

    /// Entries that this rank stores (MatGetInfo).
    pub fn entries(&self) -> f64 {
        let mut info = MaybeUninit::<raw::MatInfo>::zeroed();
        // SAFETY: a live handle; zeros are numbers, and PETSc fills them.
        unsafe {
            let kind = raw::MatInfoType::MAT_LOCAL;
            match check(raw::MatGetInfo(self.raw(), kind, info.as_mut_ptr())) {
                Ok(()) => info.assume_init().nz_used,
                Err(_) => 0.0,
            }
        }
    }

    /// Bytes that this rank reads and writes in a product: value and column of each entry, 12 bytes;
    /// the beginning of each row, x and y, 20 bytes.
    pub fn bytes_per_product(&self) -> f64 {
        12.0 * self.entries() + 20.0 * self.owned as f64
    }

    /// Number of rows this rank owns.
    pub fn owned(&self) -> usize {
        self.owned
    }
}
