//! The subdomain of a rank. At first every rank has the undivided body.

use super::{Body, Edge, Nodes, Partition, body::QuadraticElements};
use crate::{
    mesh::{Curve, Mesh},
    petsc::{Ghosts, PetscError, Session, divide},
};
use rustc_hash::FxHashMap as HashMap;
use std::{collections::BTreeSet, rc::Rc, sync::OnceLock};

/// The nodes and triangles of a subdomain: the owned nodes, the triangles around them, and the other nodes of
/// these triangles as ghosts.
///
/// *Local* indices count these nodes and triangles; all others are indices in the undivided body.
/// (PETSc numbers the nodes a third way, see [`Partition`].)
#[derive(Debug)]
pub struct Subdomain {
    /// The vertices, nodes of ζ.
    vertices: LocalNodes,
    /// The nodes of u for P2; `None` if they are the vertices.
    quadratic: Option<LocalNodes>,
    /// Index in the undivided mesh of each local triangle; the triangles that belong to the rank come first.
    triangles: Vec<usize>,
    own_triangles: usize,
}

/// The nodes of a space in a subdomain.
#[derive(Debug)]
struct LocalNodes {
    /// Index in the undivided body of each local node, owned ones first.
    nodes: Vec<usize>,
    /// Local index of each of `nodes`.
    local: HashMap<usize, usize>,
    partition: Partition,
}

impl LocalNodes {
    /// From the `owner` of each node of a space: the owned nodes of this rank, and the other nodes in `kept`
    /// as ghosts. Collective.
    fn new(
        session: &Session,
        owner: &[usize],
        kept: impl Iterator<Item = usize>,
    ) -> Result<Self, PetscError> {
        let (comm, total) = (session.comm(), owner.len());
        let mut nodes: Vec<usize> = (0..total).filter(|&i| owner[i] == comm.rank()).collect();
        let owned = nodes.len();
        let ghosts: BTreeSet<usize> = kept.filter(|&i| owner[i] != comm.rank()).collect();
        nodes.extend(ghosts);
        // PETSc numbers the nodes owner by owner. The index of each node among the nodes of its owner, and
        // the first number of each owner.
        let mut counts = vec![0; comm.size()];
        let mut index = vec![0; total];
        for (index, &owner) in index.iter_mut().zip(owner) {
            *index = counts[owner];
            counts[owner] += 1;
        }
        let first: Vec<usize> = (0..comm.size()).map(|r| counts[..r].iter().sum()).collect();
        let petsc = nodes.iter().map(|&i| (first[owner[i]] + index[i]) as i32).collect();
        let roots: Vec<_> = nodes[owned..].iter().map(|&i| (owner[i], index[i])).collect();
        let ghosts = Ghosts::new(session, owned, &roots)?;
        Ok(Self {
            local: nodes.iter().enumerate().map(|(local, &node)| (node, local)).collect(),
            partition: Partition::distributed(comm, owned, total, petsc, ghosts),
            nodes,
        })
    }

    fn field<T: Copy>(&self, undivided: &[T], block: usize) -> Vec<T> {
        self.nodes.iter().flat_map(|&i| &undivided[block * i..block * (i + 1)]).copied().collect()
    }

    /// The nodes of these triangles in local indices.
    fn cells<const N: usize>(
        &self,
        undivided: &[[usize; N]],
        triangles: &[usize],
    ) -> Vec<[usize; N]> {
        triangles.iter().map(|&t| undivided[t].map(|node| self.local[&node])).collect()
    }

    /// The edges of a curve with an owned end.
    fn curve(&self, undivided: &Curve) -> Curve {
        let local = |edge: &[usize; 2]| {
            let [a, b] = edge.map(|node| self.local.get(&node).copied());
            Some([a?, b?]).filter(|[a, b]| a.min(b) < &self.partition.owned())
        };
        let edges = undivided.edges.iter().filter_map(local).collect();
        Curve { edges, other_edges: undivided.other_edges }
    }

    /// The nodes of the subdomain as [`Nodes`].
    fn restrict(self, undivided: &Nodes) -> Rc<Nodes> {
        Rc::new(Nodes {
            points: self.field(&undivided.points, 1),
            weights: self.field(&undivided.weights, 1),
            area: undivided.area,
            partition: self.partition,
        })
    }
}

