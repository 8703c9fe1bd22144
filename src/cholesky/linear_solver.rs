//! Linear systems by conjugate gradients on a Cholesky factor that is kept.

mod conjugate_gradients;

use super::{Condensed, Factor, LinearSystem, Precision};
use crate::petsc::{Matrix, PetscError, Session, Vector};

/// Chooses which of the condensed unknowns are prescribed, given the system that is left for them when
/// all others are eliminated. The answer is `None` where the choice stays the same, else per unknown the
/// change of its prescribed value, or `None` where it is free. The last solve of the system must be with
/// that choice. Collective.
pub type Choose<'a, E> = &'a mut dyn FnMut(&mut Condensed) -> Result<Option<Vec<Option<f64>>>, E>;

/// Conjugate gradients (Hestenes and Stiefel, J. Res. Nat. Bur. Standards 49, 1952) preconditioned by
/// a Cholesky factor: that of the matrix itself, which they polish, or that of an earlier system with
/// other values, and where the factor is not condensed (`Factor::condense`) other prescribed unknowns.
///
/// Of an earlier A₀ = Σ ζ₀ Aₜ, summed over triangles, the preconditioner is A₀⁻¹E with E = diag(A₀)/diag(A):
/// where ζ/ζ₀ varies slowly, A is nearly E⁻¹A₀ for forces as concentrated as those at contact nodes and the
/// edges of loads, of which A₀ alone would leave (ζ − ζ₀)/ζ₀. It is not quite symmetric, so that the gradients
/// are flexible (Notay, SIAM J. Sci. Comput. 22, 2000): each direction is made conjugate to the last one, not
/// to what symmetry would make of it.
///
/// PETSc's KSPFCG would need a matrix without the prescribed unknowns for each set of them, and another
/// product for the residual on them, which is the contact forces.
pub struct LinearSolver {
    factor: Factor,
    /// A with rows and columns of prescribed unknowns zeroed: what is factorised where the factor is not
    /// condensed.
    modified: Option<Matrix>,
    /// b − A x.
    residual: Vector,
    /// r: the residual with 0 on prescribed unknowns; or E r.
    free_residual: Vector,
    /// ‖r‖₂, and at the start of the solve.
    norm: f64,
    first_norm: f64,
    /// E.
    scaling: Vec<f64>,
    /// z.
    preconditioned: Vector,
    /// p.
    direction: Vector,
    /// A p.
    image: Vector,
    /// d.
    correction: Vector,
}

/// What a linear solve took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolveReport {
    /// Whether the residual came down to its limit.
    pub converged: bool,
    /// Iterations, each a product and a pair of triangular solves.
    pub iterations: usize,
    /// Factorisations, also of a matrix that is not positive definite.
    pub factorisations: usize,
}

/// Iterations that the factor of the system itself may need. It takes one or two to remove the
/// rounding error of the factor, more where the entries of the matrix vary by many orders.
const MOST_ITERATIONS: usize = 200;

