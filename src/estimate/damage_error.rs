//! The error that the mesh makes in the damage.
//!
//! Let z be the damage on a much finer mesh, and ζ the damage of the run. Their difference e = z − ζ is sought as a
//! quadratic function. Equation (25) for z, less its residual for ζ, reads
//!
//! (e_n − e_{n−1}, w) + k (κ∇e_n, ∇w) = k (φ* − ζ′, w) − k (κ∇ζ_n, ∇w) for all quadratic w.
//!
//! It is solved in five to ten long steps between states of the run, by conjugate gradients in the hierarchical
//! basis. The source φ* of z comes from the strains of a much finer mesh ([`FineStrains`]) at the same ζ. Strains
//! under the same stress are proportional to 1/ζ, so φ* = φ((ζ/z)² |ε*|², z).

use super::{
    fine_strains::FineStrains,
    hierarchical::{affine, coefficients, interpolation_error, laplace, mass, values},
    order_pair::OrderPair,
    quadratic_system::QuadraticSystem,
};
use crate::{
    evolution::{Compliance, DamageStep, Instants, Outcome, Phases, RunError, agreed},
    model::DamageLaw,
    petsc::PetscError,
    problem::{DiscreteProblem, State},
};
use nalgebra::{Matrix6, Vector3, Vector6};

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

/// The error that the mesh makes in the last damage. `None` without damage, and if the active nodes of a state
/// alone do not support the body. Collective.
pub(super) fn damage_error(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    compliance: Compliance,
    mut instants: Instants,
    outcome: &Outcome,
) -> Option<DamageError> {
    let comm = problem.body.nodes.partition.comm();
    let last = &outcome.last.state;
    let undamaged = comm.all(last.zeta == problem.initial_damage());
    let laws = problem.damage().filter(|_| !undamaged)?;
    instants.end(last);
    let stopped = outcome.stopped.is_some();
    instants.falling.extend(outcome.stopped.map(|stop| (stop.time, problem.threshold())));
    let error = error_at_end(problem, damage_step, compliance, laws, &instants, stopped);
    agreed(comm, error).ok().flatten()
}

/// Follows e from the first instant to the last. The run may have `stopped` at ζ_*.
fn error_at_end(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    compliance: Compliance,
    laws: &[DamageLaw],
    instants: &Instants,
    stopped: bool,
) -> Result<Option<DamageError>, RunError> {
    let [first, .., last] = &instants.states[..] else { return Ok(None) };
    let (session, phases) = (damage_step.session, Phases::default());
    let comm = problem.body.nodes.partition.comm();
    let other = agreed(comm, problem.of_other_order())?.restrict_as(session, problem)?;
    let pair = OrderPair::new(session, problem, &other, compliance, last, &phases)?;
    let fine = pair.problems()[1];
    let Some(nodes) = fine.body.quadratic_nodes() else { return Ok(None) };
    let mut strains = FineStrains::new(pair, stopped);
    let mut error = ZetaError::new(problem, laws, fine, nodes, &first.zeta)?;
    let (initial, mut delay) = (error.field.clone(), None);
    let mut before: Option<Sources> = None;
    for state in &instants.states {
        let Some(strains) = strains.squared(state)? else { return Ok(None) };
        let load = damage_step.source(state).load.as_slice().to_vec();
        let mut now = Sources { state, load, fine: error.source(state, &strains) };
        if let Some(before) = &before {
            error.advance(damage_step, before, &now)?;
            now.fine = error.source(state, &strains);
        }
        before = Some(now);
        let minimum = error.minimum(state);
        if minimum > problem.threshold() {
            delay = instants.delay(state.time, minimum).or(delay);
        }
    }
    Ok(error.at_end(&initial, last, delay))
}

/// A state of the run with the load b of its own source, m²/s, and the source φ* of z.
struct Sources<'s> {
    state: &'s State,
    load: Vec<f64>,
    fine: Vec<Vector6<f64>>,
}

/// Steps whose lengths differ by less than this factor share a preconditioner.
const ALIKE: f64 = 1.7;

