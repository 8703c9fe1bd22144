//! The mesh of a measurement: bisected everywhere.

use super::sizes::areas;
use crate::{
    fem::ON_SIDE,
    mesh::{Mesh, MeshError, Refinement, twice_area},
};

/// A mesh whose triangles have half the size of those of a coarse mesh.
pub(super) struct Finer {
    pub(super) mesh: Mesh,
    /// Per triangle: the triangle of the coarse mesh that contains it.
    pub(super) parents: Vec<usize>,
    /// Per new node: the ends of the edge that it halves. The new nodes follow the nodes of the coarse mesh.
    pub(super) halved_edges: Vec<[usize; 2]>,
}

impl Finer {
    /// Divides the triangles of `mesh` into parts of half their size.
    ///
    /// # Errors
    /// A triangle cannot be bisected.
    pub(super) fn new(mesh: &Mesh) -> Result<Self, MeshError> {
        let refinement = Refinement::start(mesh.clone()).refine_everywhere()?;
        let Refinement { mesh, parent_of_triangle: parents, halved_edges, .. } = refinement;
        Ok(Self { mesh, parents, halved_edges })
    }

    /// A field at the vertices, from its values at the vertices of the coarse mesh, affine on its triangles.
    pub(super) fn interpolated(&self, mut values: Vec<f64>) -> Vec<f64> {
        for &[a, b] in &self.halved_edges {
            values.push(0.5 * (values[a] + values[b]));
        }
        values
    }
}

/// Per triangle: does it touch one of the points? A point outside all triangles, as beyond a chord, touches the nearest
/// ones.
pub(super) fn touching(mesh: &Mesh, points: &[[f64; 2]]) -> Vec<bool> {
    let mut touching = vec![false; mesh.triangles.len()];
    for &point in points {
        // The smallest barycentric coordinate of the point.
        let depth = |nodes: &[usize; 3]| {
            let [a, b, c] = nodes.map(|node| mesh.nodes[node]);
            let parts = [[a, b], [b, c], [c, a]].map(|[p, q]| twice_area(p, q, point));
            parts.into_iter().fold(f64::INFINITY, f64::min) / twice_area(a, b, c)
        };
        let depths: Vec<f64> = mesh.triangles.iter().map(depth).collect();
        let deepest = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (touches, depth) in touching.iter_mut().zip(depths) {
            *touches |= depth >= deepest.min(0.0) - ON_SIDE;
        }
    }
    touching
}

/// The size of the largest triangle of `mesh` that touches `point`: the side of a square of twice its area, m.
pub(super) fn size_at(mesh: &Mesh, point: [f64; 2]) -> f64 {
    let here = touching(mesh, &[point]);
    let areas = areas(mesh).into_iter().zip(here).filter(|(_, touches)| *touches);
    areas.fold(0.0, |most, (area, _)| f64::max(most, 2.0 * area)).sqrt()
}
