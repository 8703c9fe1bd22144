//! Estimates the errors of an answer whose KKT residuals are small.

use super::{ContactStep, active_bounds, displacement};
use crate::{
    evolution::{DiscreteProblem, Outcome, State},
    fem::Stiffness,
    linear::{LinearSolver, LinearSystem},
    petsc::{PetscError, Vector},
};

/// The promised relative error of displacements is the larger of this and `TOLERANCES` times the KKT tolerance.
/// Residuals of rounding above it are accepted only if the tolerance allows them or their effect on u is small.
pub(super) const MAX_ROUNDING: f64 = 1e-6;
const TOLERANCES: f64 = 100.0;
/// A mesh is too coarse if the estimated relative error in the energy norm is larger. The displacement under the
/// load is then too small by about the square of this error.
const COARSE: f64 = 0.5;

/// Estimated errors of an answer, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Accuracy {
    /// The error of u over max |u|, against the exact discrete answer with the same active nodes. KKT residuals
    /// bound forces; with an ill-conditioned K, small forces move u far. Infinite if the active nodes alone do not
    /// support the body.
    ///
    /// The larger error of two steps: the last one, and the one with the maximum stationarity residual.
    pub displacement: f64,
    /// PETSc's reason if a KSP of PETSc options could not estimate this error, which is infinite then.
    pub gave_up: Option<&'static str>,
    /// The time of this step, s.
    pub time: f64,
    /// The discretisation error in the energy norm in the last step. If it is unloaded: in the
    /// step with the maximum displacement. Only [`estimate`](crate::estimate) sets it.
    pub energy: f64,
}

impl Accuracy {
    /// The promised relative error of displacements at a KKT tolerance.
    pub fn promised(tolerance: f64) -> f64 {
        MAX_ROUNDING.max(TOLERANCES * tolerance)
    }

    /// Notes for the user on these errors at a KKT tolerance; none if they are small.
    pub fn notes(&self, tolerance: f64) -> Vec<String> {
        let (displacement, time) = (self.displacement, self.time);
        let support = match (displacement, self.gave_up) {
            (f64::INFINITY, Some(reason)) => Some(format!(
                "at t = {time:.4e}, PETSc's KSP ended with {reason} above its tolerance: the error of the \
                 displacements cannot be estimated; change the options -elastic_ksp_… and -elastic_pc_…"
            )),
            (f64::INFINITY, None) => Some(format!(
                "at t = {time:.4e}, the active contact nodes alone do not support the body: the error of \
                 the displacements cannot be estimated"
            )),
            _ => (displacement > Self::promised(tolerance)).then(|| {
                format!(
                    "the stiffness is ill-conditioned (a slender or very soft part?): displacements \
                     at t = {time:.4e} are exact only to about {displacement:.0e} of the largest, \
                     although the residuals are small"
                )
            }),
        };
        let energy = (self.energy > COARSE).then(|| {
            format!(
                "the mesh is too coarse: strains jump between triangles by about {:.0} % (energy \
                 norm), and displacements may be far too small; use smaller or less stretched \
                 triangles, several across a part that bends",
                100.0 * self.energy
            )
        });
        [support, energy].into_iter().flatten().collect()
    }
}

/// Displacements caused by small forces at a state of a run, with the active nodes fixed.
pub(crate) struct FixedContact<'a> {
    problem: &'a DiscreteProblem,
    stiffness: Stiffness,
    /// The fixed unknowns.
    active: Vec<usize>,
    solver: LinearSolver,
    gave_up: Option<&'static str>,
    rhs: Vector,
    answer: Vector,
}

impl<'a> ContactStep<'a> {
    /// The solver with the contact of a state kept fixed, with the factor of the last solve.
    pub(crate) fn into_fixed_contact(self) -> Result<FixedContact<'a>, PetscError> {
        let Self { problem, stiffness, elastic: mut solver, load, c, .. } = self;
        let bounded = problem.constraints.bounds.iter().map(|bound| bound.dof);
        solver.factor().set_condensed(&stiffness.matrix, bounded)?;
        let (active, gave_up, rhs, answer) = (Vec::new(), None, load, c);
        Ok(FixedContact { problem, stiffness, active, solver, gave_up, rhs, answer })
    }
}

