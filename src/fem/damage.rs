//! The damage system (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(φ).

use super::{Body, Triangle, body::at_quadratic_points, element::POINTS};
use crate::{
    cholesky::{LinearSolver, LinearSystem, Precision},
    mesh::Order,
    model::DamageLaw,
    petsc::{Matrix, Pattern, PetscError, Session, Vector},
};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

/// How (28) integrates products with a test function λ_i: the mass M and the source load b.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
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
    /// The mass matrix of one triangle, m².
    pub fn of(self, triangle: &Triangle) -> Matrix3<f64> {
        match self {
            Self::Consistent => triangle.mass(),
            Self::Lumped => Matrix3::from_diagonal_element(triangle.area() / 3.0),
        }
    }
}

/// The damage source φ of (25) at three points of each triangle, 1/s: for P1 displacements at the
/// vertices, from nodal ζ and the triangle's |ε|²; for P2 at the quadrature points, from ζ and |ε|²
/// there. `strain_squared` is that of [`Elasticity::strain_squared`](super::Elasticity), `laws` are those
/// of the materials by their numbers.
pub fn source(
    body: &Body,
    laws: &[DamageLaw],
    strain_squared: &[f64],
    zeta: &[f64],
) -> Vec<[f64; 3]> {
    let of_triangle = |(t, nodes): (usize, &[usize; 3])| {
        let (law, vertices) = (&laws[body.material(t)], nodes.map(|node| zeta[node]));
        let (e2, zeta) = match body.order() {
            Order::Linear => ([strain_squared[t]; 3], vertices),
            Order::Quadratic => (strain_squared.as_chunks().0[t], at_quadratic_points(vertices)),
        };
        [0, 1, 2].map(|q| law.source(e2[q], zeta[q]))
    };
    body.mesh.triangles.iter().enumerate().map(of_triangle).collect()
}

/// The load b_i = ∫ φ λ_i, m²/s, of a source φ as [`source`] gives it: for P1 affine between the
/// vertices, for P2 by the quadrature points.
pub fn source_load(body: &Body, mass: Mass, source: &[[f64; 3]]) -> Vec<f64> {
    let mut load = vec![0.0; body.mesh.nodes.len()];
    let values = Matrix3::from(POINTS) / 3.0;
    for ((nodes, triangle), phi) in body.mesh.triangles.iter().zip(&body.triangles).zip(source) {
        let weights = match body.order() {
            Order::Linear => mass.of(triangle),
            Order::Quadratic => values * triangle.area(),
        };
        let b = weights * Vector3::from(*phi);
        for (node, b) in nodes.iter().zip(b.iter()) {
            load[*node] += b;
        }
    }
    load
}

/// How well ζ_n solves (28), from its residual r = (M + kκL)ζ_n − Mζ_{n−1} − kb.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DamageCertificate {
    /// ‖r‖₂ over the norm of the right-hand side (its mass lumped).
    pub residual: f64,
    /// An upper bound of the error of the solve in ζ_n at any node.
    pub error: f64,
}

impl DamageCertificate {
    /// For ζ_{n−1} = `before` and ζ_n = `after`, a step k = `step`, s, the source load b = `load`
    /// and the diffusions κ of the materials, m²/s. Collective.
    ///
    /// The residual is summed triangle by triangle, without the matrices of the solver. On a
    /// triangle T the least eigenvalue of M, |T|/12 [2 1 1; 1 2 1; 1 1 2], is a quarter of that of
    /// the lumped mass |T|/3. So M + kκL ≥ M ≥ ¼W with W the diagonal matrix of the node areas w,
    /// and the error e satisfies √w_i |e_i| ≤ ‖e‖_W ≤ 4 ‖W^-½ r‖; for the lumped mass, where
    /// M = W, the 4 is 1.
    pub fn of(
        body: &Body,
        mass: Mass,
        diffusions: &[f64],
        step: f64,
        load: &[f64],
        [before, after]: [&[f64]; 2],
    ) -> Self {
        let residual = residual(body, mass, (step, diffusions), [before, after]);
        let (mut squares, mut weighted, mut rhs) = (0.0, 0.0, 0.0);
        let mut least = f64::INFINITY;
        for i in 0..body.vertices.partition.owned() {
            let (area, b) = (body.vertices.weights[i], step * load[i]);
            let r = residual[i] - b;
            squares += r * r;
            weighted += r * r / area;
            rhs += (area * before[i] + b).powi(2);
            least = area.min(least);
        }
        let comm = body.vertices.partition.comm();
        let mut sums = [squares, weighted, rhs];
        comm.sum(&mut sums);
        let [squares, weighted, rhs] = sums;
        let factor = match mass {
            Mass::Consistent => 4.0,
            Mass::Lumped => 1.0,
        };
        Self {
            residual: (squares / rhs.max(f64::MIN_POSITIVE)).sqrt(),
            error: factor * (weighted / comm.min(least)).sqrt(),
        }
    }
}

