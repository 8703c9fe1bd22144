//! What can be wrong with a mesh, told to the person at the terminal.

use std::{fmt, io, path::PathBuf};

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file was read but is not a mesh of a plane body.
    #[error("{}{}: {problem}", path.display(), place.as_ref().map(Place::to_string).unwrap_or_default())]
    File {
        /// The file.
        path: PathBuf,
        /// Where in it, when that is known.
        place: Option<Place>,
        /// What is wrong.
        problem: Box<Problem>,
    },
    /// Neither `.geo` nor `.msh`.
    #[error("{}: a mesh is a .msh file or a .geo file for gmsh", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
    },
    /// A mesh parameter gmsh would misread or ignore.
    #[error("{}: mesh parameter `{name}` = {value}: {reason}", path.display())]
    Parameter {
        /// The `.geo` file.
        path: PathBuf,
        /// Name of the parameter.
        name: String,
        /// Its value.
        value: f64,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// gmsh is not installed.
    #[error(
        "{}: gmsh is needed to mesh this file and was not found; install it with `make deps` \
         (Debian: apt install gmsh), or give a .msh file",
        path.display()
    )]
    GmshMissing {
        /// The `.geo` file.
        path: PathBuf,
    },
    /// gmsh ran and did not produce a mesh.
    #[error("{}: gmsh could not mesh it:\n{message}", path.display())]
    GmshFailed {
        /// The `.geo` file.
        path: PathBuf,
        /// gmsh's own error lines.
        message: String,
    },
}

/// A place in a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Line number of a text file, from 1.
    Line(usize),
    /// Offset in a binary file, from 0, and the section it lies in.
    Byte {
        /// Section name without the dollar sign; empty before the first section.
        section: String,
        /// Offset in bytes.
        byte: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte { section, byte } if section.is_empty() => write!(f, ", byte {byte}"),
            Self::Byte { section, byte } => write!(f, ", byte {byte} in ${section}"),
        }
    }
}

/// What is wrong in a mesh file. Nodes and elements go by their tags in the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages are the documentation")]
pub enum Problem {
    #[error("the file is empty")]
    Empty,
    #[error("not a gmsh mesh: it does not begin with $MeshFormat")]
    NotMsh,
    #[error(
        "MSH version {0} is not supported, 4.1 and 2.2 are; convert the file with \
         `gmsh OLD.msh -save -format msh41 -o NEW.msh` (or -format msh22)"
    )]
    Version(String),
    #[error(
        "written on a machine with the other byte order; convert it there with \
         `gmsh OLD.msh -save -format msh41 -o NEW.msh` (text, without -bin)"
    )]
    ByteOrder,
    #[error(
        "written with {0}-byte numbers where 8 are expected; convert it there with \
         `gmsh OLD.msh -save -format msh41 -o NEW.msh` (text, without -bin)"
    )]
    DataSize(String),
    #[error("the file ends inside ${section}: it was cut off; mesh or copy it again")]
    Truncated { section: String },
    #[error("expected {what}, found `{found}`")]
    Expected { what: &'static str, found: String },
    #[error(
        "{count} {what} are announced, more than the rest of the file can hold: \
         it was cut off or damaged; mesh or copy it again"
    )]
    Count { what: &'static str, count: u64 },
    #[error("{announced} {what} are announced but {found} are listed")]
    Total { what: &'static str, announced: usize, found: usize },
    #[error("there is no ${0} section")]
    MissingSection(&'static str),
    #[error("$Entities must come before $Elements, or the physical groups are lost")]
    LateEntities,
    #[error(
        "the mesh is partitioned; write it whole: mesh without -part, or without \
         Mesh.NbPartitions in the .geo"
    )]
    Partitioned,
    #[error(
        "$ParametricNodes of MSH 2 are not supported; mesh without -save_parametric \
         (Mesh.SaveParametric = 0), or with -format msh41"
    )]
    ParametricNodes,
    #[error("node {0} is listed twice")]
    DuplicateNode(u64),
    #[error("a coordinate of node {0} is not a finite number")]
    NotFinite(u64),
    #[error("node {node} has z = {z}: the body must lie in the plane z = 0")]
    NotPlanar { node: u64, z: f64 },
    #[error(
        "the mesh holds {0}; only three-node triangles are supported: mesh with `gmsh -2`, \
         without Recombine and with Mesh.ElementOrder = 1"
    )]
    Unusable(String),
    #[error(
        "unknown element type {0}; only lines (1), triangles (2) and points (15) are supported"
    )]
    UnknownType(i64),
    #[error(
        "there are no triangles; mesh with `gmsh -2`, and give the body a Physical Surface \
         if there are physical groups at all"
    )]
    NoTriangles,
    #[error("triangle {0} has no area: its nodes lie on a line; mend the mesh there")]
    ZeroArea(u64),
    #[error("element {element} refers to node {node}, which $Nodes does not list")]
    MissingNode { element: u64, node: u64 },
    #[error(
        "triangles {first} and {second} are the same: two surfaces lie on each other; \
         keep one of them (gmsh: Coherence)"
    )]
    DuplicateTriangle { first: u64, second: u64 },
    #[error(
        "the edge between nodes {} and {} belongs to three triangles ({}, {}, {}): \
         surfaces overlap; keep one of them", nodes[0], nodes[1], triangles[0], triangles[1], triangles[2]
    )]
    CrowdedEdge { nodes: [u64; 2], triangles: [u64; 3] },
    #[error(
        "triangles {} and {} lie on the same side of their common edge, nodes {} and {}: \
         the mesh folds over itself there", triangles[0], triangles[1], nodes[0], nodes[1]
    )]
    Fold { nodes: [u64; 2], triangles: [u64; 2] },
    #[error(
        "line {line} of the physical curve `{curve}`, nodes {} and {}, is no edge of any triangle \
         of the body; does its surface belong to a Physical Surface?", nodes[0], nodes[1]
    )]
    StrayLine { line: u64, curve: String, nodes: [u64; 2] },
}
