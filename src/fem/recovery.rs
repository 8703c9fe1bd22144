//! How well a mesh resolves an answer.

use super::{Body, Elasticity};
use crate::petsc::PetscError;
use nalgebra::Vector3;

impl Elasticity {
    /// The error of u in the energy norm, relative to the energy norm of u, as estimated from
    /// how much the strain jumps between triangles (Zienkiewicz and Zhu, Int. J. Numer. Meth.
    /// Eng. 24, 1987; here strains are averaged at the nodes, weighted by area and stiffness,
    /// because stresses jump with ζ).
    ///
    /// # Errors
    /// PETSc failed.
    pub fn energy_error(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Result<f64, PetscError> {
        let strains: Vec<Vector3<f64>> = (0..body.triangles.len())
            .map(|t| body.triangles[t].strain(&body.gather(t, u)))
            .collect();
        // Of each node the weighted strains, then the weights.
        let mut sums = vec![0.0; 4 * body.mesh.nodes.len()];
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let weight = zeta[t] * body.triangles[t].area;
            for &node in nodes {
                let at = &mut sums[4 * node..4 * (node + 1)];
                at.iter_mut().zip(&strains[t]).for_each(|(sum, strain)| *sum += weight * strain);
                at[3] += weight;
            }
        }
        body.partition.update(&mut sums, 4)?;
        let mean = |node: usize| {
            let at = &sums[4 * node..4 * (node + 1)];
            Vector3::new(at[0], at[1], at[2]) / at[3]
        };
        let (mut jump, mut energy) = (0.0, 0.0);
        for (t, nodes) in body.mesh.triangles[..body.own_triangles].iter().enumerate() {
            let weight = zeta[t] * body.triangles[t].area;
            let off = nodes.map(|node| mean(node) - strains[t]);
            let sum = off.iter().sum::<Vector3<f64>>();
            // ∫ of a product of linear functions: (Σ v_i·v_i + (Σ v_i)·(Σ v_i)) |T| / 12.
            let squared = |v: &Vector3<f64>| v.dot(&(self.d * v));
            jump += weight / 12.0 * (off.iter().map(squared).sum::<f64>() + squared(&sum));
            energy += weight * squared(&strains[t]);
        }
        let mut both = [jump, energy];
        body.partition.comm().sum(&mut both);
        let [jump, energy] = both;
        Ok(if jump == 0.0 { 0.0 } else { (jump / energy).sqrt() })
    }
}
