//! The P1 triangle, of ζ at both orders.

use super::element::{Element, QuadraturePoint};
use crate::mesh::twice_area;
use nalgebra::Matrix3;

/// The P1 triangle: area and gradients of the three barycentric functions.
pub type Triangle = Element<3, 1>;

impl Triangle {
    /// From the corners in counter-clockwise order.
    pub fn new(corners: [[f64; 2]; 3]) -> Self {
        let [a, b, c] = corners;
        let twice = twice_area(a, b, c);
        // ∇λ_a is the opposite side turned by 90° over twice the area.
        let gradient = |p: [f64; 2], q: [f64; 2]| [(p[1] - q[1]) / twice, (q[0] - p[0]) / twice];
        let gradients = [gradient(b, c), gradient(c, a), gradient(a, b)];
        Self { points: [QuadraturePoint { weight: 0.5 * twice, gradients }] }
    }

    /// ∇λ_i, 1/m.
    #[inline(always)]
    pub fn gradients(&self) -> &[[f64; 2]; 3] {
        &self.points[0].gradients
    }

    /// The consistent mass M_ij = ∫ λ_i λ_j = |T|/12 (1 + δ_ij), m².
    pub fn mass(&self) -> Matrix3<f64> {
        let off = self.area() / 12.0;
        Matrix3::from_fn(|i, j| if i == j { 2.0 * off } else { off })
    }

    /// The Laplace matrix L_ij = ∫ ∇λ_i·∇λ_j.
    pub fn laplace(&self) -> Matrix3<f64> {
        let (g, area) = (self.gradients(), self.area());
        Matrix3::from_fn(|i, j| area * (g[i][0] * g[j][0] + g[i][1] * g[j][1]))
    }
}