/// e = z − ζ at an instant.
struct ZetaError<'a> {
    problem: &'a DiscreteProblem,
    /// The damage laws of the materials by their numbers.
    laws: &'a [DamageLaw],
    /// κL of each triangle, m²/s.
    diffusions: Vec<Matrix6<f64>>,
    /// The problem in P2, the six nodes of each of its triangles, and its node at each vertex.
    fine: &'a DiscreteProblem,
    nodes: &'a [[usize; 6]],
    node_of_vertex: Vec<usize>,
    /// The coefficients of e in the hierarchical basis, by the nodes of P2.
    field: Vec<f64>,
    /// The length of the step for which the preconditioner was made, s.
    preconditioned: f64,
}

impl<'a> ZetaError<'a> {
    /// At the start, where ζ interpolates ζ₀.
    fn new(
        problem: &'a DiscreteProblem,
        laws: &'a [DamageLaw],
        fine: &'a DiscreteProblem,
        nodes: &'a [[usize; 6]],
        initial: &[f64],
    ) -> Result<Self, PetscError> {
        let mut field = vec![0.0; fine.body.nodes.points.len()];
        for (nodes, heights) in nodes.iter().zip(interpolation_error(&problem.body, initial)?) {
            nodes[3..].iter().zip(heights).for_each(|(&node, height)| field[node] = height);
        }
        let node_of_vertex = fine.body.node_of_vertex();
        let (body, kappa) = (&problem.body, problem.diffusions());
        let diffusion = |(t, triangle)| kappa[body.material(t)] * laplace(triangle);
        let diffusions = body.triangles.iter().enumerate().map(diffusion).collect();
        Ok(Self {
            problem,
            laws,
            diffusions,
            fine,
            nodes,
            node_of_vertex,
            field,
            preconditioned: 0.0,
        })
    }

    /// From one state to the next, with the mean of their sources φ*.
    fn advance(
        &mut self,
        damage_step: &mut DamageStep,
        before: &Sources,
        now: &Sources,
    ) -> Result<(), RunError> {
        let (body, k) = (&self.problem.body, now.state.time - before.state.time);
        let skipped = self.skipped_rates(before, now)?;
        let mut load = vec![0.0; self.field.len()];
        let mut matrices = Vec::with_capacity(body.triangles.len());
        for (t, triangle) in body.triangles.iter().enumerate() {
            let vertices = body.mesh.triangles[t];
            let (mass, diffusion) = (mass(triangle), self.diffusions[t]);
            let source = coefficients(0.5 * (before.fine[t] + now.fine[t]));
            let [zeta, zeta_before, skipped] = [&now.state.zeta, &before.state.zeta, &skipped]
                .map(|field| affine(vertices.map(|i| field[i])));
            let rate = (zeta - zeta_before) / k - skipped;
            let mut of_triangle = mass * (source - rate) - diffusion * (zeta + self.on(t));
            // At the vertices the skipped rates balance the residual of ζ exactly.
            let excess = triangle.area() / 3.0 * skipped - mass * skipped;
            (0..3).for_each(|i| of_triangle[i] += excess[i]);
            let nodes = self.nodes[t].iter().zip(&of_triangle);
            nodes.for_each(|(&node, of_node)| load[node] += k * of_node);
            matrices.push(mass + k * diffusion);
        }
        if !(self.preconditioned / ALIKE..=self.preconditioned * ALIKE).contains(&k) {
            self.preconditioned = k;
        }
        let session = damage_step.session;
        let linear = (damage_step.system(self.preconditioned)?, self.preconditioned);
        let owned = &self.node_of_vertex[..body.vertices.partition.owned()];
        let mut system = QuadraticSystem::new(&self.fine.body, self.nodes, matrices, owned, linear);
        let change = system.solve(session, &load)?;
        self.field.iter_mut().zip(change).for_each(|(e, change)| *e += change);
        Ok(())
    }

