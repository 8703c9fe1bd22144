//! A Cholesky factor over the ranks by substructuring (Przemieniecki, AIAA J. 1, 1963).
//!
//! The unknowns of a rank are interior (I), with neighbours on this rank and in the interface only, or
//! belong to the interface Γ between the ranks. A x = b is solved by block elimination:
//!
//! ```text
//! S = A_ΓΓ − Σ A_ΓI A_II⁻¹ A_IΓ              the Schur complement, dense, the same on all ranks,
//! S x_Γ = b_Γ − Σ A_ΓI A_II⁻¹ b_I            by every rank,
//! A_II x_I = b_I − A_IΓ x_Γ                  by each rank for its own interior (sums over ranks).
//! ```
//!
//! A rank factorises its interior together with the part of the interface next to it, with c 1 in the
//! place of A_ΓΓ: the last block of that factor then tells its part of S,
//! L_Γ L_Γᵀ = c 1 − A_ΓI A_II⁻¹ A_IΓ, and its triangular solves do the rest. On one rank all unknowns
//! are interior.

use super::{Cholesky, LowerTriangle, Precision};
use crate::petsc::{Communicator, Matrix, PetscError};
use nalgebra::DMatrix;

/// The factor of a matrix whose unknowns are divided among the ranks.
pub(super) struct Substructure {
    comm: Communicator,
    precision: Precision,
    division: Division,
    /// Of the interior and the interface next to it.
    local: Cholesky,
    /// Of S, where there is an interface.
    schur: Option<Cholesky>,
}

/// The unknowns of a rank.
struct Division {
    /// Of each owned unknown what it is.
    kinds: Vec<Unknown>,
    /// Global indices of all ranks' interface unknowns, increasing.
    interface: Vec<i32>,
    /// Indices in `interface` of those next to this rank's interior, increasing.
    near: Vec<usize>,
    /// The number of interior unknowns.
    interior: usize,
}

#[derive(Clone, Copy)]
enum Unknown {
    /// With its index among the interior unknowns of the rank.
    Interior(usize),
    /// With its index in the interface of all ranks.
    Interface(usize),
}

/// Interface unknowns up to which a dense Schur complement on every rank is tried: then it takes
/// 290 MB. At 2100 unknowns steps were five times as fast as with MUMPS.
const LARGEST_INTERFACE: usize = 6000;

impl Substructure {
    /// Divides, orders and analyses the unknowns of a matrix; `None` if the interface is too large.
    /// Collective.
    pub(super) fn new(
        comm: Communicator,
        matrix: &Matrix,
        precision: Precision,
    ) -> Result<Option<Self>, PetscError> {
        let Some(division) = Division::of(comm, matrix)? else { return Ok(None) };
        let mut a = division.local_matrix(matrix, 1.0)?;
        let mut local = Cholesky::analyse(&mut a, None, 0, precision)?;
        // The same order with the interface moved to the end.
        let (interior, near) = (division.interior as i64, division.near.len());
        let last = interior..interior + near as i64;
        if near > 0 {
            let order = local.order().iter().copied().filter(|&i| i < interior);
            let order = order.chain(last.clone()).collect();
            local = Cholesky::analyse(&mut a, Some(order), near, precision)?;
        }
        let in_place = local.order()[division.interior..].iter().copied().eq(last);
        let this = Self { comm, precision, division, local, schur: None };
        Ok(comm.all(in_place).then_some(this))
    }

    /// The work of a factorisation on this rank, in bytes that a solve reads in the same time.
    pub(super) fn work(&self) -> f64 {
        self.local.work() + self.schur.as_ref().map_or(0.0, Cholesky::work)
    }

    /// Bytes that a solve reads on this rank.
    pub(super) fn bytes(&self) -> f64 {
        self.local.bytes() + self.schur.as_ref().map_or(0.0, Cholesky::bytes)
    }

