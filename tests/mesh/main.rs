//! Meshes: what every file must give, what is wrong with a malformed one, what gmsh makes of the
//! geometries, the boundary of a mesh and its refinement.

#[path = "../common/mod.rs"]
mod common;

mod boundary;
mod geometries;
mod malformed;
mod reader;
mod refine;