impl Subdomain {
    /// The subdomain of this rank; `None` if there is only one rank. Collective.
    ///
    /// # Errors
    /// PETSc cannot divide the mesh.
    pub fn new(session: &Session, body: &Body) -> Result<Option<Self>, PetscError> {
        let (comm, mesh) = (session.comm(), &body.mesh);
        if comm.is_serial() {
            return Ok(None);
        }
        let owner = divide(session, mesh.nodes.len(), &mesh.triangles)?;
        // A triangle belongs to the owner of its first node.
        let around = |t: &usize| mesh.triangles[*t].iter().any(|&i| owner[i] == comm.rank());
        let own = |t: &usize| owner[mesh.triangles[*t][0]] == comm.rank();
        let mut triangles: Vec<usize> = (0..mesh.triangles.len()).filter(own).collect();
        let own_triangles = triangles.len();
        triangles.extend((0..mesh.triangles.len()).filter(|t| around(t) && !own(t)));

        let kept = triangles.iter().flat_map(|&t| mesh.triangles[t]);
        let vertices = LocalNodes::new(session, &owner, kept)?;
        let quadratic = body.quadratic.as_ref().map(|quadratic| {
            // The middle of an edge belongs to the owner of its first end.
            let mut owner = owner.to_vec();
            owner.resize(body.nodes.points.len(), 0);
            quadratic.middle.iter().for_each(|(ends, &node)| owner[node] = owner[ends[0]]);
            let kept = triangles.iter().flat_map(|&t| quadratic.nodes[t]);
            LocalNodes::new(session, &owner, kept)
        });
        Ok(Some(Self { vertices, quadratic: quadratic.transpose()?, triangles, own_triangles }))
    }

    /// The nodes of u.
    fn nodes(&self) -> &LocalNodes {
        self.quadratic.as_ref().unwrap_or(&self.vertices)
    }

    /// The local index of a node of u, if the rank keeps it.
    pub fn local(&self, node: usize) -> Option<usize> {
        self.nodes().local.get(&node).copied()
    }

    /// The local index of a node of u, if the rank owns it.
    pub fn owned(&self, node: usize) -> Option<usize> {
        self.local(node).filter(|&local| local < self.nodes().partition.owned())
    }

    /// The local index of a triangle, if the rank keeps it.
    pub fn triangle(&self, triangle: usize) -> Option<usize> {
        self.triangles.iter().position(|&kept| kept == triangle)
    }

    /// The local part of a nodal field like u of the undivided body with `block` components.
    pub fn field<T: Copy>(&self, undivided: &[T], block: usize) -> Vec<T> {
        self.nodes().field(undivided, block)
    }

    /// The edges that have an end which the rank owns, with local indices.
    pub fn edges(&self, undivided: &[Edge]) -> Vec<Edge> {
        let local = |edge: &Edge| {
            let [a, b] = edge.ends.map(|node| self.local(node));
            let (ends, owned) = ([a?, b?], self.nodes().partition.owned());
            let middle = edge.middle.and_then(|node| self.local(node));
            (ends[0].min(ends[1]) < owned).then_some(Edge { ends, middle })
        };
        undivided.iter().filter_map(local).collect()
    }

    /// The local part of the undivided body.
    pub fn body(self, undivided: &Body) -> Body {
        let Self { vertices, quadratic, triangles, own_triangles } = self;
        let part = &undivided.mesh;
        let mesh = Mesh {
            nodes: vertices.field(&part.nodes, 1),
            triangles: vertices.cells(&part.triangles, &triangles),
            curves: part.curves.iter().map(|(n, c)| (n.clone(), vertices.curve(c))).collect(),
            gmsh: part.gmsh.clone(),
            // The elements know their curvature, the body its materials, the constraints the corners.
            ..Mesh::default()
        };
        let elements = undivided.quadratic.as_ref().zip(quadratic.as_ref());
        let elements = elements.map(|(undivided, nodes)| QuadraticElements {
            nodes: nodes.cells(&undivided.nodes, &triangles),
            elements: triangles.iter().map(|&t| undivided.elements[t]).collect(),
            middle: HashMap::default(),
        });
        let near = &undivided.near_jumps;
        let near_jumps = if near.is_empty() { Vec::new() } else { vertices.field(near, 1) };
        let vertices = vertices.restrict(&undivided.vertices);
        Body {
            mesh,
            triangles: triangles.iter().map(|&t| undivided.triangles[t]).collect(),
            own_triangles,
            materials: triangles
                .iter()
                .filter_map(|&t| undivided.materials.get(t).copied())
                .collect(),
            near_jumps,
            global_triangles: triangles,
            nodes: match quadratic {
                None => Rc::clone(&vertices),
                Some(nodes) => nodes.restrict(&undivided.nodes),
            },
            vertices,
            quadratic: elements,
            patches: OnceLock::new(),
            ..*undivided
        }
    }
}
