//! What the mesh does to the damage.
//!
//! The damage z of a much finer mesh is ζ + δ + β, with ζ that of the run, δ affine and β = z − Iz, 0 at
//! the vertices. With b* the load of z's source φ*, (28) for both leaves
//!
//! (M + kκL) δ_n = M δ_{n−1} + k (b* − b)_i − ∫ (β_n − β_{n−1}) λ_i − kκ ∫ ∇β_n·∇λ_i,
//!
//! solved with a few long steps, in turn with the equation of z tested by the bubbles of the edges, for β
//! ([`Bubbles`]). φ* comes from the strains ε* of a much finer mesh for the same ζ ([`BestStrains`]): as
//! strains at the same stress go like 1/ζ, φ* = φ((ζ/z)² |ε*|², z).

use super::{
    DiscreteProblem, Outcome, Phases, RunError, State,
    best_strains::BestStrains,
    both_orders::BothOrders,
    bubbles::{BubbleSystem, Bubbles},
    contact_step::Compliance,
    damage_step::DamageStep,
    instants::Instants,
};
use crate::{
    fem::{
        affine_diffusion, bubble_flux, bubble_load, bulged, diffusion_load, interpolation_error,
        mean_product, missing_mass, quadratic_load,
    },
    model::DamageLaw,
    petsc::PetscError,
    scene::Stepping,
};
use nalgebra::Vector3;
use std::array;

/// The estimated error that the mesh makes in the damage.
pub(super) struct DamageError {
    /// ‖z − ζ‖ / ‖ζ₀ − z‖ in L².
    pub(super) relative: f64,
    /// z − ζ at the vertices.
    pub(super) change: Vec<f64>,
    /// See [`Outcome::damage_indicators`](super::Outcome).
    pub(super) indicators: Vec<f64>,
    /// How long after z the run's ζ has fallen to the same least value, s: at the last instant when both
    /// still fall, if there is one.
    pub(super) delay: Option<f64>,
}

/// The error that the mesh makes in the last damage; `None` without damage, or where the active nodes
/// of a state alone do not support the body. Collective.
pub(super) fn mesh_error(
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
    let estimate = damage_error(problem, damage_step, compliance, laws, &instants, stopped);
    let told = comm.all(estimate.is_ok());
    estimate.ok().flatten().filter(|_| told)
}

/// From the first instant to the last, where the run may have `stopped` at ζ_*.
fn damage_error(
    problem: &DiscreteProblem,
    damage_step: &mut DamageStep,
    mut compliance: Compliance,
    laws: &[DamageLaw],
    instants: &Instants,
    stopped: bool,
) -> Result<Option<DamageError>, RunError> {
    let session = damage_step.session;
    let [first, .., last] = &instants.states[..] else { return Ok(None) };
    // K makes room for what P2 has.
    compliance.keep_factor(last)?;
    let other = problem.of_other_order(session)?;
    let phases = Phases::default();
    let orders = BothOrders::new(session, problem, &other, compliance, last, &phases)?;
    let Some(orders) = orders else { return Ok(None) };
    let fine = orders.problems()[1];
    let mut strains = BestStrains::new(orders, stopped);
    let mut error = ZetaError {
        problem,
        laws,
        diffusions: problem.diffusions(),
        bubbles: Bubbles::new(session, fine),
        change: vec![0.0; first.zeta.len()],
        middles: interpolation_error(&problem.body, &first.zeta)?,
        source: Vec::new(),
        own: Vec::new(),
        step: problem.scene().time.map_or(0.0, |grid| match grid.stepping {
            Stepping::Uniform { steps } => grid.end / steps as f64,
            Stepping::Auto { .. } => 0.0,
        }),
        delay: None,
    };
    let initial = error.middles.clone();
    let mut before: Option<&State> = None;
    for state in &instants.states {
        let Some(strain_squared) = strains.squared(state)? else { return Ok(None) };
        let own = damage_step.source(state).load.as_slice().to_vec();
        let source = |error: &ZetaError| error.source(state, &strain_squared);
        if let Some(before) = before {
            error.advance(damage_step, [before, state], &own, source)?;
        }
        (error.source, error.own) = (source(&error), own);
        let least = error.least(state);
        if least > problem.threshold() {
            error.delay = instants.delay(state.time, least).or(error.delay);
        }
        before = Some(state);
    }
    Ok(error.judged(&initial, last))
}

