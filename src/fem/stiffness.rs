//! The damaged elastic operator (ζ Aε(u), ε(v)) of (26) as a matrix for solvers.

use super::{Body, Cells, Elasticity, NodalBases, for_elements};
use crate::petsc::{Matrix, PetscError, Session, Vector};
use nalgebra::{Matrix2, Matrix3};

/// The stiffness matrix K_ij = Σ_q w_q ζ_q Aε(φ_i) : ε(φ_j) over the quadrature points q of the
/// elements, in the unknowns of [`NodalBases`]. The pattern is made once, values are refilled.
///
/// K consists of 2×2 blocks, one for each pair of nodes with a common triangle. A refill adds those of
/// every element in turn where they are stored.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns have only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    /// For each element and two of its nodes (i, j) the places of both rows of K_ij among the stored
    /// entries; `NOWHERE` where another rank has them, or i ≠ j and one of the two is fixed.
    places: Vec<[u32; 2]>,
    /// The places of the entries in rows or columns of fixed unknowns, and whether on the diagonal.
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
        let pairs = for_elements!(body, cells => pairs(&cells, is_stored));
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (&[a, b], [i, j]) in pairs.iter().flat_map(|pair| ENTRIES.map(|entry| (pair, entry))) {
            rows.push(partition.row(a as usize, 2, i));
            columns.push(partition.global(b as usize, 2, j));
        }
        let mut pattern = Matrix::with_pattern(session, 2 * partition.owned(), 2, rows, columns)?;
        let entries = pattern.places()?;
        // A copy does without the COO pattern, which is larger than the matrix.
        let mut matrix = pattern.duplicate()?;
        drop(pattern);
        matrix.set_near_null_space(rigid_motions(session, body, bases)?)?;

        let (mut of_fixed, mut free_diagonal) = (Vec::new(), Vec::new());
        for (&[a, b], block) in pairs.iter().zip(entries.as_chunks::<4>().0) {
            for ([i, j], &place) in ENTRIES.into_iter().zip(block) {
                let on_diagonal = a == b && i == j;
                if fixed[2 * a as usize + i] || fixed[2 * b as usize + j] {
                    of_fixed.push((place, on_diagonal));
                } else if on_diagonal {
                    free_diagonal.push(place);
                }
            }
        }
        let mut first = vec![0; partition.owned() + 1];
        pairs.iter().for_each(|[a, _]| first[*a as usize + 1] += 1);
        (0..partition.owned()).for_each(|a| first[a + 1] += first[a]);
        let place = |a: usize, b: usize| {
            let of_row = if is_stored(a, b) { first[a]..first[a + 1] } else { 0..0 };
            let pair = of_row.into_iter().find(|&pair| pairs[pair][1] as usize == b);
            pair.map_or(NOWHERE, |pair| [entries[4 * pair], entries[4 * pair + 2]])
        };
        let places: Vec<[u32; 2]> = for_elements!(body, cells => {
            let couples = cells.nodes.iter().flat_map(|n| n.iter().flat_map(|a| n.map(|b| (*a, b))));
            couples.map(|(a, b)| place(a, b)).collect()
        });

        let mut stiffness = Self { matrix, scale: 0.0, places, fixed: of_fixed };
        let sound = body.at_points(&vec![1.0; body.mesh.nodes.len()]);
        stiffness.refill(body, elasticity, bases, &sound)?;
        let mut values = Vec::new();
        stiffness.matrix.read_entries(&mut values)?;
        let trace: f64 = free_diagonal.iter().map(|&place| values[place as usize]).sum();
        let (trace, free) =
            (partition.comm().total(trace), partition.comm().count(free_diagonal.len()));
        let young = || elasticity.materials().map(|material| material.young).fold(0.0, f64::max);
        stiffness.scale = if trace > 0.0 { trace / free as f64 } else { young() };
        stiffness.refill(body, elasticity, bases, &sound)?;
        Ok(stiffness)
    }

    /// Bytes that a refill moves: of each element nodes, points, places and ζ once; K is written,
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

/// The pairs of nodes (a, b) with a common triangle, increasing, that are stored.
fn pairs<const N: usize, const Q: usize>(
    cells: &Cells<N, Q>,
    is_stored: impl Fn(usize, usize) -> bool,
) -> Vec<[u32; 2]> {
    let couples = cells.nodes.iter().flat_map(|n| n.iter().flat_map(|a| n.map(|b| (*a, b))));
    let stored = couples.filter(|&(a, b)| is_stored(a, b));
    // As single numbers they are sorted twice as fast.
    let mut pairs: Vec<u64> = stored.map(|(a, b)| (a as u64) << 32 | b as u64).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs.into_iter().map(|pair| [(pair >> 32) as u32, pair as u32]).collect()
}