    /// The rates that a long step misses. The run makes many steps between two states, whose sources differ from
    /// the mean b of both states. At vertex i the rate is (M ζ′ + κL ζ_n − b)_i over the weight of i. Collective.
    fn skipped_rates(&self, before: &Sources, now: &Sources) -> Result<Vec<f64>, PetscError> {
        let (body, k) = (&self.problem.body, now.state.time - before.state.time);
        let loads = now.load.iter().zip(&before.load);
        let mut rates: Vec<f64> = loads.map(|(b, before)| -0.5 * (b + before)).collect();
        for (t, (nodes, triangle)) in body.mesh.triangles.iter().zip(&body.triangles).enumerate() {
            let [now, before] =
                [now, before].map(|sources| Vector3::from(nodes.map(|i| sources.state.zeta[i])));
            let diffusion = self.diffusions[t].fixed_view::<3, 3>(0, 0);
            let residual = self.problem.mass().of(triangle) * (now - before) / k + diffusion * now;
            nodes.iter().zip(&residual).for_each(|(&node, of_node)| rates[node] += of_node);
        }
        rates.iter_mut().zip(&body.vertices.weights).for_each(|(rate, weight)| *rate /= weight);
        body.vertices.partition.update(&mut rates, 1)?;
        Ok(rates)
    }

    /// The coefficients of e on triangle `t`.
    fn on(&self, t: usize) -> Vector6<f64> {
        self.nodes[t].map(|node| self.field[node]).into()
    }

    /// e at the vertices.
    fn at_vertices(&self) -> Vec<f64> {
        self.node_of_vertex.iter().map(|&node| self.field[node]).collect()
    }

    /// min z at the vertices. Collective.
    fn minimum(&self, state: &State) -> f64 {
        let z = state.zeta.iter().zip(self.at_vertices()).map(|(zeta, e)| zeta + e);
        self.problem.body.vertices.partition.min_max(&z.collect::<Vec<_>>()).0
    }

    /// φ* of `state` at the vertices and midpoints of each triangle, 1/s, with |ε*|² = `strain_squared`.
    fn source(&self, state: &State, strain_squared: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let body = &self.problem.body;
        let of_triangle = |(t, nodes): (usize, &[usize; 3])| {
            let law = &self.laws[body.material(t)];
            let zeta = affine(nodes.map(|node| state.zeta[node]));
            let (zeta, z) = (values(zeta), values(zeta + self.on(t)));
            Vector6::from_fn(|i, _| {
                let (zeta, z) = (law.truncate(zeta[i]), law.truncate(z[i]));
                law.source((zeta / z).powi(2) * strain_squared[t][i], z)
            })
        };
        body.mesh.triangles.iter().enumerate().map(of_triangle).collect()
    }

    /// The error in the `last` state, from the `initial` e. Collective.
    fn at_end(self, initial: &[f64], last: &State, delay: Option<f64>) -> Option<DamageError> {
        let body = &self.problem.body;
        let start = self.problem.initial_damage();
        let (mut sums, mut indicators) = ([0.0; 2], Vec::with_capacity(body.own_triangles));
        for (t, nodes) in body.mesh.triangles.iter().enumerate().take(body.own_triangles) {
            let mass = mass(&body.triangles[t]);
            let square = |v: Vector6<f64>| v.dot(&(mass * v));
            let error = self.on(t);
            // ζ₀ − z.
            let mut damage = affine(nodes.map(|node| start[node] - last.zeta[node])) - error;
            (3..6).for_each(|i| damage[i] += initial[self.nodes[t][i]]);
            let bubbles = error - affine([error[0], error[1], error[2]]);
            sums[0] += square(error);
            sums[1] += square(damage);
            indicators.push(square(bubbles));
        }
        body.vertices.partition.comm().sum(&mut sums);
        indicators.iter_mut().for_each(|square| *square /= sums[1]);
        let (relative, change) = ((sums[0] / sums[1]).sqrt(), self.at_vertices());
        relative.is_finite().then_some(DamageError { relative, change, indicators, delay })
    }
}
