//! A Cholesky factor over the ranks: each eliminates its own unknowns, all share the rest.

use super::{Cholesky, Lower, Precision};
use crate::petsc::{Communicator, PetscError, check, raw};
use nalgebra::DMatrix;
use std::{ptr, slice};

/// The factor of a matrix whose unknowns are divided: the interior ones of a rank have no
/// neighbours on other ranks; the interface B, between the ranks, separates them
/// (Przemieniecki, AIAA J. 1, 1963).
///
/// With the Schur complement S = K_BB − Σ K_BI K_II⁻¹ K_IB, dense and the same on all ranks, a
/// solve is a forward solve in each rank's interior, one with S, and a backward solve. A rank's
/// factor holds its part of the interface last, with c 1 for K_BB: the last block L_S of it then
/// tells the rank's part of S, L_S L_Sᵀ = c 1 − K_BI K_II⁻¹ K_IB. On one rank all is interior.
pub(in crate::petsc) struct Substructure {
    comm: Communicator,
    precision: Precision,
    parts: Parts,
    local: Cholesky,
    /// The factor of S, where there is an interface.
    shared: Option<Cholesky>,
}

/// What the unknowns of a rank are.
struct Parts {
    /// Of each owned unknown its place among the interior or the interface ones.
    role: Vec<Role>,
    /// Global numbers of all ranks' interface unknowns, in increasing order.
    interface: Vec<i32>,
    /// Places in `interface` of those next to this rank's interior.
    near: Vec<usize>,
    interior: usize,
}

#[derive(Clone, Copy)]
enum Role {
    Interior(usize),
    Interface(usize),
}

/// Interface unknowns up to which a dense Schur complement on every rank is tried: then it takes
/// 290 MB. At 2100 unknowns steps were five times as fast as with MUMPS.
const WIDEST: usize = 6000;

impl Substructure {
    /// Divides and orders the unknowns of a matrix; `None` if the interface is too wide. Collective.
    ///
    /// # Safety
    /// `matrix` is a live handle.
    pub(in crate::petsc) unsafe fn new(
        comm: Communicator,
        matrix: raw::Mat,
        precision: Precision,
    ) -> Result<Option<Self>, PetscError> {
        let (mut first, mut end) = (0, 0);
        // SAFETY: the caller's promise.
        check(unsafe { raw::MatGetOwnershipRange(matrix, &mut first, &mut end) })?;
        // Of two neighbours on different ranks, that on the higher one is in the interface.
        let mut own = Vec::new();
        let mut role = Vec::new();
        for row in first..end {
            // SAFETY: an owned row.
            let lower =
                unsafe { with_row(matrix, row, |columns, _| columns.iter().any(|&j| j < first)) }?;
            role.push(match lower {
                true => Role::Interface(own.len()),
                false => Role::Interior(role.len() - own.len()),
            });
            if lower {
                own.push(row);
            }
        }
        let counts = comm.gather(&[own.len() as f64]);
        let width = counts.iter().sum::<f64>() as usize;
        if width > WIDEST {
            return Ok(None);
        }
        let before = counts[..comm.rank()].iter().sum::<f64>() as usize;
        let mut interface = vec![0.0; width];
        own.iter().enumerate().for_each(|(i, &row)| interface[before + i] = f64::from(row));
        comm.sum(&mut interface);
        let interface: Vec<i32> = interface.into_iter().map(|row| row as i32).collect();
        for role in &mut role {
            if let Role::Interface(i) = role {
                *i += before;
            }
        }

        let interior = role.len() - own.len();
        let mut near = Vec::new();
        for (row, role) in (first..end).zip(&role) {
            if let Role::Interior(_) = role {
                // SAFETY: an owned row.
                unsafe {
                    with_row(matrix, row, |columns, _| {
                        near.extend(columns.iter().filter_map(|j| interface.binary_search(j).ok()));
                    })?;
                }
            }
        }
        near.sort_unstable();
        near.dedup();

        let parts = Parts { role, interface, near, interior };
        // In CHOLMOD's order, the interface moved to the end.
        // SAFETY: the caller's promise.
        let mut whole = unsafe { parts.eliminated(matrix, first, 1.0)? };
        let mut local = Cholesky::analyse(&mut whole, None, 0, precision)?;
        let last = (interior..interior + parts.near.len()).map(|i| i as i64);
        if !parts.near.is_empty() {
            let order = local.order().iter().copied().filter(|&i| i < interior as i64);
            let order = order.chain(last.clone()).collect();
            local = Cholesky::analyse(&mut whole, Some(order), parts.near.len(), precision)?;
        }
        let kept = local.order()[interior..].iter().copied().eq(last);
        Ok(comm.all(kept).then_some(Self { comm, precision, parts, local, shared: None }))
    }

    /// The work of a factorisation on this rank, in bytes that a solve reads in the same time.
    pub(in crate::petsc) fn work(&self) -> f64 {
        self.local.work() + self.shared.as_ref().map_or(0.0, Cholesky::work)
    }

    /// Bytes that a solve reads on this rank.
    pub(in crate::petsc) fn traffic(&self) -> f64 {
        self.local.traffic() + self.shared.as_ref().map_or(0.0, Cholesky::traffic)
    }

