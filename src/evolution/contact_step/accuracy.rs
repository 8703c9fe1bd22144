//! How large the errors of an answer may be although its KKT residuals are small.

use super::{ContactStep, active_bounds, displacement};
use crate::{
    cholesky::{LinearSolver, LinearSystem, Precision},
    evolution::{DiscreteProblem, Outcome, State, Step},
    fem::{RigidPart, Stiffness},
    petsc::{PetscError, Session, Vector},
};
use std::rc::Rc;

/// Displacements are promised to this, relative, or to `TOLERANCES` times the KKT tolerance.
const DISPLACEMENT: f64 = 1e-6;
const TOLERANCES: f64 = 100.0;
/// A mesh is too coarse if the energy norm is estimated to be off by more than this: the
/// displacement under the load is then too small by about the square of it.
const COARSE: f64 = 0.5;
/// The discretisation is judged at the last step, unless its displacements are less than this part of
/// the largest.
const UNLOADED: f64 = 0.01;
/// A deformation below this part of a rigid motion is taken for rounding.
const CARRIED: f64 = 1e-11;
/// An estimate up to this part of the promised error is not repeated for another step.
const SAFE: f64 = 0.1;

/// Estimated errors of an answer, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Accuracy {
    /// Of the largest displacement, against the exact answer of the discrete problem with the
    /// same active nodes. The KKT residuals bound forces; where K is ill-conditioned small
    /// forces move u far. Infinite where the active nodes alone do not support the body.
    ///
    /// The larger of two: of the last step, and of the step with the largest stationarity residual.
    pub displacement: f64,
    /// The time of the step of which `displacement` is, s.
    pub time: f64,
    /// Of the discretisation in the last step, in the energy norm
    /// ([`RecoveredStrains`](crate::fem::RecoveredStrains)); where that is unloaded, in the step of the
    /// largest displacement.
    pub energy: f64,
}

impl Accuracy {
    /// How exact displacements should be, relative, at a KKT tolerance.
    pub fn promised(tolerance: f64) -> f64 {
        DISPLACEMENT.max(TOLERANCES * tolerance)
    }

    /// What the user should know about these errors at a KKT tolerance; nothing if they are small.
    pub fn notes(&self, tolerance: f64) -> Vec<String> {
        let mut notes = Vec::new();
        if self.displacement.is_infinite() {
            notes.push(format!(
                "at t = {:.4e}, the active contact nodes alone do not support the body: how exact the \
                 displacements are cannot be estimated",
                self.time
            ));
        } else if self.displacement > Self::promised(tolerance) {
            notes.push(format!(
                "the stiffness is ill-conditioned (a slender or very soft part?): small as the residuals \
                 are, displacements are exact only to about {:.0e} of the largest at t = {:.4e}",
                self.displacement, self.time
            ));
        }
        if self.energy > COARSE {
            notes.push(format!(
                "the mesh is too coarse for this answer: strains jump from triangle to triangle \
                 by about {:.0} % (energy norm), and displacements may be far too small; use \
                 smaller or less stretched triangles, several across a part that bends",
                100.0 * self.energy
            ));
        }
        notes
    }
}

impl ContactStep<'_> {
    /// Estimates the errors of the last answer of a run, and of the one with the largest stationarity
    /// residual before it, relative to the largest displacement. Costs a factorisation, in the place
    /// of the solver's own; a second one if the first error, enlarged by the ratio of the two
    /// residuals, comes near to what is promised.
    ///
    /// # Errors
    /// PETSc failed.
    pub(in crate::evolution) fn accuracy(self, outcome: &Outcome) -> Result<Accuracy, PetscError> {
        let Self { session, problem, stiffness, solver, .. } = self;
        drop(solver);
        let (body, elasticity) = (&problem.body, &problem.elasticity);
        let last = &outcome.last;
        let larger =
            |before: &&Rc<Step>| before.record.displacement_max > last.record.displacement_max;
        let most = outcome.most_displaced.as_ref().filter(larger).map_or(last, Rc::as_ref);
        let max = most.record.displacement_max;
        // What is left of u after unloading is judged less well than what there was.
        let judged = if last.record.displacement_max < UNLOADED * max { most } else { last };
        let State { u, zeta, .. } = &judged.state;
        let [rigid, rest] = RigidPart::of(body, u).max_norms(body, u);
        // What is only carried along has no strains but rounding.
        let energy = match rest > CARRIED * rigid {
            true => problem.energy_error(zeta, u)?,
            false => 0.0,
        };
        let displacement = displacement_error(session, problem, stiffness, &last.state, max)?;
        let mut accuracy = Accuracy { displacement, energy, time: last.state.time };
        let Some(worst) = &outcome.least_accurate else { return Ok(accuracy) };
        let ratio = worst.record.kkt_stationarity / last.record.kkt_stationarity;
        let expected = displacement * ratio.max(1.0);
        if expected <= SAFE * Accuracy::promised(problem.tolerance) {
            return Ok(accuracy);
        }
        let stiffness = Stiffness::new(session, body, elasticity, &problem.constraints.bases)?;
        let displacement = displacement_error(session, problem, stiffness, &worst.state, max)?;
        if displacement > accuracy.displacement {
            accuracy = Accuracy { displacement, time: worst.state.time, ..accuracy };
        }
        Ok(accuracy)
    }
}

/// max |K⁻¹(f − Ku)| / `max`, the active nodes fixed: the correction that the residual forces ask
/// for.
fn displacement_error(
    session: &Session,
    problem: &DiscreteProblem,
    mut stiffness: Stiffness,
    state: &State,
    max: f64,
) -> Result<f64, PetscError> {
    if max == 0.0 || problem.body.nodes.partition.max_norm(&state.u) == 0.0 {
        return Ok(0.0);
    }
    let zeta_at_points = problem.zeta_at_points(&state.zeta);
    stiffness.refill(&zeta_at_points)?;
    let (body, constraints) = (&problem.body, &problem.constraints);
    let internal = problem.elasticity.internal_force(body, &zeta_at_points, &state.u);
    let mut residual = problem.load(state.time);
    residual.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
    constraints.bases.force_to_local(&mut residual);
    constraints.bases.zero_fixed(&mut residual);
    let flags = active_bounds(constraints, &state.contact, 0.0);
    let active = constraints.bounds.iter().zip(flags).filter(|(_, active)| *active > 0.0);
    let active: Vec<usize> = active.map(|(bound, _)| bound.dof).collect();
    active.iter().for_each(|&dof| residual[dof] = 0.0);

    let mut rhs = Vector::zeros(session, 2 * body.nodes.partition.owned())?;
    let mut correction = Vector::zeros(session, 2 * body.nodes.partition.owned())?;
    rhs.set(&residual[..rhs.owned()])?;
    let mut solver = LinearSolver::new(session, "elastic_", rhs.owned(), Precision::Full)?;
    let scale = stiffness.scale;
    let mut matrix = stiffness.into_matrix();
    matrix.zero_rows_columns(&active, scale)?;
    let system = LinearSystem::of(&matrix);
    solver.factorise(system)?;
    // One digit of an error is enough.
    if !solver.solve(system, &rhs, &mut correction, 0.1 * rhs.norm()?)?.converged {
        return Ok(f64::INFINITY);
    }
    let correction = displacement(problem, vec![0.0; residual.len()], &correction)?;
    Ok(body.nodes.partition.max_norm(&correction) / max)
}
