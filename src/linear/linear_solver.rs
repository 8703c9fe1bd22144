//! Linear systems by a KSP of PETSc on a preconditioner that is kept.

mod preconditioner;

use super::{
    CondensedSystem, Factor, LinearSystem, Precision, Reduction, linear_system::TRIANGULAR_SOLVES,
};
use crate::petsc::{Ksp, KspProblem, Matrix, PetscError, Session, Vector, stage};
use preconditioner::TimedFactor;
use std::mem::take;

/// A KSP, by default conjugate gradients with a [`Factor`] of this matrix or of an earlier one. PETSc options
/// may choose another preconditioner. If the matrix is too large for a factor, a preconditioner of PETSc
/// replaces it.
///
/// The KSP solves A d = b − A x for the correction d of a start x, and begins with d = 0. So x is rounded
/// once, not in each iteration, and the residual stays close to b − A x (van der Vorst and Ye, SIAM J. Sci.
/// Comput. 22, 2000).
pub struct LinearSolver {
    ksp: Ksp,
    prefix: String,
    factor: Factor,
    /// The number of rows for which the preconditioner was chosen, and whether it is the factor.
    chosen: Option<(usize, bool)>,
    /// Does the KSP keep prescribed unknowns at 0, because P⁻¹r is 0 there? The residual there, a reaction, must not count:
    /// conjugate gradients take products with P⁻¹r alone, and the convergence test is ours.
    ignores_reactions: bool,
    /// A with the rows and columns of prescribed unknowns zeroed, for preconditioners of PETSc, and for other KSPs.
    modified: Option<Matrix>,
    /// b − A x.
    residual: Vector,
    /// ‖b − A x‖₂ on the free unknowns, now and at the start.
    norm: f64,
    first_norm: f64,
    /// d.
    correction: Vector,
    /// b of a modified system, with 0 at prescribed unknowns.
    right: Vector,
    /// P⁻¹ r of the first residual, and whether the KSP begins with it.
    expanded: Vector,
    prepared: bool,
    /// Iterations since the start.
    iterations: usize,
}

/// The cost of a linear solve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolveReport {
    /// Did the residual reach its limit?
    pub converged: bool,
    /// Iterations, each a product and a pair of triangular solves.
    pub iterations: usize,
    /// Factorisations, also of a matrix that is not positive definite.
    pub factorisations: usize,
    /// PETSc's reason if a KSP with a preconditioner of PETSc options missed its limit.
    pub gave_up: Option<&'static str>,
}

/// The largest number of iterations with the factor of the system itself. One or two remove the rounding
/// error of the factor; more are needed if the entries of the matrix vary by many orders. `-ksp_max_it`
/// limits the iterations with preconditioners of PETSc.
const MOST_ITERATIONS: usize = 200;

impl LinearSolver {
    /// For systems with `owned` unknowns on this rank. Its PETSc options begin with `prefix`.
    ///
    /// # Errors
    /// The memory does not suffice.
    pub fn new(
        session: &Session,
        prefix: &str,
        owned: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        let zeros = || Vector::zeros(session, owned);
        Ok(Self {
            ksp: Ksp::new(session, prefix, owned)?,
            prefix: prefix.to_owned(),
            factor: Factor::new(session, precision),
            chosen: None,
            ignores_reactions: true,
            modified: None,
            residual: zeros()?,
            norm: 0.0,
            first_norm: 0.0,
            correction: zeros()?,
            right: zeros()?,
            expanded: zeros()?,
            prepared: false,
            iterations: 0,
        })
    }

