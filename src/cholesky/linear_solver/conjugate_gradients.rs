//! The iteration itself, with the factor that there is.

use super::{Choose, LinearSolver, SolveReport};
use crate::{
    cholesky::{LinearSystem, Reduction},
    petsc::{PetscError, Vector},
};
use std::mem::take;

impl LinearSolver {
    /// r ← b − A x, and whether that is small enough already.
    pub(super) fn start(
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
    pub(super) fn is_reached(
        &mut self,
        system: LinearSystem,
        limit: f64,
    ) -> Result<bool, PetscError> {
        self.free_residual.axpby(1.0, &self.residual, 0.0)?;
        system.clear_prescribed(&mut self.free_residual)?;
        self.norm = self.free_residual.norm()?;
        Ok(self.norm.is_finite() && self.norm <= limit)
    }

    /// E, of the factored matrix and this one; 1 where there is no quotient.
    pub(super) fn set_scaling(&mut self, system: LinearSystem) -> Result<(), PetscError> {
        let diagonal = system.matrix.diagonal()?;
        let quotient = |(old, new): (&f64, &f64)| if old * new > 0.0 { old / new } else { 1.0 };
        self.scaling.clear();
        self.scaling.extend(self.factor.diagonal().iter().zip(&diagonal).map(quotient));
        Ok(())
    }

    /// z ← P⁻¹E r with 0 on prescribed unknowns; or with those that are chosen, if they are others, and
    /// the changes of them.
    pub(super) fn apply_factor<E: From<PetscError>>(
        &mut self,
        system: LinearSystem,
        choose: Option<Choose<E>>,
    ) -> Result<Option<Vec<usize>>, E> {
        let (bytes, z) = (self.factor.bytes_per_application(), &mut self.preconditioned);
        let r = &mut self.free_residual;
        if choose.is_some() {
            r.axpby(1.0, &self.residual, 0.0)?;
        }
        r.write(|r| r.iter_mut().zip(&self.scaling).for_each(|(r, e)| *r *= e))?;
        let apply = || match choose {
            Some(choose) => self.factor.apply_choosing(r, z, choose),
            None => Ok(self.factor.apply(r, z).map(|()| None)?),
        };
        let chosen = system.book(|booking| booking.triangular_solves, bytes, apply)?;
        if chosen.is_none() {
            system.clear_prescribed(&mut self.preconditioned)?;
        }
        Ok(chosen)
    }

    /// Flexible conjugate gradients from x and its residual r, with P the factored matrix, until
    /// ‖r‖₂ ≤ `limit` on the free unknowns, and at most so many times:
    ///
    /// ```text
    /// z = P⁻¹E r,   β = − zᵀAp / pᵀAp, at first 0,   p ← z + β p,
    /// α = rᵀp / pᵀAp,   d ← d + α p, at first α p,   r ← r − α A p,   in the end x ← x + d.
    /// ```
    ///
    /// r, z, p and d are 0 on prescribed unknowns in all of this; A is not positive definite if rᵀp or pᵀAp
    /// is not positive. The first z may be there already (`preconditioned`).
    ///
    /// x is rounded once and not in each iteration, so that r stays nearer to b − A x (van der Vorst and Ye,
    /// SIAM J. Sci. Comput. 22, 2000).
    pub(super) fn iterate(
        &mut self,
        system: LinearSystem,
        x: &mut Vector,
        (limit, most): (f64, usize),
        mut preconditioned: bool,
        report: &mut SolveReport,
    ) -> Result<(), PetscError> {
        let (mut stiffness, mut corrected) = (None, false);
        for _ in 0..most {
            if report.converged {
                break;
            }
            report.iterations += 1;
            if !take(&mut preconditioned) {
                self.apply_factor::<PetscError>(system, None)?;
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
            self.correction.axpby(energy / last, &self.direction, f64::from(corrected))?;
            corrected = true;
            self.residual.axpby(-energy / last, &self.image, 1.0)?;
            report.converged = self.is_reached(system, limit)?;
        }
        if corrected {
            x.axpby(1.0, &self.correction, 1.0)?;
        }
        let reduction = |norm: f64| (self.first_norm / norm).ln();
        let (asked, reached) = (reduction(limit), reduction(self.norm));
        self.factor.end_solve(Reduction { asked, reached });
        Ok(())
    }
}
