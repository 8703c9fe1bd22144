//! The error that the mesh makes in the damage.
//!
//! Let z be the damage on a much finer mesh, and ζ the damage of the run. Their difference e = z − ζ is
//! sought as a quadratic function. Equation (25) for z, less what ζ makes of it, reads
//!
//! (e_n − e_{n−1}, w) + k (κ∇e_n, ∇w) = k (φ* − ζ′, w) − k (κ∇ζ_n, ∇w) for all quadratic w.
//!
//! It is solved for about ten long steps between states of the run, by conjugate gradients in the
//! hierarchical basis. The source φ* of z comes from the strains of a much finer mesh ([`FineStrains`]) at
//! the same ζ. Strains under the same stress are proportional to 1/ζ, so φ* = φ((ζ/z)² |ε*|², z).

use super::{
    fine_strains::FineStrains,
    hierarchical::{affine, coefficients, interpolation_error, laplace, mass, values},
    instants::Instants,
    order_pair::OrderPair,
};
use crate::{
    evolution::{
        Compliance, DamageStep, DiscreteProblem, Outcome, Phases, RunError, State, agreed,
    },
    fem::DamageSystem,
    model::DamageLaw,
    petsc::{Operator, PetscError, Session, solve_by_energy},
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
    /// How long after z the ζ of the run has fallen to the same minimum, s. It is taken at the last instant
    /// at which both still fall; `None` if there is no such instant.
    pub(super) delay: Option<f64>,
}

/// The part of the energy of a change of e that the iteration may leave, and its largest number of iterations.
const REST: f64 = 0.01;
const ITERATIONS: usize = 30;

/// The error that the mesh makes in the last damage. It is `None` without damage, and where the active nodes
/// of a state alone do not support the body. Collective.
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
    let other = problem.of_other_order(session)?;
    let pair = OrderPair::new(session, problem, &other, compliance, last, &phases)?;
    let fine = pair.problems()[1];
    let Some(nodes) = fine.body.quadratic_nodes() else { return Ok(None) };
    let mut strains = FineStrains::new(pair, stopped);
    let mut error = ZetaError::new(problem, laws, fine, nodes, &first.zeta)?;
    let (initial, mut delay) = (error.field.clone(), None);
    let mut before: Option<(&State, Vec<f64>, Vec<Vector6<f64>>)> = None;
    for state in &instants.states {
        let Some(strains) = strains.squared(state)? else { return Ok(None) };
        let load = damage_step.source(state).load.as_slice().to_vec();
        if let Some((before, load_before, source_before)) = &before {
            let means = load.iter().zip(load_before).map(|(b, before)| 0.5 * (b + before));
            let rates = error.sampled_rates([before, state], &means.collect::<Vec<_>>())?;
            let next = error.source(state, &strains);
            let source = next.iter().zip(source_before).map(|(f, before)| 0.5 * (f + before));
            let source: Vec<_> = source.collect();
            error.advance(damage_step, [before, state], &rates, &source)?;
        }
        before = Some((state, load, error.source(state, &strains)));
        let minimum = error.minimum(state);
        if minimum > problem.threshold() {
            delay = instants.delay(state.time, minimum).or(delay);
        }
    }
    Ok(error.at_end(&initial, last, delay))
}

