//! How well a mesh resolves an answer.

use super::{Body, Elasticity};
use nalgebra::Vector3;

impl Elasticity {
    /// The error of u in the energy norm, relative to the energy norm of u, as estimated from
    /// how much the strain jumps between triangles (Zienkiewicz and Zhu, Int. J. Numer. Meth.
    /// Eng. 24, 1987; here strains are averaged at the nodes, weighted by area and stiffness,
    /// because stresses jump with ζ).
    pub fn energy_error(&self, body: &Body, zeta: &[f64], u: &[f64]) -> f64 {
        let strains: Vec<Vector3<f64>> = (0..body.triangles.len())
            .map(|t| body.triangles[t].strain(&body.gather(t, u)))
            .collect();
        let mut sums = vec![(Vector3::zeros(), 0.0); body.mesh.nodes.len()];
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let weight = zeta[t] * body.triangles[t].area;
            for &node in nodes {
                sums[node].0 += weight * strains[t];
                sums[node].1 += weight;
            }
        }
        let (mut jump, mut energy) = (0.0, 0.0);
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let weight = zeta[t] * body.triangles[t].area;
            let off = nodes.map(|node| sums[node].0 / sums[node].1 - strains[t]);
            let mean = off.iter().sum::<Vector3<f64>>();
            // ∫ of a product of linear functions: (Σ v_i·v_i + (Σ v_i)·(Σ v_i)) |T| / 12.
            let squared = |v: &Vector3<f64>| v.dot(&(self.d * v));
            jump += weight / 12.0 * (off.iter().map(squared).sum::<f64>() + squared(&mean));
            energy += weight * squared(&strains[t]);
        }
        if jump == 0.0 { 0.0 } else { (jump / energy).sqrt() }
    }
}