    /// Factorises the present values of a matrix of the same pattern; false if it is not positive
    /// definite. Collective.
    pub(super) fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let division = &self.division;
        let (mut schur, largest_row_sum) = division.interface_rows(matrix)?;
        // A_ΓI A_II⁻¹ A_IΓ ≤ A_ΓΓ for a definite A, so with this c the rank's matrix is definite.
        let c = 2.0 * self.comm.max(largest_row_sum);
        let block = self.local.factorise(&mut division.local_matrix(matrix, c)?)?;
        if !self.comm.all(block.is_some()) {
            return Ok(false);
        }
        let block = block.unwrap_or_default();
        let part = &block * block.transpose();
        for (j, &column) in division.near.iter().enumerate() {
            for (i, &row) in division.near.iter().enumerate() {
                schur[(row, column)] += part[(i, j)];
            }
            schur[(column, column)] -= c;
        }
        if division.interface.is_empty() {
            return Ok(true);
        }
        self.comm.sum(schur.as_mut_slice());
        let definite = self.factorise_schur(&schur)?;
        Ok(self.comm.all(definite))
    }

    /// Factorises S, in its own order: it is dense.
    fn factorise_schur(&mut self, schur: &DMatrix<f64>) -> Result<bool, PetscError> {
        let size = schur.nrows();
        let mut lower = LowerTriangle::default();
        for j in 0..size {
            (j..size).for_each(|i| lower.push(i, schur[(i, j)]));
            lower.end_column();
        }
        let mut factor = match self.schur.take() {
            Some(factor) => factor,
            None => {
                let order = Some((0..size as i64).collect());
                Cholesky::analyse(&mut lower, order, 0, self.precision)?
            }
        };
        let definite = factor.factorise(&mut lower)?.is_some();
        self.schur = Some(factor);
        Ok(definite)
    }

    /// `z` ← A⁻¹ `r` on the owned unknowns. Collective.
    pub(super) fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let local = self.local.solver();
        let Division { kinds, interface, near, interior } = &self.division;
        if interface.is_empty() {
            local.forward(r);
            return local.backward(z);
        }
        let mut shared = vec![0.0; interface.len()];
        let mut own = vec![0.0; interior + near.len()];
        for (r, kind) in r.iter().zip(kinds) {
            match *kind {
                Unknown::Interior(i) => own[i] = *r,
                Unknown::Interface(i) => shared[i] = *r,
            }
        }
        local.forward(&own);
        // − A_ΓI A_II⁻¹ r_I.
        let eliminated = local.interface(near.len());
        near.iter().zip(&eliminated).for_each(|(&i, eliminated)| shared[i] += eliminated);
        self.comm.sum(&mut shared);
        if let Some(schur) = &mut self.schur {
            schur.solver().forward(&shared);
            schur.solver().backward(&mut shared);
        }
        let solved: Vec<f64> = near.iter().map(|&i| shared[i]).collect();
        local.set_interface(&solved);
        local.backward(&mut own);
        for (z, kind) in z.iter_mut().zip(kinds) {
            *z = match *kind {
                Unknown::Interior(i) => own[i],
                Unknown::Interface(i) => shared[i],
            };
        }
    }
}

impl Division {
    /// Divides the unknowns of a matrix: of two neighbours on different ranks, the one on the higher
    /// rank belongs to the interface. `None` if that is too large. Collective.
    fn of(comm: Communicator, matrix: &Matrix) -> Result<Option<Self>, PetscError> {
        let rows = matrix.rows();
        let (mut kinds, mut own) = (Vec::new(), Vec::new());
        for row in rows.clone() {
            let on_interface =
                matrix.read_row(row, |columns, _| columns.iter().any(|&j| j < rows.start))?;
            kinds.push(match on_interface {
                true => Unknown::Interface(own.len()),
                false => Unknown::Interior(kinds.len() - own.len()),
            });
            if on_interface {
                own.push(row);
            }
        }
        let counts = comm.gather(&[own.len() as f64]);
        let size = counts.iter().sum::<f64>() as usize;
        if size > LARGEST_INTERFACE {
            return Ok(None);
        }
        let before = counts[..comm.rank()].iter().sum::<f64>() as usize;
        let mut interface = vec![0.0; size];
        own.iter().enumerate().for_each(|(i, &row)| interface[before + i] = f64::from(row));
        comm.sum(&mut interface);
        let interface: Vec<i32> = interface.into_iter().map(|row| row as i32).collect();
        for kind in &mut kinds {
            if let Unknown::Interface(i) = kind {
                *i += before;
            }
        }

        let mut near = Vec::new();
        for (row, kind) in rows.zip(&kinds) {
            if let Unknown::Interior(_) = kind {
                matrix.read_row(row, |columns, _| {
                    near.extend(columns.iter().filter_map(|j| interface.binary_search(j).ok()));
                })?;
            }
        }
        near.sort_unstable();
        near.dedup();
        let interior = kinds.len() - own.len();
        Ok(Some(Self { kinds, interface, near, interior }))
    }

    /// A_ΓΓ in the rows that this rank owns, and its largest row sum of absolute values.
    fn interface_rows(&self, matrix: &Matrix) -> Result<(DMatrix<f64>, f64), PetscError> {
        let mut block = DMatrix::zeros(self.interface.len(), self.interface.len());
        let mut largest = 0.0_f64;
        for (row, kind) in matrix.rows().zip(&self.kinds) {
            let Unknown::Interface(i) = *kind else { continue };
            matrix.read_row(row, |columns, values| {
                let mut sum = 0.0;
                for (column, value) in columns.iter().zip(values) {
                    if let Ok(j) = self.interface.binary_search(column) {
                        block[(i, j)] = *value;
                        sum += value.abs();
                    }
                }
                largest = largest.max(sum);
            })?;
        }
        Ok((block, largest))
    }

    /// The rank's interior, behind it the interface next to it with c on the diagonal:
    /// [A_II A_IΓ; A_ΓI c 1]. The pattern of the last block is full, as that of S.
    fn local_matrix(&self, matrix: &Matrix, c: f64) -> Result<LowerTriangle, PetscError> {
        let mut lower = LowerTriangle::default();
        let rows = matrix.rows();
        for (row, kind) in rows.clone().zip(&self.kinds) {
            let Unknown::Interior(i) = *kind else { continue };
            matrix.read_row(row, |columns, values| {
                for (&column, &value) in columns.iter().zip(values) {
                    let own = usize::try_from(column - rows.start).ok();
                    match own.and_then(|j| self.kinds.get(j)) {
                        Some(Unknown::Interior(j)) if *j >= i => lower.push(*j, value),
                        Some(Unknown::Interior(_)) => {}
                        _ => {
                            let found = self.interface.binary_search(&column).ok();
                            let near = found.and_then(|i| self.near.binary_search(&i).ok());
                            near.iter().for_each(|near| lower.push(self.interior + near, value));
                        }
                    }
                }
            })?;
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
