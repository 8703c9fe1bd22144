//! How far an answer may be off although its KKT residuals are small.

use super::Equilibrium;
use crate::{
    evolution::{Accuracy, Setting, State},
    fem::Stiffness,
    petsc::{LinearSolver, PetscError, Session, Vector},
};

impl Equilibrium<'_> {
    /// Estimates the errors of the answers `states`, of which the first is the last of a run: of
    /// the displacement the largest of them, of the energy that of the first. Costs a factorisation
    /// for each, in the place of the solver's own.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accuracy(self, states: &[&State]) -> Result<Accuracy, PetscError> {
        let (setting, mut stiffness) = (self.setting, self.stiffness);
        drop(self.solver);
        let mut accuracy = Accuracy::default();
        if let Some(last) = states.first() {
            let (body, elasticity) = (&setting.body, &setting.elasticity);
            accuracy.energy = elasticity.energy_error(body, &last.zeta_mean, &last.u)?;
            accuracy.time = last.time;
        }
        for state in states {
            let displacement = displacement_error(self.session, setting, &mut stiffness, state)?;
            if displacement > accuracy.displacement {
                (accuracy.displacement, accuracy.time) = (displacement, state.time);
            }
        }
        Ok(accuracy)
    }
}

/// max |K⁻¹(f − Ku)| / max |u|, the pressing nodes held: the correction that the residual
/// forces ask for.
fn displacement_error(
    session: &Session,
    setting: &Setting,
    stiffness: &mut Stiffness,
    state: &State,
) -> Result<f64, PetscError> {
    let size = setting.body.partition.largest(&state.u);
    if size == 0.0 {
        return Ok(0.0);
    }
    stiffness.refill(&state.zeta_mean)?;
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

    let mut rhs = Vector::zeros(session, 2 * body.partition.owned())?;
    let mut correction = Vector::zeros(session, 2 * body.partition.owned())?;
    rhs.set(&residual[..rhs.owned()])?;
    stiffness.matrix.hold(&pressing, stiffness.scale)?;
    let mut solver = LinearSolver::cholesky(session, "elastic_", 2 * body.partition.total())?;
    solver.factorise(&stiffness.matrix)?;
    // One digit of an error is enough.
    if !solver.solve(&rhs, &mut correction, 0.1 * rhs.norm()?)?.converged {
        return Ok(f64::INFINITY);
    }
    let mut correction = body.partition.field(correction.read(<[f64]>::to_vec)?, 2)?;
    constraints.frames.displacement_from_frame(&mut correction);
    setting.motions.remove_free(body, &mut correction);
    Ok(body.partition.largest(&correction) / size)
}
