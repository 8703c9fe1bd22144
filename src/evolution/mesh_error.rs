//! What the mesh does to the damage: damage steps once more, in P1 and in P2.

use super::{ContactStep, DiscreteProblem, Phases, RunError, State, Step, damage_step::DamageStep};
use crate::{
    contact::SOLVERS,
    fem::{
        DamageSystem, Elements, RecoveredStrains, mean_product, quadratic_load, strains_at_nodes,
    },
    mesh::Order,
    model::DamageLaw,
    petsc::{PetscError, Session},
};
use nalgebra::Vector3;
use std::array;

/// So many intervals of time at least and about twice as many at most, if there are so many steps; with
/// three the error of a load that swings once was estimated at 0.6 of it.
const INTERVALS: usize = 5;
/// Vertices up to which displacements of order 1 are solved for again in order 2, which takes far more
/// than a step of theirs.
const MOST: usize = 4000;
/// Times that z₂ of an instant is computed, each with the source of the one before.
const PASSES: usize = 2;
/// The KKT tolerance of the other order: a few digits of an error are enough.
const TOLERANCE: f64 = 1e-4;

/// States of a run at a few times, evenly spread over its steps.
pub(super) struct Instants {
    /// Every so many steps.
    stride: usize,
    states: Vec<State>,
}

impl Instants {
    pub(super) fn new() -> Self {
        Self { stride: 1, states: Vec::new() }
    }

    /// Sees an accepted step.
    pub(super) fn observe(&mut self, step: &Step) {
        if !step.record.step.is_multiple_of(self.stride) {
            return;
        }
        self.states.push(step.state.clone());
        if self.states.len() > 2 * INTERVALS {
            self.stride *= 2;
            let mut index = 0..;
            self.states.retain(|_| index.next().is_some_and(|i| i % 2 == 0));
        }
    }

    /// The states, `last` being the last one.
    fn until(mut self, last: &State) -> Vec<State> {
        if let [.., before, end] = &self.states[..]
            && last.time - end.time < 0.5 * (end.time - before.time)
        {
            self.states.pop();
        }
        self.states.push(last.clone());
        self.states
    }
}

/// The estimated error that the mesh makes in the damage.
pub(super) struct DamageError {
    /// ‖z₂ − z₁‖ / ‖ζ₀ − z₂‖ in L².
    pub(super) relative: f64,
    /// z₂ − z₁ at the vertices.
    pub(super) change: Vec<f64>,
    /// See [`Outcome::damage_indicators`](super::Outcome).
    pub(super) indicators: Vec<f64>,
}

/// The error that the mesh makes in the damage `last`; `None` without damage, where the same contact
/// problem with displacements of the other order has no answer, or where that has too many. Collective.
pub(super) fn mesh_error(
    session: &Session,
    problem: &DiscreteProblem,
    instants: Instants,
    last: &State,
) -> Option<DamageError> {
    let comm = problem.body.nodes.partition.comm();
    let undamaged = comm.all(last.zeta == problem.initial_damage());
    let law = problem.damage().filter(|_| !undamaged)?;
    let vertices = problem.body.vertices.partition.total();
    if problem.body.order() == Order::Linear && vertices > MOST {
        return None;
    }
    let estimate = damage_error(session, problem, &law, &instants.until(last));
    let told = comm.all(estimate.is_ok());
    estimate.ok().flatten().filter(|_| told)
}