    /// Factorises the present values of `matrix`; false if it is not positive definite. Collective.
    ///
    /// # Safety
    /// `matrix` is a live handle with the pattern this was made for.
    pub(in crate::petsc) unsafe fn factorise(
        &mut self,
        matrix: raw::Mat,
    ) -> Result<bool, PetscError> {
        let parts = &self.parts;
        let width = parts.interface.len();
        let (mut first, mut end) = (0, 0);
        // SAFETY: the caller's promise.
        check(unsafe { raw::MatGetOwnershipRange(matrix, &mut first, &mut end) })?;
        let mut schur = DMatrix::zeros(width, width);
        let mut size = 0.0_f64;
        for (row, role) in (first..end).zip(&parts.role) {
            let Role::Interface(i) = *role else { continue };
            // SAFETY: an owned row.
            unsafe {
                with_row(matrix, row, |columns, values| {
                    let mut sum = 0.0;
                    for (column, value) in columns.iter().zip(values) {
                        if let Ok(j) = parts.interface.binary_search(column) {
                            schur[(i, j)] = *value;
                            sum += value.abs();
                        }
                    }
                    size = size.max(sum);
                })?;
            }
        }
        // K_BI K_II⁻¹ K_IB is at most K_BB: with this the rank's matrix is definite.
        let c = 2.0 * self.comm.max(size);
        // SAFETY: the caller's promise.
        let mut whole = unsafe { parts.eliminated(matrix, first, c)? };
        let near = parts.near.len();
        let block = self.local.factorise(&mut whole)?;
        if !self.comm.all(block.is_some()) {
            return Ok(false);
        }
        let block = DMatrix::from_vec(near, near, block.unwrap_or_default());
        let part = &block * block.transpose();
        for (j, &to) in parts.near.iter().enumerate() {
            parts.near.iter().enumerate().for_each(|(i, &at)| schur[(at, to)] += part[(i, j)]);
            schur[(to, to)] -= c;
        }
        if width == 0 {
            return Ok(true);
        }
        self.comm.sum(schur.as_mut_slice());
        let mut lower = Lower::new();
        for j in 0..width {
            (j..width).for_each(|i| lower.push(i, schur[(i, j)]));
            lower.end_column();
        }
        let mut shared = match self.shared.take() {
            Some(shared) => shared,
            None => {
                let order = Some((0..width as i64).collect());
                Cholesky::analyse(&mut lower, order, 0, self.precision)?
            }
        };
        let definite = shared.factorise(&mut lower)?.is_some();
        self.shared = Some(shared);
        Ok(self.comm.all(definite))
    }

    /// `z` ← the factored matrix' inverse · `r`. Collective.
    pub(in crate::petsc) fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let local = self.local.triangle();
        let Parts { role: roles, interface, near, interior } = &self.parts;
        if interface.is_empty() {
            local.forward(r);
            return local.backward(z);
        }
        let mut shared = vec![0.0; interface.len()];
        let mut inside = vec![0.0; interior + near.len()];
        for (r, role) in r.iter().zip(roles) {
            match *role {
                Role::Interior(i) => inside[i] = *r,
                Role::Interface(i) => shared[i] = *r,
            }
        }
        local.forward(&inside);
        // −K_BI K_II⁻¹ r_I.
        let eliminated = local.last(near.len());
        near.iter().zip(&eliminated).for_each(|(&at, eliminated)| shared[at] += eliminated);
        self.comm.sum(&mut shared);
        if let Some(factor) = &mut self.shared {
            factor.triangle().forward(&shared);
            factor.triangle().backward(&mut shared);
        }
        let solved: Vec<f64> = near.iter().map(|&at| shared[at]).collect();
        local.set_last(&solved);
        local.backward(&mut inside);
        for (z, role) in z.iter_mut().zip(roles) {
            *z = match *role {
                Role::Interior(i) => inside[i],
                Role::Interface(i) => shared[i],
            };
        }
    }
}

impl Parts {
    /// The rank's interior, behind it its interface with c on the diagonal. The pattern of that block is
    /// full, as that of S.
    unsafe fn eliminated(&self, matrix: raw::Mat, first: i32, c: f64) -> Result<Lower, PetscError> {
        let mut lower = Lower::new();
        for (row, role) in self.role.iter().enumerate() {
            let Role::Interior(i) = *role else { continue };
            let add = |columns: &[i32], values: &[f64]| {
                for (&column, &value) in columns.iter().zip(values) {
                    let own = usize::try_from(column - first).ok().and_then(|j| self.role.get(j));
                    match own {
                        Some(Role::Interior(j)) if *j >= i => lower.push(*j, value),
                        Some(Role::Interior(_)) => {}
                        _ => {
                            let found = self.interface.binary_search(&column).ok();
                            if let Some(at) = found.and_then(|b| self.near.binary_search(&b).ok()) {
                                lower.push(self.interior + at, value);
                            }
                        }
                    }
                }
            };
            // SAFETY: the caller passes a live matrix whose rows begin at `first`.
            unsafe { with_row(matrix, first + row as i32, add)? };
            lower.end_column();
        }
        for j in 0..self.near.len() {
            lower.push(self.interior + j, c);
            (j + 1..self.near.len()).for_each(|i| lower.push(self.interior + i, 0.0));
            lower.end_column();
        }
        Ok(lower)
    }
}

/// Lends the columns and values of an owned row.
unsafe fn with_row<R>(
    matrix: raw::Mat,
    row: i32,
    reader: impl FnOnce(&[i32], &[f64]) -> R,
) -> Result<R, PetscError> {
    let (mut count, mut columns, mut values) = (0, ptr::null(), ptr::null());
    // SAFETY: the caller passes a live matrix and a row that it owns; PETSc lends `count` entries.
    unsafe {
        check(raw::MatGetRow(matrix, row, &mut count, &mut columns, &mut values))?;
        let result = match count {
            0 => reader(&[], &[]),
            _ => reader(
                slice::from_raw_parts(columns, count as usize),
                slice::from_raw_parts(values, count as usize),
            ),
        };
        check(raw::MatRestoreRow(matrix, row, &mut count, &mut columns, &mut values))?;
        Ok(result)
    }
}
