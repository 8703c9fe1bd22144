//! Linear systems by conjugate gradients on a Cholesky factor that is kept.

use super::{Condensed, Factor, LinearSystem, Precision, Reduction};
use crate::petsc::{Matrix, PetscError, Session, Vector};
use std::mem::take;

/// Chooses which of the condensed unknowns are prescribed, given the system that is left for them when
/// all others are eliminated: of each by how much it then changes, or `None` where the unknowns that are
/// prescribed stay the same. The last solve must be that of the choice. Collective.
pub type Choose<'a> =
    &'a mut dyn FnMut(&mut Condensed) -> Result<Option<Vec<Option<f64>>>, PetscError>;

/// Conjugate gradients (Hestenes and Stiefel, J. Res. Nat. Bur. Standards 49, 1952) preconditioned by
/// a Cholesky factor: that of the matrix itself, which they polish, or that of an earlier system with
/// other values, and where the factor is not condensed (`Factor::condense`) other prescribed unknowns,
/// another diagonal.
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
    /// A + D with rows and columns of prescribed unknowns zeroed: what is factorised where the factor is
    /// not condensed.
    modified: Option<Matrix>,
    /// b − (A + D) x.
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
            norm: 0.0,
            first_norm: 0.0,
            scaling: Vec::new(),
            preconditioned: zeros()?,
            direction: zeros()?,
            image: zeros()?,
        })
    }

    /// The factor.
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// The factor alone.
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

    /// Whether the factor that there is serves for the system: a condensed one is made that of the same
    /// unknowns prescribed, with the same diagonal.
    fn restrict(&mut self, system: LinearSystem) -> Result<bool, PetscError> {
        if !self.factor.exists() || !self.factor.is_condensed(system.matrix)? {
            return Ok(self.factor.exists());
        }
        let (prescribed, added) = (system.prescribed, system.added);
        let restrict = || self.factor.restrict(prescribed.unwrap_or(&[]), added.unwrap_or(&[]));
        system.book(|booking| booking.restriction, 0.0, restrict)
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
        if !self.restrict(system)? {
            return Ok(SolveReport::default());
        }
        let mut report = self.start(system, b, x, limit)?;
        self.iterate_choosing(system, x, (limit, MOST_ITERATIONS), None, &mut report)?;
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
        self.solve_choosing(system, b, x, limit, None)
    }

    /// As [`Self::solve_renewing`]; before the first iteration, unless the start is a solution, other
    /// unknowns may be chosen to be prescribed, if the factor is condensed: for the matrix that it was made
    /// of the choice and the answer are exact.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn solve_choosing(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &mut Vector,
        limit: f64,
        mut choose: Option<Choose>,
    ) -> Result<SolveReport, PetscError> {
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
    fn iterate_choosing(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        (limit, most): (f64, usize),
        choose: Option<Choose>,
        report: &mut SolveReport,
    ) -> Result<Option<Vec<usize>>, PetscError> {
        if !report.converged {
            self.set_scaling(system)?;
        }
        let condensed = !report.converged && self.factor.is_condensed(system.matrix)?;
        let Some(choose) = choose.filter(|_| condensed) else {
            self.iterate(system, x, (limit, most), false, report)?;
            return Ok(None);
        };
        let chosen = self.apply_factor(system, Some(choose))?;
        let Some(chosen) = chosen else {
            self.iterate(system, x, (limit, most), true, report)?;
            return Ok(None);
        };
        report.iterations += 1;
        let system = LinearSystem { prescribed: Some(&chosen), ..system };
        x.axpby(1.0, &self.preconditioned, 1.0)?;
        system.multiply(&self.preconditioned, &mut self.image)?;
        self.residual.axpby(-1.0, &self.image, 1.0)?;
        report.converged = self.is_reached(system, limit)?;
        self.iterate(system, x, (limit, most), false, report)?;
        Ok(Some(chosen))
    }

    /// E, of the factored matrix and this one; 1 where there is no quotient.
    fn set_scaling(&mut self, system: LinearSystem) -> Result<(), PetscError> {
        let mut diagonal = system.matrix.diagonal()?;
        if !self.factor.is_condensed(system.matrix)? {
            system.added.iter().copied().flatten().for_each(|&(i, d)| diagonal[i] += d);
        }
        let quotient = |(old, new): (&f64, &f64)| if old * new > 0.0 { old / new } else { 1.0 };
        self.scaling.clear();
        self.scaling.extend(self.factor.diagonal().iter().zip(&diagonal).map(quotient));
        Ok(())
    }

    /// z ← P⁻¹E r with 0 on prescribed unknowns; or with those that are chosen, if they are others, and
    /// the changes of them.
    fn apply_factor(
        &mut self,
        system: LinearSystem,
        choose: Option<Choose>,
    ) -> Result<Option<Vec<usize>>, PetscError> {
        let (bytes, z) = (self.factor.bytes_per_application(), &mut self.preconditioned);
        let r = &mut self.free_residual;
        if choose.is_some() {
            r.axpby(1.0, &self.residual, 0.0)?;
        }
        r.write(|r| r.iter_mut().zip(&self.scaling).for_each(|(r, e)| *r *= e))?;
        let apply = || match choose {
            Some(choose) => self.factor.apply_choosing(r, z, choose),
            None => self.factor.apply(r, z).map(|()| None),
        };
        let chosen = system.book(|booking| booking.triangular_solves, bytes, apply)?;
        if chosen.is_none() {
            system.clear_prescribed(&mut self.preconditioned)?;
        }
        Ok(chosen)
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
        self.first_norm = self.norm;
        Ok(SolveReport { converged, ..SolveReport::default() })
    }

    /// Whether ‖r‖₂ ≤ `limit` on the free unknowns; never where the norm overflows, as the limit of a
    /// huge b does too.
    fn is_reached(&mut self, system: LinearSystem, limit: f64) -> Result<bool, PetscError> {
        self.free_residual.axpby(1.0, &self.residual, 0.0)?;
        system.clear_prescribed(&mut self.free_residual)?;
        self.norm = self.free_residual.norm()?;
        Ok(self.norm.is_finite() && self.norm <= limit)
    }

    /// Flexible conjugate gradients from x and its residual r, with P the factored matrix and K = A + D.
    /// Until ‖r‖₂ ≤ `limit` on the free unknowns, and at most so many times:
    ///
    /// ```text
    /// z = P⁻¹E r,   β = − zᵀKp / pᵀKp, at first 0,   p ← z + β p,
    /// α = rᵀp / pᵀKp,   x ← x + α p,   r ← r − α K p.
    /// ```
    ///
    /// r, z and p are 0 on prescribed unknowns in all of this; K is not positive definite if rᵀp or pᵀKp
    /// is not positive. The first z may be there already (`preconditioned`).
    fn iterate(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        (limit, most): (f64, usize),
        mut preconditioned: bool,
        report: &mut SolveReport,
    ) -> Result<(), PetscError> {
        let mut stiffness = None;
        for _ in 0..most {
            if report.converged {
                break;
            }
            report.iterations += 1;
            if !take(&mut preconditioned) {
                self.apply_factor(system, None)?;
            }
            let conjugate = |last: f64| Ok(-self.image.dot(&self.preconditioned)? / last);
            let beta = stiffness.map_or(Ok(0.0), conjugate)?;
            self.direction.axpby(1.0, &self.preconditioned, beta)?;
            system.multiply(&self.direction, &mut self.image)?;
            let last = *stiffness.insert(self.direction.dot(&self.image)?);
            let energy = self.residual.dot(&self.direction)?;
            if !(last > 0.0 && energy > 0.0) {
                break;
            }
            x.axpby(energy / last, &self.direction, 1.0)?;
            self.residual.axpby(-energy / last, &self.image, 1.0)?;
            report.converged = self.is_reached(system, limit)?;
        }
        let reduction = |norm: f64| (self.first_norm / norm).ln();
        let (asked, reached) = (reduction(limit), reduction(self.norm));
        self.factor.end_solve(Reduction { asked, reached });
        Ok(())
    }
}
