//! The damage system (28) for quadratic functions in the hierarchical basis, by conjugate gradients.

use crate::{
    fem::{Body, DamageSystem},
    petsc::{Operator, PetscError, Session, solve_by_energy},
};
use nalgebra::{Matrix6, Vector6};

/// The matrix M + kκL, triangle by triangle.
pub(super) struct QuadraticSystem<'a> {
    /// The body with elements of P2, and the six nodes of each.
    body: &'a Body,
    nodes: &'a [[usize; 6]],
    matrices: Vec<Matrix6<f64>>,
    diagonal: Vec<f64>,
    /// The nodes at the vertices that this rank owns.
    vertices: &'a [usize],
    /// The factorised system in P1 for a step of about this length, and the length of that step, s.
    linear: (&'a mut DamageSystem, f64),
}

/// The fraction of the energy of the solution that the iteration may leave, and the maximum number of iterations.
const REST: f64 = 1e-3;
const ITERATIONS: usize = 30;

impl<'a> QuadraticSystem<'a> {
    pub(super) fn new(
        body: &'a Body,
        nodes: &'a [[usize; 6]],
        matrices: Vec<Matrix6<f64>>,
        vertices: &'a [usize],
        linear: (&'a mut DamageSystem, f64),
    ) -> Self {
        let mut diagonal = vec![0.0; body.nodes.points.len()];
        for (nodes, matrix) in nodes.iter().zip(&matrices) {
            nodes.iter().zip(&matrix.diagonal()).for_each(|(&node, d)| diagonal[node] += d);
        }
        Self { body, nodes, matrices, diagonal, vertices, linear }
    }

    /// The field with this `load`. Collective.
    pub(super) fn solve(
        &mut self,
        session: &Session,
        load: &[f64],
    ) -> Result<Vec<f64>, PetscError> {
        let partition = &self.body.nodes.partition;
        let found = solve_by_energy(session, self, &load[..partition.owned()], ITERATIONS)?;
        partition.field(found.unwrap_or_else(|| vec![0.0; partition.owned()]), 1)
    }
}

impl Operator for QuadraticSystem<'_> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let field = self.body.nodes.partition.field(x.to_vec(), 1)?;
        let mut image = vec![0.0; field.len()];
        for (nodes, matrix) in self.nodes.iter().zip(&self.matrices) {
            let of_triangle = matrix * Vector6::from(nodes.map(|node| field[node]));
            nodes.iter().zip(&of_triangle).for_each(|(&node, value)| image[node] += value);
        }
        y.copy_from_slice(&image[..y.len()]);
        Ok(())
    }

    /// Divides the bubbles by the diagonal, and applies the inverse of the P1 matrix at the vertices.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError> {
        z.iter_mut().zip(r).zip(&self.diagonal).for_each(|((z, r), diagonal)| *z = r / diagonal);
        let (linear, k) = &mut self.linear;
        let load: Vec<f64> = self.vertices.iter().map(|&node| r[node] / *k).collect();
        let solved = linear.correction(&load)?.unwrap_or_default();
        self.vertices.iter().zip(solved).for_each(|(&node, change)| z[node] = change);
        Ok(())
    }

    fn is_enough(&self, gained: f64, left: f64) -> bool {
        left <= REST * gained
    }
}
