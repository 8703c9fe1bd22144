//! Converts meshes of other programs to MSH 4.1 with Python.

use super::MeshError;
use crate::python::{SCRIPTS, python, script_command};
use std::path::Path;

/// The sources of the converter.
pub fn sources() -> String {
    SCRIPTS.iter().filter(|(name, _)| name.starts_with("meshes/")).map(|(_, text)| *text).collect()
}

/// The bytes of the MSH 4.1 file that the script makes from the file `path`, with the array that has its `materials`. Some
/// formats need no meshio.
///
/// # Errors
/// Python or meshio is missing, or the file is no plane mesh in the format that its extension names.
pub fn run(path: &Path, materials: Option<&str>) -> Result<Vec<u8>, MeshError> {
    let python = python(&["meshio"]).or_else(|problem| python(&[]).map_err(|_| problem));
    let python = python.map_err(|problem| MeshError::file(path, problem))?;
    let made = script_command(&python, "meshes.convert")
        .and_then(|mut command| command.arg(path).args(materials).output());
    let made = made.map_err(MeshError::io(Path::new(&python)))?;
    let said = String::from_utf8_lossy(&made.stderr);
    let last = said.trim().lines().last().unwrap_or("the conversion failed");
    if !made.status.success() {
        // The script names the file and the line; this message also has the folder.
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let at = last
            .strip_prefix(&*name)
            .and_then(|rest| rest.strip_prefix(", line ")?.split_once(": "));
        let (place, problem) =
            at.map_or((String::new(), last), |(line, rest)| (format!(":{line}"), rest));
        return Err(MeshError::File { path: path.to_owned(), place, problem: problem.to_owned() });
    }
    Ok(made.stdout)
}
