//! The damage system (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(φ).

use super::{Body, Nodes, Triangle, body::at_quadratic_points, element::POINTS};
use crate::{
    linear::{Factor, LinearSolver, LinearSystem, Precision},
    mesh::Order,
    model::{DamageLaw, DamagePoint, DamageSource},
    petsc::{Matrix, Pattern, PetscError, Session, Vector},
};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::{
    cmp::Ordering::{Equal, Less},
    rc::Rc,
};

/// How (28) integrates products with a test function λ_i: the mass M and the source load b.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mass {
    /// Exactly, as in the paper.
    #[default]
    Consistent,
    /// By the values at the vertices: M is diagonal, with the row sums. If L has no positive entry off its
    /// diagonal (no obtuse angles), ζ obeys the maximum principle for every k.
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

/// A damage source φ of another author is positive or no number at a point.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the damage law {law} gives the source {phi} 1/s at ({}, {}), where ζ = {zeta}; mend the law: its source must be a number, \
     at most 0", place[0], place[1]
)]
pub struct WrongSource {
    law: &'static str,
    phi: f64,
    place: [f64; 2],
    zeta: f64,
}

/// The damage source φ of (25) at three points of each triangle, 1/s: for P1 displacements at the
/// vertices, from nodal ζ and the triangle's strain; for P2 at the quadrature points, from ζ and the strain
/// there. `strains` are those of [`Body::strains`], `laws` the constants of the materials by their numbers.
///
/// # Errors
/// φ is positive or no number at a point.
pub fn source(
    body: &Body,
    (source, laws): (&(impl DamageSource + ?Sized), &[DamageLaw]),
    strains: &[Vector3<f64>],
    zeta: &[f64],
) -> Result<Vec<[f64; 3]>, WrongSource> {
    // A NaN, which is neither less nor equal, is refused too.
    let is_wrong = |phi: &f64| !matches!(phi.partial_cmp(&0.0), Some(Less | Equal));
    let mut phi = Vec::with_capacity(body.mesh.triangles.len());
    for (t, nodes) in body.mesh.triangles.iter().enumerate() {
        let law = &laws[body.material(t)];
        let (vertices, corners) = (nodes.map(|n| zeta[n]), nodes.map(|n| body.mesh.nodes[n]));
        let (strains, zeta, places) = match body.order() {
            Order::Linear => ([&strains[t]; 3], vertices, corners),
            Order::Quadratic => {
                let [x, y] = [0, 1].map(|i| at_quadratic_points(corners.map(|place| place[i])));
                let places = [0, 1, 2].map(|q| [x[q], y[q]]);
                (strains.as_chunks().0[t].each_ref(), at_quadratic_points(vertices), places)
            }
        };
        let values = [0, 1, 2].map(|q| {
            source.source(&DamagePoint { place: places[q], strain: strains[q], zeta: zeta[q], law })
        });
        if let Some(q) = values.iter().position(is_wrong) {
            let law = source.name();
            return Err(WrongSource { law, phi: values[q], place: places[q], zeta: zeta[q] });
        }
        phi.push(values);
    }
    Ok(phi)
}

/// The load b_i = ∫ φ λ_i, m²/s, of a source φ from [`source`]. For P1 φ is affine between the vertices; for
/// P2 the quadrature points integrate it.
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

/// The matrix M + kκL of (28), with the factor of this or of an earlier step length k. With several materials L is
/// Σ_T κ_T/κ L_T, where κ belongs to the first material.
pub struct DamageSystem {
    /// The mass matrix M, m².
    pub mass: Matrix,
    /// The matrix L of the Laplace operator.
    pub laplace: Matrix,
    matrix: Matrix,
    solver: LinearSolver,
    rhs: Vector,
    unknown: Vector,
    /// The right sides and solutions of [`Self::diffuse`].
    flows: [Vector; 2],
    changes: [Vector; 2],
    /// The nodes of ζ.
    vertices: Rc<Nodes>,
    /// ‖`rhs`‖₂ of the last damage step.
    rhs_size: f64,
    /// κ of the first material, m²/s.
    diffusion: f64,
    step: f64,
    /// ‖diag L‖₂.
    laplace_size: f64,
}

