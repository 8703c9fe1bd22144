//! The error of u from the solver, for an answer whose KKT residuals are small.

use super::{ContactStep, active_bounds, displacement};
use crate::{
    evolution::{DiscreteProblem, Outcome, State},
    linear::{LinearSystem, SolveReport},
    petsc::PetscError,
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
                "the error of the displacements at t = {time:.4e} is unknown, as PETSc's KSP ended with {reason} above its \
                 tolerance; change the options -elastic_ksp_… and -elastic_pc_… (explain petsc-options)"
            )),
            (f64::INFINITY, None) => Some(format!(
                "the error of the displacements at t = {time:.4e} is unknown, as the nodes in contact do not support the \
                 body (explain collapse)"
            )),
            _ => (displacement > Self::promised(tolerance)).then(|| {
                format!(
                    "the stiffness is ill-conditioned (a slender or very soft part?): displacements \
                     at t = {time:.4e} are exact only to about {displacement:.0e} of the largest, \
                     although the residuals are small (explain solvers)"
                )
            }),
        };
        let energy = (self.energy > COARSE).then(|| {
            format!(
                "the mesh is too coarse: strains jump between triangles by about {:.0} % (energy \
                 norm), and displacements may be far too small; use smaller or less stretched \
                 triangles, several across a part that bends (explain accuracy)",
                100.0 * self.energy
            )
        });
        [support, energy].into_iter().flatten().collect()
    }
}

impl ContactStep<'_> {
    /// After a run: estimates the errors of its last step, relative to the maximum displacement. The step with the
    /// maximum stationarity residual follows if the first error times the ratio of the residuals comes near the
    /// promised error. The factor of the last solve is usually good enough.
    pub(crate) fn accuracy(&mut self, outcome: &Outcome) -> Result<Accuracy, PetscError> {
        let bounded = self.problem.constraints.bounds.iter().map(|bound| bound.dof);
        self.elastic.factor().set_condensed(&self.stiffness.matrix, bounded)?;
        let max = outcome.most_displaced().record.displacement_max;
        let last = self.of_state(&outcome.last.state, max)?;
        let Some(worst) = &outcome.least_accurate else { return Ok(last) };
        let ratio = worst.record.kkt_stationarity / outcome.last.record.kkt_stationarity;
        if last.displacement * ratio.max(1.0) <= Accuracy::promised(self.problem.tolerance) {
            return Ok(last);
        }
        let worst = self.of_state(&worst.state, max)?;
        Ok(if worst.displacement > last.displacement { worst } else { last })
    }

    /// Estimates max |K⁻¹(f − Ku)| / `max` with the active nodes fixed, to one digit or more: the correction by the
    /// residual forces. Collective.
    fn of_state(&mut self, state: &State, max: f64) -> Result<Accuracy, PetscError> {
        let problem = self.problem;
        let DiscreteProblem { body, constraints, .. } = &**problem;
        let partition = &body.nodes.partition;
        let mut accuracy = Accuracy { time: state.time, ..Accuracy::default() };
        if max == 0.0 || partition.max_norm(&state.u) == 0.0 {
            return Ok(accuracy);
        }
        let zeta = problem.zeta_at_points(&state.zeta);
        let internal = problem.elasticity.internal_force(body, &zeta, &state.u);
        let mut forces = problem.motions.balanced(body, problem.load(state.time));
        forces.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
        let flags = active_bounds(constraints, &state.contact, 0.0);
        let active = constraints.bounds.iter().zip(flags).filter(|(_, active)| *active > 0.0);
        let active: Vec<_> = active.map(|(bound, _)| bound.dof).collect();
        // With an old factor, the error may have one digit less than the residual.
        let (solved, correction) = self.corrected(&zeta, forces, &active, |norm| 0.01 * norm)?;
        accuracy.gave_up = solved.gave_up;
        accuracy.displacement = match solved.converged {
            true => partition.max_norm(&correction) / max,
            false => f64::INFINITY,
        };
        Ok(accuracy)
    }

    /// K⁻¹ f for nodal `forces` f, with ζ at the quadrature points and the unknowns `held` at zero, up to the residual that
    /// `limit` gives for ‖f‖. Collective.
    pub(crate) fn corrected(
        &mut self,
        zeta: &[f64],
        mut forces: Vec<f64>,
        held: &[usize],
        limit: impl Fn(f64) -> f64,
    ) -> Result<(SolveReport, Vec<f64>), PetscError> {
        let Self { problem, stiffness, elastic, load, c, .. } = self;
        let DiscreteProblem { body, constraints, .. } = &***problem;
        constraints.bases.force_to_local(&mut forces);
        constraints.bases.zero_fixed(&mut forces);
        held.iter().for_each(|&dof| forces[dof] = 0.0);
        load.set(&forces[..load.owned()])?;
        c.write(|u| u.fill(0.0))?;
        stiffness.set_damage(body, zeta);
        let comm = body.comm();
        let system = LinearSystem {
            prescribed: comm.any(!held.is_empty()).then_some(held),
            scale: stiffness.scale,
            ..LinearSystem::of(&stiffness.matrix)
        };
        let limit = limit(load.norm()?);
        let solved = elastic.solve_renewing(system, load, c, limit)?;
        Ok((solved, displacement(problem, vec![0.0; forces.len()], c)?))
    }

    /// Bounded unknowns that prevent the motions which contact alone prevents, one for each: the largest pivots of Gaussian
    /// elimination on their u·ν, in increasing order. Collective.
    pub(crate) fn holding(&self) -> Vec<usize> {
        let (comm, mut rows) = (self.problem.body.comm(), self.rigid.clone());
        let mut held = Vec::new();
        for k in 0..rows.ncols() {
            let size = |i: &usize| rows[(*i, k)].abs();
            let best = (0..rows.nrows()).max_by(|i, j| size(i).total_cmp(&size(j)));
            let (_, rank) = comm.min_with_rank(-best.as_ref().map_or(0.0, size));
            let entry = |j| best.map_or(0.0, |i| rows[(i, j)]);
            let pivot: Vec<f64> =
                (0..rows.ncols()).map(|j| comm.broadcast(rank, entry(j))).collect();
            let own = best.filter(|_| comm.rank() == rank);
            held.extend(own.map(|i| self.problem.constraints.bounds[i].dof));
            let column = rows.column(k).clone_owned();
            (k + 1..rows.ncols())
                .for_each(|j| rows.column_mut(j).axpy(-pivot[j] / pivot[k], &column, 1.0));
        }
        held.sort_unstable();
        held
    }
}
