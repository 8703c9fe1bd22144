//! The dense Schur complement of the unknowns that are eliminated last.
//!
//! - In: S, from the substructure; prescribed unknowns and penalties, from a contact solver.
//! - Out: the unknowns of Γ and, where they are prescribed, the forces that hold them.
//! - Callers: [`Substructure`](super::substructure::Substructure), and the active-set and penalty-duality solvers by
//!   way of [`Condensed`]. They solve with S for many prescribed sets, and only S is factorised anew for them.

use super::{Cholesky, LowerTriangle, Precision};
use crate::petsc::{Communicator, PetscError};
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};
use std::iter;

/// S of a matrix, and the factor of S with prescribed unknowns F̄ and an added diagonal D:
///
/// ```text
/// S_D = S + D,   (S_D)_FF x_F = b_F − (S_D)_FF̄ x_F̄,   x_F̄ given.
/// ```
///
/// In the factored matrix prescribed unknowns have the rows and columns of a scaled identity. All ranks have
/// the same factor.
pub(super) struct SchurComplement {
    comm: Communicator,
    /// The precision of the first factor.
    precision: Precision,
    /// S; without rows if Γ is empty.
    matrix: DMatrix<f64>,
    /// The size of its entries.
    scale: f64,
    /// The factor of S_D, and the changes that made S_D.
    factor: Option<Cholesky>,
    changes: Option<Changes>,
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
    pub(super) fn new(comm: Communicator, precision: Precision) -> Self {
        let matrix = DMatrix::zeros(0, 0);
        Self { comm, precision, matrix, scale: 1.0, factor: None, changes: None }
    }

    /// Replaces S, whose entries have about the size `scale`, and discards the factor.
    pub(super) fn set(&mut self, matrix: DMatrix<f64>, scale: f64) {
        (self.matrix, self.scale, self.changes) = (matrix, scale, None);
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
        let definite = self.factorise(&changes)?;
        self.changes = definite.then_some(changes);
        Ok(definite)
    }

    /// Factorises S_D, in its own order: it is dense.
    fn factorise(&mut self, changes: &Changes) -> Result<bool, PetscError> {
        let (size, prescribed) = (self.matrix.nrows(), |i: usize| changes.prescribed[i] != 0.0);
        let mut lower = LowerTriangle::default();
        for (j, column) in self.matrix.column_iter().enumerate() {
            let diagonal = column[j] + changes.added[j];
            lower.push(j, if prescribed(j) { self.scale } else { diagonal });
            for i in j + 1..size {
                lower.push(i, if prescribed(i) || prescribed(j) { 0.0 } else { column[i] });
            }
            lower.end_column();
        }
        let factor = match &mut self.factor {
            Some(factor) => factor,
            none => {
                let (mut pattern, order) = (LowerTriangle::default(), (0..size as i64).collect());
                pattern.push_coupled(size, 1.0);
                none.insert(Cholesky::analyse(&mut pattern, Some(order), 0, self.precision)?)
            }
        };
        let definite = factor.factorise(&mut lower)?.is_some();
        Ok(self.comm.all(definite))
    }

    /// As [`Self::solve`], but prescribed unknowns keep their values in `x`; `b` becomes b − S_D x.
    fn solve_prescribed(&mut self, b: &mut [f64], x: &mut [f64]) {
        let Some(changes) = self.changes.clone() else { return };
        let unknowns = || x.iter().zip(&changes.prescribed);
        let given: Vec<f64> = unknowns().map(|(x, prescribed)| x * prescribed).collect();
        self.subtract_product(&given, b);
        let mut free = b.to_vec();
        self.solve(&mut free, x);
        self.subtract_product(x, b);
        x.iter_mut().zip(given).for_each(|(x, given)| *x += given);
    }

    /// `b` ← `b` − S_D `x`.
    fn subtract_product(&self, x: &[f64], b: &mut [f64]) {
        let (x, rows) = (DVectorView::from_slice(x, x.len()), b.len());
        DVectorViewMut::from_slice(b, rows).gemv(-1.0, &self.matrix, &x, 1.0);
        let Some(Changes { added, .. }) = &self.changes else { return };
        b.iter_mut().zip(added).zip(x.iter()).for_each(|((b, d), x)| *b -= d * x);
    }

    /// `x` ← the solution for `b`, with 0 on prescribed unknowns; `b` is changed.
    pub(super) fn solve(&mut self, b: &mut [f64], x: &mut [f64]) {
        let (Some(factor), Some(changes)) = (&mut self.factor, &self.changes) else { return };
        let prescribed = b.iter_mut().zip(&changes.prescribed).filter(|(_, p)| **p != 0.0);
        prescribed.for_each(|(b, _)| *b = 0.0);
        factor.solve(b, x);
    }

    /// The precision of the factor.
    pub(super) fn precision(&self) -> Precision {
        self.factor.as_ref().map_or(self.precision, Cholesky::precision)
    }

    /// The time of a factorisation, as the number of bytes that solves read in this time.
    pub(super) fn work(&self) -> f64 {
        self.factor.as_ref().map_or(0.0, Cholesky::work)
    }

    /// Bytes that a solve reads.
    pub(super) fn bytes(&self) -> f64 {
        self.factor.as_ref().map_or(0.0, Cholesky::bytes)
    }
}

/// The system of the condensed unknowns after the elimination of all others: S x = b − p, with the forces p
/// on prescribed unknowns.
///
/// If the factor is that of an earlier matrix A₀, then E^-½ A₀ E^-½ replaces the present matrix
/// ([`Factor`](super::Factor)). With e = E^½, x = e x₀ and p = p₀/e for the unknowns x₀ and forces p₀ of A₀.
pub struct Condensed<'a> {
    pub(super) schur: &'a mut SchurComplement,
    /// The places of this rank's condensed unknowns.
    pub(super) own: Vec<usize>,
    /// e of this rank's condensed unknowns.
    pub(super) scaling: Vec<f64>,
    /// b₀ and x₀ of all places.
    pub(super) b: &'a [f64],
    pub(super) x: &'a mut [f64],
}

impl Condensed<'_> {
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
        let places = || own.iter().zip(&*scaling);
        let unknowns = places().map(|(&i, e)| e * x[i]).collect();
        Ok(Some([unknowns, places().map(|(&i, e)| forces[i] / e).collect()]))
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
        schur.solve(&mut forces, x);
        Ok(Some(own.iter().zip(&*scaling).map(|(&i, e)| e * x[i]).collect()))
    }
}
