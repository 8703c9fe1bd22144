//! The dense Schur complement of the unknowns that are eliminated last.
//!
//! - In: S, from the substructure; prescribed unknowns and penalties, from a contact solver.
//! - Out: the unknowns of Γ and, where they are prescribed, the forces that hold them.
//! - Callers: [`Substructure`](super::substructure::Substructure), and the active-set and penalty-duality solvers by
//!   way of [`CondensedSystem`]. They solve with S for many prescribed sets, and only S is factorised anew for them.

use super::dense::DenseCholesky;
use crate::petsc::{Communicator, PetscError};
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};
use std::iter;

/// S of a matrix, and the factor of S with prescribed unknowns F̄ and an added diagonal D:
///
/// ```text
/// S_D = S + D,   (S_D)_FF x_F = b_F − (S_D)_FF̄ x_F̄,   x_F̄ given.
/// ```
///
/// All ranks have the same factor.
pub(super) struct SchurComplement {
    comm: Communicator,
    /// S; without rows if Γ is empty.
    matrix: DMatrix<f64>,
    /// The factor of (S_D)_FF, the changes that made S_D, and F.
    factor: Option<DenseCholesky>,
    changes: Option<Changes>,
    free: Vec<usize>,
}

/// The changes that make S_D of S.
#[derive(Clone, PartialEq)]
struct Changes {
    /// Per unknown: 1 if it is prescribed, else 0.
    prescribed: Vec<f64>,
    /// D.
    added: Vec<f64>,
}

impl SchurComplement {
    /// A complement without values.
    pub(super) fn new(comm: Communicator) -> Self {
        Self { comm, matrix: DMatrix::zeros(0, 0), factor: None, changes: None, free: Vec::new() }
    }

    /// Replaces S and discards the factor.
    pub(super) fn set(&mut self, matrix: DMatrix<f64>) {
        (self.matrix, self.changes) = (matrix, None);
    }

    /// Prescribes owned unknowns and adds to their diagonal entries of S. It returns false if the rest is not
    /// positive definite. The factor stays if no change was made. Collective.
    pub(super) fn prescribe(
        &mut self,
        prescribed: impl Iterator<Item = usize>,
        added: impl Iterator<Item = (usize, f64)>,
    ) -> Result<bool, PetscError> {
        let size = self.matrix.nrows();
        let mut changes = Changes { prescribed: vec![0.0; size], added: vec![0.0; size] };
        prescribed.for_each(|i| changes.prescribed[i] = 1.0);
        added.for_each(|(i, d)| changes.added[i] += d);
        self.comm.sum(&mut changes.prescribed);
        self.comm.sum(&mut changes.added);
        if size == 0 || self.changes.as_ref() == Some(&changes) {
            return Ok(true);
        }
        self.factorise(&changes);
        let definite = self.comm.all(self.factor.is_some());
        self.changes = definite.then_some(changes);
        Ok(definite)
    }

    /// Factorises (S_D)_FF.
    fn factorise(&mut self, changes: &Changes) {
        let is_free = |i: &usize| changes.prescribed[*i] == 0.0;
        self.free = (0..self.matrix.nrows()).filter(is_free).collect();
        let mut lower = DMatrix::zeros(self.free.len(), self.free.len());
        for (column, &j) in self.free.iter().enumerate() {
            let (mut to, from) = (lower.column_mut(column), self.matrix.column(j));
            for (row, &i) in self.free.iter().enumerate().skip(column) {
                to[row] = from[i];
            }
            to[column] += changes.added[j];
        }
        self.factor = DenseCholesky::new(lower);
    }

    /// As [`Self::solve`] without D, but prescribed unknowns keep their values in `x`; `b` becomes b − S x.
    fn solve_prescribed(&mut self, b: &mut [f64], x: &mut [f64]) {
        let Some(Changes { prescribed, .. }) = &self.changes else { return };
        let given: Vec<f64> =
            x.iter().zip(prescribed).map(|(x, prescribed)| x * prescribed).collect();
        let mut reduced = b.to_vec();
        if given.iter().any(|&x| x != 0.0) {
            self.subtract_product(&given, &mut reduced);
        }
        self.solve(&reduced, x);
        x.iter_mut().zip(given).for_each(|(x, given)| *x += given);
        self.subtract_product(x, b);
    }

