//! The damage system (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(φ).

use super::Body;
use crate::{
    model::DamageLaw,
    petsc::{LinearSolver, Matrix, PetscError, Session, Vector},
};

/// The load b_i = ∫ φ λ_i of the damage source (25).
///
/// The strain is constant on a triangle; φ is taken at its vertices (nodal ζ, triangle
/// strain) and the affine function through these values is integrated exactly.
pub fn source_load(body: &Body, law: &DamageLaw, strain_squared: &[f64], zeta: &[f64]) -> Vec<f64> {
    let mut load = vec![0.0; zeta.len()];
    for ((nodes, triangle), e2) in
        body.mesh.triangles.iter().zip(&body.triangles).zip(strain_squared)
    {
        let phi = nodes.map(|node| law.source(*e2, zeta[node]));
        let sum: f64 = phi.iter().sum();
        for (node, phi) in nodes.iter().zip(phi) {
            load[*node] += triangle.area / 12.0 * (sum + phi);
        }
    }
    load
}

/// M + kκL, factored once for each step length, and M.
pub struct DamageSystem {
    mass: Matrix,
    matrix: Matrix,
    mass_values: Vec<f64>,
    laplace_values: Vec<f64>,
    solver: LinearSolver,
    rhs: Vector,
    unknown: Vector,
    diffusion: f64,
    step: f64,
}

impl DamageSystem {
    /// Assembles and factorises for diffusion κ (m²/s) and step k (s).
    pub fn new(
        session: &Session,
        body: &Body,
        diffusion: f64,
        step: f64,
    ) -> Result<Self, PetscError> {
        let owned = body.partition.owned();
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        let (mut mass_values, mut laplace_values) = (Vec::new(), Vec::new());
        for (nodes, triangle) in body.mesh.triangles.iter().zip(&body.triangles) {
            let (mass, laplace) = (triangle.mass(), triangle.laplace());
            for i in 0..3 {
                for j in 0..3 {
                    rows.push(body.partition.row(nodes[i], 1, 0));
                    columns.push(body.partition.global(nodes[j], 1, 0));
                    mass_values.push(mass[(i, j)]);
                    laplace_values.push(laplace[(i, j)]);
                }
            }
        }
        let mut mass = Matrix::with_pattern(session, owned, 1, rows.clone(), columns.clone())?;
        mass.set_values(&mass_values)?;
        let mut system = Self {
            mass,
            matrix: Matrix::with_pattern(session, owned, 1, rows, columns)?,
            mass_values,
            laplace_values,
            solver: LinearSolver::cholesky(session, "damage_")?,
            rhs: Vector::zeros(session, owned)?,
            unknown: Vector::zeros(session, owned)?,
            diffusion,
            step,
        };
        system.set_step(step)?;
        Ok(system)
    }

    /// Refills and factorises the matrix for another step length k, s.
    pub fn set_step(&mut self, step: f64) -> Result<(), PetscError> {
        let factor = step * self.diffusion;
        let sum = self.mass_values.iter().zip(&self.laplace_values).map(|(m, l)| m + factor * l);
        self.matrix.set_values(&sum.collect::<Vec<_>>())?;
        self.step = step;
        self.solver.factorise(&self.matrix)
    }

    /// Replaces ζ_{n−1} by ζ_n for the source load b; false if the linear solver failed.
    pub fn advance(&mut self, load: &[f64], zeta: &mut [f64]) -> Result<bool, PetscError> {
        let owned = self.rhs.owned();
        self.unknown.set(&zeta[..owned])?;
        self.mass.multiply(&self.unknown, &mut self.rhs)?;
        let step = self.step;
        self.rhs.write(|rhs| rhs.iter_mut().zip(load).for_each(|(r, b)| *r += step * b))?;
        let residual = 1e-13 * self.rhs.norm()?;
        let krylov = self.solver.solve(&self.rhs, &mut self.unknown, residual)?;
        self.unknown.get(&mut zeta[..owned])?;
        Ok(krylov.converged)
    }
}
