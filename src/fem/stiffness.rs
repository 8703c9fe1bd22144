//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26) as a matrix for solvers.

use super::{Body, Elasticity, NodalBases};
use crate::petsc::{Matrix, PetscError, Session, Vector};
use nalgebra::Matrix2;

/// The stiffness matrix K(ζ) in the unknowns of a [`NodalBases`]; pattern once, values refilled.
///
/// K consists of 2×2 blocks, one for each pair of nodes with a common triangle. Every pair {a, b}
/// keeps what its triangles contribute without damage: a refill reads these once, in order.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns hold only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    /// For each pair the end of its contributions, and whether a = b.
    pairs: Vec<(u32, bool)>,
    /// A triangle and its undamaged block, row by row, N/m.
    contributions: Vec<(u32, [f64; 4])>,
    values: Vec<f64>,
}

impl Stiffness {
    /// Blocks and pattern; the values are those of the undamaged body.
    pub fn new(
        session: &Session,
        body: &Body,
        elasticity: &Elasticity,
        bases: &NodalBases,
    ) -> Result<Self, PetscError> {
        let partition = &body.partition;
        let (places, pairs) = pairs(body);
        let contributions: Vec<_> = places
            .iter()
            .map(|&(t, i, j)| (t, block(body, t as usize, [i, j], elasticity, bases)))
            .collect();
        drop(places);

        let fixed = bases.fixed();
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        let mut place = |a: usize, b: usize| {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let row = partition.row(a, 2, i);
                let skip = row < 0 || fixed[2 * a + i] || fixed[2 * b + j];
                rows.push(if skip { -1 } else { row });
                columns.push(if skip { -1 } else { partition.global(b, 2, j) });
            }
        };
        let (mut first, mut trace) = (0, 0.0);
        for &([a, b], end) in &pairs {
            place(a, b);
            if a != b {
                place(b, a);
            } else if a < partition.owned() {
                for (_, block) in &contributions[first..end as usize] {
                    trace += if fixed[2 * a] { 0.0 } else { block[0] };
                    trace += if fixed[2 * a + 1] { 0.0 } else { block[3] };
                }
            }
            first = end as usize;
        }
        let diagonal: Vec<usize> = (0..2 * partition.owned()).filter(|&dof| fixed[dof]).collect();
        for &dof in &diagonal {
            rows.push(partition.row(dof / 2, 2, dof % 2));
            columns.push(partition.row(dof / 2, 2, dof % 2));
        }
        let trace = partition.comm().total(trace);
        let free = partition.comm().count(2 * partition.owned() - diagonal.len());
        let scale = if trace > 0.0 { trace / free as f64 } else { elasticity.material.young };

        let values = vec![scale; rows.len()];
        let mut matrix = Matrix::with_pattern(session, 2 * partition.owned(), 2, rows, columns)?;
        matrix.set_near_null_space(rigid_motions(session, body, bases)?)?;
        let pairs = pairs.iter().map(|&([a, b], end)| (end, a == b)).collect();
        let mut stiffness = Self { matrix, scale, pairs, contributions, values };
        stiffness.refill(&vec![1.0; body.triangles.len()])?;
        Ok(stiffness)
    }

    /// Bytes that a refill moves: contributions and pairs, ζ̄ once, the values written, read again
    /// with their places (PETSc keeps two numbers of 8 bytes each), and K's own values.
    pub fn refill_traffic(&self) -> f64 {
        let read = 40 * self.contributions.len() + 8 * self.pairs.len();
        read as f64 + 32.0 * self.values.len() as f64 + 8.0 * self.matrix.entries()
    }

    /// K alone, as last filled; what only refills need is given up.
    pub fn into_matrix(self) -> Matrix {
        self.matrix
    }

    /// K(ζ) from the mean ζ̄ of each triangle: exact, the strains being constant there.
    pub fn refill(&mut self, zeta: &[f64]) -> Result<(), PetscError> {
        let mut values = self.values.chunks_exact_mut(4);
        let mut first = 0;
        for &(end, diagonal) in &self.pairs {
            let mut sum = [0.0; 4];
            for (t, block) in &self.contributions[first..end as usize] {
                let z = zeta[*t as usize];
                sum.iter_mut().zip(block).for_each(|(sum, unit)| *sum += z * unit);
            }
            first = end as usize;
            if let Some(block) = values.next() {
                block.copy_from_slice(&sum);
            }
            // The block (b, a) is the transpose of (a, b).
            if !diagonal && let Some(block) = values.next() {
                block.copy_from_slice(&[sum[0], sum[2], sum[1], sum[3]]);
            }
        }
        self.matrix.set_values(&self.values)
    }
}