impl FixedContact<'_> {
    /// Estimates the errors of the last step of a run, relative to the maximum displacement. The step with the
    /// maximum stationarity residual follows if the first error times the ratio of the residuals comes near the
    /// promised error. The kept factor is usually good enough.
    pub(crate) fn accuracy(&mut self, outcome: &Outcome) -> Result<Accuracy, PetscError> {
        let problem = self.problem;
        let last = &outcome.last;
        let max = outcome.most_displaced().record.displacement_max;
        let displacement = self.displacement_error(&last.state, max)?;
        let (gave_up, time) = (self.gave_up, last.state.time);
        let mut accuracy = Accuracy { displacement, gave_up, energy: 0.0, time };
        let Some(worst) = &outcome.least_accurate else { return Ok(accuracy) };
        let ratio = worst.record.kkt_stationarity / last.record.kkt_stationarity;
        let expected = displacement * ratio.max(1.0);
        if expected <= Accuracy::promised(problem.tolerance) {
            return Ok(accuracy);
        }
        let displacement = self.displacement_error(&worst.state, max)?;
        if displacement > accuracy.displacement {
            let (gave_up, time) = (self.gave_up, worst.state.time);
            accuracy = Accuracy { displacement, gave_up, time, ..accuracy };
        }
        Ok(accuracy)
    }

    /// max |K⁻¹(f − Ku)| / `max` with the active nodes fixed: the correction by the residual forces.
    fn displacement_error(&mut self, state: &State, max: f64) -> Result<f64, PetscError> {
        let problem = self.problem;
        if max == 0.0 || problem.body.nodes.partition.max_norm(&state.u) == 0.0 {
            return Ok(0.0);
        }
        let zeta = problem.zeta_at_points(&state.zeta);
        let internal = problem.terms.internal_force(&problem.body, &zeta, &state.u);
        let mut residual = problem.motions.balanced(&problem.body, problem.load(state.time));
        residual.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
        let DiscreteProblem { body, constraints, .. } = problem;
        let flags = active_bounds(constraints, &state.contact, 0.0);
        let active = constraints.bounds.iter().zip(flags).filter(|(_, active)| *active > 0.0);
        self.active = active.map(|(bound, _)| bound.dof).collect();
        self.stiffness.set_damage(body, &zeta);
        let correction = self.displacement(residual)?;
        let max_norm = |u: Vec<f64>| problem.body.nodes.partition.max_norm(&u) / max;
        Ok(correction.map_or(f64::INFINITY, max_norm))
    }

    /// K(ζ)⁻¹ times nodal `forces`, N per metre of thickness, with the active nodes fixed: to one digit or
    /// more. `None` if these nodes do not support the body. Collective.
    fn displacement(&mut self, mut forces: Vec<f64>) -> Result<Option<Vec<f64>>, PetscError> {
        let Self { problem, stiffness, active, solver, gave_up, rhs, answer } = self;
        let bases = &problem.constraints.bases;
        bases.force_to_local(&mut forces);
        bases.zero_fixed(&mut forces);
        active.iter().for_each(|&dof| forces[dof] = 0.0);
        rhs.set(&forces[..rhs.owned()])?;
        answer.write(|u| u.fill(0.0))?;
        let norm = rhs.norm()?;
        // With an old factor, the error may have one digit less than the residual.
        let prescribed = problem.body.nodes.partition.comm().any(!active.is_empty());
        let system = LinearSystem {
            prescribed: prescribed.then_some(&active[..]),
            scale: stiffness.scale,
            ..LinearSystem::of(&stiffness.matrix)
        };
        let solved = solver.solve_renewing(system, rhs, answer, 0.01 * norm)?;
        *gave_up = solved.gave_up;
        solved.converged.then(|| displacement(problem, vec![0.0; forces.len()], answer)).transpose()
    }
}
