//! The Cholesky factor of a matrix, kept as the preconditioner of later ones.
//!
//! - In: the matrices of one kind, K(ζ) or M + kκL, one after the other, and once the unknowns that may be
//!   prescribed ([`Factor::set_condensed`]).
//! - Out: z = B r with a symmetric positive definite B near A⁻¹ ([`Factor::apply`]); the two halves of an
//!   exact solve, between which a contact solver chooses the prescribed unknowns ([`CondensedSystem`]); and the
//!   number of iterations after which a new factor costs less than the old one.
//! - Callers: [`LinearSolver`](super::LinearSolver), which has one and lets KSP apply it, and TAO's Newton steps.
//!
//! It calls the [`Substructure`] of its matrices, which calls a [`Cholesky`](super::Cholesky) factor for the interior
//! of the rank and a [`SchurComplement`](super::schur::SchurComplement) for the interface.

mod checkpoint;
mod condensed;

pub use checkpoint::FactorState;

use super::{
    CondensedSystem, Precision, Reduction, RefactorisationPolicy, scaling::Scaling,
    substructure::Substructure,
};
use crate::petsc::{Communicator, Matrix, PetscError, Session, ShellPreconditioner, Vector};
use std::mem::take;

/// A Cholesky factor: CHOLMOD's with our own solves. With several ranks or with contact it uses
/// substructuring.
///
/// It orders and analyses once for each number of rows. A factor is the preconditioner of later matrices
/// until [`RefactorisationPolicy`] finds a new one due. Let A₀ = Σ ζ₀ Aₜ be the factored matrix, summed over
/// triangles, and A = Σ ζ Aₜ a later one. The preconditioner is E^½ A₀⁻¹ E^½ with E = diag(A₀)/diag(A). Where
/// ζ/ζ₀ varies slowly, A is nearly E^-½ A₀ E^-½ for concentrated forces, as at contact nodes. With A₀⁻¹ alone
/// the part (ζ − ζ₀)/ζ₀ of such forces would remain.
pub struct Factor {
    comm: Communicator,
    /// Matrices with this number of rows are condensed to the unknowns that may be prescribed later, and these owned
    /// unknowns ([`Self::set_condensed`]).
    condensed: (usize, Vec<usize>),
    /// The number of rows of the analysed matrix, and its factor, which is `None` if the matrix or the interface
    /// between the ranks is too large.
    substructure: Option<(usize, Option<Box<Substructure>>)>,
    /// The state that checkpoints keep.
    state: FactorState,
    /// E^½.
    scaling: Scaling,
    /// Was a checkpoint loaded whose factor must still be made?
    loaded: bool,
}

/// The assumed cost, in iterations, of making a preconditioner of PETSc: between the costs of MUMPS and gamg.
const UNKNOWN_COST: f64 = 10.0;

/// The number of rows above which several ranks use multigrid: the memory of factors grows faster than the
/// number of rows. Below it steps with factors are faster (SPEED.md, section 2).
pub(super) const VERY_LARGE: usize = 2_500_000;

impl Factor {
    /// A factor of no matrix yet.
    pub fn new(session: &Session, precision: Precision) -> Self {
        Self {
            comm: session.comm(),
            condensed: (0, Vec::new()),
            substructure: None,
            state: FactorState::new(precision),
            scaling: Scaling::default(),
            loaded: false,
        }
    }

    /// The ranks among which its matrices are divided.
    pub(super) fn comm(&self) -> Communicator {
        self.comm
    }

    /// The next analysis is for a factor in double precision.
    pub(crate) fn set_full_precision(&mut self) {
        self.state.precision = Precision::Full;
    }

    /// Analyses the matrix. It returns false if the matrix or its interface is too large for a factor.
    /// Collective.
    ///
    /// # Errors
    /// There is no memory for it.
    pub(crate) fn analyse(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let rows = matrix.size()?;
        let before = self.substructure.take();
        if before.as_ref().is_none_or(|(size, _)| *size != rows) && !self.loaded {
            // The factor of another matrix, or a preconditioner of PETSc, is none for this one.
            self.state.policy = None;
        }
        let substructure = match before {
            Some((size, substructure)) if size == rows => substructure,
            _ if !self.comm.is_serial() && rows >= VERY_LARGE => None,
            _ => {
                let (of_rows, condensed) = &self.condensed;
                let last = if *of_rows == rows { &condensed[..] } else { &[] };
                Substructure::new(self.comm, matrix, last, self.state.precision)?.map(Box::new)
            }
        };
        let possible = substructure.is_some();
        self.substructure = Some((rows, substructure));
        Ok(possible)
    }

    fn substructure(&mut self) -> Option<&mut Substructure> {
        self.substructure.as_mut()?.1.as_deref_mut()
    }

