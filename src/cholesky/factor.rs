//! The factor that preconditions a matrix, whatever makes it.

mod method;
mod shell;

use super::{Choose, Precision, Reduction, RefactorisationPolicy};
use crate::{
    archive::{Archive, ArchiveError},
    petsc::{Communicator, Matrix, PetscError, Session, Vector},
};
use method::Method;

/// A Cholesky factor: CHOLMOD's with solves of our own, by substructuring where there are several
/// ranks or contact. On several ranks MUMPS takes its place (PCCHOLESKY) where their interface is too large,
/// a cycle of algebraic multigrid (PCGAMG) where the matrix is very large. PETSc options can ask for
/// any other preconditioner.
///
/// Fill-reducing ordering and symbolic factorisation are done once for each number of rows. A factor
/// may be kept as the preconditioner of later matrices until [`RefactorisationPolicy`] finds a new one
/// due.
pub struct Factor {
    comm: Communicator,
    prefix: String,
    /// Of the two factors of a substructure.
    precisions: [Precision; 2],
    /// The rows of the matrices to condense, and their owned unknowns that [`Self::restrict`] may prescribe.
    condensed: (usize, Vec<usize>),
    /// The rows of the matrices that it is for, and the method, chosen with the first of them.
    method: Option<(usize, Method)>,
    /// `None` before the first factorisation, and after one that failed.
    policy: Option<RefactorisationPolicy>,
    /// Applications in the present solve.
    applications: usize,
    /// Factorisations that did not fail.
    factorisations: usize,
    /// The values of the matrix last factorised, from which a checkpoint makes the same factor.
    values: Vec<f64>,
    /// The diagonal of that matrix, the part of this rank.
    diagonal: Vec<f64>,
    /// Whether the factor was loaded and is yet to be made.
    loaded: bool,
}

/// The cost, in iterations, of a factorisation whose work is not known. Measured on square.toml with
/// n = 64 and 256, on one and two ranks: MUMPS 4 to 10, gamg 13 to 33, CHOLMOD through PETSc 10 to 19.
const UNKNOWN_COST: f64 = 10.0;

impl Factor {
    /// A factor whose PETSc options begin with `prefix` (`-elastic_pc_type …`).
    pub fn new(session: &Session, prefix: &str, precision: Precision) -> Self {
        Self {
            comm: session.comm(),
            prefix: prefix.to_owned(),
            precisions: [precision; 2],
            condensed: (0, Vec::new()),
            method: None,
            policy: None,
            applications: 0,
            factorisations: 0,
            values: Vec::new(),
            diagonal: Vec::new(),
            loaded: false,
        }
    }

    /// Makes factors of matrices like this one so that [`Self::restrict`] may prescribe these owned unknowns,
    /// if there are not too many of them. Other unknowns than those of the last call discard the present
    /// factor. Collective.
    pub(crate) fn condense(
        &mut self,
        matrix: &Matrix,
        unknowns: impl Iterator<Item = usize>,
    ) -> Result<(), PetscError> {
        let condensed = (matrix.size()?, unknowns.collect());
        if self.comm.any(condensed != self.condensed) {
            (self.condensed, self.method) = (condensed, None);
            self.policy = self.policy.take().filter(|_| self.loaded);
        }
        Ok(())
    }

