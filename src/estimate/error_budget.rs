//! The computation of the error budget.

use super::RecoveredStrains;
use crate::{
    evolution::{ErrorBudget, Outcome},
    petsc::PetscError,
    problem::{DiscreteProblem, State},
};
use std::collections::BTreeMap;

impl ErrorBudget {
    /// The budget of the last accepted state, from the estimated error `steps` of its ζ. Collective.
    pub(super) fn new(problem: &DiscreteProblem, outcome: &Outcome, steps: Option<&[f64]>) -> Self {
        let (accuracy, state) = (&outcome.accuracy, &outcome.last.state);
        let caused = |error: &[f64]| problem.displacement_error_of(error, state);
        Self {
            displacement_mesh: accuracy.energy,
            damage_mesh: None,
            displacement_steps: steps.map(caused),
            damage_steps: steps.and_then(|error| problem.relative_to_damage(error, state)),
            solver: accuracy.displacement,
            figures: BTreeMap::new(),
            can_be_damaged: problem.damage().is_some(),
            zeta_steps: steps.map(|error| {
                let (low, high) = problem.body.vertices.partition.min_max(error);
                // 0 < ζ ≤ 1 bounds every error of ζ.
                [high.max(-low), problem.body.mean(error).abs()].map(|error| error.min(1.0))
            }),
        }
    }
}

impl DiscreteProblem {
    /// The estimated error of u in the energy norm, relative, from the mesh. Collective.
    pub(crate) fn energy_error(&self, zeta: &[f64], u: &[f64]) -> Result<f64, PetscError> {
        let recovered = RecoveredStrains::new(&self.body, u)?;
        let zeta = self.zeta_at_points(zeta);
        Ok(recovered.energy_error(&self.elasticity, &zeta, u).relative())
    }

    /// ‖field‖ / ‖ζ₀ − ζ‖ in L², by the weights of the vertices; `None` without damage. Collective.
    pub(super) fn relative_to_damage(&self, field: &[f64], state: &State) -> Option<f64> {
        let vertices = &self.body.vertices;
        let initial = self.initial_damage();
        let values = field.iter().zip(initial.iter().zip(&state.zeta));
        let mut sums = [0.0; 2];
        let owned = vertices.weights.iter().zip(values).take(vertices.partition.owned());
        for (weight, (value, (from, zeta))) in owned {
            sums[0] += weight * value * value;
            sums[1] += weight * (from - zeta) * (from - zeta);
        }
        vertices.partition.comm().sum(&mut sums);
        (sums[1] > 0.0).then(|| (sums[0] / sums[1]).sqrt())
    }

    /// A bound on the relative error of u in the energy norm due to errors δζ = `error`. As K δu = −δK u, it is
    /// ‖δζ/ζ ε(u)‖ over ‖ε(u)‖. For large δζ, max(ζ, ζ + δζ) replaces ζ, and the factor is at most 1. Collective.
    pub(super) fn displacement_error_of(&self, error: &[f64], state: &State) -> f64 {
        let body = &self.body;
        let (zeta, error) = (self.zeta_at_points(&state.zeta), body.at_points(error));
        let energies = self.elasticity.energies(body, &zeta, &state.u);
        let own = energies.len() / body.triangles.len() * body.own_triangles;
        let mut sums = [0.0; 2];
        for ((energy, zeta), error) in energies.iter().zip(&zeta).zip(&error).take(own) {
            sums[0] += energy * (error / zeta.max(zeta + error)).powi(2).min(1.0);
            sums[1] += energy;
        }
        body.nodes.partition.comm().sum(&mut sums);
        if sums[1] > 0.0 { (sums[0] / sums[1]).sqrt() } else { 0.0 }
    }
}
