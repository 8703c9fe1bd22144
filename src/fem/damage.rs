//! The damage system (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(φ).

use super::{Body, Triangle};
use crate::{
    model::DamageLaw,
    petsc::{LinearSolver, Matrix, PetscError, Session, Vector},
};
use nalgebra::{Matrix3, Vector3};

/// How (28) integrates products with a test function λ_i: the mass M and the source load b.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mass {
    /// Exactly, as in the paper.
    #[default]
    Consistent,
    /// By the values at the vertices: M is diagonal (its rows summed). Where L has no positive
    /// entry off its diagonal (no obtuse angles), ζ obeys the maximum principle for every k.
    Lumped,
}

impl Mass {
    /// The mass of one triangle, m².
    fn of(self, triangle: &Triangle) -> Matrix3<f64> {
        match self {
            Self::Consistent => triangle.mass(),
            Self::Lumped => Matrix3::from_diagonal_element(triangle.area / 3.0),
        }
    }
}

/// The damage source φ of (25) at the vertices of each triangle, from nodal ζ and the
/// triangle's |ε|², 1/s.
pub fn source(body: &Body, law: &DamageLaw, strain_squared: &[f64], zeta: &[f64]) -> Vec<[f64; 3]> {
    let at_vertices =
        |(nodes, e2): (&[usize; 3], &f64)| nodes.map(|node| law.source(*e2, zeta[node]));
    body.mesh.triangles.iter().zip(strain_squared).map(at_vertices).collect()
}

/// The load b_i = ∫ φ λ_i of a source given at the vertices and affine between them, m²/s.
pub fn source_load(body: &Body, mass: Mass, source: &[[f64; 3]]) -> Vec<f64> {
    let mut load = vec![0.0; body.mesh.nodes.len()];
    for ((nodes, triangle), phi) in body.mesh.triangles.iter().zip(&body.triangles).zip(source) {
        let b = mass.of(triangle) * Vector3::from(*phi);
        for (node, b) in nodes.iter().zip(b.iter()) {
            load[*node] += b;
        }
    }
    load
}

/// M + kκL, factored once for each step length, M and L.
pub struct DamageSystem {
    mass: Matrix,
    laplace: Matrix,
    matrix: Matrix,
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
        mass: Mass,
        diffusion: f64,
        step: f64,
    ) -> Result<Self, PetscError> {
        let owned = body.partition.owned();
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        let (mut mass_values, mut laplace_values) = (Vec::new(), Vec::new());
        for (nodes, triangle) in body.mesh.triangles.iter().zip(&body.triangles) {
            let (mass, laplace) = (mass.of(triangle), triangle.laplace());
            for i in 0..3 {
                for j in 0..3 {
                    rows.push(body.partition.row(nodes[i], 1, 0));
                    columns.push(body.partition.global(nodes[j], 1, 0));
                    mass_values.push(mass[(i, j)]);
                    laplace_values.push(laplace[(i, j)]);
                }
            }
        }
        let mut filled = Matrix::with_pattern(session, owned, 1, rows, columns)?;
        let mut with = |values: Vec<f64>| {
            filled.set_values(&values)?;
            // A copy does without the pattern's bookkeeping, which is larger than the matrix.
            filled.duplicate()
        };
        let (mass, laplace) = (with(mass_values)?, with(laplace_values)?);
        let mut system = Self {
            matrix: mass.duplicate()?,
            mass,
            laplace,
            solver: LinearSolver::cholesky(session, "damage_", body.partition.total())?,
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
        self.matrix.copy(&self.mass)?;
        self.matrix.add(step * self.diffusion, &self.laplace)?;
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
