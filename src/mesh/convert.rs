//! Converts meshes of other programs to MSH 4.1 with Python.

use super::{MeshError, gmsh::note};
use crate::python::{ISOLATED, python};
use std::{path::Path, process::Command};

/// The Python program that writes a mesh as MSH 4.1.
pub const SCRIPT: &str = include_str!("../../scripts/convert.py");

/// The bytes of the MSH 4.1 file that the script makes from the file `path`. Some formats need no meshio.
///
/// # Errors
/// Python or meshio is missing, or the file is no plane mesh in the format that its extension names.
pub fn run(path: &Path) -> Result<Vec<u8>, MeshError> {
    let python = python(&["meshio"]).or_else(|problem| python(&[]).map_err(|_| problem));
    let python = python.map_err(|problem| MeshError::file(path, problem))?;
    let mut command = Command::new(&python);
    command.args(ISOLATED).args(["-c", SCRIPT]).arg(path);
    let made = command.output().map_err(MeshError::io(Path::new(&python)))?;
    let said = String::from_utf8_lossy(&made.stderr);
    let last = said.trim().lines().last().unwrap_or("the conversion failed");
    if !made.status.success() {
        return Err(MeshError::file(path, last));
    }
    said.lines().filter_map(|line| line.strip_prefix("note: ")).for_each(|text| note(path, text));
    Ok(made.stdout)
}
