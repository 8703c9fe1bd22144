//! How far an answer may be off although its KKT residuals are small.

use super::Equilibrium;
use crate::{
    evolution::{Accuracy, State},
    petsc::{LinearSolver, PetscError, Vector},
};

impl Equilibrium<'_> {
    /// Estimates the errors of the last answer; costs a factorisation, in the place of the
    /// solver's own.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accuracy(self, state: &State) -> Result<Accuracy, PetscError> {
        let setting = self.setting;
        let energy = setting.elasticity.energy_error(&setting.body, &state.zeta_mean, &state.u)?;
        let displacement = self.displacement_error(state)?;
        Ok(Accuracy { displacement, energy })
    }

    /// max |K⁻¹(f − Ku)| / max |u|, the pressing nodes held: the correction that the residual
    /// forces ask for.
    fn displacement_error(mut self, state: &State) -> Result<f64, PetscError> {
        let setting = self.setting;
        let size = setting.body.partition.largest(&state.u);
        if size == 0.0 {
            return Ok(0.0);
        }
        self.fill(&state.zeta_mean)?;
        let (body, constraints) = (&setting.body, &setting.constraints);
        let internal = setting.elasticity.internal_force(body, &state.zeta_mean, &state.u);
        let external = setting.loads.at(body, state.time);
        let mut residual: Vec<f64> = external.iter().zip(&internal).map(|(f, r)| f - r).collect();
        constraints.frames.force_to_frame(&mut residual);
        let active = state.contact.iter().filter(|point| point.active);
        let bounds = active.filter_map(|p| constraints.bound_along(p.node, p.normal));
        let mut pressing: Vec<usize> = bounds.map(|i| constraints.bounds[i].dof).collect();
        pressing.dedup();
        pressing.iter().for_each(|&dof| residual[dof] = 0.0);
        let fixed = constraints.frames.fixed();
        residual.iter_mut().zip(fixed).filter(|(_, on)| **on).for_each(|(r, _)| *r = 0.0);

        let mut rhs = Vector::zeros(self.session, self.c.owned())?;
        let mut correction = Vector::zeros(self.session, self.c.owned())?;
        rhs.set(&residual[..rhs.owned()])?;
        drop(self.solver);
        let scale = self.stiffness.scale;
        let mut matrix = self.stiffness.into_matrix();
        matrix.hold(&pressing, scale)?;
        let mut solver =
            LinearSolver::cholesky(self.session, "elastic_", 2 * body.partition.total())?;
        solver.factorise(&matrix)?;
        // One digit of an error is enough.
        if !solver.solve(&rhs, &mut correction, 0.1 * rhs.norm()?)?.converged {
            return Ok(f64::INFINITY);
        }
        let mut correction = body.partition.field(correction.read(<[f64]>::to_vec)?, 2)?;
        constraints.frames.displacement_from_frame(&mut correction);
        setting.motions.remove_free(body, &mut correction);
        Ok(body.partition.largest(&correction) / size)
    }
}
