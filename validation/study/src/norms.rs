//! Norms of the difference between fields on two meshes of the same body.

use super::locate::Locator;
use nalgebra::{Matrix3x2, RowVector2, Vector2, Vector3, Vector4};
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
    points: Vec<(usize, Vector3<f64>)>,
}

/// Barycentric coordinates of the points in the fine triangle; their weights are equal.
const POINTS: [Vector3<f64>; 3] =
    [Vector3::new(4.0, 1.0, 1.0), Vector3::new(1.0, 4.0, 1.0), Vector3::new(1.0, 1.0, 4.0)];
const SIXTH: f64 = 1.0 / 6.0;

impl<'a> Embedding<'a> {
    /// Of `coarse` in `fine`, two triangulations of the same body.
    pub fn new(fine: &'a Body, coarse: &'a Body) -> Self {
        let locator = Locator::new(coarse);
        let points = fine.mesh.triangles.iter().flat_map(|nodes| {
            let corners = nodes.map(|node| Vector2::from(fine.mesh.nodes[node]));
            let at = |weights: Vector3<f64>| -> Vector2<f64> {
                SIXTH * (0..3).map(|i| weights[i] * corners[i]).sum::<Vector2<f64>>()
            };
            POINTS.map(|weights| locator.locate(at(weights).into()))
        });
        Self { fine, coarse, points: points.collect() }
    }

    /// The norms of `fine` − `coarse`, fields on the fine and on the coarse mesh.
    pub fn difference(&self, fine: &Fields, coarse: &Fields) -> Norms {
        let triangles = 0..self.coarse.triangles.len();
        let coarse_gradients: Vec<_> =
            triangles.map(|t| gradients(self.coarse, t, coarse)).collect();
        let mut squares = Vector4::zeros();
        for (t, points) in self.points.chunks_exact(3).enumerate() {
            let (fine_gradients, zeta) =
                (gradients(self.fine, t, fine), corners(self.fine, t, fine));
            let mut of_triangle = Vector4::zeros();
            for ((coarse_t, place), weights) in points.iter().zip(&POINTS) {
                let below = corners(self.coarse, *coarse_t, coarse);
                let value = SIXTH * zeta.dot(weights) - below.dot(place);
                let gradients = fine_gradients - coarse_gradients[*coarse_t];
                let u = gradients.fixed_rows::<2>(0);
                let strain = 0.5 * (u + u.transpose());
                of_triangle += Vector4::new(
                    strain.norm_squared(),
                    u.norm_squared(),
                    value * value,
                    gradients.row(2).norm_squared(),
                );
            }
            squares += self.fine.triangles[t].area() / 3.0 * of_triangle;
        }
        let [strain, gradient, zeta, zeta_gradient] = squares.map(f64::sqrt).into();
        Norms { strain, gradient, zeta, zeta_gradient }
    }
}

/// The rows ∇u_x, ∇u_y and ∇ζ on triangle `t`: Σ (u_x, u_y, ζ)_i ∇λ_iᵀ.
fn gradients(body: &Body, t: usize, fields: &Fields) -> Matrix3x2<f64> {
    let nodes = body.mesh.triangles[t].iter().zip(body.triangles[t].gradients());
    let values = |i: usize| Vector3::new(fields.u[2 * i], fields.u[2 * i + 1], fields.zeta[i]);
    nodes.map(|(&node, slope)| values(node) * RowVector2::from(*slope)).sum()
}

/// ζ at the corners of triangle `t`.
fn corners(body: &Body, t: usize, fields: &Fields) -> Vector3<f64> {
    body.mesh.triangles[t].map(|node| fields.zeta[node]).into()
}