/// M(ζ_n − ζ_{n−1}) + kκL ζ_n, summed over the triangles, with k, s, and the κ of the materials, m²/s.
fn residual(
    body: &Body,
    mass: Mass,
    (step, diffusions): (f64, &[f64]),
    [before, after]: [&[f64]; 2],
) -> Vec<f64> {
    let mut residual = vec![0.0; after.len()];
    let triangles = body.mesh.triangles.iter().zip(&body.triangles);
    for (t, (nodes, triangle)) in triangles.enumerate() {
        let spread = step * diffusions[body.material(t)];
        let zeta = nodes.map(|node| after[node]);
        let change: [f64; 3] = std::array::from_fn(|i| zeta[i] - before[nodes[i]]);
        // (Mv)_i is |T|/12 (Σ_j v_j + v_i) for the consistent mass and |T|/3 v_i for the lumped.
        let (sum, own) = match mass {
            Mass::Consistent => (change[0] + change[1] + change[2], triangle.area() / 12.0),
            Mass::Lumped => (0.0, triangle.area() / 3.0),
        };
        let flux = [0, 1].map(|axis| {
            let slope = |i: usize| zeta[i] * triangle.gradients()[i][axis];
            spread * triangle.area() * (slope(0) + slope(1) + slope(2))
        });
        for ((node, change), [dx, dy]) in nodes.iter().zip(change).zip(triangle.gradients()) {
            residual[*node] += own * (sum + change) + dx * flux[0] + dy * flux[1];
        }
    }
    residual
}

/// The matrix M + kκL of (28) with its factor, made anew for each step length k. Where κ differs from
/// material to material, L is Σ_T κ_T/κ L_T with κ that of the first.
pub struct DamageSystem {
    mass: Matrix,
    laplace: Matrix,
    matrix: Matrix,
    solver: LinearSolver,
    rhs: Vector,
    unknown: Vector,
    /// κ of the first material, m²/s.
    diffusion: f64,
    step: f64,
    /// ‖diag L‖₂.
    laplace_size: f64,
}

impl DamageSystem {
    /// Assembles and factorises for the diffusions κ of the materials (m²/s) and step k (s).
    ///
    /// # Errors
    /// PETSc failed.
    pub fn new(
        session: &Session,
        body: &Body,
        mass: Mass,
        diffusions: &[f64],
        step: f64,
    ) -> Result<Self, PetscError> {
        let partition = &body.vertices.partition;
        let owned = partition.owned();
        let column = |node: usize| partition.global(node, 1, 0);
        let couples =
            body.mesh.triangles.iter().flat_map(|n| n.iter().flat_map(|a| n.map(|b| (*a, b))));
        let own = couples.filter(|(a, _)| *a < owned);
        let pattern = Pattern::new(owned, own.map(|(a, b)| (a, column(b))));
        let [mut masses, mut laplacian] =
            [vec![0.0; pattern.entries()], vec![0.0; pattern.entries()]];
        let mut diagonal = vec![0.0; body.mesh.nodes.len()];
        let triangles = body.mesh.triangles.iter().zip(&body.triangles);
        for (t, (nodes, triangle)) in triangles.enumerate() {
            let ratio = diffusions[body.material(t)] / diffusions[0];
            let (mass, laplace) = (mass.of(triangle), ratio * triangle.laplace());
            for (i, &a) in nodes.iter().enumerate().filter(|(_, a)| **a < owned) {
                diagonal[a] += laplace[(i, i)];
                for (j, &b) in nodes.iter().enumerate() {
                    if let Some(position) = pattern.position(a, column(b)) {
                        masses[position] += mass[(i, j)];
                        laplacian[position] += laplace[(i, j)];
                    }
                }
            }
        }
        let with = |values: &[f64]| Matrix::with_pattern(session, 1, &pattern, values);
        let (mass, laplace) = (with(&masses)?, with(&laplacian)?);
        let mut system = Self {
            matrix: mass.duplicate()?,
            mass,
            laplace,
            // One iteration with all digits costs less than two with half of them.
            solver: LinearSolver::new(session, "damage_", owned, Precision::Full)?,
            rhs: Vector::zeros(session, owned)?,
            unknown: Vector::zeros(session, owned)?,
            diffusion: diffusions[0],
            step,
            laplace_size: partition.norm(&diagonal, 1),
        };
        system.set_step(step)?;
        Ok(system)
    }

