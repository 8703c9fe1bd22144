//! The operator K of (26) for solvers: products by elements, entries for factors.

mod groups;

use super::{Body, Elasticity, NodalBases, Nodes, for_elements};
use crate::petsc::{Matrix, Operator, Pattern, PetscError, Session, Vector};
pub(super) use groups::Groups;
use nalgebra::Matrix2;
use std::{cell::RefCell, iter::zip, rc::Rc};

/// The stiffness matrix K of the [`Elasticity`], in the unknowns of [`NodalBases`].
///
/// Products and the diagonal are sums over the elements. The entries are written where they are read: for
/// factors and for preconditioners of PETSc.
pub struct Stiffness {
    /// K, symmetric; rows and columns of fixed unknowns have only a diagonal.
    pub matrix: Matrix,
    /// Mean diagonal entry of the undamaged K, N/m: the scale of the matrix.
    pub scale: f64,
    operator: Rc<RefCell<ElementOperator>>,
}

/// K in the unknowns of nodal bases, from the elements.
struct ElementOperator {
    sums: Box<dyn ElementSums>,
    /// Per node: K_xx, K_xy and K_yy of the node with itself, without bases.
    diagonal: Vec<[f64; 3]>,
    /// Per element and pair of its nodes (i, j): the places of both rows of K_ij among the stored entries.
    /// `NOT_STORED` if another rank owns the row, or if i ≠ j and one of the unknowns is fixed.
    places: Vec<[u32; 2]>,
    nodes: Rc<Nodes>,
    bases: NodalBases,
    /// The diagonal entry of fixed unknowns.
    scale: f64,
    /// The places of the entries in rows or columns of fixed unknowns. Is the entry on the diagonal?
    fixed: Vec<(u32, bool)>,
}

/// Sums over the elements, in displacements without nodal bases.
pub(crate) trait ElementSums {
    /// Takes ζ at the quadrature points, and adds K_xx, K_xy and K_yy of each node with itself to `diagonal`.
    fn set(&mut self, body: &Body, zeta: &[f64], diagonal: &mut [[f64; 3]]);

    /// Adds the internal forces of `u` to `force`.
    fn add_forces(&self, u: &[f64], force: &mut [f64]);

    /// Calls `add` for the pairs of nodes (i, j), j ≤ i, of every element: the numbers of (i, j) and of (j, i) among
    /// all pairs, the nodes, and K_ij. Element e has the pairs N² e to N² (e + 1), row by row.
    fn for_blocks(&self, add: &mut dyn FnMut([usize; 2], [usize; 2], Matrix2<f64>));
}

/// The place of a row that is not stored.
const NOT_STORED: [u32; 2] = [u32::MAX; 2];
/// The entries of a block, row by row.
const BLOCK_ENTRIES: [[usize; 2]; 4] = [[0, 0], [0, 1], [1, 0], [1, 1]];

impl Stiffness {
    /// The elements and their pattern; the values are those of the undamaged body.
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
        let couples = for_elements!(body, cells => couples(cells.flat_nodes()));
        let stored = couples.clone().filter(|&(a, b)| is_stored(a, b)).map(|(a, b)| (a, column(b)));
        let pattern = Pattern::new(partition.owned(), stored);
        let (mut matrix, entries) = Matrix::with_places(session, 2, &pattern.of_blocks())?;
        matrix.set_near_null_space(rigid_motions(session, body, bases)?)?;

        let place = |(a, b): (usize, usize)| {
            let position = is_stored(a, b).then(|| pattern.position(a, column(b))).flatten();
            let rows = |position| pattern.rows_of_block(a, position).map(|row| entries[row]);
            position.map_or(NOT_STORED, rows)
        };
        let mut of_fixed = Vec::new();
        let mut place = |(a, b)| {
            let rows = place((a, b));
            for [i, j] in BLOCK_ENTRIES.into_iter().filter(|_| rows != NOT_STORED) {
                if fixed[2 * a + i] || fixed[2 * b + j] {
                    of_fixed.push((rows[i] + j as u32, a == b && i == j));
                }
            }
            rows
        };
        let places = couples.map(&mut place).collect();
        of_fixed.sort_unstable();
        of_fixed.dedup();

