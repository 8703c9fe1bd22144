//! The body: its mesh, the geometry of its triangles, and which nodes this rank owns.

use super::{Partition, Triangle};
use crate::mesh::Mesh;
use nalgebra::Vector3;

/// A triangulated body, or the subdomain of it that this rank keeps.
#[derive(Debug)]
pub struct Body {
    /// The triangulation.
    pub mesh: Mesh,
    /// Area and gradients, one per triangle of the mesh.
    pub triangles: Vec<Triangle>,
    /// The first so many triangles belong to this rank; every triangle belongs to one rank.
    pub own_triangles: usize,
    /// Ownership of the nodes.
    pub partition: Partition,
    /// ∫ λ_i, m²: the weight of each node in an integral.
    pub node_area: Vec<f64>,
    /// |Ω| of the undivided body, m².
    pub area: f64,
    /// Its centroid x̄, m.
    pub centroid: [f64; 2],
    /// Its ∫|x − x̄|², m⁴.
    pub polar_inertia: f64,
}

impl Body {
    /// The undivided body, on one rank.
    pub fn new(mesh: Mesh) -> Self {
        let corners = |t: &[usize; 3]| t.map(|node| mesh.nodes[node]);
        let triangles: Vec<Triangle> =
            mesh.triangles.iter().map(|t| Triangle::new(corners(t))).collect();
        let partition = Partition::serial(mesh.nodes.len());
        let node_area = node_area(&mesh, &triangles);
        let (own_triangles, area) = (triangles.len(), node_area.iter().sum::<f64>());
        let mean = |of: &dyn Fn([f64; 2]) -> f64| {
            let weighted = mesh.nodes.iter().zip(&node_area).map(|(&x, a)| a * of(x));
            weighted.sum::<f64>() / area
        };
        let centroid = [mean(&|x| x[0]), mean(&|x| x[1])];
        let polar = |[x, y]: [f64; 2]| (x - centroid[0]).powi(2) + (y - centroid[1]).powi(2);
        let polar_inertia = area * mean(&polar);
        Self { mesh, triangles, own_triangles, partition, node_area, area, centroid, polar_inertia }
    }

    /// Whether this rank knows all triangles around the nodes that it owns: their parts of
    /// ∫ λ_i add up to the value in the undivided body.
    pub fn is_covered(&self) -> bool {
        let known = node_area(&self.mesh, &self.triangles);
        let mut areas = known.iter().zip(&self.node_area).take(self.partition.owned());
        areas.all(|(known, area)| (known - area).abs() <= 1e-9 * area)
    }

    /// The six displacements (u_1x, u_1y, …, u_3y) of a triangle from a nodal field.
    #[inline(always)]
    pub fn gather(&self, triangle: usize, u: &[f64]) -> [f64; 6] {
        let [a, b, c] = self.mesh.triangles[triangle];
        [u[2 * a], u[2 * a + 1], u[2 * b], u[2 * b + 1], u[2 * c], u[2 * c + 1]]
    }

    /// The strain (ε_xx, ε_yy, 2ε_xy) of a triangle from nodal displacements.
    #[inline(always)]
    pub fn strain(&self, triangle: usize, u: &[f64]) -> Vector3<f64> {
        self.triangles[triangle].strain(&self.gather(triangle, u))
    }

    /// ∫ζ/|Ω| of a nodal field. Collective.
    pub fn mean(&self, field: &[f64]) -> f64 {
        self.partition.dot(&self.node_area, field, 1) / self.area
    }
}

/// ∫ λ_i over `triangles`, m²: a third of each triangle around a node.
fn node_area(mesh: &Mesh, triangles: &[Triangle]) -> Vec<f64> {
    let mut area = vec![0.0; mesh.nodes.len()];
    for (nodes, triangle) in mesh.triangles.iter().zip(triangles) {
        nodes.iter().for_each(|&node| area[node] += triangle.area / 3.0);
    }
    area
}
