//! Norms of the difference between fields on two meshes of the same body.

use super::locate::Locator;
use signorini::fem::Body;

/// The fields of one time at the nodes of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Fields {
    /// Displacements (u_x, u_y) in turn, m.
    pub u: Vec<f64>,
    /// ζ.
    pub zeta: Vec<f64>,
}

impl Fields {
    /// u = 0 and ζ = 0 at `nodes` nodes.
    pub fn zero(nodes: usize) -> Self {
        Self { u: vec![0.0; 2 * nodes], zeta: vec![0.0; nodes] }
    }
}

/// Norms of a displacement and a damage field.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Norms {
    /// ‖ε(u)‖ in L², the norm of V, m.
    pub strain: f64,
    /// |u| in H¹, m.
    pub gradient: f64,
    /// ‖ζ‖ in L², the norm of Y, m.
    pub zeta: f64,
    /// |ζ| in H¹.
    pub zeta_gradient: f64,
}

impl Norms {
    /// ‖u‖_V + ‖ζ‖_Y: what Corollary 7 bounds and Table 1 lists.
    pub fn sum(&self) -> f64 {
        self.strain + self.zeta
    }

    /// The larger of each.
    pub fn max(&self, other: &Self) -> Self {
        Self {
            strain: self.strain.max(other.strain),
            gradient: self.gradient.max(other.gradient),
            zeta: self.zeta.max(other.zeta),
            zeta_gradient: self.zeta_gradient.max(other.zeta_gradient),
        }
    }
}

/// The P1 functions of a coarse mesh seen from the triangles of a fine one.
///
/// Integrals are taken over the fine triangles by three inner points, exact for squares of P1
/// functions: without error where the fine mesh refines the coarse one, else but for the fine
/// triangles that an edge of the coarse mesh crosses.
pub struct Embedding<'a> {
    fine: &'a Body,
    coarse: &'a Body,
    /// For each point: the coarse triangle it is in and its barycentric coordinates there.
    points: Vec<(usize, [f64; 3])>,
}

/// Barycentric coordinates of the points in the fine triangle; their weights are equal.
const POINTS: [[f64; 3]; 3] = [[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]];
const SIXTH: f64 = 1.0 / 6.0;

impl<'a> Embedding<'a> {
    /// Of `coarse` in `fine`, two triangulations of the same body.
    pub fn new(fine: &'a Body, coarse: &'a Body) -> Self {
        let locator = Locator::new(coarse);
        let points = fine.mesh.triangles.iter().flat_map(|nodes| {
            let corners = nodes.map(|node| fine.mesh.nodes[node]);
            let at = |weights: &[f64; 3], axis: usize| -> f64 {
                SIXTH * (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f64>()
            };
            POINTS.map(|weights| locator.locate([at(&weights, 0), at(&weights, 1)]))
        });
        Self { fine, coarse, points: points.collect() }
    }

    /// The norms of `fine` − `coarse`, fields on the fine and on the coarse mesh.
    pub fn difference(&self, fine: &Fields, coarse: &Fields) -> Norms {
        let gradients: Vec<_> =
            (0..self.coarse.triangles.len()).map(|t| gradients(self.coarse, t, coarse)).collect();
        let mut squares = [0.0; 4];
        for (t, points) in self.points.chunks_exact(3).enumerate() {
            let slopes = self::gradients(self.fine, t, fine);
            let zeta = self.fine.mesh.triangles[t].map(|node| fine.zeta[node]);
            let mut of_triangle = [0.0; 4];
            for ((triangle, place), weights) in points.iter().zip(&POINTS) {
                let below = self.coarse.mesh.triangles[*triangle].map(|node| coarse.zeta[node]);
                let [ux, uy, z] = difference(&slopes, &gradients[*triangle]);
                let shear = ux[1] + uy[0];
                let value = SIXTH * dot(weights, &zeta) - dot(place, &below);
                of_triangle[0] += ux[0] * ux[0] + uy[1] * uy[1] + 0.5 * shear * shear;
                of_triangle[1] += ux[0] * ux[0] + ux[1] * ux[1] + uy[0] * uy[0] + uy[1] * uy[1];
                of_triangle[2] += value * value;
                of_triangle[3] += z[0] * z[0] + z[1] * z[1];
            }
            let weight = self.fine.triangles[t].area / 3.0;
            squares.iter_mut().zip(of_triangle).for_each(|(sum, part)| *sum += weight * part);
        }
        let [strain, gradient, zeta, zeta_gradient] = squares.map(f64::sqrt);
        Norms { strain, gradient, zeta, zeta_gradient }
    }
}

/// ∇u_x, ∇u_y and ∇ζ on triangle `t`.
fn gradients(body: &Body, t: usize, fields: &Fields) -> [[f64; 2]; 3] {
    let mut gradients = [[0.0; 2]; 3];
    for (&node, slope) in body.mesh.triangles[t].iter().zip(&body.triangles[t].gradients) {
        let values = [fields.u[2 * node], fields.u[2 * node + 1], fields.zeta[node]];
        for (gradient, value) in gradients.iter_mut().zip(values) {
            gradient[0] += slope[0] * value;
            gradient[1] += slope[1] * value;
        }
    }
    gradients
}

fn difference(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> [[f64; 2]; 3] {
    [0, 1, 2].map(|i| [a[i][0] - b[i][0], a[i][1] - b[i][1]])
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
