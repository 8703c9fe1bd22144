//! Linear systems by conjugate gradients on a Cholesky factor that is kept.

use super::{Factor, Precision};
use crate::{
    petsc::{Matrix, PetscError, Session, Vector},
    phases::Phases,
};

/// (A + D) x = b on the unknowns that are not prescribed, A + D positive definite there.
#[derive(Clone, Copy)]
pub struct LinearSystem<'a> {
    /// A.
    pub matrix: &'a Matrix,
    /// The nonzero entries of the diagonal D; `None` where no rank has any.
    pub added: Option<&'a [(usize, f64)]>,
    /// The unknowns that keep their values in x (Dirichlet conditions); `None` where no rank has any.
    pub prescribed: Option<&'a [usize]>,
    /// The size of A's diagonal entries: what prescribed unknowns have there in the factored matrix.
    pub scale: f64,
    /// Where the time of a solve's parts is booked.
    pub booking: Option<Booking<'a>>,
}

/// Names of the phases that a solve consists of.
#[derive(Clone, Copy)]
pub struct Booking<'a> {
    /// Where they are booked.
    pub phases: &'a Phases,
    /// A new factor.
    pub factorisation: &'static str,
    /// An application of the factor.
    pub triangular_solves: &'static str,
    /// A product with A + D.
    pub product: &'static str,
}

impl<'a> LinearSystem<'a> {
    /// A x = b.
    pub fn of(matrix: &'a Matrix) -> Self {
        Self { matrix, added: None, prescribed: None, scale: 1.0, booking: None }
    }

    /// `y` ← (A + D) `x`.
    fn multiply(self, x: &Vector, y: &mut Vector) -> Result<(), PetscError> {
        let bytes = self.matrix.bytes_per_product();
        self.book(|booking| booking.product, bytes, || self.matrix.multiply(x, y))?;
        let Some(added) = self.added else { return Ok(()) };
        x.read(|x| y.write(|y| added.iter().for_each(|&(i, d)| y[i] += d * x[i])))?
    }

    /// `v` ← 0 on the prescribed unknowns.
    fn clear_prescribed(self, v: &mut Vector) -> Result<(), PetscError> {
        let Some(prescribed) = self.prescribed else { return Ok(()) };
        v.write(|v| prescribed.iter().for_each(|&i| v[i] = 0.0))
    }

    fn book<R>(
        self,
        name: impl FnOnce(&Booking) -> &'static str,
        bytes: f64,
        work: impl FnOnce() -> R,
    ) -> R {
        match self.booking {
            Some(booking) => booking.phases.time_moving(name(&booking), bytes, work),
            None => work(),
        }
    }
}

