//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26) as a matrix for solvers.

use super::{Body, Cells, Elasticity, NodalBases, for_elements};
use crate::petsc::{Matrix, PetscError, Session, Vector};
use nalgebra::Matrix2;

/// The stiffness matrix K_ij = Σ_q w_q ζ_q Aε(φ_i) : ε(φ_j) over the quadrature points q of the
/// elements, in the unknowns of [`NodalBases`]. The pattern is made once, values are refilled.
///
/// K consists of 2×2 blocks, one for each pair of nodes with a common triangle. For every pair the
/// undamaged contributions of its points are kept: a refill reads these once, in order.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns have only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    /// For each pair of nodes the end of its contributions, and whether it is one node twice.
    pairs: Vec<(u32, bool)>,
    /// A quadrature point and its undamaged block, row by row, N/m.
    contributions: Vec<(u32, [f64; 4])>,
    values: Vec<f64>,
}

impl Stiffness {
    /// Blocks and pattern; the values are those of the undamaged body.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn new(
        session: &Session,
        body: &Body,
        elasticity: &Elasticity,
        bases: &NodalBases,
    ) -> Result<Self, PetscError> {
        let partition = &body.nodes.partition;
        let (contributions, pairs) = for_elements!(body, cells => {
            let (places, pairs) = pairs(&cells, partition.owned());
            (contributions(body, &cells, &places, elasticity, bases), pairs)
        });

        let fixed = bases.fixed();
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        let mut push_block = |a: usize, b: usize| {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let row = partition.row(a, 2, i);
                let skip = row < 0 || fixed[2 * a + i] || fixed[2 * b + j];
                rows.push(if skip { -1 } else { row });
                columns.push(if skip { -1 } else { partition.global(b, 2, j) });
            }
        };
        let (mut first, mut trace) = (0, 0.0);
        for &([a, b], end) in &pairs {
            push_block(a, b);
            if a != b {
                push_block(b, a);
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
        let young = || elasticity.materials().map(|material| material.young).fold(0.0, f64::max);
        let scale = if trace > 0.0 { trace / free as f64 } else { young() };

        let values = vec![scale; rows.len()];
        let mut matrix = Matrix::with_pattern(session, 2 * partition.owned(), 2, rows, columns)?;
        matrix.set_near_null_space(rigid_motions(session, body, bases)?)?;
        let pairs = pairs.iter().map(|&([a, b], end)| (end, a == b)).collect();
        let mut stiffness = Self { matrix, scale, pairs, contributions, values };
        stiffness.refill(&body.at_points(&vec![1.0; body.mesh.nodes.len()]))?;
        Ok(stiffness)
    }

    /// Bytes that a refill moves: contributions and pairs, ζ once, the values written, read again
    /// with their places (PETSc keeps two numbers of 8 bytes each), and K's own values.
    pub fn refill_traffic(&self) -> f64 {
        let read = 40 * self.contributions.len() + 8 * self.pairs.len();
        read as f64 + 32.0 * self.values.len() as f64 + 8.0 * self.matrix.entries()
    }

    /// K(ζ) from the values of ζ at the quadrature points, [`Body::at_points`]. (For P1, where strains
    /// are constant, this is exact.)
    ///
    /// # Errors
    /// PETSc failed.
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
        let mut field: Vec<f64> = body.nodes.points.iter().flat_map(|&x| motion(x)).collect();
        bases.displacement_to_local(&mut field);
        bases.zero_fixed(&mut field);
        let mut vector = Vector::zeros(session, 2 * body.nodes.partition.owned())?;
        vector.set(&field[..2 * body.nodes.partition.owned()])?;
        Ok(vector)
    };
    motions.into_iter().map(vector).collect()
}

/// A triangle and two of its nodes.
type Place = (u32, u8, u8);

/// All pairs of nodes {a ≥ b} with a common triangle, one of them among the first `owned`, each with
/// the end of its triangles in the first list.
fn pairs<const N: usize, const Q: usize>(
    cells: &Cells<N, Q>,
    owned: usize,
) -> (Vec<Place>, Vec<([usize; 2], u32)>) {
    let mut found: Vec<([u32; 2], Place)> = Vec::with_capacity(N * (N + 1) / 2 * cells.nodes.len());
    for (t, nodes) in cells.nodes.iter().enumerate() {
        for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let (i, j) = if nodes[i] >= nodes[j] { (i, j) } else { (j, i) };
            if nodes[j] < owned {
                found.push(([nodes[i] as u32, nodes[j] as u32], (t as u32, i as u8, j as u8)));
            }
        }
    }
    found.sort_unstable();
    let mut end = 0;
    let pairs = found.chunk_by(|(a, _), (b, _)| a == b).map(|same| {
        end += (Q * same.len()) as u32;
        (same[0].0.map(|node| node as usize), end)
    });
    let pairs = pairs.collect();
    (found.into_iter().map(|(_, place)| place).collect(), pairs)
}

/// The quadrature points of each place with their undamaged blocks, row by row, in the unknowns of
/// `bases`: D_i⁻ᵀ K_ij D_j⁻¹.
fn contributions<const N: usize, const Q: usize>(
    body: &Body,
    cells: &Cells<N, Q>,
    places: &[Place],
    elasticity: &Elasticity,
    bases: &NodalBases,
) -> Vec<(u32, [f64; 4])> {
    let mut contributions = Vec::with_capacity(Q * places.len());
    for &(t, i, j) in places {
        let (i, j, nodes) = (usize::from(i), usize::from(j), &cells.nodes[t as usize]);
        let d = elasticity.d(body, t as usize);
        let (left, right) = (bases.inverse(nodes[i]), bases.inverse(nodes[j]));
        for (q, point) in cells.elements[t as usize].points.iter().enumerate() {
            let mut k: Matrix2<f64> = point.stiffness(d, i, j);
            if let Some(inverse) = left {
                k = inverse.transpose() * k;
            }
            if let Some(inverse) = right {
                k *= inverse;
            }
            let block = [k[(0, 0)], k[(0, 1)], k[(1, 0)], k[(1, 1)]];
            contributions.push((t * Q as u32 + q as u32, block));
        }
    }
    contributions
}