/// The translations and the rotation in the unknowns of `bases`, 0 on fixed ones: what multigrid
/// must represent on its coarse levels.
fn rigid_motions(
    session: &Session,
    body: &Body,
    bases: &NodalBases,
) -> Result<Vec<Vector>, PetscError> {
    let motions: [fn([f64; 2]) -> [f64; 2]; 3] = [|_| [1.0, 0.0], |_| [0.0, 1.0], |[x, y]| [-y, x]];
    let vector = |motion: fn([f64; 2]) -> [f64; 2]| {
        let mut field: Vec<f64> = body.mesh.nodes.iter().flat_map(|&x| motion(x)).collect();
        bases.displacement_to_local(&mut field);
        field.iter_mut().zip(bases.fixed()).filter(|(_, on)| **on).for_each(|(v, _)| *v = 0.0);
        let mut vector = Vector::zeros(session, 2 * body.partition.owned())?;
        vector.set(&field[..2 * body.partition.owned()])?;
        Ok(vector)
    };
    motions.into_iter().map(vector).collect()
}

/// A triangle and two of its corners.
type Place = (u32, u8, u8);

/// All pairs of nodes {a ≥ b} with a common triangle, one of them owned, each with the end of its
/// places in the first list.
fn pairs(body: &Body) -> (Vec<Place>, Vec<([usize; 2], u32)>) {
    let mut found: Vec<([u32; 2], Place)> = Vec::with_capacity(6 * body.triangles.len());
    for (t, nodes) in body.mesh.triangles.iter().enumerate() {
        for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)] {
            let (i, j) = if nodes[i] >= nodes[j] { (i, j) } else { (j, i) };
            if nodes[j] < body.partition.owned() {
                found.push(([nodes[i] as u32, nodes[j] as u32], (t as u32, i as u8, j as u8)));
            }
        }
    }
    found.sort_unstable();
    let mut pairs: Vec<([usize; 2], u32)> = Vec::new();
    for (k, (pair, _)) in found.iter().enumerate() {
        let (pair, end) = (pair.map(|node| node as usize), k as u32 + 1);
        match pairs.last_mut() {
            Some(last) if last.0 == pair => last.1 = end,
            _ => pairs.push((pair, end)),
        }
    }
    (found.into_iter().map(|(_, place)| place).collect(), pairs)
}

/// The block of two corners of triangle `t` in the unknowns of `bases`, row by row.
fn block(
    body: &Body,
    t: usize,
    corners: [u8; 2],
    elasticity: &Elasticity,
    bases: &NodalBases,
) -> [f64; 4] {
    let [i, j] = corners.map(usize::from);
    let mut k = body.triangles[t].stiffness(&elasticity.d, i, j);
    let turn = |i: usize| bases.inverse(body.mesh.triangles[t][i]);
    if let Some(inverse) = turn(i) {
        k = inverse.transpose() * k;
    }
    if let Some(inverse) = turn(j) {
        k *= inverse;
    }
    let k: Matrix2<f64> = k;
    [k[(0, 0)], k[(0, 1)], k[(1, 0)], k[(1, 1)]]
}
