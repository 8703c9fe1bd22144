//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26), matrix-free, for the residuals that
//! judge solvers.

use super::Body;
use crate::model::Material;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Strains, stresses and internal forces of a displacement field, triangle by triangle.
#[derive(Debug, Clone, Copy)]
pub struct Elasticity {
    /// A, as the matrix D of [`Material::stiffness`], Pa.
    pub(super) d: Matrix3<f64>,
    /// The material.
    pub material: Material,
}

impl Elasticity {
    /// The operator of an undamaged `material`.
    pub fn new(material: Material) -> Self {
        Self { d: material.stiffness(), material }
    }

    /// |ε|² = Σ ε_ij² on each triangle (the shear counts twice) from nodal u.
    pub fn strain_squared(&self, body: &Body, u: &[f64]) -> Vec<f64> {
        let squared = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
        (0..body.triangles.len()).map(|t| squared(body.strain(t, u))).collect()
    }

    /// σ = ζ̄ Aε(u), Pa, on triangle `t` with its mean damage `zeta` = ζ̄.
    pub fn stress(&self, body: &Body, t: usize, zeta: f64, u: &[f64]) -> Vector3<f64> {
        self.d * body.strain(t, u) * zeta
    }

    /// The internal forces F_i = ∫ ζ̄ Aε(u) : ε(φ_i) of nodal u, N per metre of thickness, with the
    /// mean damage ζ̄ of each triangle.
    pub fn internal_force(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; u.len()];
        let triangles = body.mesh.triangles.iter().zip(&body.triangles).zip(zeta);
        for (t, ((nodes, triangle), zeta)) in triangles.enumerate() {
            let strain = triangle.strain(&body.gather(t, u));
            let f = triangle.force(&(self.d * strain * *zeta));
            for (i, node) in nodes.iter().enumerate() {
                force[2 * node] += f[2 * i];
                force[2 * node + 1] += f[2 * i + 1];
            }
        }
        force
    }

    /// The rounding error that double precision leaves in the internal forces of u: at each node
    /// ε_machine Σ ζ̄ |K_T||u| over its triangles T, N per metre of thickness (Oettli and Prager,
    /// Numer. Math. 6, 1964).
    pub fn force_rounding(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut rounding = vec![0.0; u.len()];
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let local = body.gather(t, u);
            let unit = f64::EPSILON * zeta[t].abs();
            for i in 0..3 {
                for j in 0..3 {
                    let k = body.triangles[t].stiffness(&self.d, i, j).abs();
                    let force = k * Vector2::new(local[2 * j].abs(), local[2 * j + 1].abs());
                    rounding[2 * nodes[i]] += unit * force[0];
                    rounding[2 * nodes[i] + 1] += unit * force[1];
                }
            }
        }
        rounding
    }
}
