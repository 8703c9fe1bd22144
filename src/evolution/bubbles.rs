//! What a quadratic field adds to its affine part: β = Σ β_e w_e, with the bubble w_e = 4 λ_a λ_b of each
//! edge e = ab.

use super::DiscreteProblem;
use crate::{
    fem::{Body, Elements, bubble_diffusion, bubble_mass},
    petsc::{Operator, PetscError, Session, solve_by_energy},
};
use std::array;

/// The bubbles of a body, one in the place of each midpoint of its P2 nodes.
pub(super) struct Bubbles<'a> {
    session: &'a Session,
    body: &'a Body,
    /// The bubbles of the sides 01, 12, 20 of each triangle.
    sides: Vec<[usize; 3]>,
    /// κ of each triangle, m²/s.
    diffusion: Vec<f64>,
}

/// The equations of the bubbles for a step.
pub(super) struct BubbleSystem<'a> {
    bubbles: &'a Bubbles<'a>,
    /// s.
    k: f64,
    diagonal: Vec<f64>,
}

/// The residual that the iterations for β may leave, as a part of that of the start; their number.
const REST: f64 = 0.1;
const ITERATIONS: usize = 30;

impl<'a> Bubbles<'a> {
    /// Of the body of `fine`, which is of order 2.
    pub(super) fn new(session: &'a Session, fine: &'a DiscreteProblem) -> Self {
        let body = &fine.body;
        let sides = match body.elements() {
            Elements::Quadratic(cells) => {
                cells.nodes.iter().map(|&[.., ab, bc, ca]| [ab, bc, ca]).collect()
            }
            Elements::Linear(_) => Vec::new(),
        };
        let kappa = fine.diffusions();
        let diffusion = (0..body.triangles.len()).map(|t| kappa[body.material(t)]).collect();
        Self { session, body, sides, diffusion }
    }

    /// The system of a step of `k` s, (β, w) + k (κ∇β, ∇w) for all bubbles w.
    pub(super) fn system(&self, k: f64) -> BubbleSystem<'_> {
        let mut system = BubbleSystem { bubbles: self, k, diagonal: Vec::new() };
        let unit = |i: usize| array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
        system.diagonal = self.assembled(|t| [0, 1, 2].map(|i| system.of(t, unit(i))[i]));
        system
    }

    /// The values of a field of bubbles on triangle `t`.
    fn on(&self, t: usize, field: &[f64]) -> [f64; 3] {
        self.sides[t].map(|bubble| field[bubble])
    }

    /// Sums over the triangles around each edge.
    fn assembled(&self, of: impl Fn(usize) -> [f64; 3]) -> Vec<f64> {
        let mut sums = vec![0.0; self.body.nodes.points.len()];
        for (t, sides) in self.sides.iter().enumerate() {
            sides.iter().zip(of(t)).for_each(|(&bubble, value)| sums[bubble] += value);
        }
        sums
    }
}

impl BubbleSystem<'_> {
    /// Its part of triangle `t` applied to a β there.
    fn of(&self, t: usize, values: [f64; 3]) -> [f64; 3] {
        let Self { bubbles, k, .. } = *self;
        let triangle = &bubbles.body.triangles[t];
        let diffusion = bubble_diffusion(triangle, values);
        let mass = bubble_mass(triangle, values);
        array::from_fn(|i| mass[i] + k * bubbles.diffusion[t] * diffusion[i])
    }

    /// β_n at the midpoints of the sides of each triangle, from β_{n−1} = `before`, with
    ///
    /// (β_n − β_{n−1}, w) + k (κ∇β_n, ∇w) = k r(w) for all bubbles w,
    ///
    /// r of the three on triangle t being `residual(t)`. The system is well conditioned on any mesh:
    /// conjugate gradients with its diagonal take a few iterations. Collective.
    pub(super) fn advance(
        &self,
        before: &[[f64; 3]],
        residual: impl Fn(usize) -> [f64; 3],
    ) -> Result<Vec<[f64; 3]>, PetscError> {
        let Self { bubbles, k, ref diagonal } = *self;
        let (body, partition) = (bubbles.body, &bubbles.body.nodes.partition);
        let b = bubbles.assembled(|t| {
            let (mass, r) = (bubble_mass(&body.triangles[t], before[t]), residual(t));
            array::from_fn(|i| mass[i] + k * r[i])
        });
        let owned = partition.owned();
        let first = b[..owned].iter().zip(diagonal).filter(|(_, d)| **d > 0.0);
        let start = partition.comm().total(first.map(|(b, d)| b * b / d).sum());
        let mut operator = Iteration { system: self, start };
        let found = solve_by_energy(bubbles.session, &mut operator, &b[..owned], ITERATIONS)?;
        let mut beta = found.unwrap_or_default();
        beta.resize(b.len(), 0.0);
        partition.update(&mut beta, 1)?;
        Ok((0..bubbles.sides.len()).map(|t| bubbles.on(t, &beta)).collect())
    }
}

/// The system of the bubbles as conjugate gradients see it.
struct Iteration<'a> {
    system: &'a BubbleSystem<'a>,
    /// rᵀD⁻¹r at the start.
    start: f64,
}

impl Operator for Iteration<'_> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let bubbles = self.system.bubbles;
        let mut field = x.to_vec();
        field.resize(bubbles.body.nodes.points.len(), 0.0);
        bubbles.body.nodes.partition.update(&mut field, 1)?;
        let image = bubbles.assembled(|t| self.system.of(t, bubbles.on(t, &field)));
        // Nodes that are no bubbles.
        let rows = image.iter().zip(&self.system.diagonal).zip(x);
        y.iter_mut()
            .zip(rows)
            .for_each(|(y, ((image, d), x))| *y = if *d > 0.0 { *image } else { *x });
        Ok(())
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError> {
        let rows = r.iter().zip(&self.system.diagonal);
        z.iter_mut().zip(rows).for_each(|(z, (r, d))| *z = if *d > 0.0 { r / d } else { *r });
        Ok(())
    }

    fn is_enough(&self, _gained: f64, left: f64) -> bool {
        left <= REST * REST * self.start
    }
}
