//! A rank's share of a body that every rank has read.

use super::{Body, Partition};
use crate::{
    mesh::{Curve, Mesh},
    petsc::{Ghosts, PetscError, Session, divide},
};
use std::collections::HashMap;

/// The nodes and triangles of a whole body that a rank keeps: the nodes it owns, the triangles
/// around them, and the other nodes of these as ghosts.
#[derive(Debug)]
pub struct Subdomain {
    /// Whole numbers of the rank's nodes, owned ones first.
    nodes: Vec<usize>,
    owned: usize,
    /// Whole numbers of the rank's triangles, its own first.
    triangles: Vec<usize>,
    own_triangles: usize,
    /// From whole numbers of nodes to the rank's.
    local: HashMap<usize, usize>,
    partition: Partition,
}

impl Subdomain {
    /// Divides the nodes of `mesh`; `None` where one rank keeps it all. Collective.
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

        // Numbers among the nodes of the same owner, and the first number of each owner.
        let mut counts = vec![0; comm.size()];
        let mut place = vec![0; total];
        for (place, &owner) in place.iter_mut().zip(&owner) {
            *place = counts[owner];
            counts[owner] += 1;
        }
        let first: Vec<usize> = (0..comm.size()).map(|r| counts[..r].iter().sum()).collect();
        let global = nodes.iter().map(|&i| (first[owner[i]] + place[i]) as i32).collect();
        let roots: Vec<_> = ghosts.iter().map(|&i| (owner[i], place[i])).collect();
        let ghosts = Ghosts::new(session, owned, &roots)?;
        Ok(Some(Self {
            local: nodes.iter().enumerate().map(|(local, &whole)| (whole, local)).collect(),
            partition: Partition::part(comm, owned, total, global, ghosts),
            nodes,
            owned,
            triangles,
            own_triangles,
        }))
    }

    /// The rank's number of a node of the whole body, if it knows the node.
    pub fn local(&self, node: usize) -> Option<usize> {
        self.local.get(&node).copied()
    }

    /// The rank's number of a node of the whole body, if it owns the node.
    pub fn owned(&self, node: usize) -> Option<usize> {
        self.local(node).filter(|&local| local < self.owned)
    }

    /// The rank's part of a nodal field with `block` components.
    pub fn field<T: Copy>(&self, whole: &[T], block: usize) -> Vec<T> {
        self.nodes.iter().flat_map(|&i| &whole[block * i..block * (i + 1)]).copied().collect()
    }

    /// The edges around the nodes that the rank owns, in its numbers.
    pub fn edges(&self, whole: &[[usize; 2]]) -> Vec<[usize; 2]> {
        let local = |&[a, b]: &[usize; 2]| match (self.local(a), self.local(b)) {
            (Some(a), Some(b)) if a.min(b) < self.owned => Some([a, b]),
            _ => None,
        };
        whole.iter().filter_map(local).collect()
    }

    /// The rank's part of `whole`.
    pub fn body(self, whole: &Body) -> Body {
        let mesh = &whole.mesh;
        let curve = |curve: &Curve| Curve { edges: self.edges(&curve.edges), ..*curve };
        let corner = |i: usize| self.local[&i];
        Body {
            mesh: Mesh {
                nodes: self.field(&mesh.nodes, 1),
                triangles: self.triangles.iter().map(|&t| mesh.triangles[t].map(corner)).collect(),
                curves: mesh.curves.iter().map(|(n, c)| (n.clone(), curve(c))).collect(),
            },
            triangles: self.triangles.iter().map(|&t| whole.triangles[t]).collect(),
            own_triangles: self.own_triangles,
            node_area: self.field(&whole.node_area, 1),
            area: whole.area,
            centroid: whole.centroid,
            polar_inertia: whole.polar_inertia,
            partition: self.partition,
        }
    }
}
