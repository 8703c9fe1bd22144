//! The elements: the P1 triangle, and the P2 triangle with straight or curved sides.

use crate::mesh::{jacobian, quadratic_derivatives};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};

/// An element with N nodes: gradients and weights at its Q quadrature points.
///
/// P1 is `Element<3, 1>`: gradients are constant and the point stands for the triangle. P2 is
/// `Element<6, 3>`: the three vertices, then the midpoints of the sides 01, 12, 20, integrated at the
/// points (2/3, 1/6, 1/6) and its permutations (exact for polynomials of degree 2 on straight
/// triangles, which keeps the order of P2: Ciarlet, The Finite Element Method for Elliptic Problems,
/// 1978, section 4.1).
#[derive(Debug, Clone, Copy)]
pub struct Element<const N: usize, const Q: usize> {
    /// The quadrature points.
    pub points: [QuadraturePoint<N>; Q],
}

/// A quadrature point of an element with N nodes.
#[derive(Debug, Clone, Copy)]
pub struct QuadraturePoint<const N: usize> {
    /// Its weight, m²; the weights of an element add up to its area.
    pub weight: f64,
    /// ∇φ_i there, 1/m.
    pub gradients: [[f64; 2]; N],
}

/// The P2 triangle.
pub type Quadratic = Element<6, 3>;

/// Barycentric coordinates of the quadrature points of P2, of equal weights.
pub const POINTS: [[f64; 3]; 3] = {
    let (near, far) = (2.0 / 3.0, 1.0 / 6.0);
    [[near, far, far], [far, near, far], [far, far, near]]
};

/// Barycentric coordinates of the six nodes of P2.
pub(super) const NODES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

/// A function at the vertices from its values at the quadrature points of a triangle, constant or
/// affine between them: an affine f has the values f(x_q) = Σf/6 + f_q/2, so f_q = 2 f(x_q) − Σf/3.
pub(crate) fn at_vertices(points: &[Vector3<f64>]) -> [Vector3<f64>; 3] {
    match points {
        [value] => [*value; 3],
        _ => {
            let sum = points.iter().sum::<Vector3<f64>>();
            [0, 1, 2].map(|i| 2.0 * points[i] - sum / 3.0)
        }
    }
}

/// The values of the six P2 functions at barycentric coordinates λ: λ_i (2λ_i − 1) at the vertices and
/// 4 λ_i λ_j at the midpoints.
pub fn quadratic_values([a, b, c]: [f64; 3]) -> [f64; 6] {
    let vertex = |l: f64| l * (2.0 * l - 1.0);
    [vertex(a), vertex(b), vertex(c), 4.0 * a * b, 4.0 * b * c, 4.0 * c * a]
}

impl Quadratic {
    /// The isoparametric element of six nodes: x = Σ x_i φ_i(λ), so that a side is a parabola through
    /// its midpoint.
    pub fn new(nodes: [[f64; 2]; 6]) -> Self {
        Self { points: POINTS.map(|point| QuadraturePoint::at(&nodes, point)) }
    }
}

impl QuadraturePoint<6> {
    /// The point λ of the isoparametric element of six nodes, with the weight of one of [`POINTS`].
    pub(super) fn at(nodes: &[[f64; 2]; 6], point: [f64; 3]) -> Self {
        let derivatives = quadratic_derivatives(point);
        let jacobian = jacobian(nodes, &derivatives);
        let determinant = jacobian.determinant();
        // J⁻ᵀ is the matrix of cofactors over the determinant.
        let cofactors = Matrix2::new(jacobian.m22, -jacobian.m21, -jacobian.m12, jacobian.m11);
        Self {
            weight: determinant / 6.0,
            gradients: derivatives.map(|[p, q]| {
                let [x, y] = [0, 1].map(|k| cofactors[(k, 0)] * p + cofactors[(k, 1)] * q);
                [x / determinant, y / determinant]
            }),
        }
    }
}

impl<const N: usize, const Q: usize> Element<N, Q> {
    /// |T|, m².
    pub fn area(&self) -> f64 {
        self.points.iter().map(|point| point.weight).sum()
    }
}

impl<const N: usize> QuadraturePoint<N> {
    /// The 3×2 matrix B_i with (ε_xx, ε_yy, 2ε_xy) = Σ B_i u_i over the nodes.
    fn strain_matrix(&self, i: usize) -> Matrix3x2<f64> {
        let [dx, dy] = self.gradients[i];
        Matrix3x2::new(dx, 0.0, 0.0, dy, dy, dx)
    }

    /// The contribution of the point to the 2×2 block K_ij = ∫ Aε(φ_i) : ε(φ_j) of two nodes, w B_iᵀ D B_j,
    /// N/m per metre of thickness, from the matrix D of A.
    pub fn stiffness(&self, d: &Matrix3<f64>, i: usize, j: usize) -> Matrix2<f64> {
        self.strain_matrix(i).transpose() * d * self.strain_matrix(j) * self.weight
    }

    /// The strain (ε_xx, ε_yy, 2ε_xy) of the displacements u_i of the nodes.
    #[inline(always)]
    pub fn strain(&self, u: &[[f64; 2]; N]) -> Vector3<f64> {
        let mut strain = Vector3::zeros();
        for ([dx, dy], [ux, uy]) in self.gradients.iter().zip(u) {
            strain[0] += dx * ux;
            strain[1] += dy * uy;
            strain[2] += dy * ux + dx * uy;
        }
        strain
    }

    /// ∇u, entry (i, j) = ∂u_i/∂x_j, of the displacements u_i of the nodes.
    pub fn gradient(&self, u: &[[f64; 2]; N]) -> Matrix2<f64> {
        let entry = |i, j| self.gradients.iter().zip(u).map(|(g, u)| u[i] * g[j]).sum();
        Matrix2::from_fn(entry)
    }

    /// The contribution of the point to the nodal forces F_i = ∫ σ : ε(φ_i), w B_iᵀ σ, of a stress (σ_xx,
    /// σ_yy, σ_xy) there.
    #[inline(always)]
    pub fn force(&self, stress: &Vector3<f64>) -> [[f64; 2]; N] {
        self.gradients.map(|[dx, dy]| {
            [
                self.weight * (dx * stress[0] + dy * stress[2]),
                self.weight * (dy * stress[1] + dx * stress[2]),
            ]
        })
    }
}
