//! The kinds of files that a mesh comes from.

use std::path::Path;

/// A kind of file, by its extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A mesh of gmsh.
    Msh,
    /// A geometry, which gmsh meshes.
    Geometry,
    /// A mesh of another program, which scripts/meshes/ converts.
    Foreign,
}

/// The formats in messages.
pub const FORMATS: &str = "a .msh, a geometry for gmsh (.geo .step .stp .brep .iges .igs), or a mesh of another program \
                           (.inp .unv .med .bdf .nas .vtu .vtk .xdmf)";

impl Format {
    /// The format of a file; `None` if the program cannot read it.
    pub fn of(path: &Path) -> Option<Self> {
        match &*path.extension()?.to_str()?.to_ascii_lowercase() {
            "msh" => Some(Self::Msh),
            "geo" | "step" | "stp" | "brep" | "iges" | "igs" => Some(Self::Geometry),
            "inp" | "unv" | "med" | "bdf" | "nas" | "vtu" | "vtk" | "xdmf" => Some(Self::Foreign),
            _ => None,
        }
    }
}

/// Whether the format of a file has arrays on its cells, of which one may have the numbers of the materials.
pub fn has_arrays(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    ["vtu", "vtk", "xdmf"].iter().any(|with_arrays| ending == *with_arrays)
}