/// Steps whose lengths differ by less than this factor share a damage system: the change of δ in one is
/// proportional to its length.
const ALIKE: f64 = 1.7;

/// z − ζ of an instant.
struct ZetaError<'a> {
    problem: &'a DiscreteProblem,
    /// Of the materials by their numbers.
    laws: &'a [DamageLaw],
    /// κ of each, m²/s.
    diffusions: Vec<f64>,
    bubbles: Bubbles<'a>,
    /// δ.
    change: Vec<f64>,
    /// β at the midpoints of the sides of each triangle.
    middles: Vec<[f64; 3]>,
    /// φ* at the vertices and midpoints of each triangle, 1/s.
    source: Vec<[f64; 6]>,
    /// b, m²/s.
    own: Vec<f64>,
    /// The k of the damage system, s: at first that of the run's, where its steps are equal.
    step: f64,
    /// See [`DamageError`].
    delay: Option<f64>,
}

impl ZetaError<'_> {
    /// From one state to the next one, whose b is `own` and whose φ* is found from an error.
    fn advance(
        &mut self,
        damage_step: &mut DamageStep,
        [before, state]: [&State; 2],
        own: &[f64],
        source: impl Fn(&Self) -> Vec<[f64; 6]>,
    ) -> Result<(), RunError> {
        let body = &self.problem.body;
        let k = state.time - before.time;
        if !(1.0 / ALIKE..ALIKE).contains(&(k / self.step)) {
            self.step = k;
        }
        let (start, change) = (self.middles.clone(), self.change.clone());
        let pairs = state.zeta.iter().zip(&before.zeta);
        let rates: Vec<f64> = pairs.map(|(now, before)| (now - before) / k).collect();
        let next = source(self);
        let mean = |t: usize| array::from_fn(|i| 0.5 * (self.source[t][i] + next[t][i]));
        let mean: Vec<[f64; 6]> = (0..next.len()).map(mean).collect();
        let mut rhs: Vec<f64> = self.own.iter().zip(own).map(|(a, b)| -0.5 * (a + b)).collect();
        let sampled = self.sampled(&rates, &rhs, state)?;
        let bubbles = self.bubbles.system(k);
        self.middles = self.bulges((&bubbles, k), &start, &sampled, state, &change, &mean)?;
        for (t, (nodes, triangle)) in body.mesh.triangles.iter().zip(&body.triangles).enumerate() {
            let middles = self.middles[t];
            let growth = array::from_fn(|i| (middles[i] - start[t][i]) / k);
            let rate = nodes.map(|node| rates[node]);
            let load = quadratic_load(triangle, mean[t]);
            let mass = missing_mass(self.problem.mass(), triangle, rate, growth);
            let diffusion = diffusion_load(triangle, middles);
            let kappa = self.diffusions[body.material(t)];
            for (i, &node) in nodes.iter().enumerate() {
                rhs[node] += load[i] - mass[i] - kappa * diffusion[i];
            }
        }
        damage_step.system(self.step)?.advance(&rhs, &mut self.change)?;
        let part = k / self.step;
        let steps = self.change.iter_mut().zip(&change);
        steps.for_each(|(after, before)| *after = before + part * (*after - before));
        body.vertices.partition.update(&mut self.change, 1)?;
        self.middles = self.bulges((&bubbles, k), &start, &sampled, state, &change, &mean)?;
        Ok(())
    }

    /// The rate that ζ would have had from the sources at two instants alone, whose −b in the mean is
    /// `negative_load`: its own `rates` less (M ζ′ + κL ζ − b)_i over the weight of the vertex.
    fn sampled(
        &self,
        rates: &[f64],
        negative_load: &[f64],
        state: &State,
    ) -> Result<Vec<f64>, PetscError> {
        let body = &self.problem.body;
        let (mut rest, mut weights) = (negative_load.to_vec(), vec![0.0; rates.len()]);
        for (t, (nodes, triangle)) in body.mesh.triangles.iter().zip(&body.triangles).enumerate() {
            let kappa = self.diffusions[body.material(t)];
            let mass = self.problem.mass().of(triangle) * Vector3::from(nodes.map(|i| rates[i]));
            let diffusion = affine_diffusion(triangle, nodes.map(|i| state.zeta[i]));
            for (i, &node) in nodes.iter().enumerate() {
                rest[node] += mass[i] + kappa * diffusion[i];
                weights[node] += triangle.area() / 3.0;
            }
        }
        let less = rates.iter().zip(rest.iter().zip(&weights));
        let mut sampled: Vec<f64> =
            less.map(|(rate, (rest, weight))| rate - rest / weight).collect();
        body.vertices.partition.update(&mut sampled, 1)?;
        Ok(sampled)
    }

    /// β of `state` from that of the instant before, `start`, where δ was `change`, with φ* and the
    /// `rates` of ζ between them. Collective.
    fn bulges(
        &self,
        (system, k): (&BubbleSystem, f64),
        start: &[[f64; 3]],
        rates: &[f64],
        state: &State,
        change: &[f64],
        source: &[[f64; 6]],
    ) -> Result<Vec<[f64; 3]>, PetscError> {
        let body = &self.problem.body;
        let vertices = self.at_vertices(state);
        let rate = |i: usize| rates[i] + (self.change[i] - change[i]) / k;
        system.advance(start, |t| {
            let (nodes, triangle) = (body.mesh.triangles[t], &body.triangles[t]);
            let rate = bulged(nodes.map(rate), [0.0; 3]);
            let load = bubble_load(triangle, array::from_fn(|i| source[t][i] - rate[i]));
            let flux = bubble_flux(triangle, nodes.map(|node| vertices[node]));
            let kappa = self.diffusions[body.material(t)];
            array::from_fn(|i| load[i] - kappa * flux[i])
        })
    }

    /// ζ + δ, with ζ of `state`.
    fn at_vertices(&self, state: &State) -> Vec<f64> {
        state.zeta.iter().zip(&self.change).map(|(zeta, d)| zeta + d).collect()
    }

    /// min z at the vertices. Collective.
    fn least(&self, state: &State) -> f64 {
        self.problem.body.vertices.partition.min_max(&self.at_vertices(state)).0
    }

    /// z − ζ at the vertices and midpoints of triangle `t`.
    fn at(&self, t: usize) -> [f64; 6] {
        bulged(self.problem.body.mesh.triangles[t].map(|node| self.change[node]), self.middles[t])
    }

    /// φ* of `state`, with |ε*|² = `strain_squared`.
    fn source(&self, state: &State, strain_squared: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let body = &self.problem.body;
        let of = |(t, nodes): (usize, &[usize; 3])| {
            let law = &self.laws[body.material(t)];
            let (zeta, error) = (bulged(nodes.map(|node| state.zeta[node]), [0.0; 3]), self.at(t));
            array::from_fn(|i| {
                let (zeta, z) = (law.truncate(zeta[i]), law.truncate(zeta[i] + error[i]));
                law.source((zeta / z).powi(2) * strain_squared[t][i], z)
            })
        };
        body.mesh.triangles.iter().enumerate().map(of).collect()
    }

    /// The error of the last state, from β at the first one. Collective.
    fn judged(self, initial: &[[f64; 3]], last: &State) -> Option<DamageError> {
        let body = &self.problem.body;
        let start = self.problem.initial_damage();
        let (mut sums, mut indicators) = ([0.0; 2], Vec::with_capacity(body.own_triangles));
        for (t, nodes) in body.mesh.triangles.iter().enumerate().take(body.own_triangles) {
            let square =
                |v: [f64; 6]| body.triangles[t].area() * mean_product(&v, &v, |a, b| a * b);
            let error = self.at(t);
            let fallen = bulged(nodes.map(|node| start[node] - last.zeta[node]), initial[t]);
            sums[0] += square(error);
            sums[1] += square(array::from_fn(|i| fallen[i] - error[i]));
            indicators.push(square(bulged([0.0; 3], self.middles[t])));
        }
        body.vertices.partition.comm().sum(&mut sums);
        indicators.iter_mut().for_each(|square| *square /= sums[1]);
        let relative = (sums[0] / sums[1]).sqrt();
        let (change, delay) = (self.change, self.delay);
        relative.is_finite().then_some(DamageError { relative, change, indicators, delay })
    }
}
