//! The error that the mesh makes in the damage.
//!
//! Let z be the damage on a much finer mesh, ζ the damage of the run, and e = z − ζ. The mesh causes e in two ways. The
//! run has the damage source of its own strains, not of the strains on a finer mesh; for these, recovered strains ε*
//! stand ([`RecoveredStrains`]), enlarged by the energy that the run misses, ‖ε*‖² (1 + η²). At the vertices e follows
//! from
//!
//! (M + kκL) e_n = M e_{n−1} + k b, b_i = ∫ (φ(|ε*|² (1 + η²)(ζ/z)², z) − φ(|ε|², ζ)) λ_i,
//!
//! in five to ten long steps between states of the run. (Under the same stress strains are proportional to 1/ζ.) Between
//! the vertices z is curved: there the error of interpolation follows from recovered gradients of ζ.

use super::{hierarchical::interpolation_error, recovery::RecoveredStrains, strains_at_nodes};
use crate::{
    evolution::{DamageStep, Instants, Outcome, RunError, agreed},
    model::DamageLaw,
    problem::{DiscreteProblem, State},
};
use nalgebra::Vector3;

/// The estimated error that the mesh makes in the damage.
pub(super) struct DamageError {
    /// ‖z − ζ‖ / ‖ζ₀ − z‖ in L².
    pub(super) relative: f64,
    /// z − ζ at the vertices.
    pub(super) change: Vec<f64>,
    /// See [`Outcome::damage_indicators`].
    pub(super) indicators: Vec<f64>,
    /// The delay, s, with which the run reaches the minimum of z. It is taken at the last state at which min ζ and
    /// min z still fall; `None` if there is no such state.
    pub(super) delay: Option<f64>,
}

/// The error that the mesh makes in the last damage. `None` without damage. Collective.
pub(super) fn damage_error(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    mut instants: Instants,
    outcome: &Outcome,
) -> Option<DamageError> {
    let comm = problem.body.nodes.partition.comm();
    let last = &outcome.last.state;
    let undamaged = comm.all(last.zeta == problem.initial_damage());
    let laws = problem.damage().filter(|_| !undamaged)?;
    instants.end(last);
    instants.falling.extend(outcome.stopped.map(|stop| (stop.time, problem.threshold())));
    let followed = follow(problem, damage_step, laws, &instants);
    let (change, delay) = agreed(comm, followed).ok()?;
    at_end(problem, last, change, delay)
}

/// Follows e at the vertices from the first state to the last. Returns it with the delay.
fn follow(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    laws: &[DamageLaw],
    instants: &Instants,
) -> Result<(Vec<f64>, Option<f64>), RunError> {
    let vertices = &problem.body.vertices.partition;
    let mut error = vec![0.0; problem.body.mesh.nodes.len()];
    let (mut delay, mut before): (_, Option<(f64, Vec<f64>)>) = (None, None);
    for state in &instants.states {
        let mut load = source_error(problem, laws, state, &error)?;
        if let Some((time, earlier)) = &before {
            let mean: Vec<f64> = load.iter().zip(earlier).map(|(a, b)| 0.5 * (a + b)).collect();
            damage_step.system(state.time - time)?.advance(&mean, &mut error)?;
            vertices.update(&mut error, 1)?;
            load = source_error(problem, laws, state, &error)?;
        }
        before = Some((state.time, load));
        let z: Vec<f64> = state.zeta.iter().zip(&error).map(|(zeta, e)| zeta + e).collect();
        let minimum = vertices.min_max(&z).0;
        if minimum > problem.threshold() {
            delay = instants.delay(state.time, minimum).or(delay);
        }
    }
    Ok((error, delay))
}

/// b_i in `state` with e at the vertices, m²/s, by the midpoints of the sides, which integrate quadratic functions.
fn source_error(
    problem: &DiscreteProblem,
    laws: &[DamageLaw],
    state: &State,
    error: &[f64],
) -> Result<Vec<f64>, RunError> {
    let body = &problem.body;
    let recovered = RecoveredStrains::new(body, &state.u)?;
    let zeta = problem.zeta_at_points(&state.zeta);
    let missing = recovered.energy_error(&problem.elasticity, &zeta, &state.u).relative().powi(2);
    // ε_ij ε_ij, from (ε_xx, ε_yy, 2ε_xy).
    let square = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
    let mut load = vec![0.0; error.len()];
    for (t, strains) in strains_at_nodes(body, &state.u).enumerate() {
        let (nodes, law) = (body.mesh.triangles[t], &laws[body.material(t)]);
        let difference = recovered.difference(t);
        for side in 0..3 {
            let ends = [nodes[side], nodes[(side + 1) % 3]];
            let [zeta, e] = [&state.zeta[..], error].map(|of| 0.5 * (of[ends[0]] + of[ends[1]]));
            let z = law.truncate(zeta + e);
            let finer = square(strains[3 + side] + difference[3 + side]) * (1.0 + missing);
            let change = law.source(finer * (law.truncate(zeta) / z).powi(2), z)
                - law.source(square(strains[3 + side]), zeta);
            ends.iter().for_each(|&end| load[end] += body.triangles[t].area() / 6.0 * change);
        }
    }
    Ok(load)
}

/// The estimate from e at the vertices and the error of interpolation of the last damage. With the heights h of the
/// bubbles on the sides, a triangle has the squared error of interpolation 4/45 |T| (Σh² + (Σh)²). Collective.
fn at_end(
    problem: &DiscreteProblem,
    last: &State,
    change: Vec<f64>,
    delay: Option<f64>,
) -> Option<DamageError> {
    let body = &problem.body;
    let comm = body.vertices.partition.comm();
    let start = problem.initial_damage();
    let heights = interpolation_error(body, &last.zeta).ok();
    let heights = if comm.all(heights.is_some()) { heights? } else { return None };
    let (mut sums, mut indicators) = ([0.0; 2], Vec::with_capacity(body.own_triangles));
    for (t, nodes) in body.mesh.triangles.iter().enumerate().take(body.own_triangles) {
        let mass = body.triangles[t].mass();
        let square = |v: Vector3<f64>| v.dot(&(mass * v));
        let error = Vector3::from(nodes.map(|node| change[node]));
        let damage = Vector3::from(nodes.map(|node| start[node] - last.zeta[node])) - error;
        let (squares, sum) = heights[t].iter().fold((0.0, 0.0), |(q, s), h| (q + h * h, s + h));
        let bubbles = 4.0 / 45.0 * body.triangles[t].area() * (squares + sum * sum);
        sums[0] += square(error) + bubbles;
        sums[1] += square(damage);
        indicators.push(bubbles);
    }
    comm.sum(&mut sums);
    indicators.iter_mut().for_each(|square| *square /= sums[1]);
    let relative = (sums[0] / sums[1]).sqrt();
    relative.is_finite().then_some(DamageError { relative, change, indicators, delay })
}