/// e = z − ζ at an instant.
struct ZetaError<'a> {
    problem: &'a DiscreteProblem,
    /// The damage laws and κ, m²/s, of the materials by their numbers.
    laws: &'a [DamageLaw],
    diffusions: Vec<f64>,
    /// The problem in P2, the six nodes of each of its triangles, and its node at each vertex.
    fine: &'a DiscreteProblem,
    nodes: &'a [[usize; 6]],
    node_of_vertex: Vec<usize>,
    /// The coefficients of e in the hierarchical basis, by the nodes of P2.
    field: Vec<f64>,
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
        let diffusions = problem.diffusions();
        Ok(Self { problem, laws, diffusions, fine, nodes, node_of_vertex, field })
    }

    /// From one state to the next, with the mean `source` φ* between them and the `rates` ζ′ of the run.
    fn advance(
        &mut self,
        damage_step: &mut DamageStep,
        [before, state]: [&State; 2],
        rates: &[f64],
        source: &[Vector6<f64>],
    ) -> Result<(), RunError> {
        let (body, k) = (&self.problem.body, state.time - before.time);
        let mut load = vec![0.0; self.field.len()];
        let mut matrices = Vec::with_capacity(source.len());
        for (t, triangle) in body.triangles.iter().enumerate() {
            let vertices = body.mesh.triangles[t];
            let (mass, diffusion) =
                (mass(triangle), self.diffusions[body.material(t)] * laplace(triangle));
            let source = coefficients(source[t]) - affine(vertices.map(|i| rates[i]));
            let zeta = affine(vertices.map(|i| state.zeta[i])) + self.on(t);
            let of_triangle = k * (mass * source - diffusion * zeta);
            let nodes = self.nodes[t].iter().zip(&of_triangle);
            nodes.for_each(|(&node, of_node)| load[node] += of_node);
            matrices.push(mass + k * diffusion);
        }
        let session = damage_step.session;
        let mut step = Step::new(self, &matrices, damage_step.system(k)?, k);
        let change = step.solve(session, load)?;
        self.field.iter_mut().zip(change).for_each(|(e, change)| *e += change);
        Ok(())
    }

    /// The rates ζ′ between two states as the sources at these two alone would make them; the run has made
    /// many steps between them. With their `mean` load b, the change of rate at a vertex is −1 over its
    /// weight times the residual (M ζ′ + κL ζ_n − b)_i.
    fn sampled_rates(
        &self,
        [before, state]: [&State; 2],
        mean: &[f64],
    ) -> Result<Vec<f64>, PetscError> {
        let body = &self.problem.body;
        let k = state.time - before.time;
        let mut rates: Vec<f64> =
            state.zeta.iter().zip(&before.zeta).map(|(now, before)| (now - before) / k).collect();
        let mut residual: Vec<f64> = mean.iter().map(|b| -b).collect();
        for (t, (nodes, triangle)) in body.mesh.triangles.iter().zip(&body.triangles).enumerate() {
            let [rate, zeta] =
                [&rates, &state.zeta].map(|field| Vector3::from(nodes.map(|i| field[i])));
            let diffusion = self.diffusions[body.material(t)] * triangle.laplace();
            let of_triangle = self.problem.mass().of(triangle) * rate + diffusion * zeta;
            nodes.iter().zip(&of_triangle).for_each(|(&node, of_node)| residual[node] += of_node);
        }
        let residuals = residual.iter().zip(&body.vertices.weights);
        rates.iter_mut().zip(residuals).for_each(|(rate, (r, weight))| *rate -= r / weight);
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

/// The matrix M + kκL of a step of length k in the hierarchical basis.
struct Step<'s, 'a> {
    error: &'s ZetaError<'a>,
    matrices: &'s [Matrix6<f64>],
    diagonal: Vec<f64>,
    /// The system of P1, which preconditions the vertices.
    system: &'s mut DamageSystem,
    k: f64,
}

impl<'s, 'a> Step<'s, 'a> {
    fn new(
        error: &'s ZetaError<'a>,
        matrices: &'s [Matrix6<f64>],
        system: &'s mut DamageSystem,
        k: f64,
    ) -> Self {
        let mut diagonal = vec![0.0; error.field.len()];
        for (nodes, matrix) in error.nodes.iter().zip(matrices) {
            nodes.iter().zip(&matrix.diagonal()).for_each(|(&node, d)| diagonal[node] += d);
        }
        Self { error, matrices, diagonal, system, k }
    }

    /// The field with this load. Collective.
    fn solve(&mut self, session: &Session, load: Vec<f64>) -> Result<Vec<f64>, PetscError> {
        let partition = &self.error.fine.body.nodes.partition;
        let found = solve_by_energy(session, self, &load[..partition.owned()], ITERATIONS)?;
        partition.field(found.unwrap_or_default(), 1)
    }
}

impl Operator for Step<'_, '_> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let partition = &self.error.fine.body.nodes.partition;
        let field = partition.field(x.to_vec(), 1)?;
        let mut image = vec![0.0; field.len()];
        for (nodes, matrix) in self.error.nodes.iter().zip(self.matrices) {
            let of_triangle = matrix * Vector6::from(nodes.map(|node| field[node]));
            nodes.iter().zip(&of_triangle).for_each(|(&node, value)| image[node] += value);
        }
        y.copy_from_slice(&image[..y.len()]);
        Ok(())
    }

    /// The bubbles are preconditioned by their diagonal, which is good on any mesh; the vertices by the
    /// factor of P1.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError> {
        z.iter_mut().zip(r).zip(&self.diagonal).for_each(|((z, r), diagonal)| *z = r / diagonal);
        let owned = self.error.problem.body.vertices.partition.owned();
        let vertices = &self.error.node_of_vertex[..owned];
        let load: Vec<f64> = vertices.iter().map(|&node| r[node] / self.k).collect();
        let solved = self.system.correction(&load)?.unwrap_or_default();
        vertices.iter().zip(solved).for_each(|(&node, change)| z[node] = change);
        Ok(())
    }

    fn is_enough(&self, gained: f64, left: f64) -> bool {
        left <= REST * gained
    }
}
