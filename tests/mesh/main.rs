//! Meshes: what every file must give, what is wrong with a malformed one, what gmsh makes of the
//! geometries, the boundary of a mesh and its refinement.

#[path = "../common/mod.rs"]
mod common;

use signorini::{
    fem::Edge,
    mesh::{BoundaryFace, Lines, Mesh, joined_faces},
};

/// A node of a boundary with its faces.
struct BoundaryNode {
    node: usize,
    faces: Vec<BoundaryFace>,
}

/// The nodes of straight boundary edges.
fn boundary_nodes(mesh: &Mesh, edges: &[[usize; 2]]) -> Vec<BoundaryNode> {
    let lines = Lines::boundary(mesh);
    let edges = edges.iter().map(|&ends| Edge { ends, middle: None });
    let faces = edges.flat_map(|edge| edge.faces(&mesh.nodes, &lines).collect::<Vec<_>>());
    let nodes = joined_faces(faces.map(|(node, face)| (node, face, ()))).into_iter();
    let faces = |faces: Vec<(BoundaryFace, _)>| faces.into_iter().map(|(face, _)| face).collect();
    nodes.map(|(node, of)| BoundaryNode { node, faces: faces(of) }).collect()
}

mod blemishes;
mod boundary;
mod foreign;
mod geometries;
mod malformed;
mod numbering;
mod reader;
mod refine;
mod smooth;
mod writer;
