//! Symmetric matrices as CHOLMOD reads them.

use super::raw;
use std::{ffi::c_void, ptr};

/// The lower triangle of a symmetric matrix in compressed sparse columns (CSC): column j has the
/// rows `rows[starts[j]..starts[j + 1]]`, all at least j.
pub struct LowerTriangle {
    starts: Vec<i64>,
    rows: Vec<i64>,
    values: Vec<f64>,
}

impl Default for LowerTriangle {
    /// A matrix without columns.
    fn default() -> Self {
        Self { starts: vec![0], rows: Vec::new(), values: Vec::new() }
    }
}

impl LowerTriangle {
    /// Adds an entry to the present column.
    pub fn push(&mut self, row: usize, value: f64) {
        self.rows.push(row as i64);
        self.values.push(value);
    }

    /// Ends the present column.
    pub fn end_column(&mut self) {
        self.starts.push(self.rows.len() as i64);
    }

    /// Adds columns with `diagonal` on the diagonal and zeros in the first of them. Eliminating the first
    /// column fills all entries below it, so the factor has a full block there.
    pub fn push_coupled(&mut self, columns: usize, diagonal: f64) {
        let first = self.size();
        for j in first..first + columns {
            self.push(j, diagonal);
            (j + 1..first + columns).filter(|_| j == first).for_each(|i| self.push(i, 0.0));
            self.end_column();
        }
    }

    /// The number of rows and columns.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// The product of the whole symmetric matrix with `x`.
    pub(super) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for (j, span) in self.starts.windows(2).enumerate() {
            for k in span[0] as usize..span[1] as usize {
                let (i, value) = (self.rows[k] as usize, self.values[k]);
                y[i] += value * x[j];
                if i != j {
                    y[j] += value * x[i];
                }
            }
        }
        y
    }

    /// A view for CHOLMOD (`cholmod_sparse` in its user guide). It is valid until the triangle changes.
    pub(super) fn view(&mut self) -> raw::cholmod_sparse {
        raw::cholmod_sparse {
            nrow: self.size(),
            ncol: self.size(),
            nzmax: self.rows.len(),
            p: self.starts.as_mut_ptr().cast::<c_void>(),
            i: self.rows.as_mut_ptr().cast::<c_void>(),
            nz: ptr::null_mut(),
            x: self.values.as_mut_ptr().cast::<c_void>(),
            z: ptr::null_mut(),
            // Symmetric, the lower triangle is given.
            stype: -1,
            itype: raw::CHOLMOD_LONG as i32,
            xtype: raw::CHOLMOD_REAL as i32,
            dtype: raw::CHOLMOD_DOUBLE as i32,
            sorted: 0,
            packed: 1,
        }
    }
}