    /// Factorises `matrix`. It returns false, and leaves no factor, if the matrix is not positive definite.
    /// Call `prescribe` before applying a condensed factor. Collective.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let (comm, entries) = (self.comm, matrix.entries() as f64);
        self.analyse(matrix)?;
        let condensed = self.is_condensed();
        let Some(factor) = self.substructure() else {
            return Err(PetscError::ours("the interface of a factor is too large"));
        };
        // BLAS may accept NaN as a positive pivot.
        let finite = comm.all(matrix.diagonal()?.iter().all(|entry| entry.is_finite()));
        let definite =
            finite && factor.factorise(matrix)? && (condensed || factor.prescribe(&[])?);
        let work = comm.max(factor.work());
        // An iteration reads the factor and the entries of the matrix with their columns.
        let iteration = comm.max(factor.bytes() + 12.0 * entries);
        // A restart needs the same precision.
        self.state.precision = factor.precision();
        self.record(matrix, definite, Some(work / iteration.max(1.0)))?;
        Ok(definite)
    }

    /// Records a new preconditioner of `matrix` and its `cost` in iterations, if it is known.
    pub(super) fn record(
        &mut self,
        matrix: &Matrix,
        definite: bool,
        cost: Option<f64>,
    ) -> Result<(), PetscError> {
        matrix.read_entries(&mut self.state.values)?;
        self.scaling = Scaling::of_factored(matrix)?;
        let cost = cost.unwrap_or(UNKNOWN_COST);
        self.state.policy = definite.then(|| RefactorisationPolicy::new(cost));
        // A new factor replaces that of a checkpoint.
        self.loaded = false;
        self.state.factorisations += usize::from(definite);
        Ok(())
    }

    /// Sets E for this matrix.
    pub(crate) fn set_scaling(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        self.scaling.set(matrix)
    }

    /// `z` ← E^½ A₀⁻¹ E^½ `r` with the factored matrix A₀: a pair of triangular solves.
    ///
    /// # Errors
    /// Sizes differ, or there is no factor.
    pub fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        self.start_application(r)?;
        let Some((_, Some(factor))) = &mut self.substructure else { return Err(missing()) };
        let scaled = self.scaling.apply(r)?;
        z.write(|z| factor.apply(scaled, z))?;
        self.scaling.apply_in_place(z)
    }

    /// [`Self::apply`] for two right sides. It takes much less time than two applications.
    ///
    /// # Errors
    /// As in [`Self::apply`].
    pub(super) fn apply_two(
        &mut self,
        r: &[Vector; 2],
        z: &mut [Vector; 2],
    ) -> Result<(), PetscError> {
        self.start_application(&r[0])?;
        let Some((_, Some(factor))) = &mut self.substructure else { return Err(missing()) };
        let [first, second] = r;
        let first = self.scaling.apply(first)?.to_vec();
        let scaled = [&first, self.scaling.apply(second)?];
        let [one, two] = z;
        one.write(|one| two.write(|two| factor.apply_two(scaled, [one, two])))??;
        z.iter_mut().try_for_each(|z| self.scaling.apply_in_place(z))
    }

    /// Counts an application to `r`. There must be a factor for vectors of this size.
    fn start_application(&mut self, r: &Vector) -> Result<(), PetscError> {
        self.state.applications += 1;
        if self.exists() && r.owned() == self.scaling.rows() { Ok(()) } else { Err(missing()) }
    }

    /// The forward elimination of [`Self::apply`]: reduces E^-½ A₀ E^-½ z = `r` to the condensed unknowns.
    /// Collective.
    ///
    /// # Errors
    /// As in [`Self::apply`].
    pub(super) fn condense(&mut self, r: &Vector) -> Result<CondensedSystem<'_>, PetscError> {
        self.start_application(r)?;
        let Self { scaling, condensed: (_, condensed), substructure, .. } = self;
        let Some((_, Some(factor))) = substructure else { return Err(missing()) };
        let of_condensed = scaling.of(condensed);
        Ok(factor.condense(scaling.apply(r)?, condensed, of_condensed))
    }

    /// The back substitution: `z` from the last solution for the condensed unknowns. Collective.
    ///
    /// # Errors
    /// Sizes differ.
    pub(super) fn expand(&mut self, z: &mut Vector) -> Result<(), PetscError> {
        let Some(factor) = self.substructure() else { return Err(missing()) };
        z.write(|z| factor.expand(z))?;
        self.scaling.apply_in_place(z)
    }

    /// The number of successful factorisations.
    pub fn factorisations(&self) -> usize {
        self.state.factorisations
    }

    /// Is there a factor?
    pub(crate) fn exists(&self) -> bool {
        self.state.policy.is_some()
    }

    /// Is there no factor, or does a new one cost less?
    pub(crate) fn is_due(&self) -> bool {
        self.iteration_limit(0.0).is_none()
    }

    /// The largest number of iterations for a solve with this factor that divides the residual by e^`asked`.
    /// `None` if there is no factor or a new one is due.
    pub(crate) fn iteration_limit(&self, asked: f64) -> Option<usize> {
        self.state.policy.as_ref().and_then(|policy| policy.iteration_limit(asked))
    }

    /// Records the iterations of a solve, or the counted applications, for the refactorisation policy.
    pub(crate) fn end_solve(&mut self, iterations: Option<usize>, reduction: Reduction) {
        let applications = take(&mut self.state.applications);
        if let Some(policy) = &mut self.state.policy {
            policy.solved(iterations.unwrap_or(applications), reduction);
        }
    }
}

fn missing() -> PetscError {
    PetscError::ours("a factor is applied that was not made for such vectors")
}

impl ShellPreconditioner for Factor {
    fn set_up(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        self.factorise(matrix)
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        Self::apply(self, r, z)
    }
}