    /// `b` ← `b` − S `x`.
    fn subtract_product(&self, x: &[f64], b: &mut [f64]) {
        let (x, rows) = (DVectorView::from_slice(x, x.len()), b.len());
        DVectorViewMut::from_slice(b, rows).gemv(-1.0, &self.matrix, &x, 1.0);
    }

    /// `x` ← the solution for `b`, with 0 on prescribed unknowns.
    pub(super) fn solve(&self, b: &[f64], x: &mut [f64]) {
        let Some(factor) = &self.factor else { return };
        let mut of_free: Vec<f64> = self.free.iter().map(|&i| b[i]).collect();
        factor.solve(&mut of_free);
        x.fill(0.0);
        self.free.iter().zip(of_free).for_each(|(&i, value)| x[i] = value);
    }

    /// Floating-point operations of a factorisation without prescribed unknowns: n³/3.
    pub(super) fn operations(&self) -> f64 {
        (self.matrix.nrows() as f64).powi(3) / 3.0
    }

    /// Bytes that a solve reads.
    pub(super) fn bytes(&self) -> f64 {
        8.0 * (self.matrix.nrows() as f64).powi(2)
    }
}

/// The system of the condensed unknowns after the elimination of all others: S x = b − p, with the forces p
/// on prescribed unknowns.
///
/// If the factor is that of an earlier matrix A₀, then E^-½ A₀ E^-½ replaces the present matrix
/// ([`Factor`](super::Factor)). With e = E^½, x = e x₀ and p = p₀/e for the unknowns x₀ and forces p₀ of A₀.
pub struct CondensedSystem<'a> {
    pub(super) schur: &'a mut SchurComplement,
    /// The positions of this rank's condensed unknowns.
    pub(super) own: Vec<usize>,
    /// e of this rank's condensed unknowns.
    pub(super) scaling: Vec<f64>,
    /// b₀ and x₀ of all positions.
    pub(super) b: &'a [f64],
    pub(super) x: &'a mut [f64],
}

impl CondensedSystem<'_> {
    /// The condensed unknowns x of this rank and the forces p there, if some are `prescribed`. `None` if the
    /// rest is not positive definite. Collective.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn solve(
        &mut self,
        prescribed: &[Option<f64>],
    ) -> Result<Option<[Vec<f64>; 2]>, PetscError> {
        let Self { schur, own, scaling, b, x } = self;
        let unknowns = || own.iter().zip(&*scaling).zip(prescribed);
        let given = || unknowns().filter_map(|((&i, e), value)| Some((i, (*value)? / e)));
        if !schur.prescribe(given().map(|(i, _)| i), iter::empty())? {
            return Ok(None);
        }
        x.fill(0.0);
        given().for_each(|(i, value)| x[i] = value);
        schur.comm.sum(x);
        let mut forces = b.to_vec();
        schur.solve_prescribed(&mut forces, x);
        let positions = || own.iter().zip(&*scaling);
        let unknowns = positions().map(|(&i, e)| e * x[i]).collect();
        Ok(Some([unknowns, positions().map(|(&i, e)| forces[i] / e).collect()]))
    }

    /// The condensed unknowns of this rank without prescribed ones: (S + D) x = b − p, with a diagonal D
    /// `added` to S and forces p. `None` if S + D is not positive definite. Collective.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn solve_penalised(
        &mut self,
        added: impl Iterator<Item = f64>,
        p: &[f64],
    ) -> Result<Option<Vec<f64>>, PetscError> {
        let Self { schur, own, scaling, b, x } = self;
        let added = own.iter().zip(&*scaling).zip(added).map(|((&i, e), d)| (i, e * e * d));
        if !schur.prescribe(iter::empty(), added)? {
            return Ok(None);
        }
        let mut forces = vec![0.0; b.len()];
        own.iter().zip(&*scaling).zip(p).for_each(|((&i, e), p)| forces[i] = -e * p);
        schur.comm.sum(&mut forces);
        forces.iter_mut().zip(*b).for_each(|(force, b)| *force += b);
        schur.solve(&forces, x);
        Ok(Some(own.iter().zip(&*scaling).map(|(&i, e)| e * x[i]).collect()))
    }
}
