//! A Cholesky factor over the ranks by substructuring (Przemieniecki, AIAA J. 1, 1963).
//!
//! Γ, the interface, has the unknowns between the ranks and those that may be prescribed or get another
//! diagonal. The other unknowns of a rank are its interior I. They are coupled only with each other and with
//! Γ. Their factor does not depend on prescribed unknowns. Block elimination solves A x = b:
//!
//! ```text
//! S = A_ΓΓ − Σ A_ΓI A_II⁻¹ A_IΓ              the Schur complement, dense, the same on all ranks,
//! S x_Γ = b_Γ − Σ A_ΓI A_II⁻¹ b_I            by every rank,
//! A_II x_I = b_I − A_IΓ x_Γ                  by each rank for its own interior (sums over ranks).
//! ```
//!
//! - In: a matrix, right-hand sides, and prescribed unknowns of Γ.
//! - Out: solutions, or first S and the condensed right-hand side and then, after the solve on Γ, the interior.
//! - Caller: [`Factor`](super::Factor) alone.
//!
//! A rank factorises its interior together with the neighbouring part of Γ, with c 1 in place of A_ΓΓ. The
//! last block of this factor gives the rank's part of S: L_Γ L_Γᵀ = c 1 − A_ΓI A_II⁻¹ A_IΓ.

use super::{
    Cholesky, LowerTriangle, Precision,
    cholesky::BYTES_PER_OPERATION,
    schur::{CondensedSystem, SchurComplement},
};
use crate::petsc::{Communicator, Matrix, PetscError};
use nalgebra::DMatrix;
use std::iter::{self, zip};

/// The factor of a matrix whose unknowns are divided among the ranks.
pub(super) struct Substructure {
    comm: Communicator,
    division: RankDivision,
    /// The factor of the interior and the neighbouring interface.
    local: Cholesky,
    /// S.
    schur: SchurComplement,
    /// b and x of a solve, by positions.
    vectors: [Vec<f64>; 2],
}

/// The unknowns of a rank. Their *positions* are those of a vector of three parts: the interior of the
/// rank, the interface next to it, the interface of all ranks.
struct RankDivision {
    /// Per owned unknown: its position, in the first or the third part.
    positions: Vec<usize>,
    /// Global indices of all ranks' unknowns of Γ, increasing.
    interface: Vec<i32>,
    /// Indices in `interface` of the neighbours of this rank's interior, increasing.
    near: Vec<usize>,
    /// The number of interior unknowns.
    interior: usize,
}

/// The part of a matrix on this rank.
struct Blocks {
    /// The first columns of [A_II A_IΓ; A_ΓI c 1], the interior and the neighbouring interface.
    local: LowerTriangle,
    /// A_ΓΓ in the rows that this rank owns.
    interface: DMatrix<f64>,
    /// Its largest row sum of absolute values.
    largest_row_sum: f64,
}

/// The largest number of interface unknowns for a dense Schur complement on every rank, which then takes 290
/// MB. Steps are faster than with MUMPS up to this number (SPEED.md, section 2).
const LARGEST_INTERFACE: usize = 6000;

impl Substructure {
    /// Divides, orders and analyses the unknowns of a matrix. Γ contains the owned unknowns `condensed`. `None` if Γ is
    /// too large. Collective.
    pub(super) fn new(
        comm: Communicator,
        matrix: &Matrix,
        condensed: &[usize],
        precision: Precision,
    ) -> Result<Option<Self>, PetscError> {
        let Some(division) = RankDivision::of(comm, matrix, condensed)? else { return Ok(None) };
        let (interior, near) = (division.interior, division.near.len());
        let Blocks { local: mut a, .. } = division.blocks(matrix)?;
        a.push_coupled(near, 1.0);
        let local = Cholesky::analyse(&mut a, near, precision)?;
        local.check_memory(comm)?;
        let last = interior as i64..(interior + near) as i64;
        let in_place = local.permutation()[interior..].iter().copied().eq(last);
        let schur = SchurComplement::new(comm);
        let length = interior + near + division.interface.len();
        let vectors = [vec![0.0; length], vec![0.0; length]];
        let this = Self { comm, division, local, schur, vectors };
        Ok(comm.all(in_place).then_some(this))
    }

