//! Which nodes this rank owns. Nothing else in the program knows.

/// The nodes of this rank: owned ones first, then ghosts, with their global numbers.
///
/// Global numbers are contiguous by owner, so that a PETSc row belongs to its owner.
/// A triangle is assembled by every rank that owns one of its nodes, into owned rows only.
#[derive(Debug, Clone)]
pub struct Partition {
    owned: usize,
    global: Vec<i32>,
}

impl Partition {
    /// One rank that owns everything.
    pub fn whole(nodes: usize) -> Self {
        Self { owned: nodes, global: (0..nodes as i32).collect() }
    }

    /// Number of nodes owned.
    pub fn owned(&self) -> usize {
        self.owned
    }

    /// Number of nodes known here, ghosts included: the length of a nodal field.
    pub fn local(&self) -> usize {
        self.global.len()
    }

    /// The global number of component `component` of a nodal field with `block` components.
    pub fn global(&self, node: usize, block: usize, component: usize) -> i32 {
        self.global[node] * block as i32 + component as i32
    }

    /// The global row of an owned node's component, −1 (left out by PETSc) of a ghost's.
    pub fn row(&self, node: usize, block: usize, component: usize) -> i32 {
        if node < self.owned { self.global(node, block, component) } else { -1 }
    }

    /// ‖·‖₂ of a field over the whole body, from its local values with `block` components.
    pub fn norm(&self, field: &[f64], block: usize) -> f64 {
        field[..self.owned * block].iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// Inner product of two fields over the whole body.
    pub fn dot(&self, a: &[f64], b: &[f64], block: usize) -> f64 {
        let owned = self.owned * block;
        a[..owned].iter().zip(&b[..owned]).map(|(a, b)| a * b).sum()
    }
}