impl DamageSystem {
    /// Assembles for the diffusions κ of the materials (m²/s) and step k (s).
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
        let zeros = || Vector::zeros(session, owned);
        let mut system = Self {
            matrix: mass.duplicate()?,
            mass,
            laplace,
            // One iteration in double precision costs less than two in single precision.
            solver: LinearSolver::new(session, "damage_", owned, Precision::Full)?,
            rhs: zeros()?,
            unknown: zeros()?,
            flows: [zeros()?, zeros()?],
            changes: [zeros()?, zeros()?],
            vertices: Rc::clone(&body.vertices),
            rhs_size: 0.0,
            diffusion: diffusions[0],
            step,
            laplace_size: partition.norm(&diagonal, 1),
        };
        system.set_step(step)?;
        Ok(system)
    }

    /// Refills the matrix for another step length k, s.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn set_step(&mut self, step: f64) -> Result<(), PetscError> {
        self.matrix.copy(&self.mass)?;
        self.matrix.add(step * self.diffusion, &self.laplace)?;
        self.step = step;
        Ok(())
    }

    /// Makes a new factor. If the matrix is not positive definite there is none, and the solves fail.
    ///
    /// # Errors
    /// PETSc or CHOLMOD failed.
    pub(crate) fn factorise(&mut self) -> Result<(), PetscError> {
        self.solver.factorise(LinearSystem::of(&self.matrix)).map(drop)
    }

    /// The factor, which a checkpoint keeps.
    pub(crate) fn factor(&mut self) -> &mut Factor {
        self.solver.factor()
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
        self.rhs_size = self.rhs.norm()?;
        let solved = self.solve(1e-13 * self.rhs_size)?;
        self.unknown.read(|unknown| zeta[..owned].copy_from_slice(unknown))?;
        Ok(solved)
    }

    /// Solves for `rhs` from `unknown` until ‖residual‖₂ ≤ `limit`. It returns whether the limit was reached.
    ///
    /// The mean of the unknown x over the body is known: 1ᵀL = 0, so 1ᵀMx = 1ᵀ`rhs`. If kκL is much larger
    /// than M, the rounding of their sum loses this mean. So the solve is for x minus its mean, and sets the
    /// mean of this difference to zero.
    fn solve(&mut self, limit: f64) -> Result<bool, PetscError> {
        let Nodes { weights, area, partition, .. } = &*self.vertices;
        let mean = partition.comm().total(self.rhs.read(|rhs| rhs.iter().sum())?) / area;
        self.rhs.write(|rhs| rhs.iter_mut().zip(weights).for_each(|(r, a)| *r -= a * mean))?;
        self.unknown.write(|x| x.iter_mut().for_each(|x| *x -= mean))?;
        let system = LinearSystem::of(&self.matrix);
        let solve = self.solver.solve_renewing(system, &self.rhs, &mut self.unknown, limit)?;
        let rest = self.unknown.read(|x| partition.dot(weights, x, 1))? / area;
        self.unknown.write(|x| x.iter_mut().for_each(|x| *x += mean - rest))?;
        Ok(solve.converged)
    }

    /// The largest [residual](super::DamageCertificate::residual) that rounding can leave: 1e-10, or more if
    /// the rounding of kκLζ dominates.
    pub fn largest_residual(&self) -> f64 {
        let round_off = 8.0 * f64::EPSILON * self.step * self.diffusion * self.laplace_size;
        1e-10 + round_off / self.rhs_size.max(f64::MIN_POSITIVE)
    }

    /// (M + kκL)⁻¹ k b at the owned nodes: the change of ζ_n for a change b = `load` of the source load.
    /// `None` if the linear solver failed.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn correction(&mut self, load: &[f64]) -> Result<Option<Vec<f64>>, PetscError> {
        /// ‖k b‖₂ below which the change does not affect ζ, and its energy bᵀ(M + kκL)⁻¹b underflows.
        const NEGLIGIBLE_LOAD: f64 = 1e-150;
        let step = self.step;
        self.rhs.write(|rhs| rhs.iter_mut().zip(load).for_each(|(r, b)| *r = step * b))?;
        self.unknown.write(|x| x.fill(0.0))?;
        let size = self.rhs.norm()?;
        // Some digits of an estimated error would do, but a correction becomes part of ζ.
        let solved = size < NEGLIGIBLE_LOAD || self.solve(1e-6 * size)?;
        let correction = self.unknown.read(<[f64]>::to_vec)?;
        Ok(solved.then_some(correction))
    }

    /// Lets two fields δ diffuse: δ ← (M + kκL)⁻¹ Mδ = δ − (M + kκL)⁻¹ kκLδ at the owned nodes. They are unchanged, and the
    /// answer is false, if the linear solver failed.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn diffuse(&mut self, fields: &mut [&mut [f64]; 2]) -> Result<bool, PetscError> {
        let (owned, factor) = (self.unknown.owned(), -self.step * self.diffusion);
        for (field, flow) in fields.iter().zip(&mut self.flows) {
            self.unknown.set(&field[..owned])?;
            self.laplace.multiply(&self.unknown, flow)?;
            flow.write(|flow| flow.iter_mut().for_each(|flow| *flow *= factor))?;
        }
        let (system, both) = (LinearSystem::of(&self.matrix), (&self.flows, &mut self.changes));
        // Some digits of an estimated error do.
        if !self.solver.solve_two(system, both.0, both.1, 1e-6)? {
            return Ok(false);
        }
        let Nodes { weights, area, partition, .. } = &*self.vertices;
        for (field, change) in fields.iter_mut().zip(&self.changes) {
            // 1ᵀL = 0: the mean of the change is 0.
            change.read(|change| {
                let mean = partition.dot(weights, change, 1) / area;
                field.iter_mut().zip(change).for_each(|(field, change)| *field += change - mean);
            })?;
        }
        Ok(true)
    }
}
