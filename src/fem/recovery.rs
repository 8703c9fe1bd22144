//! How well a mesh resolves an answer.

use super::{Body, Elasticity};
use crate::petsc::PetscError;
use nalgebra::Vector3;

impl Elasticity {
    /// An estimate of the error of u in the energy norm, relative to the energy norm of u:
    /// (∫ ζ̄ A(ε* − ε(u)) : (ε* − ε(u)) / ∫ ζ̄ Aε(u) : ε(u))^½, with ε* the recovered strain.
    ///
    /// ε* is affine on each triangle; at a node it is the mean of ε(u) on the triangles around it,
    /// weighted by ζ̄ |T| (Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 24, 1987, who recover
    /// stresses; these jump with ζ̄).
    ///
    /// # Errors
    /// PETSc failed.
    pub fn energy_error(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Result<f64, PetscError> {
        let strains: Vec<_> = (0..body.triangles.len()).map(|t| body.strain(t, u)).collect();
        let weight = |t: usize| zeta[t] * body.triangles[t].area;
        // Per node: Σ weight·strain (3 entries), then Σ weight.
        let mut sums = vec![[0.0; 4]; body.mesh.nodes.len()];
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            for &node in nodes {
                let [x, y, xy, total] = &mut sums[node];
                *x += weight(t) * strains[t][0];
                *y += weight(t) * strains[t][1];
                *xy += weight(t) * strains[t][2];
                *total += weight(t);
            }
        }
        body.partition.update(sums.as_flattened_mut(), 4)?;
        let recovered = |node: usize| {
            let [x, y, xy, total] = sums[node];
            Vector3::new(x, y, xy) / total
        };
        let (mut error, mut energy) = (0.0, 0.0);
        for (t, nodes) in body.mesh.triangles[..body.own_triangles].iter().enumerate() {
            let differences = nodes.map(|node| recovered(node) - strains[t]);
            let sum = differences.iter().sum::<Vector3<f64>>();
            // ∫ Av : v of an affine v with the values v_i at the vertices is
            // (Σ Av_i : v_i + A(Σ v_i) : (Σ v_i)) |T| / 12.
            let squared = |v: &Vector3<f64>| v.dot(&(self.d * v));
            let squares = differences.iter().map(squared).sum::<f64>();
            error += weight(t) / 12.0 * (squares + squared(&sum));
            energy += weight(t) * squared(&strains[t]);
        }
        let mut sums = [error, energy];
        body.partition.comm().sum(&mut sums);
        let [error, energy] = sums;
        Ok(if error == 0.0 { 0.0 } else { (error / energy).sqrt() })
    }
}