    /// Refills and factorises the matrix for another step length k, s. A matrix that is not positive
    /// definite is no error here: the solves do not converge.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub fn set_step(&mut self, step: f64) -> Result<(), PetscError> {
        self.matrix.copy(&self.mass)?;
        self.matrix.add(step * self.diffusion, &self.laplace)?;
        self.step = step;
        self.solver.factorise(LinearSystem::of(&self.matrix)).map(drop)
    }

    /// (28): replaces ζ_{n−1} by the solution ζ_n of (M + kκL) ζ_n = M ζ_{n−1} + k b for the source
    /// load b = `load`; false if the linear solver failed.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn advance(&mut self, load: &[f64], zeta: &mut [f64]) -> Result<bool, PetscError> {
        let owned = self.rhs.owned();
        self.unknown.set(&zeta[..owned])?;
        self.mass.multiply(&self.unknown, &mut self.rhs)?;
        let step = self.step;
        self.rhs.write(|rhs| rhs.iter_mut().zip(load).for_each(|(r, b)| *r += step * b))?;
        let solved = self.solve(1e-13 * self.rhs.norm()?)?;
        self.unknown.read(|unknown| zeta[..owned].copy_from_slice(unknown))?;
        Ok(solved)
    }

    /// Solves for `rhs` from `unknown` until ‖residual‖₂ ≤ `limit`; whether that was reached.
    fn solve(&mut self, limit: f64) -> Result<bool, PetscError> {
        let system = LinearSystem::of(&self.matrix);
        Ok(self.solver.solve(system, &self.rhs, &mut self.unknown, limit)?.converged)
    }

    /// The largest [`DamageCertificate::residual`] of a solution as good as round-off allows:
    /// 1e-10, and where diffusion prevails what is lost in kκLζ, of which the terms are up to 1.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn largest_residual(&self) -> Result<f64, PetscError> {
        let round_off = 8.0 * f64::EPSILON * self.step * self.diffusion * self.laplace_size;
        Ok(1e-10 + round_off / self.rhs.norm()?.max(f64::MIN_POSITIVE))
    }

    /// (M + kκL)⁻¹ k b of a source load b = `load`, at the nodes owned: what ζ_n changes by with the
    /// load. `None` if the linear solver failed.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn correction(&mut self, load: &[f64]) -> Result<Option<Vec<f64>>, PetscError> {
        /// ‖k b‖₂ below which the change is less than any digit of ζ, and its energy bᵀ(M + kκL)⁻¹b
        /// less than the least double.
        const NEGLIGIBLE: f64 = 1e-150;
        let step = self.step;
        self.rhs.write(|rhs| rhs.iter_mut().zip(load).for_each(|(r, b)| *r = step * b))?;
        self.unknown.write(|x| x.fill(0.0))?;
        let size = self.rhs.norm()?;
        // Some digits of a correction are enough.
        let solved = size < NEGLIGIBLE || self.solve(1e-6 * size)?;
        let correction = self.unknown.read(<[f64]>::to_vec)?;
        Ok(solved.then_some(correction))
    }
}
