//! The body: its mesh, the geometry of its triangles, and its share on this rank.

use super::{Partition, Triangle};
use crate::mesh::Mesh;

/// A triangulated body.
#[derive(Debug)]
pub struct Body {
    /// The triangulation.
    pub mesh: Mesh,
    /// Area and gradients, one per triangle of the mesh.
    pub triangles: Vec<Triangle>,
    /// Of these, the first so many are this rank's own: every triangle is one rank's.
    pub own_triangles: usize,
    /// Ownership of the nodes.
    pub partition: Partition,
    /// ∫ λ_i, m²: the weight of each node in an integral.
    pub node_area: Vec<f64>,
    /// |Ω| of the whole body, m².
    pub area: f64,
    /// Its centroid x̄, m.
    pub centroid: [f64; 2],
    /// ∫|x − x̄|², m⁴.
    pub polar_inertia: f64,
}

impl Body {
    /// The whole of `mesh` on one rank.
    pub fn new(mesh: Mesh) -> Self {
        let corners = |t: &[usize; 3]| t.map(|node| mesh.nodes[node]);
        let triangles: Vec<Triangle> =
            mesh.triangles.iter().map(|t| Triangle::new(corners(t))).collect();
        let partition = Partition::whole(mesh.nodes.len());
        let mut node_area = vec![0.0; mesh.nodes.len()];
        for (t, triangle) in mesh.triangles.iter().zip(&triangles) {
            for &node in t {
                node_area[node] += triangle.area / 3.0;
            }
        }
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

    /// Whether the triangles known here are all those around the nodes owned: their shares of the
    /// areas of these nodes add up.
    pub fn is_covered(&self) -> bool {
        let mut area = vec![0.0; self.mesh.nodes.len()];
        for (t, triangle) in self.mesh.triangles.iter().zip(&self.triangles) {
            t.iter().for_each(|&node| area[node] += triangle.area / 3.0);
        }
        let owned = self.partition.owned();
        let mut both = area[..owned].iter().zip(&self.node_area);
        both.all(|(found, whole)| (found - whole).abs() <= 1e-9 * whole)
    }

    /// The six displacements of a triangle out of a nodal field.
    #[inline(always)]
    pub fn gather(&self, triangle: usize, u: &[f64]) -> [f64; 6] {
        let [a, b, c] = self.mesh.triangles[triangle];
        [u[2 * a], u[2 * a + 1], u[2 * b], u[2 * b + 1], u[2 * c], u[2 * c + 1]]
    }

    /// ∫ζ/|Ω| of a nodal field.
    pub fn mean(&self, field: &[f64]) -> f64 {
        self.partition.dot(&self.node_area, field, 1) / self.area
    }
}
