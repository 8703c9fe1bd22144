//! Ownership of nodes, and the exchange of values between ranks.

use crate::{
    maximum,
    petsc::{Communicator, Ghosts, PetscError},
};

/// The nodes of this rank: owned ones first, then ghosts, with their global indices.
///
/// Global indices are PETSc's: contiguous on each rank, so that every rank owns the rows of its
/// nodes. A triangle is assembled by every rank that owns one of its nodes, into owned rows only:
/// what is assembled at ghosts is incomplete.
#[derive(Debug)]
pub struct Partition {
    owned: usize,
    /// Nodes of the undivided body.
    total: usize,
    /// Global index of each local node.
    global: Vec<i32>,
    comm: Communicator,
    /// `None` where one rank owns everything.
    ghosts: Option<Ghosts>,
}

impl Partition {
    /// One rank that owns everything.
    pub fn serial(nodes: usize) -> Self {
        let global = (0..nodes as i32).collect();
        Self { owned: nodes, total: nodes, global, comm: Communicator::serial(), ghosts: None }
    }

    /// One of several ranks, which owns the first `owned` of its nodes.
    pub(super) fn distributed(
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

    /// Number of nodes of the undivided body.
    pub fn total(&self) -> usize {
        self.total
    }

    /// The global index of component `component` of a nodal field with `block` components.
    pub fn global(&self, node: usize, block: usize, component: usize) -> i32 {
        self.global[node] * block as i32 + component as i32
    }

    /// Fetches the ghosts of a field with `block` components from their owners. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn update(&self, field: &mut [f64], block: usize) -> Result<(), PetscError> {
        match &self.ghosts {
            Some(ghosts) => ghosts.update(field, block),
            None => Ok(()),
        }
    }

    /// A field with its ghosts from its `owned` values. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn field(&self, mut owned: Vec<f64>, block: usize) -> Result<Vec<f64>, PetscError> {
        owned.resize(self.local() * block, 0.0);
        self.update(&mut owned, block)?;
        Ok(owned)
    }

    /// ‖·‖₂ of a field with `block` components over the undivided body; max |·| if no squares can be held. Collective.
    pub fn norm(&self, field: &[f64], block: usize) -> f64 {
        let own = &field[..self.owned * block];
        self.or_component(self.comm.total(own.iter().map(|v| v * v).sum::<f64>()).sqrt(), own)
    }

    /// `norm`, or max |·| of the field if its squares underflow. Collective.
    fn or_component(&self, norm: f64, own: &[f64]) -> f64 {
        match norm {
            0.0 => self.comm.max(own.iter().fold(0.0, |max, v| maximum(max, v.abs()))),
            norm => norm,
        }
    }

    /// Inner product of two fields with `block` components over the undivided body. Collective.
    pub fn dot(&self, a: &[f64], b: &[f64], block: usize) -> f64 {
        let owned = self.owned * block;
        self.comm.total(a[..owned].iter().zip(&b[..owned]).map(|(a, b)| a * b).sum())
    }

    /// max |u_i| over the nodes i of the undivided body, u_i the vector at node i; the largest component if no squares
    /// can be held. Collective.
    pub fn max_norm(&self, u: &[f64]) -> f64 {
        let own = &u[..2 * self.owned];
        let squares = own.as_chunks::<2>().0.iter().map(|[x, y]| x * x + y * y);
        self.or_component(self.comm.max(squares.fold(0.0, maximum)).sqrt(), own)
    }

    /// (min, max) of a field with one component over the undivided body. Collective.
    pub fn min_max(&self, field: &[f64]) -> (f64, f64) {
        let owned = field[..self.owned].iter();
        let start = [f64::NEG_INFINITY; 2];
        let [low, high] = owned.fold(start, |[a, b], &z| [maximum(a, -z), maximum(b, z)]);
        (-self.comm.max(low), self.comm.max(high))
    }
}