        let mut operator = ElementOperator {
            sums: elasticity.sums(body),
            diagonal: vec![[0.0; 3]; body.nodes.points.len()],
            places,
            nodes: Rc::clone(&body.nodes),
            bases: bases.clone(),
            scale: 0.0,
            fixed: of_fixed,
        };
        operator.set_damage(body, &body.at_points(&vec![1.0; body.mesh.nodes.len()]));
        operator.scale = operator.mean_diagonal().unwrap_or_else(|| {
            elasticity.materials().map(|material| material.young).fold(0.0, f64::max)
        });
        let (scale, operator) = (operator.scale, Rc::new(RefCell::new(operator)));
        matrix.set_operator(Rc::clone(&operator) as Rc<dyn Operator>)?;
        Ok(Self { matrix, scale, operator })
    }

    /// K(ζ) from the values of ζ at the quadrature points, [`Body::at_points`]. (For P1, where strains
    /// are constant, this is exact.) All else as it was made of.
    pub fn set_damage(&mut self, body: &Body, zeta: &[f64]) {
        self.operator.borrow_mut().set_damage(body, zeta);
        self.matrix.set_changed();
    }
}

impl ElementOperator {
    fn set_damage(&mut self, body: &Body, zeta: &[f64]) {
        self.diagonal.fill([0.0; 3]);
        self.sums.set(body, zeta, &mut self.diagonal);
    }

    /// The diagonal entries of the owned unknowns; D⁻ᵀ K_ii D⁻¹ with the bases D.
    fn diagonal(&self) -> Vec<f64> {
        let of_node = |(node, &[xx, xy, yy]): (usize, &[f64; 3])| match self.bases.inverse(node) {
            None => [xx, yy],
            Some(inverse) => {
                let block = inverse.transpose() * Matrix2::new(xx, xy, xy, yy) * inverse;
                [block[(0, 0)], block[(1, 1)]]
            }
        };
        let owned = self.diagonal.iter().take(self.nodes.partition.owned()).enumerate();
        let mut diagonal: Vec<f64> = owned.flat_map(of_node).collect();
        let fixed = zip(&mut diagonal, self.bases.fixed()).filter(|(_, fixed)| **fixed);
        fixed.for_each(|(entry, _)| *entry = self.scale);
        diagonal
    }

    /// The mean diagonal entry of the free unknowns of all ranks. `None` if it is not positive. Collective.
    fn mean_diagonal(&self) -> Option<f64> {
        let (diagonal, comm) = (self.diagonal(), self.nodes.partition.comm());
        let free = || zip(&diagonal, self.bases.fixed()).filter(|(_, fixed)| !**fixed);
        let trace = comm.total(free().map(|(entry, _)| entry).sum());
        let count = comm.count(free().count());
        (trace > 0.0).then(|| trace / count as f64)
    }
}

impl Operator for RefCell<ElementOperator> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let ElementOperator { sums, nodes, bases, scale, .. } = &*self.borrow();
        let mut u = x.to_vec();
        bases.zero_fixed(&mut u);
        let mut u = nodes.partition.field(u, 2)?;
        bases.displacement_to_global(&mut u);
        let mut force = vec![0.0; u.len()];
        sums.add_forces(&u, &mut force);
        bases.force_to_local(&mut force);
        y.copy_from_slice(&force[..y.len()]);
        let fixed = zip(zip(y, x), bases.fixed()).filter(|(_, fixed)| **fixed);
        fixed.for_each(|((y, x), _)| *y = scale * x);
        Ok(())
    }

    fn diagonal(&self) -> Vec<f64> {
        self.borrow().diagonal()
    }

    fn write(&self, entries: &mut [f64]) {
        let ElementOperator { sums, places, bases, scale, fixed, .. } = &*self.borrow();
        sums.for_blocks(&mut |[upper, lower], nodes, mut block| {
            let [of_i, of_j] = nodes.map(|node| bases.inverse(node));
            block = of_i.map_or(block, |inverse| inverse.transpose() * block);
            block = of_j.map_or(block, |inverse| block * inverse);
            add(entries, places[upper], &block);
            if upper != lower {
                add(entries, places[lower], &block.transpose());
            }
        });
        fixed.iter().for_each(|&(place, on_diagonal)| {
            entries[place as usize] = if on_diagonal { *scale } else { 0.0 };
        });
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

/// The pairs of nodes (a, b) of each element, from the nodes of all elements, `count` in turn for each.
fn couples((count, nodes): (usize, &[usize])) -> impl Iterator<Item = (usize, usize)> + Clone {
    let elements = nodes.chunks_exact(count);
    elements.flat_map(|of| of.iter().flat_map(move |&a| of.iter().map(move |&b| (a, b))))
}
