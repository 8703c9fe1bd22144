//! The part of a body that a rank keeps, after every rank has read the undivided body.

use super::{Body, Partition};
use crate::{
    mesh::{Curve, Mesh},
    petsc::{Ghosts, PetscError, Session, divide},
};
use std::collections::HashMap;

/// The nodes and triangles that a rank keeps: the nodes it owns, the triangles around them, and
/// the other nodes of these as ghosts.
///
/// *Local* indices count these nodes and triangles; all others are indices in the undivided mesh.
/// (PETSc numbers the nodes a third way, see [`Partition`].)
#[derive(Debug)]
pub struct Subdomain {
    /// Index in the undivided mesh of each local node, owned ones first.
    nodes: Vec<usize>,
    owned: usize,
    /// The same of each local triangle; first those that belong to the rank.
    triangles: Vec<usize>,
    own_triangles: usize,
    /// Local index of each of `nodes`.
    local: HashMap<usize, usize>,
    partition: Partition,
}

impl Subdomain {
    /// Divides the nodes of `mesh` among the ranks; `None` if there is only one. Collective.
    ///
    /// # Errors
    /// PETSc cannot divide it.
    pub fn of(session: &Session, mesh: &Mesh) -> Result<Option<Self>, PetscError> {
        let comm = session.comm();
        if comm.is_serial() {
            return Ok(None);
        }
        let total = mesh.nodes.len();
        let owner = divide(session, total, &mesh.triangles)?;
        let mut nodes: Vec<usize> = (0..total).filter(|&i| owner[i] == comm.rank()).collect();
        let owned = nodes.len();
        // A triangle belongs to the owner of its first node.
        let around = |t: &usize| mesh.triangles[*t].iter().any(|&i| owner[i] == comm.rank());
        let own = |t: &usize| owner[mesh.triangles[*t][0]] == comm.rank();
        let mut triangles: Vec<usize> = (0..mesh.triangles.len()).filter(own).collect();
        let own_triangles = triangles.len();
        triangles.extend((0..mesh.triangles.len()).filter(|t| around(t) && !own(t)));

        let corners = triangles.iter().flat_map(|&t| mesh.triangles[t]);
        let mut ghosts: Vec<usize> = corners.filter(|&i| owner[i] != comm.rank()).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        nodes.extend(&ghosts);

        // PETSc numbers the nodes owner by owner: the index of each node among those of its owner,
        // and the first number of each owner.
        let mut counts = vec![0; comm.size()];
        let mut index = vec![0; total];
        for (index, &owner) in index.iter_mut().zip(&owner) {
            *index = counts[owner];
            counts[owner] += 1;
        }
        let first: Vec<usize> = (0..comm.size()).map(|r| counts[..r].iter().sum()).collect();
        let petsc = nodes.iter().map(|&i| (first[owner[i]] + index[i]) as i32).collect();
        let roots: Vec<_> = ghosts.iter().map(|&i| (owner[i], index[i])).collect();
        let ghosts = Ghosts::new(session, owned, &roots)?;
        Ok(Some(Self {
            local: nodes.iter().enumerate().map(|(local, &node)| (node, local)).collect(),
            partition: Partition::distributed(comm, owned, total, petsc, ghosts),
            nodes,
            owned,
            triangles,
            own_triangles,
        }))
    }

    /// The local index of a node, if the rank keeps it.
    pub fn local(&self, node: usize) -> Option<usize> {
        self.local.get(&node).copied()
    }

    /// The local index of a node, if the rank owns it.
    pub fn owned(&self, node: usize) -> Option<usize> {
        self.local(node).filter(|&local| local < self.owned)
    }

    /// The local part of a nodal field of the undivided body with `block` components.
    pub fn field<T: Copy>(&self, undivided: &[T], block: usize) -> Vec<T> {
        self.nodes.iter().flat_map(|&i| &undivided[block * i..block * (i + 1)]).copied().collect()
    }

    /// The edges that have a node which the rank owns, with local indices.
    pub fn edges(&self, undivided: &[[usize; 2]]) -> Vec<[usize; 2]> {
        let local = |&[a, b]: &[usize; 2]| match (self.local(a), self.local(b)) {
            (Some(a), Some(b)) if a.min(b) < self.owned => Some([a, b]),
            _ => None,
        };
        undivided.iter().filter_map(local).collect()
    }

    /// The local part of the undivided body.
    pub fn body(self, undivided: &Body) -> Body {
        let mesh = &undivided.mesh;
        let curve = |curve: &Curve| Curve { edges: self.edges(&curve.edges), ..*curve };
        let corner = |i: usize| self.local[&i];
        let curved = mesh.curved.iter().filter_map(|([a, b], &midpoint)| {
            let (a, b) = (self.local(*a)?, self.local(*b)?);
            Some(([a.min(b), a.max(b)], midpoint))
        });
        Body {
            mesh: Mesh {
                nodes: self.field(&mesh.nodes, 1),
                triangles: self.triangles.iter().map(|&t| mesh.triangles[t].map(corner)).collect(),
                curves: mesh.curves.iter().map(|(n, c)| (n.clone(), curve(c))).collect(),
                curved: curved.collect(),
            },
            triangles: self.triangles.iter().map(|&t| undivided.triangles[t]).collect(),
            own_triangles: self.own_triangles,
            node_area: self.field(&undivided.node_area, 1),
            area: undivided.area,
            centroid: undivided.centroid,
            polar_inertia: undivided.polar_inertia,
            partition: self.partition,
        }
    }
}
