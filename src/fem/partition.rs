//! Which nodes this rank owns, and what it must ask the others. Nothing else in the program knows.

use crate::petsc::{Communicator, Ghosts, PetscError};

/// The nodes of this rank: owned ones first, then ghosts, with their global numbers.
///
/// Global numbers are contiguous by owner, so that a PETSc row belongs to its owner.
/// A triangle is assembled by every rank that owns one of its nodes, into owned rows only: what is
/// assembled at ghosts is incomplete.
#[derive(Debug)]
pub struct Partition {
    owned: usize,
    /// Nodes of the whole body.
    total: usize,
    global: Vec<i32>,
    comm: Communicator,
    /// None where one rank owns everything.
    ghosts: Option<Ghosts>,
}

impl Partition {
    /// One rank that owns everything.
    pub fn whole(nodes: usize) -> Self {
        let global = (0..nodes as i32).collect();
        Self { owned: nodes, total: nodes, global, comm: Communicator::serial(), ghosts: None }
    }

    /// One of several ranks, with the global numbers of its nodes, `owned` of them its own.
    pub(super) fn part(
        comm: Communicator,
        owned: usize,
        total: usize,
        global: Vec<i32>,
        ghosts: Ghosts,
    ) -> Self {
        Self { owned, total, global, comm, ghosts: Some(ghosts) }
    }

    /// The ranks among which the body is divided.
    pub fn comm(&self) -> Communicator {
        self.comm
    }

    /// Number of nodes owned.
    pub fn owned(&self) -> usize {
        self.owned
    }

    /// Number of nodes known here, ghosts included: the length of a nodal field.
    pub fn local(&self) -> usize {
        self.global.len()
    }

    /// Number of nodes of the whole body.
    pub fn total(&self) -> usize {
        self.total
    }

    /// The global number of component `component` of a nodal field with `block` components.
    pub fn global(&self, node: usize, block: usize, component: usize) -> i32 {
        self.global[node] * block as i32 + component as i32
    }

    /// The global row of an owned node's component, −1 (left out by PETSc) of a ghost's.
    pub fn row(&self, node: usize, block: usize, component: usize) -> i32 {
        if node < self.owned { self.global(node, block, component) } else { -1 }
    }

    /// Fetches the ghosts of a field with `block` components from their owners. Collective.
    pub fn update(&self, field: &mut [f64], block: usize) -> Result<(), PetscError> {
        match &self.ghosts {
            Some(ghosts) => ghosts.update(field, block),
            None => Ok(()),
        }
    }

    /// A field from its owned values. Collective.
    pub fn field(&self, mut owned: Vec<f64>, block: usize) -> Result<Vec<f64>, PetscError> {
        owned.resize(self.local() * block, 0.0);
        self.update(&mut owned, block)?;
        Ok(owned)
    }

    /// ‖·‖₂ of a field over the whole body, from its local values with `block` components.
    pub fn norm(&self, field: &[f64], block: usize) -> f64 {
        let squares = field[..self.owned * block].iter().map(|v| v * v).sum::<f64>();
        self.comm.total(squares).sqrt()
    }

    /// Inner product of two fields over the whole body.
    pub fn dot(&self, a: &[f64], b: &[f64], block: usize) -> f64 {
        let owned = self.owned * block;
        self.comm.total(a[..owned].iter().zip(&b[..owned]).map(|(a, b)| a * b).sum())
    }

    /// The largest |·| of a field with two components, over the whole body.
    pub fn largest(&self, u: &[f64]) -> f64 {
        let (owned, _) = u[..2 * self.owned].as_chunks::<2>();
        let square = owned.iter().map(|[x, y]| x * x + y * y).fold(0.0, f64::max);
        self.comm.max(square).sqrt()
    }

    /// (min, max) of a field over the whole body.
    pub fn extremes(&self, field: &[f64]) -> (f64, f64) {
        let owned = field[..self.owned].iter();
        let (low, high) = owned
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &z| (low.min(z), high.max(z)));
        (self.comm.min(low), self.comm.max(high))
    }
}