impl LinearSolver {
    /// For systems of `owned` unknowns on this rank, with the PETSc options of
    /// [`Factor`] under `prefix`.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn new(
        session: &Session,
        prefix: &str,
        owned: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        Self::with(session, Factor::new(session, prefix, precision), owned)
    }

    /// The same with a factor of its own.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn with(session: &Session, factor: Factor, owned: usize) -> Result<Self, PetscError> {
        let zeros = || Vector::zeros(session, owned);
        Ok(Self {
            factor,
            modified: None,
            residual: zeros()?,
            free_residual: zeros()?,
            norm: 0.0,
            first_norm: 0.0,
            scaling: Vec::new(),
            preconditioned: zeros()?,
            direction: zeros()?,
            image: zeros()?,
            correction: zeros()?,
        })
    }

    /// The factor.
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Keeps only the factor.
    pub fn into_factor(self) -> Factor {
        self.factor
    }

    /// Factorises the system; false if it is not positive definite.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn factorise(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        if self.factor.is_condensed(system.matrix)? {
            return Ok(self.factor.factorise(system.matrix)? && self.restrict(system)?);
        }
        let Some(prescribed) = system.prescribed else {
            return self.factor.factorise(system.matrix);
        };
        let matrix = match &mut self.modified {
            Some(matrix) => matrix,
            none => none.insert(system.matrix.duplicate()?),
        };
        matrix.copy(system.matrix)?;
        matrix.zero_rows_columns(prescribed, system.scale)?;
        self.factor.factorise(matrix)
    }

    /// Whether there is a factor that preconditions the system. In a condensed one the unknowns that the
    /// system prescribes are prescribed first.
    fn restrict(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        if !self.factor.exists() || !self.factor.is_condensed(system.matrix)? {
            return Ok(self.factor.exists());
        }
        let restrict = || self.factor.restrict(system.prescribed.unwrap_or(&[]));
        system.book(|booking| booking.restriction, 0.0, restrict)
    }

    /// Solves from the start `x` until ‖b − A x‖₂ ≤ `limit` on the free unknowns, with the factor
    /// that there is; without one `x` is left alone.
    ///
    /// # Errors
    /// PETSc failed. Whether the limit was reached stands in the report.
    pub fn solve(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &mut Vector,
        limit: f64,
    ) -> Result<SolveReport, PetscError> {
        if !self.restrict(system)? {
            return Ok(SolveReport::default());
        }
        let mut report = self.start(system, b, x, limit)?;
        let most = (limit, MOST_ITERATIONS);
        self.iterate_choosing::<PetscError>(system, x, most, None, &mut report)?;
        Ok(report)
    }

    /// As [`Self::solve`], with a new factor where one is due or the old one takes too long. The limit is
    /// then missed only if the system is not positive definite, or too ill-conditioned for it.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn solve_renewing(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &mut Vector,
        limit: f64,
    ) -> Result<SolveReport, PetscError> {
        self.solve_choosing::<PetscError>(system, b, x, limit, None)
    }

    /// As [`Self::solve_renewing`]; before the first iteration, unless the start is a solution, other
    /// unknowns may be chosen to be prescribed, if the factor is condensed: for the matrix that it was made
    /// of the choice and the answer are exact.
    ///
    /// # Errors
    /// PETSc, CHOLMOD or the choice failed.
    pub fn solve_choosing<E: From<PetscError>>(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &mut Vector,
        limit: f64,
        mut choose: Option<Choose<E>>,
    ) -> Result<SolveReport, E> {
        self.factor.remake(system.matrix)?;
        let mut report = self.start(system, b, x, limit)?;
        let mut chosen = None;
        if let Some(most) = self.factor.iteration_limit((self.norm / limit).ln())
            && self.restrict(system)?
        {
            chosen = self.iterate_choosing(system, x, (limit, most), choose.take(), &mut report)?;
        }
        if !report.converged {
            let prescribed = chosen.as_deref().or(system.prescribed);
            let system = LinearSystem { prescribed, ..system };
            report.factorisations += 1;
            if system.book(|booking| booking.factorisation, 0.0, || self.factorise(system))? {
                let limits = (limit, MOST_ITERATIONS);
                self.iterate_choosing(system, x, limits, choose, &mut report)?;
            }
        }
        Ok(report)
    }

    /// As [`Self::iterate`], after a choice of prescribed unknowns, which is returned where it is another.
    fn iterate_choosing<E: From<PetscError>>(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        (limit, most): (f64, usize),
        choose: Option<Choose<E>>,
        report: &mut SolveReport,
    ) -> Result<Option<Vec<usize>>, E> {
        if !report.converged {
            self.set_scaling(system)?;
        }
        let condensed = !report.converged && self.factor.is_condensed(system.matrix)?;
        let choose = choose.filter(|_| condensed);
        let asked = choose.is_some();
        let chosen = choose.map_or(Ok(None), |choose| self.apply_factor(system, Some(choose)))?;
        let prescribed = chosen.as_deref().or(system.prescribed);
        let system = LinearSystem { prescribed, ..system };
        if chosen.is_some() {
            report.iterations += 1;
            x.axpby(1.0, &self.preconditioned, 1.0)?;
            system.multiply(&self.preconditioned, &mut self.image)?;
            self.residual.axpby(-1.0, &self.image, 1.0)?;
            report.converged = self.is_reached(system, limit)?;
        }
        self.iterate(system, x, (limit, most), asked && chosen.is_none(), report)?;
        Ok(chosen)
    }

    /// b − A x of the last solve on all unknowns: on prescribed ones, the forces that keep them
    /// there.
    pub fn residual(&self) -> &Vector {
        &self.residual
    }
}
