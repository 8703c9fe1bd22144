//! How far an answer may be off although its KKT residuals are small.

use super::ContactStep;
use crate::{
    cholesky::{LinearSolver, LinearSystem, Precision},
    evolution::{Accuracy, DiscreteProblem, State, Step},
    fem::{RigidPart, Stiffness},
    petsc::{PetscError, Session, Vector},
};

/// A deformation below this part of a rigid motion is taken for rounding.
const CARRIED: f64 = 1e-11;
/// A part of the promised error that an estimate may reach before another is made.
const SAFE: f64 = 0.1;

impl ContactStep<'_> {
    /// Estimates the errors of the `last` answer of a run, and of the `worst` one before it, whose
    /// stationarity is given, relative to the displacements of the `largest` one. Costs a
    /// factorisation, in the place of the solver's own; a second one if the first error, enlarged as
    /// the residual of the worst answer is, comes near to what is promised.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accuracy(
        self,
        last: &Step,
        worst: Option<&(f64, State)>,
        largest: Option<&(f64, State)>,
    ) -> Result<Accuracy, PetscError> {
        let (session, problem, stiffness) = (self.session, self.problem, self.stiffness);
        let (body, elasticity, state) = (&problem.body, &problem.elasticity, &last.state);
        drop(self.solver);
        let last_size = (last.record.displacement_max, state);
        let (size, resolved) = largest.map_or(last_size, |(size, state)| (*size, state));
        let [rigid, rest] = RigidPart::of(body, &resolved.u).sizes(body, &resolved.u);
        // What is only carried along has no strains but rounding.
        let energy = match rest > CARRIED * rigid {
            true => elasticity.energy_error(body, &resolved.zeta_mean, &resolved.u)?,
            false => 0.0,
        };
        let displacement = displacement_error(session, problem, stiffness, state, size)?;
        let accuracy = Accuracy { displacement, energy, time: state.time };
        let Some((residual, state)) = worst else { return Ok(accuracy) };
        let expected = displacement * (residual / last.record.kkt_stationarity).max(1.0);
        if expected <= SAFE * Accuracy::promised(problem.tolerance) {
            return Ok(accuracy);
        }
        let stiffness = Stiffness::new(session, body, elasticity, &problem.constraints.bases)?;
        let displacement = displacement_error(session, problem, stiffness, state, size)?;
        Ok(match displacement > accuracy.displacement {
            true => Accuracy { displacement, time: state.time, ..accuracy },
            false => accuracy,
        })
    }
}

/// max |K⁻¹(f − Ku)| / `size`, the active nodes fixed: the correction that the residual forces ask
/// for.
fn displacement_error(
    session: &Session,
    problem: &DiscreteProblem,
    mut stiffness: Stiffness,
    state: &State,
    size: f64,
) -> Result<f64, PetscError> {
    if size == 0.0 || problem.body.partition.largest(&state.u) == 0.0 {
        return Ok(0.0);
    }
    stiffness.refill(&state.zeta_mean)?;
    let (body, constraints) = (&problem.body, &problem.constraints);
    let internal = problem.elasticity.internal_force(body, &state.zeta_mean, &state.u);
    let external = problem.load(state.time);
    let mut residual: Vec<f64> = external.iter().zip(&internal).map(|(f, r)| f - r).collect();
    constraints.bases.force_to_local(&mut residual);
    let active = state.contact.iter().filter(|point| point.active);
    let bounds = active.filter_map(|p| constraints.bound_along(p.node, p.normal));
    let mut pressing: Vec<usize> = bounds.map(|i| constraints.bounds[i].dof).collect();
    pressing.dedup();
    pressing.iter().for_each(|&dof| residual[dof] = 0.0);
    let fixed = constraints.bases.fixed();
    residual.iter_mut().zip(fixed).filter(|(_, on)| **on).for_each(|(r, _)| *r = 0.0);

    let mut rhs = Vector::zeros(session, 2 * body.partition.owned())?;
    let mut correction = Vector::zeros(session, 2 * body.partition.owned())?;
    rhs.set(&residual[..rhs.owned()])?;
    let mut solver = LinearSolver::new(session, "elastic_", rhs.owned(), Precision::Full)?;
    let scale = stiffness.scale;
    let mut matrix = stiffness.into_matrix();
    matrix.zero_rows_columns(&pressing, scale)?;
    let system = LinearSystem::of(&matrix);
    solver.factorise(system)?;
    // One digit of an error is enough.
    if !solver.solve(system, &rhs, &mut correction, 0.1 * rhs.norm()?)?.converged {
        return Ok(f64::INFINITY);
    }
    let mut correction = body.partition.field(correction.read(<[f64]>::to_vec)?, 2)?;
    constraints.bases.displacement_to_global(&mut correction);
    problem.motions.remove_free(body, &mut correction);
    Ok(body.partition.largest(&correction) / size)
}
