//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26) as a matrix for solvers.

use super::{Body, Cells, Elasticity, NodalBases, for_elements};
use crate::petsc::{Matrix, Pattern, PetscError, Session, Vector};
use nalgebra::{Matrix2, Matrix3};

/// The stiffness matrix K_ij = Σ_q w_q ζ_q Aε(φ_i) : ε(φ_j) over the quadrature points q of the
/// elements, in the unknowns of [`NodalBases`]. The pattern is made once, values are refilled.
///
/// K consists of 2×2 blocks, one for each pair of nodes with a common triangle. A refill adds the blocks of
/// each element to the stored entries.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns have only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    /// Per element and pair of its nodes (i, j): the places of both rows of K_ij among the stored entries.
    /// `NOWHERE` if another rank owns the row, or if i ≠ j and one of the unknowns is fixed.
    places: Vec<[u32; 2]>,
    /// The places of the entries in rows or columns of fixed unknowns. Is the entry on the diagonal?
    fixed: Vec<(u32, bool)>,
}

/// The place of a row that is not stored.
const NOWHERE: [u32; 2] = [u32::MAX; 2];
/// The entries of a block, row by row.
const ENTRIES: [[usize; 2]; 4] = [[0, 0], [0, 1], [1, 0], [1, 1]];

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
        let (partition, fixed) = (&body.nodes.partition, bases.fixed());
        let is_fixed = |node: usize| fixed[2 * node] && fixed[2 * node + 1];
        let is_stored =
            |a: usize, b: usize| a < partition.owned() && (a == b || !is_fixed(a) && !is_fixed(b));
        let column = |node: usize| partition.global(node, 1, 0);
        let pattern = for_elements!(body, cells => {
            let stored = couples(&cells).filter(|&(a, b)| is_stored(a, b));
            Pattern::new(partition.owned(), stored.map(|(a, b)| (a, column(b))))
        });
        let (mut matrix, entries) = Matrix::with_places(session, 2, &pattern.of_blocks())?;
        matrix.set_near_null_space(rigid_motions(session, body, bases)?)?;

        let place = |(a, b): (usize, usize)| {
            let position = is_stored(a, b).then(|| pattern.position(a, column(b))).flatten();
            let rows = |position| pattern.rows_of_block(a, position).map(|row| entries[row]);
            position.map_or(NOWHERE, rows)
        };
        let (mut places, mut of_fixed) = (Vec::new(), Vec::new());
        for_elements!(body, cells => for (a, b) in couples(&cells) {
            let rows = place((a, b));
            places.push(rows);
            for [i, j] in ENTRIES.into_iter().filter(|_| rows != NOWHERE) {
                if fixed[2 * a + i] || fixed[2 * b + j] {
                    of_fixed.push((rows[i] + j as u32, a == b && i == j));
                }
            }
        });
        of_fixed.sort_unstable();
        of_fixed.dedup();

        let mut stiffness = Self { matrix, scale: 0.0, places, fixed: of_fixed };
        let sound = body.at_points(&vec![1.0; body.mesh.nodes.len()]);
        stiffness.refill(body, elasticity, bases, &sound)?;
        let diagonal = stiffness.matrix.diagonal()?;
        let free = || diagonal.iter().zip(fixed).filter(|(_, fixed)| !**fixed);
        let trace = partition.comm().total(free().map(|(entry, _)| entry).sum());
        let free = partition.comm().count(free().count());
        let young = || elasticity.materials().map(|material| material.young).fold(0.0, f64::max);
        stiffness.scale = if trace > 0.0 { trace / free as f64 } else { young() };
        stiffness.refill(body, elasticity, bases, &sound)?;
        Ok(stiffness)
    }

    /// Bytes that a refill reads and writes: nodes, points, places and ζ of each element once; K is written,
    /// read and written again.
    pub fn bytes_per_refill(&self, body: &Body) -> f64 {
        let elements = for_elements!(body, cells => {
            let points = cells.elements.iter().map(|element| 8 * element.points.len()).sum::<usize>();
            size_of_val(cells.nodes) + size_of_val(cells.elements) + points
        });
        (elements + size_of_val(&self.places[..])) as f64 + 24.0 * self.matrix.entries() as f64
    }

    /// K(ζ) from the values of ζ at the quadrature points, [`Body::at_points`]. (For P1, where strains
    /// are constant, this is exact.) All else as it was made of.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn refill(
        &mut self,
        body: &Body,
        elasticity: &Elasticity,
        bases: &NodalBases,
        zeta: &[f64],
    ) -> Result<(), PetscError> {
        let Self { matrix, scale, places, fixed } = self;
        matrix.fill(|entries| {
            for_elements!(body, cells => {
                let d = |t| elasticity.d(body, t);
                add_blocks(&cells, d, bases, zeta.as_chunks().0, places, entries);
            });
            for &(place, on_diagonal) in &*fixed {
                entries[place as usize] = if on_diagonal { *scale } else { 0.0 };
            }
        })
    }
}

/// Adds the blocks D_i⁻ᵀ K_ij D_j⁻¹ of all elements, in the unknowns of `bases`, to the entries of K at
/// their places; `d` is the matrix of A in an element.
fn add_blocks<'a, const N: usize, const Q: usize>(
    cells: &Cells<N, Q>,
    d: impl Fn(usize) -> &'a Matrix3<f64>,
    bases: &NodalBases,
    zeta: &[[f64; Q]],
    places: &[[u32; 2]],
    entries: &mut [f64],
) {
    let elements = cells.nodes.iter().zip(cells.elements).zip(zeta);
    for (t, (((nodes, element), zeta), places)) in
        elements.zip(places.chunks_exact(N * N)).enumerate()
    {
        let (d, inverses) = (d(t), nodes.map(|node| bases.inverse(node)));
        let rotated = inverses.iter().any(Option::is_some);
        for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let mut block = element.stiffness(d, zeta, i, j);
            if rotated {
                block = inverses[i].map_or(block, |inverse| inverse.transpose() * block);
                block = inverses[j].map_or(block, |inverse| block * inverse);
            }
            add(entries, places[i * N + j], &block);
            if i != j {
                add(entries, places[j * N + i], &block.transpose());
            }
        }
    }
}

/// Adds a block to the entries at the places of its rows.
#[inline(always)]
fn add(entries: &mut [f64], places: [u32; 2], block: &Matrix2<f64>) {
    for (i, place) in places.into_iter().enumerate() {
        let place = place as usize;
        if let Some([x, y]) = entries.get_mut(place..place + 2) {
            *x += block[(i, 0)];
            *y += block[(i, 1)];
        }
    }
}

/// The translations and the rotation in the unknowns of `bases`, 0 on fixed ones. The coarse levels of
/// multigrid must represent them.
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

/// The pairs of nodes (a, b) of each element.
fn couples<const N: usize, const Q: usize>(
    cells: &Cells<N, Q>,
) -> impl Iterator<Item = (usize, usize)> + Clone {
    cells.nodes.iter().flat_map(|nodes| nodes.iter().flat_map(|a| nodes.map(|b| (*a, b))))
}
