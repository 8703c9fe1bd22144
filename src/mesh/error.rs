//! Errors of meshes, as messages for the person at the terminal.

use crate::interrupt::Signal;
use std::{
    io,
    path::{Path, PathBuf},
};

/// Why there is no mesh.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file is not the mesh of one plane body, or gmsh cannot make such a mesh from it.
    #[error("{}{place}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// `:LINE` in a text file, `, byte N in $SECTION` in a binary one, empty if not known.
        place: String,
        /// The problem and its remedy. Nodes and elements have the tags of the file.
        problem: String,
    },
    /// A signal came while gmsh worked.
    #[error("{0} while gmsh worked")]
    Interrupted(Signal),
    /// The sides of a triangle with this vertex, m, are so curved that its parts would fold over each other.
    #[error("the triangle at ({}, {}) is too curved; start from a finer mesh there", .0[0], .0[1])]
    TooCurved([f64; 2]),
}

debug_is_message!(MeshError);

impl MeshError {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        |source| Self::Io { path: path.to_owned(), source }
    }

    pub(super) fn file(path: &Path, problem: impl Into<String>) -> Self {
        Self::File { path: path.to_owned(), place: String::new(), problem: problem.into() }
    }
}