/// Damage steps from each of `states` to the next: z₁ in P1 with the run's own source φ(ε(u), ζ), z₂ in
/// P2 with what the source would be on a finer mesh. Both have the same error of time.
///
/// With d = z₂ − z₁ and z = ζ + d, the strain at the same stress is ζ/z ε(u), and the source of z₂
///
/// φ(ζ/z ε(u), z) + (ζ/z)² c (φ(ε(u₂), ζ) − φ(ε(u₁), ζ)).
///
/// The second term is what u lacks: u₁ and u₂ are the displacements of either order for the same ζ,
/// u is one of them, and c = η²/‖u₂ − u₁‖² from the estimated error η of u, at order 1 at least 1.
fn damage_error(
    session: &Session,
    problem: &DiscreteProblem,
    law: &DamageLaw,
    states: &[State],
) -> Result<Option<DamageError>, RunError> {
    let (phases, other) = (Phases::default(), problem.of_other_order(session, TOLERANCE)?);
    let mut contact = ContactStep::new(session, &other, SOLVERS[0], &phases)?;
    let damage_step = DamageStep { session, problem, phases: &phases, system: None };
    let (body, cells) = match (problem.body.elements(), other.body.elements()) {
        (Elements::Quadratic(cells), _) => (&problem.body, cells),
        (_, Elements::Quadratic(cells)) => (&other.body, cells),
        _ => return Ok(None),
    };
    let (vertices, nodes) = (&body.vertices.partition, &body.nodes.partition);
    let [first, second, ..] = states else { return Ok(None) };
    let (mut k, mass) = (second.time - first.time, problem.mass());
    let mut linear = DamageSystem::new(session, body, mass, law.diffusion, k)?;
    let mut quadratic = DamageSystem::quadratic(session, body, cells, law.diffusion, k)?;
    let initial = problem.initial_damage_at(&body.nodes.points);
    let (mut z1, mut z2) = (problem.initial_damage(), initial.clone());
    let difference = |z1: &[f64], z2: &[f64]| subtract(z2, &body.at_nodes(z1));
    let (mut time, mut before): (f64, Option<[Vec<f64>; 2]>) = (first.time, None);
    for state in states {
        if let Order::Linear = problem.body.order() {
            // Active are the same nodes, and the midpoints between two of them.
            let mut active = vec![0.0; z1.len()];
            let points = state.contact.iter().filter(|point| point.active);
            points.for_each(|point| active[point.node] = 1.0);
            vertices.update(&mut active, 1)?;
            let active = body.at_nodes(&active);
            let bounds = other.constraints.bounds.iter();
            let guess: Vec<f64> = bounds.map(|bound| active[bound.node].floor()).collect();
            contact.set_warm_start(&guess);
        }
        let solved = contact.solve(0, state.time, &state.zeta)?;
        contact.accept(state.time)?;
        let source = Source::new(law, [problem, &other], state, &solved.state.u)?;
        let load = |d: &[f64]| {
            let values = source.values(law, cells.nodes, &body.at_nodes(&state.zeta), d);
            quadratic_load(body, cells, &values)
        };
        let load1 = damage_step.source(state).load.as_slice().to_vec();
        let mut load2 = load(&difference(&z1, &z2));
        if let Some([before1, before2]) = before {
            // Steps of equal length differ by rounding.
            if (state.time - time - k).abs() > 1e-6 * k {
                k = state.time - time;
                linear.set_step(k)?;
                quadratic.set_step(k)?;
            }
            linear.advance(&mean(&before1, &load1), &mut z1)?;
            vertices.update(&mut z1, 1)?;
            let from = z2.clone();
            for _ in 0..PASSES {
                z2.clone_from(&from);
                quadratic.advance(&mean(&before2, &load2), &mut z2)?;
                nodes.update(&mut z2, 1)?;
                load2 = load(&difference(&z1, &z2));
            }
        }
        (time, before) = (state.time, Some([load1, load2]));
    }
    let error = difference(&z1, &z2);
    let done = subtract(&initial, &z2);
    let mut change = vec![0.0; z1.len()];
    let mut indicators = Vec::new();
    let mut sums = [0.0; 2];
    let local = body.mesh.triangles.iter().zip(cells.nodes).zip(&body.triangles).enumerate();
    for (t, ((vertices, nodes), triangle)) in local {
        vertices.iter().zip(nodes).for_each(|(&vertex, &node)| change[vertex] = error[node]);
        if t < body.own_triangles {
            let square = |v: [f64; 6]| triangle.area() * mean_product(&v, &v, |a, b| a * b);
            sums[0] += square(nodes.map(|node| error[node]));
            sums[1] += square(nodes.map(|node| done[node]));
            let [a, b, c, ab, bc, ca] = nodes.map(|node| z2[node]);
            let inner = [ab - 0.5 * (a + b), bc - 0.5 * (b + c), ca - 0.5 * (c + a)];
            indicators.push(square([0.0, 0.0, 0.0, inner[0], inner[1], inner[2]]));
        }
    }
    nodes.comm().sum(&mut sums);
    indicators.iter_mut().for_each(|square| *square /= sums[1]);
    let relative = (sums[0] / sums[1]).sqrt();
    Ok(relative.is_finite().then_some(DamageError { relative, change, indicators }))
}

