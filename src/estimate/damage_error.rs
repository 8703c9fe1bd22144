//! The error that the mesh makes in the damage.
//!
//! Let z be the damage on a much finer mesh and ζ the damage of the run. The mesh causes z − ζ in two ways. The run has
//! the damage source b of its own strains, not of the strains on a finer mesh. For these, recovered strains ε* stand
//! ([`RecoveredStrains`]), enlarged by the energy that the run misses, ‖ε*‖² (1 + η²). In the state of largest
//! displacement,
//!
//! (M + tκL) d = t b, (M + tκL) e = t δb, δb_i = ∫ (φ(|ε*|² (1 + η²), ζ) − φ(|ε|², ζ)) λ_i
//!
//! are the damage by b during the time t of the run, and its error. At the vertices z − ζ is e ‖ζ₀ − ζ‖/‖d‖. Between
//! the vertices z is curved: there the error of interpolation follows from recovered gradients of ζ.

use super::{hierarchical::interpolation_error, recovery::RecoveredStrains, strains_at_nodes};
use crate::{
    evolution::{DamageStep, Outcome, RunError, agreed},
    model::DamageLaw,
    problem::{DiscreteProblem, State},
};
use nalgebra::{DVector, Vector3};

/// The estimated error that the mesh makes in the damage.
pub(super) struct DamageError {
    /// ‖z − ζ‖ / ‖ζ₀ − z‖ in L².
    pub(super) relative: f64,
    /// z − ζ at the vertices.
    pub(super) change: Vec<f64>,
    /// See [`Outcome::damage_indicators`].
    pub(super) indicators: Vec<f64>,
    /// The delay, s, with which the run reaches the minimum of z.
    pub(super) delay: f64,
}

/// The error that the mesh makes in the last damage. `None` without damage. Collective.
pub(super) fn damage_error(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    outcome: &Outcome,
) -> Option<DamageError> {
    let comm = problem.body.nodes.partition.comm();
    let last = &outcome.last.state;
    let undamaged = comm.all(last.zeta == problem.initial_damage());
    let laws = problem.damage().filter(|_| !undamaged)?;
    let changes = changes(problem, damage_step, laws, outcome);
    let (change, delay) = agreed(comm, changes).ok()?;
    at_end(problem, last, change, delay)
}

/// z − ζ at the vertices, and the delay at the vertex of minimum ζ.
fn changes(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    laws: &[DamageLaw],
    outcome: &Outcome,
) -> Result<(Vec<f64>, f64), RunError> {
    let vertices = &problem.body.vertices.partition;
    let (last, state) = (&outcome.last.state, &outcome.most_displaced().state);
    let loads = [damage_step.source(state).load, source_error(problem, laws, state)?];
    let system = damage_step.system(last.time)?;
    let mut spread = |load: DVector<f64>| -> Result<_, RunError> {
        let mut field = DVector::zeros(load.len());
        system.advance(load.as_slice(), field.as_mut_slice())?;
        vertices.update(field.as_mut_slice(), 1)?;
        Ok(field)
    };
    let [d, e] = loads.map(&mut spread);
    let (d, e) = (d?, e?);
    let initial = problem.initial_damage();
    let done = |i: usize| initial[i] - last.zeta[i];
    let norm = |values: &dyn Fn(usize) -> f64| {
        let weights = problem.body.vertices.weights.iter().enumerate().take(vertices.owned());
        vertices.comm().total(weights.map(|(i, weight)| weight * values(i).powi(2)).sum()).sqrt()
    };
    let scale = norm(&done) / norm(&|i| d[i]);
    let weakest = (0..vertices.owned()).min_by(|&a, &b| last.zeta[a].total_cmp(&last.zeta[b]));
    let delay = weakest.map_or(0.0, |i| last.time * (done(i) / d[i]) * (e[i] / d[i]));
    let (_, rank) = vertices.comm().min_with_rank(weakest.map_or(f64::INFINITY, |i| last.zeta[i]));
    Ok(((scale * e).as_slice().to_vec(), vertices.comm().broadcast(rank, delay)))
}

/// δb_i in `state`, m²/s, by the midpoints of the sides, which integrate quadratic functions.
fn source_error(
    problem: &DiscreteProblem,
    laws: &[DamageLaw],
    state: &State,
) -> Result<DVector<f64>, RunError> {
    let body = &problem.body;
    let recovered = RecoveredStrains::new(body, &state.u)?;
    let zeta = problem.zeta_at_points(&state.zeta);
    let missing = recovered.energy_error(&problem.elasticity, &zeta, &state.u).relative().powi(2);
    // ε_ij ε_ij, from (ε_xx, ε_yy, 2ε_xy).
    let square = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
    let mut load = DVector::zeros(state.zeta.len());
    for (t, strains) in strains_at_nodes(body, &state.u).enumerate() {
        let (nodes, law) = (body.mesh.triangles[t], &laws[body.material(t)]);
        let difference = recovered.difference(t);
        for side in 0..3 {
            let ends = [nodes[side], nodes[(side + 1) % 3]];
            let zeta = 0.5 * (state.zeta[ends[0]] + state.zeta[ends[1]]);
            let finer = square(strains[3 + side] + difference[3 + side]) * (1.0 + missing);
            let change = law.source(finer, zeta) - law.source(square(strains[3 + side]), zeta);
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
    delay: f64,
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
