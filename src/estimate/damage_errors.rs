//! Errors of ζ in the last state, as by the time steps: their size, and the error of u that they cause.

use crate::problem::{DiscreteProblem, State};

/// ‖field‖ / ‖ζ₀ − ζ‖ in L², by the weights of the vertices; `None` without damage. Collective.
pub(super) fn relative_to_damage(
    problem: &DiscreteProblem,
    field: &[f64],
    state: &State,
) -> Option<f64> {
    let vertices = &problem.body.vertices;
    let initial = problem.initial_damage();
    let values = field.iter().zip(initial.iter().zip(&state.zeta));
    let mut sums = [0.0; 2];
    let owned = vertices.weights.iter().zip(values).take(vertices.partition.owned());
    for (weight, (value, (from, zeta))) in owned {
        sums[0] += weight * value * value;
        sums[1] += weight * (from - zeta) * (from - zeta);
    }
    vertices.partition.comm().sum(&mut sums);
    (sums[1] != 0.0).then(|| (sums[0] / sums[1]).sqrt())
}

/// A bound on the relative error of u in the energy norm due to errors δζ = `error`. As K δu = −δK u, it is
/// ‖δζ/ζ ε(u)‖ over ‖ε(u)‖. For large δζ, max(ζ, ζ + δζ) replaces ζ, and the factor is at most 1. Collective.
pub(super) fn displacement_error_of(
    problem: &DiscreteProblem,
    error: &[f64],
    state: &State,
) -> f64 {
    let body = &problem.body;
    let (zeta, error) = (problem.zeta_at_points(&state.zeta), body.at_points(error));
    let energies = problem.elasticity.energies(body, &zeta, &state.u);
    let own = body.points_per_triangle() * body.own_triangles;
    let mut sums = [0.0; 2];
    for ((energy, zeta), error) in energies.iter().zip(&zeta).zip(&error).take(own) {
        sums[0] += energy * (error / zeta.max(zeta + error)).powi(2).min(1.0);
        sums[1] += energy;
    }
    body.comm().sum(&mut sums);
    if sums[1] == 0.0 { 0.0 } else { (sums[0] / sums[1]).sqrt() }
}