    /// The time of a factorisation on this rank, as the number of bytes that solves read in this time.
    pub(super) fn work(&self) -> f64 {
        self.local.work() + BYTES_PER_OPERATION * self.schur.operations()
    }

    /// The precision of the factor of the interior.
    pub(super) fn precision(&self) -> Precision {
        self.local.precision()
    }

    /// Bytes that a solve reads on this rank.
    pub(super) fn bytes(&self) -> f64 {
        self.local.bytes() + self.schur.bytes()
    }

    /// Factorises a matrix with the same pattern. It returns false if the matrix is not positive definite,
    /// whatever unknowns are prescribed. Call [`Self::prescribe`] next. Collective.
    pub(super) fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let near = &self.division.near;
        let Blocks { mut local, interface: mut schur, largest_row_sum } =
            self.division.blocks(matrix)?;
        // A_ΓI A_II⁻¹ A_IΓ ≤ A_ΓΓ for a semidefinite A, so with this c the rank's matrix is definite.
        let scale = self.comm.max(largest_row_sum);
        let c = 2.0 * scale;
        local.push_coupled(near.len(), c);
        let block = self.local.factorise(&mut local)?;
        if !self.comm.all(block.is_some()) {
            return Ok(false);
        }
        let block = block.unwrap_or_default();
        let part = &block * block.transpose();
        for (j, &column) in near.iter().enumerate() {
            for (i, &row) in near.iter().enumerate() {
                schur[(row, column)] += part[(i, j)];
            }
            schur[(column, column)] -= c;
        }
        self.comm.sum(schur.as_mut_slice());
        self.schur.set(schur);
        Ok(true)
    }

    /// Prescribes some of the condensed unknowns. It returns false if the rest of the matrix is not positive
    /// definite. Collective.
    pub(super) fn prescribe(&mut self, prescribed: &[usize]) -> Result<bool, PetscError> {
        let (positions, shared) = (&self.division.positions, self.division.shared());
        let position = |&i: &usize| positions[i] - shared;
        self.schur.prescribe(prescribed.iter().map(position), iter::empty())
    }

    /// `z` ← A⁻¹ `r` on the owned unknowns, 0 on prescribed ones. Collective.
    pub(super) fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        if self.division.interface.is_empty() {
            return self.local.solve(r, z);
        }
        self.eliminate(r);
        let shared = self.division.shared();
        let [b, x] = &mut self.vectors;
        self.schur.solve(&b[shared..], &mut x[shared..]);
        self.expand(z);
    }

    /// [`Self::apply`] for two right sides. Collective.
    pub(super) fn apply_two(&mut self, r: [&[f64]; 2], z: [&mut [f64]; 2]) {
        if self.division.interface.is_empty() {
            return self.local.solve_two(r, z);
        }
        zip(r, z).for_each(|(r, z)| self.apply(r, z));
    }

    /// Eliminates the interior from A x = `r`. Collective.
    fn eliminate(&mut self, r: &[f64]) {
        let shared = self.division.shared();
        let RankDivision { positions, near, .. } = &self.division;
        let [b, _] = &mut self.vectors;
        b[shared..].fill(0.0);
        positions.iter().zip(r).for_each(|(&position, r)| b[position] = *r);
        let (b_local, b_shared) = b.split_at_mut(shared);
        // − A_ΓI A_II⁻¹ r_I
        let values = self.local.forward(b_local);
        near.iter().zip(values).for_each(|(&i, value)| b_shared[i] += value);
        self.comm.sum(b_shared);
    }

    /// The system S x = b of the owned unknowns `condensed` after the elimination of the interior from A x =
    /// `r`. Their e is `scaling`. Collective.
    pub(super) fn condense(
        &mut self,
        r: &[f64],
        condensed: &[usize],
        scaling: Vec<f64>,
    ) -> CondensedSystem<'_> {
        self.eliminate(r);
        let Self { division, schur, vectors: [b, x], .. } = self;
        let shared = division.shared();
        let own = condensed.iter().map(|&i| division.positions[i] - shared).collect();
        CondensedSystem { schur, own, scaling, b: &b[shared..], x: &mut x[shared..] }
    }

    /// `z` ← the solution for the last x of the interface. Collective.
    pub(super) fn expand(&mut self, z: &mut [f64]) {
        let Self { division, local, vectors, .. } = self;
        let RankDivision { positions, near, .. } = &*division;
        let (x_local, x_shared) = vectors[1].split_at_mut(division.shared());
        let interface: Vec<f64> = near.iter().map(|&i| x_shared[i]).collect();
        local.backward(&interface, x_local);
        positions.iter().zip(z).for_each(|(&position, z)| *z = vectors[1][position]);
    }
}