/// Conjugate gradients (Hestenes and Stiefel, J. Res. Nat. Bur. Standards 49, 1952) preconditioned by
/// a Cholesky factor: that of the matrix itself, which they polish, or that of an earlier system with
/// other values, other prescribed unknowns, another diagonal.
///
/// PETSc's KSPCG makes the same operations in the same order, but would need a matrix without the
/// prescribed unknowns for each set of them, and another product for the residual on them, which is the
/// contact forces.
pub struct LinearSolver {
    factor: Factor,
    /// A + D with rows and columns of prescribed unknowns zeroed: what is factorised.
    modified: Option<Matrix>,
    /// b − (A + D) x.
    residual: Vector,
    /// r: the residual with 0 on prescribed unknowns.
    free_residual: Vector,
    /// z.
    preconditioned: Vector,
    /// p.
    direction: Vector,
    /// (A + D) p.
    image: Vector,
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
            preconditioned: zeros()?,
            direction: zeros()?,
            image: zeros()?,
        })
    }

    /// The factor.
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Factorises the system; false if it is not positive definite.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn factorise(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        if system.added.is_none() && system.prescribed.is_none() {
            return self.factor.factorise(system.matrix);
        }
        let matrix = match &mut self.modified {
            Some(matrix) => matrix,
            none => none.insert(system.matrix.duplicate()?),
        };
        matrix.copy(system.matrix)?;
        if let Some(added) = system.added {
            self.image.write(|d| {
                d.fill(0.0);
                added.iter().for_each(|&(i, value)| d[i] += value);
            })?;
            matrix.add_diagonal(&self.image)?;
        }
        if let Some(prescribed) = system.prescribed {
            matrix.zero_rows_columns(prescribed, system.scale)?;
        }
        self.factor.factorise(matrix)
    }

    /// Solves from the start `x` until ‖b − (A + D) x‖₂ ≤ `limit` on the free unknowns, with the factor
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
        if !self.factor.exists() {
            return Ok(SolveReport::default());
        }
        let mut report = self.start(system, b, x, limit)?;
        self.iterate(system, x, limit, MOST_ITERATIONS, &mut report)?;
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
        self.factor.remake(system.matrix)?;
        let mut report = self.start(system, b, x, limit)?;
        if let Some(most) = self.factor.iteration_limit() {
            self.iterate(system, x, limit, most, &mut report)?;
        }
        if !report.converged {
            report.factorisations += 1;
            if system.book(|booking| booking.factorisation, 0.0, || self.factorise(system))? {
                self.iterate(system, x, limit, MOST_ITERATIONS, &mut report)?;
            }
        }
        Ok(report)
    }

    /// b − (A + D) x of the last solve on all unknowns: on prescribed ones, the forces that keep them
    /// there.
    pub fn residual(&self) -> &Vector {
        &self.residual
    }

    /// r ← b − (A + D) x, and whether that is small enough already.
    fn start(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &Vector,
        limit: f64,
    ) -> Result<SolveReport, PetscError> {
        system.multiply(x, &mut self.residual)?;
        self.residual.axpby(1.0, b, -1.0)?;
        let converged = self.is_reached(system, limit)?;
        Ok(SolveReport { converged, ..SolveReport::default() })
    }

    /// Whether ‖r‖₂ ≤ `limit` on the free unknowns; never where the norm overflows, as the limit of a
    /// huge b does too.
    fn is_reached(&mut self, system: LinearSystem, limit: f64) -> Result<bool, PetscError> {
        self.free_residual.axpby(1.0, &self.residual, 0.0)?;
        system.clear_prescribed(&mut self.free_residual)?;
        let norm = self.free_residual.norm()?;
        Ok(norm.is_finite() && norm <= limit)
    }

    /// Conjugate gradients from x and its residual r, with P the factored matrix and K = A + D. Until
    /// ‖r‖₂ ≤ `limit` on the free unknowns, and at most so many times:
    ///
    /// ```text
    /// z = P⁻¹ r,   β = rᵀz / (rᵀz)_previous, at first rᵀz / ∞,   p ← z + β p,
    /// α = rᵀz / pᵀKp,   x ← x + α p,   r ← r − α K p.
    /// ```
    ///
    /// r, z and p are 0 on prescribed unknowns in all of this; K is not positive definite if rᵀz or pᵀKp
    /// is not positive.
    fn iterate(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        limit: f64,
        most: usize,
        report: &mut SolveReport,
    ) -> Result<(), PetscError> {
        let mut energy = f64::INFINITY;
        for _ in 0..most {
            if report.converged {
                break;
            }
            report.iterations += 1;
            let bytes = self.factor.bytes_per_application();
            system.book(
                |booking| booking.triangular_solves,
                bytes,
                || self.factor.apply(&self.free_residual, &mut self.preconditioned),
            )?;
            system.clear_prescribed(&mut self.preconditioned)?;
            let previous = energy;
            energy = self.free_residual.dot(&self.preconditioned)?;
            self.direction.axpby(1.0, &self.preconditioned, energy / previous)?;
            system.multiply(&self.direction, &mut self.image)?;
            let stiffness = self.direction.dot(&self.image)?;
            if !(stiffness > 0.0 && energy > 0.0) {
                break;
            }
            x.axpby(energy / stiffness, &self.direction, 1.0)?;
            self.residual.axpby(-energy / stiffness, &self.image, 1.0)?;
            report.converged = self.is_reached(system, limit)?;
        }
        self.factor.end_solve();
        Ok(())
    }
}
