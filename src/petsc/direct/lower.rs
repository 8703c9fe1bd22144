//! Symmetric matrices as CHOLMOD reads them.

use crate::petsc::raw;
use std::{ffi::c_void, ptr};

/// The lower triangle by columns: rows `rows[starts[j]..starts[j + 1]]`, all at least j.
#[derive(Default)]
pub(super) struct Lower {
    starts: Vec<i64>,
    rows: Vec<i64>,
    values: Vec<f64>,
}

impl Lower {
    /// Of `size` rows, to be filled column by column.
    pub(super) fn new() -> Self {
        Self { starts: vec![0], ..Self::default() }
    }

    pub(super) fn push(&mut self, row: usize, value: f64) {
        self.rows.push(row as i64);
        self.values.push(value);
    }

    pub(super) fn end_column(&mut self) {
        self.starts.push(self.rows.len() as i64);
    }

    pub(super) fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// The symmetric matrix' product with `x`.
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

    /// What CHOLMOD reads; valid while this is not changed.
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
            stype: -1,
            itype: raw::CHOLMOD_LONG as i32,
            xtype: raw::CHOLMOD_REAL as i32,
            dtype: raw::CHOLMOD_DOUBLE as i32,
            sorted: 0,
            packed: 1,
        }
    }
}
