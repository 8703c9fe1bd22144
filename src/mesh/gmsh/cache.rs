//! The mesh of a `.geo`, kept in a file beside it for later runs.
//!
//! A kept file ends with a comment of three digests: of all inputs from which gmsh made the mesh, of the gmsh that
//! made it, and of the file before this comment. A mesh is read again if the first digest is that of the present
//! inputs, and gmsh is the same program or has the same version. A file is replaced only if the third digest is
//! right: then this program wrote it, and nobody has changed it.

use sha2::{Digest, Sha256};
use std::{
    env,
    ffi::OsString,
    fs, io,
    iter::once,
    path::{Path, PathBuf},
    process::Command,
};

/// Commands and options of a `.geo` that read the file of the name that follows in quotes. (An unquoted name
/// is known to gmsh alone.)
const READERS: [&str; 4] = ["Include", "Merge", "ShapeFromFile", "FileName"];
/// Commands of a `.geo` whose result depends on more than files.
const IMPURE: [&str; 2] = ["SystemCall", "GetEnv"];

/// The files from which gmsh makes a mesh.
pub struct Inputs {
    /// The contents of the `.geo` and of all files that it names, directly or through others.
    pub contents: Vec<Vec<u8>>,
    /// Whether the mesh depends on these files alone.
    pub are_all: bool,
}

impl Inputs {
    /// Reads a `.geo` and each file whose name stands there in quotes. gmsh reports missing files.
    pub fn read(geo: &Path) -> io::Result<Self> {
        let mut files = vec![fs::canonicalize(geo)?];
        let mut inputs = Self { contents: Vec::new(), are_all: true };
        while let Some(file) = files.get(inputs.contents.len()).cloned() {
            let bytes = fs::read(&file)?;
            let text = String::from_utf8_lossy(&bytes);
            // gmsh also runs the options beside a file.
            let options = format!("{}.opt", file.display());
            for name in text.split('"').chain(once(&*options)) {
                // Most names are relative to the file that contains them, those of size fields to the working folder.
                for path in [file.with_file_name(name), PathBuf::from(name)] {
                    let path = fs::canonicalize(path).ok();
                    files.extend(path.filter(|path| path.is_file() && !files.contains(path)));
                }
            }
            let argument = |rest: &str| {
                rest.trim_start_matches(|c: char| c.is_whitespace() || "(={".contains(c))
                    .starts_with('"')
            };
            inputs.are_all &= !IMPURE.iter().any(|command| text.contains(command))
                && READERS.iter().all(|reader| text.split(reader).skip(1).all(argument));
            inputs.contents.push(bytes);
        }
        Ok(inputs)
    }

    /// The digest of these files, of the options that the user has saved in gmsh, and of what else gmsh gets.
    pub fn digest(&self, arguments: &[OsString], last: &str) -> String {
        let options = env::home_dir().and_then(|home| fs::read(home.join(".gmsh-options")).ok());
        let files: Vec<_> = self.contents.iter().chain(&options).map(|file| digest(file)).collect();
        digest(format!("{files:?} {arguments:?} {last:?}").as_bytes())
    }
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The comment after a mesh that this gmsh made from inputs of this digest.
pub fn signature(mesh: &[u8], [inputs, gmsh]: [&str; 2]) -> String {
    format!("$Comments\ninputs {inputs}, gmsh {gmsh}, mesh {}\n$EndComments\n", digest(mesh))
}

/// The digests of the inputs and of the gmsh of a kept mesh; `None` for any other file.
pub fn origin(file: &[u8]) -> Option<[&str; 2]> {
    let none = digest(b"");
    let start = file.len().checked_sub(signature(b"", [&none, &none]).len())?;
    let (mesh, end) = file.split_at(start);
    let rest = str::from_utf8(end).ok()?.strip_prefix("$Comments\ninputs ")?;
    let (inputs, rest) = rest.split_once(", gmsh ")?;
    let origin = [inputs, rest.split(',').next()?];
    (signature(mesh, origin).as_bytes() == end).then_some(origin)
}

/// The digest of the path, the length and the time of the installed gmsh, if there is one. Asking it for its version
/// takes as long as a small mesh.
pub fn program() -> Option<String> {
    let paths = env::var_os("PATH")?;
    let program = env::split_paths(&paths).map(|folder| folder.join("gmsh")).find(|p| p.is_file());
    let program = fs::canonicalize(program?).ok()?;
    let data = fs::metadata(&program).ok()?;
    let identity = format!("{program:?} {} {:?}", data.len(), data.modified().ok()?);
    Some(digest(identity.as_bytes()))
}

/// The version of the installed gmsh, if there is one.
pub fn version() -> Option<String> {
    let said = Command::new("gmsh").arg("--version").output().ok()?;
    // Some versions write it to stdout, others to stderr. A development version goes on with "-git".
    let said = [said.stdout, said.stderr].concat();
    Some(String::from_utf8_lossy(&said).trim().split('-').next()?.to_owned())
}
