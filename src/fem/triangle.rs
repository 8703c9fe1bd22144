//! The P1 triangle.

use crate::mesh::twice_area;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, SVector, Vector3};

/// Area and gradients of the three barycentric functions of one triangle.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Area |T|, m².
    pub area: f64,
    /// ∇λ_i, constant on the triangle, 1/m.
    pub gradients: [[f64; 2]; 3],
}

impl Triangle {
    /// From the corners in counter-clockwise order.
    pub fn new(corners: [[f64; 2]; 3]) -> Self {
        let [a, b, c] = corners;
        let twice = twice_area(a, b, c);
        // ∇λ_a is the opposite side turned by 90° over twice the area.
        let gradient = |p: [f64; 2], q: [f64; 2]| [(p[1] - q[1]) / twice, (q[0] - p[0]) / twice];
        Self { area: 0.5 * twice, gradients: [gradient(b, c), gradient(c, a), gradient(a, b)] }
    }

    /// The 3×2 matrix B_i with (ε_xx, ε_yy, 2ε_xy) = Σ B_i u_i over the corners.
    fn strain_matrix(&self, i: usize) -> Matrix3x2<f64> {
        let [dx, dy] = self.gradients[i];
        Matrix3x2::new(dx, 0.0, 0.0, dy, dy, dx)
    }

    /// The 2×2 block K_ij = ∫ Aε(φ_i) : ε(φ_j) = |T| B_iᵀ D B_j of two corners, N/m per metre of
    /// thickness, from the matrix D of A.
    pub fn stiffness(&self, d: &Matrix3<f64>, i: usize, j: usize) -> Matrix2<f64> {
        self.strain_matrix(i).transpose() * d * self.strain_matrix(j) * self.area
    }

    /// The strain (ε_xx, ε_yy, 2ε_xy) of nodal displacements (u_1x, u_1y, …, u_3y).
    #[inline(always)]
    pub fn strain(&self, u: &[f64; 6]) -> Vector3<f64> {
        let mut strain = Vector3::zeros();
        for (i, [dx, dy]) in self.gradients.iter().enumerate() {
            strain[0] += dx * u[2 * i];
            strain[1] += dy * u[2 * i + 1];
            strain[2] += dy * u[2 * i] + dx * u[2 * i + 1];
        }
        strain
    }

    /// ∇u, entry (i, j) = ∂u_i/∂x_j, of nodal displacements (u_1x, u_1y, …, u_3y).
    pub fn gradient(&self, u: &[f64; 6]) -> Matrix2<f64> {
        let entry = |i, j| (0..3).map(|k| u[2 * k + i] * self.gradients[k][j]).sum();
        Matrix2::from_fn(entry)
    }

    /// The nodal forces F_i = ∫ σ : ε(φ_i) = |T| B_iᵀ σ of a constant stress (σ_xx, σ_yy, σ_xy).
    #[inline(always)]
    pub fn force(&self, stress: &Vector3<f64>) -> SVector<f64, 6> {
        let mut force = SVector::zeros();
        for (i, [dx, dy]) in self.gradients.iter().enumerate() {
            force[2 * i] = self.area * (dx * stress[0] + dy * stress[2]);
            force[2 * i + 1] = self.area * (dy * stress[1] + dx * stress[2]);
        }
        force
    }

    /// The consistent mass M_ij = ∫ λ_i λ_j = |T|/12 (1 + δ_ij), m².
    pub fn mass(&self) -> Matrix3<f64> {
        let off = self.area / 12.0;
        Matrix3::from_fn(|i, j| if i == j { 2.0 * off } else { off })
    }

    /// The Laplace matrix L_ij = ∫ ∇λ_i·∇λ_j.
    pub fn laplace(&self) -> Matrix3<f64> {
        let g = &self.gradients;
        Matrix3::from_fn(|i, j| self.area * (g[i][0] * g[j][0] + g[i][1] * g[j][1]))
    }
}