impl RankDivision {
    /// Where the third part of the positions begins.
    fn shared(&self) -> usize {
        self.interior + self.near.len()
    }

    /// Divides the unknowns of a matrix. Of two neighbours on different ranks, the one on the higher rank
    /// belongs to Γ. So do those in `condensed`. `None` if Γ is too large. Collective.
    fn of(
        comm: Communicator,
        matrix: &Matrix,
        condensed: &[usize],
    ) -> Result<Option<Self>, PetscError> {
        let rows = matrix.rows();
        let mut shared = vec![false; rows.len()];
        condensed.iter().for_each(|&i| shared[i] = true);
        let before = |columns: &[i32], _: &[f64]| columns.iter().any(|&j| j < rows.start);
        let (mut inner, mut own) = (Vec::new(), Vec::new());
        for (row, shared) in rows.clone().zip(shared) {
            let shared = shared || matrix.read_stored(row, before)?;
            if shared { &mut own } else { &mut inner }.push(row);
        }
        let own: Vec<f64> = own.into_iter().map(f64::from).collect();
        let interface: Vec<i32> = comm.gather(&own).into_iter().map(|row| row as i32).collect();
        if interface.len() > LARGEST_INTERFACE {
            return Ok(None);
        }
        let mut near = Vec::new();
        for &row in &inner {
            matrix.read_stored(row, |columns, _| {
                near.extend(columns.iter().filter_map(|j| interface.binary_search(j).ok()));
            })?;
        }
        near.sort_unstable();
        near.dedup();
        let interior = inner.len();
        let mut positions = vec![0; rows.len()];
        let owned = |row: i32| (row - rows.start) as usize;
        inner.into_iter().enumerate().for_each(|(position, row)| positions[owned(row)] = position);
        for (i, &row) in interface.iter().enumerate().filter(|(_, row)| rows.contains(row)) {
            positions[owned(row)] = interior + near.len() + i;
        }
        Ok(Some(Self { positions, interface, near, interior }))
    }

    /// Reads the rows that this rank owns. Collective.
    fn blocks(&self, matrix: &Matrix) -> Result<Blocks, PetscError> {
        let (interior, shared) = (self.interior, self.shared());
        let (mut local, mut largest_row_sum) = (LowerTriangle::default(), 0.0_f64);
        let mut interface = DMatrix::zeros(self.interface.len(), self.interface.len());
        let (rows, entries) = (matrix.rows(), matrix.assembled_rows()?);
        for (row, &position) in rows.clone().zip(&self.positions) {
            entries.read(row, |columns, values| {
                let mut row_sum = 0.0;
                for (&column, &value) in columns.iter().zip(values) {
                    match self.position(rows.start, column) {
                        // The transpose of an entry of `local`.
                        Some(other) if other < interior && other < position => {}
                        Some(other) if other < interior => local.push(other, value),
                        Some(other) if position < interior => {
                            let near = self.near.binary_search(&(other - shared));
                            near.iter().for_each(|near| local.push(interior + near, value));
                        }
                        Some(other) => {
                            interface[(position - shared, other - shared)] = value;
                            row_sum += value.abs();
                        }
                        None => {}
                    }
                }
                largest_row_sum = largest_row_sum.max(row_sum);
            })?;
            if position < interior {
                local.end_column();
            }
        }
        Ok(Blocks { local, interface, largest_row_sum })
    }

    /// The position of an unknown with this global index; `None` in the interior of another rank.
    fn position(&self, first: i32, unknown: i32) -> Option<usize> {
        let owned = usize::try_from(unknown - first).ok().and_then(|i| self.positions.get(i));
        let shared = self.shared();
        let on_interface = || Some(shared + self.interface.binary_search(&unknown).ok()?);
        owned.copied().or_else(on_interface)
    }
}
