//! What can be wrong with a mesh, told to the person at the terminal.

use std::{
    fmt, io,
    path::{Path, PathBuf},
};

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
    /// A mesh parameter that gmsh would misread or ignore.
    #[error("{}: mesh parameter {reason}", path.display())]
    Parameter {
        /// The `.geo` file.
        path: PathBuf,
        /// The parameter, and what is wrong with it.
        reason: String,
    },
    /// No mesh was made of the file: it is not for gmsh, or gmsh is missing or has failed.
    #[error("{}: {reason}", path.display())]
    Meshing {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
}

impl MeshError {
    /// The error of a file that could not be read or written.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        |source| Self::Io { path: path.to_owned(), source }
    }

    pub(super) fn meshing(path: &Path, reason: impl Into<String>) -> Self {
        Self::Meshing { path: path.to_owned(), reason: reason.into() }
    }
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
        "its binary numbers are those of another machine (byte order or size); convert it there \
         with `gmsh OLD.msh -save -format msh41 -o NEW.msh` (text, without -bin)"
    )]
    ForeignNumbers,
    #[error("the file ends inside ${section}: it was cut off; mesh or copy it again")]
    Truncated { section: String },
    #[error(
        "expected {what}, but ${section} ends here: it lists less than it announces; mesh or copy \
         it again"
    )]
    SectionEnds { what: String, section: String },
    #[error("expected {what}, found `{found}`")]
    Expected { what: String, found: String },
    #[error("there is no ${0} section")]
    MissingSection(&'static str),
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
        "element {element} is of gmsh's type {element_type} ({name}); only three-node triangles \
         are supported: mesh with `gmsh -2`, without Recombine and with Mesh.ElementOrder = 1"
    )]
    ElementType { element: u64, element_type: i32, name: &'static str },
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
        "triangles {} and {} lie on the same side of their common edge, nodes {} and {}: two \
         surfaces overlap, of which one should go (gmsh: Coherence), or the mesh folds over itself",
        triangles[0], triangles[1], nodes[0], nodes[1]
    )]
    Overlap { triangles: [u64; 2], nodes: [u64; 2] },
    #[error(
        "line {line} of the physical curve `{curve}`, nodes {} and {}, is no edge of any triangle \
         of the body; does its surface belong to a Physical Surface?", nodes[0], nodes[1]
    )]
    StrayLine { line: u64, curve: String, nodes: [u64; 2] },
}