    /// The factor.
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Solves from the start `x` until ‖b − A x‖₂ ≤ `limit` on the free unknowns, with a new preconditioner if one is
    /// due or the old one needs too many iterations. The solve misses the limit only if the system is not positive definite or too
    /// ill-conditioned.
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
        self.start(system, b, x, limit)?;
        self.finish(system, x, limit)
    }

    /// Solves for two right sides from x = 0, each until ‖b − A x‖₂ ≤ `accuracy` ‖b‖₂, as [`Self::solve_renewing`] does. The
    /// first application of a factor is one for both. It returns whether both reached their limits.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn solve_two(
        &mut self,
        system: LinearSystem,
        b: &[Vector; 2],
        x: &mut [Vector; 2],
        accuracy: f64,
    ) -> Result<bool, PetscError> {
        self.remake(system)?;
        let applies = self.factor.exists() && self.uses_factor(system.matrix)?;
        if applies {
            self.factor.set_scaling(system.matrix)?;
            stage(TRIANGULAR_SOLVES, || self.factor.apply_two(b, x))?;
        } else {
            x.iter_mut().try_for_each(|x| x.write(|x| x.fill(0.0)))?;
        }
        let mut converged = true;
        for (b, x) in b.iter().zip(x) {
            let first = b.norm()?;
            self.start(system, b, x, accuracy * first)?;
            (self.first_norm, self.iterations) = (first, usize::from(applies));
            converged &= self.finish(system, x, accuracy * first)?.converged;
        }
        Ok(converged)
    }

    /// r ← b − A x. Is ‖r‖₂ ≤ `limit` already?
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn start(
        &mut self,
        system: LinearSystem,
        b: &Vector,
        x: &Vector,
        limit: f64,
    ) -> Result<bool, PetscError> {
        self.remake(system)?;
        (self.prepared, self.iterations) = (false, 0);
        system.multiply(x, &mut self.residual)?;
        self.residual.axpby(1.0, b, -1.0)?;
        self.norm = self.residual.free_norm(system.prescribed)?;
        self.first_norm = self.norm;
        if self.norm > limit && self.factor.exists() && self.uses_factor(system.matrix)? {
            self.factor.set_scaling(system.matrix)?;
        }
        Ok(self.is_small(limit))
    }

    /// Is ‖r‖₂ ≤ `limit` on the free unknowns? False if the norm overflows: for a huge b the limit overflows
    /// too.
    fn is_small(&self, limit: f64) -> bool {
        self.norm.is_finite() && self.norm <= limit
    }

    /// Makes a new factor if one is due. Returns the number of factorisations.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn prepare(&mut self, system: LinearSystem) -> Result<usize, PetscError> {
        let due = self.factor.is_due();
        if due {
            self.factorise(system)?;
        }
        Ok(usize::from(due))
    }

    /// Forward elimination: reduces A d = r to the condensed unknowns. `None` without a factor: A is then not
    /// positive definite, whatever unknowns are prescribed. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn condense(&mut self) -> Result<Option<CondensedSystem<'_>>, PetscError> {
        if !self.factor.exists() {
            return Ok(None);
        }
        let Self { factor, residual, .. } = self;
        stage(TRIANGULAR_SOLVES, || factor.condense(residual)).map(Some)
    }

    /// Back substitution: `x` ← `x` + d from the last solution for the condensed unknowns. If no prescribed
    /// unknown has `moved`, the next iteration begins with d instead. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn expand(
        &mut self,
        system: LinearSystem,
        moved: bool,
        x: &mut Vector,
    ) -> Result<(), PetscError> {
        stage(TRIANGULAR_SOLVES, || self.factor.expand(&mut self.expanded))?;
        self.prepared = !moved;
        if moved {
            self.iterations += 1;
            x.axpby(1.0, &self.expanded, 1.0)?;
            system.multiply(&self.expanded, &mut self.correction)?;
            self.residual.axpby(-1.0, &self.correction, 1.0)?;
            self.norm = self.residual.free_norm(system.prescribed)?;
        }
        Ok(())
    }

    /// Solves on from the present residual to `limit`, with a new preconditioner if one is due or the old one
    /// needs too many iterations.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn finish(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        limit: f64,
    ) -> Result<SolveReport, PetscError> {
        let converged = self.is_small(limit);
        let mut report =
            SolveReport { converged, iterations: self.iterations, ..SolveReport::default() };
        if !converged
            && let Some(most) = self.factor.iteration_limit(self.needed_reduction(limit))
            && self.is_ready(system)?
        {
            self.iterate(system, x, (limit, Some(most)), &mut report)?;
        }
        if !report.converged {
            report.factorisations += 1;
            if self.factorise(system)? {
                self.iterate(system, x, (limit, None), &mut report)?;
            }
        }
        Ok(report)
    }

    /// ln(‖r₀‖₂ / `limit`): the reduction of the residual that the solve needs.
    fn needed_reduction(&self, limit: f64) -> f64 {
        (self.first_norm / limit).ln()
    }

    /// Runs the KSP on the present residual until ‖r‖₂ ≤ `limit` on the free unknowns. Without a number of
    /// iterations, a preconditioner of the system itself has its usual limit.
    fn iterate(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        (limit, most): (f64, Option<usize>),
        report: &mut SolveReport,
    ) -> Result<(), PetscError> {
        let most = most.or(self.uses_factor(system.matrix)?.then_some(MOST_ITERATIONS));
        self.prescribe_in_copy(system)?;
        let prescribed = system.prescribed.unwrap_or(&[]);
        let clear = |d: &mut [f64]| prescribed.iter().for_each(|&i| d[i] = 0.0);
        let is_prepared = take(&mut self.prepared);
        let (matrix, b) = match &self.modified {
            Some(matrix) => {
                self.right.axpby(1.0, &self.residual, 0.0)?;
                self.right.write(clear)?;
                (matrix, &self.right)
            }
            None => (system.matrix, &self.residual),
        };
        let problem = KspProblem { matrix, prescribed: system.prescribed, limit, most };
        let first = is_prepared.then_some(&self.expanded);
        let of = self.modified.is_some().then_some(b);
        let mut own = TimedFactor { factor: &mut self.factor, first, of };
        let solved = self.ksp.solve(&problem, &mut own, b, &mut self.correction)?;
        self.norm = solved.norm;
        if self.modified.is_some() {
            self.correction.write(clear)?;
            system.multiply(&self.correction, &mut self.right)?;
            self.residual.axpby(-1.0, &self.right, 1.0)?;
        } else {
            self.residual.axpby(1.0, self.ksp.residual(), 0.0)?;
        }
        x.axpby(1.0, &self.correction, 1.0)?;
        report.iterations += solved.iterations;
        report.converged = self.is_small(limit);
        report.gave_up = solved.reason.filter(|_| !report.converged);
        self.end_solve(report.iterations, self.norm, limit);
        Ok(())
    }

    /// Records a solve for the refactorisation policy: its iterations, and the `norm` that it reached instead
    /// of `limit`.
    pub fn end_solve(&mut self, iterations: usize, norm: f64, limit: f64) {
        let reached = (self.first_norm / norm).ln();
        let reduction = Reduction { asked: self.needed_reduction(limit), reached };
        self.factor.end_solve(Some(iterations), reduction);
    }

    /// b − A x of the last solve. On prescribed unknowns these are the forces that prescribe them.
    pub fn residual(&self) -> &Vector {
        &self.residual
    }
}