/// What φ of z₂ is made of, at the P2 nodes of each triangle.
struct Source {
    /// |ε(u)|².
    strain_squared: Vec<[f64; 6]>,
    /// c (φ(ε(u₂), ζ) − φ(ε(u₁), ζ)), 1/s.
    missing: Vec<[f64; 6]>,
}

impl Source {
    /// For the state of the run and the displacements `u` of the `other` order. Collective.
    fn new(
        law: &DamageLaw,
        [problem, other]: [&DiscreteProblem; 2],
        state: &State,
        u: &[f64],
    ) -> Result<Self, PetscError> {
        let body = &problem.body;
        let strains = [(body, &state.u[..]), (&other.body, u)];
        let [own, other] = strains.map(|(body, u)| strains_at_nodes(body, u));
        let zeta: Vec<[f64; 6]> =
            body.mesh.triangles.iter().map(|t| at_six(t.map(|i| state.zeta[i]))).collect();
        let distance = (0..body.own_triangles).map(|t| {
            let difference: [Vector3<f64>; 6] = array::from_fn(|i| own[t][i] - other[t][i]);
            let stress = difference.map(|strain| problem.elasticity.d * strain);
            let mean = zeta[t][..3].iter().map(|&z| law.truncate(z)).sum::<f64>() / 3.0;
            mean * body.triangles[t].area() * mean_product(&difference, &stress, Vector3::dot)
        });
        let distance = body.nodes.partition.comm().total(distance.sum());
        let at_points = problem.zeta_at_points(&state.zeta);
        let recovered = RecoveredStrains::new(body, &state.u)?;
        let square = recovered.energy_error(&problem.elasticity, &at_points, &state.u).error;
        let factor = match body.order() {
            Order::Linear => -(square / distance).max(1.0),
            Order::Quadratic => square / distance,
        };
        let factor = if distance > 0.0 { factor } else { 0.0 };
        let strain_squared = own.iter().map(|e| e.map(squared)).collect();
        let missing = (own.iter().zip(&other).zip(&zeta)).map(|((own, other), zeta)| {
            array::from_fn(|i| {
                let [own, other] = [own[i], other[i]].map(|e| law.source(squared(e), zeta[i]));
                factor * (own - other)
            })
        });
        Ok(Self { missing: missing.collect(), strain_squared })
    }

    /// φ of z₂ for ζ and d at the P2 nodes.
    fn values(
        &self,
        law: &DamageLaw,
        cells: &[[usize; 6]],
        zeta: &[f64],
        d: &[f64],
    ) -> Vec<[f64; 6]> {
        let value = |(t, nodes): (usize, &[usize; 6])| {
            array::from_fn(|i| {
                let (zeta, d) = (law.truncate(zeta[nodes[i]]), d[nodes[i]]);
                let z = law.truncate(zeta + d);
                let more = (zeta / z).powi(2);
                law.source(more * self.strain_squared[t][i], z) + more * self.missing[t][i]
            })
        };
        cells.iter().enumerate().map(value).collect()
    }
}

/// |ε|² of (ε_xx, ε_yy, 2ε_xy).
fn squared(e: Vector3<f64>) -> f64 {
    e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2]
}

/// An affine function at the vertices and the midpoints of the sides 01, 12, 20.
fn at_six([a, b, c]: [f64; 3]) -> [f64; 6] {
    [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)]
}

fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn mean(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
}
