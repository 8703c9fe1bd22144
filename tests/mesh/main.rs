//! Meshes: what every file must give, what is wrong with a malformed one, what gmsh makes of the
//! geometries, the boundary of a mesh and its refinement.

#[path = "../common/mod.rs"]
mod common;

use signorini::{
    fem::Edge,
    mesh::{BoundaryNode, Lines, Mesh},
};

/// The nodes of straight boundary edges.
fn boundary_nodes(mesh: &Mesh, edges: &[[usize; 2]]) -> Vec<BoundaryNode> {
    let lines = Lines::boundary(mesh);
    let edges = edges.iter().map(|&ends| Edge { ends, middle: None });
    let faces = edges.flat_map(|edge| edge.faces(&mesh.nodes, &lines).collect::<Vec<_>>());
    signorini::mesh::boundary_nodes(faces)
}

mod blemishes;
mod boundary;
mod foreign;
mod geometries;
mod malformed;
mod numbering;
mod reader;
mod refine;
mod writer;