    /// Saves or loads the factor as the values of the matrix that it was made of.
    ///
    /// # Errors
    /// The archive has no factor there.
    pub fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        archive.value(&mut self.values)?;
        archive.value(&mut self.precisions)?;
        archive.value(&mut self.policy)?;
        archive.value(&mut self.applications)?;
        archive.value(&mut self.factorisations)?;
        self.loaded |= archive.is_loading() && self.policy.is_some();
        Ok(())
    }

    /// Makes the factor that was loaded again, of a matrix with the pattern of this one. Collective.
    ///
    /// # Errors
    /// The pattern is another, or as in [`Self::factorise`].
    pub(super) fn remake(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        if !std::mem::take(&mut self.loaded) {
            return Ok(());
        }
        let mut copy = matrix.duplicate()?;
        copy.set_entries(&self.values)?;
        let (policy, factorisations) = (self.policy.take(), self.factorisations);
        if self.factorise(&copy)? {
            (self.policy, self.factorisations) = (policy, factorisations);
        }
        Ok(())
    }

    /// Factorises the present values of `matrix`; false if it is not positive definite: then there is
    /// no factor. Where it is condensed a restriction must follow before it is applied. Collective.
    ///
    /// # Errors
    /// There is no memory for it, or PETSc options ask for what this PETSc does not have.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let (comm, entries) = (self.comm, matrix.entries() as f64);
        let (definite, cost) = match self.method(matrix)? {
            Method::Petsc(preconditioner) => (preconditioner.set_up(matrix)?, UNKNOWN_COST),
            Method::Substructure { factor, condensed } => {
                let definite = factor.factorise(matrix)? && (*condensed || factor.restrict(&[])?);
                let work = comm.max(factor.work());
                // An iteration reads the factor and the entries of the matrix with their columns.
                let iteration = comm.max(factor.bytes() + 12.0 * entries);
                (definite, work / iteration.max(1.0))
            }
        };
        self.keep_precisions();
        matrix.read_entries(&mut self.values)?;
        self.diagonal = matrix.diagonal()?;
        self.policy = definite.then(|| RefactorisationPolicy::new(cost));
        self.factorisations += usize::from(definite);
        Ok(definite)
    }

    /// Whether factors of such a matrix can be restricted. Collective.
    ///
    /// # Errors
    /// As in [`Self::factorise`].
    pub(crate) fn is_condensed(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        Ok(matches!(self.method(matrix)?, Method::Substructure { condensed: true, .. }))
    }

    /// Prescribes some of the condensed unknowns of the matrix last factorised; false if what is left of it
    /// is not positive definite. Collective.
    pub(super) fn restrict(&mut self, prescribed: &[usize]) -> Result<bool, PetscError> {
        let Some((_, Method::Substructure { factor, .. })) = &mut self.method else {
            return Ok(false);
        };
        let definite = factor.restrict(prescribed)?;
        self.keep_precisions();
        Ok(definite)
    }

    /// A factor that needs all digits will need them after a checkpoint too.
    fn keep_precisions(&mut self) {
        if let Some((_, Method::Substructure { factor, .. })) = &self.method {
            self.precisions = factor.precisions();
        }
    }

    /// Bytes that an application reads on this rank; 0 where unknown.
    pub fn bytes_per_application(&self) -> f64 {
        match &self.method {
            Some((_, Method::Substructure { factor, .. })) => factor.bytes(),
            _ => 0.0,
        }
    }

    /// `z` ← A⁻¹ `r`, A the matrix last factorised: a pair of triangular solves.
    ///
    /// # Errors
    /// Sizes differ, or nothing was factorised.
    pub fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        self.applications += 1;
        let fits = self.exists() && r.owned() == z.owned();
        match &mut self.method {
            Some((_, Method::Petsc(preconditioner))) => preconditioner.apply(r, z),
            Some((_, Method::Substructure { factor, .. })) if fits => {
                r.read(|r| z.write(|z| factor.apply(r, z)))?
            }
            _ => Err(PetscError::ours("a factor is applied that was not made for such vectors")),
        }
    }

    /// Prescribes these unknowns in the factor, where it is condensed; false if there is no factor then.
    /// Collective.
    pub(crate) fn prescribe(&mut self, unknowns: &[usize]) -> Result<bool, PetscError> {
        let condensed =
            matches!(self.method, Some((_, Method::Substructure { condensed: true, .. })));
        Ok(self.exists() && (!condensed || self.restrict(unknowns)?))
    }

    /// As [`Self::apply`], but `choose` decides which of the condensed unknowns are prescribed; they are
    /// returned if they are not the same as before. Collective.
    ///
    /// # Errors
    /// As in [`Self::apply`], or the factor is not condensed, or the choice failed.
    pub(super) fn apply_choosing<E: From<PetscError>>(
        &mut self,
        r: &Vector,
        z: &mut Vector,
        choose: Choose<E>,
    ) -> Result<Option<Vec<usize>>, E> {
        let Some((_, Method::Substructure { factor, condensed: true })) = &mut self.method else {
            let detail = "unknowns are chosen in a factor that is not condensed";
            return Err(PetscError::ours(detail).into());
        };
        self.applications += 1;
        let chosen =
            r.read(|r| z.write(|z| factor.apply_choosing(r, z, &self.condensed.1, choose)))???;
        self.keep_precisions();
        let prescribed = |values: Vec<Option<f64>>| {
            let unknowns = self.condensed.1.iter().zip(values);
            unknowns.filter_map(|(&i, value)| value.is_some().then_some(i)).collect()
        };
        Ok(chosen.map(prescribed))
    }

    /// The owned diagonal entries of the matrix last factorised.
    pub(super) fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Factorisations made so far that did not fail.
    pub fn factorisations(&self) -> usize {
        self.factorisations
    }

    /// Whether the last factorisation went well.
    pub(crate) fn exists(&self) -> bool {
        self.policy.is_some()
    }

    /// Iterations that a solve with the factor of an earlier matrix is worth, where it is asked to divide the
    /// residual by e^`asked`; `None` if a new factor is due, or there is none.
    pub(super) fn iteration_limit(&self, asked: f64) -> Option<usize> {
        self.policy.as_ref().and_then(|policy| policy.iteration_limit(asked))
    }

    /// Ends a solve: its applications tell how good the factor still is.
    pub(super) fn end_solve(&mut self, reduction: Reduction) {
        let iterations = std::mem::take(&mut self.applications);
        if let Some(policy) = &mut self.policy {
            policy.solved(iterations, reduction);
        }
    }
}
