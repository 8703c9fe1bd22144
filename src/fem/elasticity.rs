//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26): as a matrix for solvers, and
//! matrix-free for the residuals that judge them.

use super::{Body, Frames};
use crate::{
    model::Material,
    petsc::{Matrix, PetscError, Session},
};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

/// Strains, stresses and internal forces of a displacement field, triangle by triangle.
#[derive(Debug, Clone, Copy)]
pub struct Elasticity {
    pub(super) d: Matrix3<f64>,
    /// The material.
    pub material: Material,
}

impl Elasticity {
    /// The operator of an undamaged `material`.
    pub fn new(material: Material) -> Self {
        Self { d: material.stiffness(), material }
    }

    /// |ε|² = Σ ε_ij² on each triangle (the shear counts twice), from nodal u.
    pub fn strain_squared(&self, body: &Body, u: &[f64]) -> Vec<f64> {
        let squared = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
        (0..body.triangles.len())
            .map(|t| squared(body.triangles[t].strain(&body.gather(t, u))))
            .collect()
    }

    /// σ = ζ̄ Aε(u) on triangle `t` with its mean damage `zeta`.
    pub fn stress(&self, body: &Body, t: usize, zeta: f64, u: &[f64]) -> Vector3<f64> {
        self.d * body.triangles[t].strain(&body.gather(t, u)) * zeta
    }

    /// Internal nodal forces ∫ ζ̄ Aε(u):ε(φ_i) of nodal u, with the mean ζ̄ per triangle.
    pub fn internal_force(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; u.len()];
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let f = body.triangles[t].force(&self.stress(body, t, zeta[t], u));
            for (i, node) in nodes.iter().enumerate() {
                force[2 * node] += f[2 * i];
                force[2 * node + 1] += f[2 * i + 1];
            }
        }
        force
    }
}

/// The stiffness matrix K(ζ) in the unknowns of a [`Frames`]; pattern once, values refilled.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns hold only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    unit: Vec<[f64; 36]>,
    values: Vec<f64>,
}

impl Stiffness {
    /// Element matrices and pattern; the values are those of the undamaged body.
    pub fn new(
        session: &Session,
        body: &Body,
        elasticity: &Elasticity,
        frames: &Frames,
    ) -> Result<Self, PetscError> {
        let partition = &body.partition;
        let unit: Vec<[f64; 36]> =
            (0..body.triangles.len()).map(|t| element(body, t, elasticity, frames)).collect();

        let fixed = frames.fixed();
        let diagonal: Vec<usize> = (0..2 * partition.owned()).filter(|&dof| fixed[dof]).collect();
        let entries = 36 * unit.len() + diagonal.len();
        let (mut rows, mut columns) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        let mut trace = 0.0;
        for (nodes, unit) in body.mesh.triangles.iter().zip(&unit) {
            let dof = |i: usize| 2 * nodes[i / 2] + i % 2;
            for i in 0..6 {
                let row = if fixed[dof(i)] { -1 } else { partition.row(nodes[i / 2], 2, i % 2) };
                for j in 0..6 {
                    let column = partition.global(nodes[j / 2], 2, j % 2);
                    let skip = row < 0 || fixed[dof(j)];
                    rows.push(if skip { -1 } else { row });
                    columns.push(if skip { -1 } else { column });
                }
                trace += if fixed[dof(i)] { 0.0 } else { unit[7 * i] };
            }
        }
        for &dof in &diagonal {
            rows.push(partition.row(dof / 2, 2, dof % 2));
            columns.push(partition.row(dof / 2, 2, dof % 2));
        }
        let free = 2 * partition.owned() - diagonal.len();
        let scale = if trace > 0.0 { trace / free as f64 } else { elasticity.material.young };

        let matrix = Matrix::with_pattern(session, 2 * partition.owned(), 2, rows, columns)?;
        let mut values = vec![scale; entries];
        values[..36 * unit.len()].fill(0.0);
        let mut stiffness = Self { matrix, scale, unit, values };
        stiffness.refill(&vec![1.0; body.triangles.len()])?;
        Ok(stiffness)
    }

    /// Bytes that a refill moves: element matrices, ζ̄, the values written, read again with their
    /// places (PETSc keeps 8 bytes each), and K's own values.
    pub fn refill_traffic(&self) -> f64 {
        let (unit, values) = (36 * self.unit.len(), self.values.len());
        8.0 * (unit + unit / 36 + 3 * values) as f64 + self.matrix.values_traffic()
    }

    /// K alone, as last filled; what only refills need is given up.
    pub fn into_matrix(self) -> Matrix {
        self.matrix
    }

    /// K(ζ) from the mean ζ̄ of each triangle: exact, the strains being constant there.
    pub fn refill(&mut self, zeta: &[f64]) -> Result<(), PetscError> {
        for ((values, unit), z) in self.values.chunks_exact_mut(36).zip(&self.unit).zip(zeta) {
            for (value, unit) in values.iter_mut().zip(unit) {
                *value = z * unit;
            }
        }
        self.matrix.set_values(&self.values)
    }
}

/// The element stiffness in the unknowns of `frames`, row by row.
fn element(body: &Body, t: usize, elasticity: &Elasticity, frames: &Frames) -> [f64; 36] {
    let nodes = body.mesh.triangles[t];
    let mut k = body.triangles[t].stiffness(&elasticity.d);
    if nodes.iter().any(|&node| frames.inverse(node).is_some()) {
        let mut turn = SMatrix::<f64, 6, 6>::identity();
        for (i, &node) in nodes.iter().enumerate() {
            let inverse = frames.inverse(node).copied().unwrap_or_else(Matrix2::identity);
            turn.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(&inverse);
        }
        k = turn.transpose() * k * turn;
    }
    std::array::from_fn(|n| k[(n / 6, n % 6)])
}
