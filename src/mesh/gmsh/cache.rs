//! The mesh of a `.geo`, kept in a file beside it for later runs.
//!
//! A kept file ends with a comment of three digests: of all inputs from which gmsh made the mesh, of the gmsh that
//! made it, and of the file before this comment. A mesh is read again if the first digest is that of the present
//! inputs, and gmsh is the same program or missing. A file is replaced only if the third digest is
//! right: then this program wrote it, and nobody has changed it.

use crate::{python::gmsh, whole_file};
use sha2::{Digest, Sha256};
use std::{
    env,
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

/// Commands and options of a `.geo` that read the file of the name that follows in quotes. (An unquoted name
/// is known to gmsh alone.)
const READERS: [&str; 4] = ["Include", "Merge", "ShapeFromFile", "FileName"];
/// Commands of a `.geo` whose result depends on more than files, and the signs of an `.xdmf`, an `.inp` and a `.bdf` that read files;
/// in any case of their letters.
const IMPURE: [&str; 5] = ["systemcall", "getenv", ".h5:", "input=", "include'"];
/// Signs between a reader and its name.
const BEFORE_NAME: [char; 7] = [' ', '\t', '\r', '\n', '(', '=', '{'];

/// The files from which gmsh makes a mesh.
pub struct Inputs {
    /// The `.geo`, and all files that it names, directly or through others.
    files: Vec<PathBuf>,
    /// Their contents.
    pub contents: Vec<Vec<u8>>,
    /// Whether the mesh depends on these files alone.
    pub are_all: bool,
}

impl Inputs {
    /// Reads a `.geo` and each file whose name stands there in quotes. gmsh reports missing files.
    pub fn read(geo: &Path) -> io::Result<Self> {
        let files = vec![fs::canonicalize(geo)?];
        let mut inputs = Self { files, contents: Vec::new(), are_all: true };
        while let Some(file) = inputs.files.get(inputs.contents.len()).cloned() {
            let bytes = whole_file::read(&file)?;
            let text = String::from_utf8_lossy(&bytes);
            // gmsh also runs the options beside a file.
            let options = fs::canonicalize(format!("{}.opt", file.display()));
            for path in parts(&file, &text).flat_map(|(_, paths)| paths).chain(options) {
                inputs.files.extend((!inputs.files.contains(&path)).then_some(path));
            }
            let argument = |rest: &str| rest.trim_start_matches(BEFORE_NAME).starts_with('"');
            let lower: String = text.to_ascii_lowercase().replace(' ', "");
            inputs.are_all &= !IMPURE.iter().any(|command| lower.contains(command))
                && READERS.iter().all(|reader| text.split(reader).skip(1).all(argument));
            inputs.contents.push(bytes);
        }
        Ok(inputs)
    }

    /// Names for copies of these files in one folder; none if files are not known.
    pub fn copies(self) -> Vec<(String, PathBuf)> {
        let ending =
            |file: &Path| file.extension().unwrap_or_default().to_string_lossy().into_owned();
        if !self.are_all || self.files.iter().any(|file| ending(file) == "opt") {
            return Vec::new();
        }
        let name = |(number, file): (usize, PathBuf)| match number {
            0 => (format!("scene.{}", ending(&file)), file),
            _ => (format!("scene-mesh{number}.{}", ending(&file)), file),
        };
        self.files.into_iter().enumerate().map(name).collect()
    }

    /// The digest of these files, of the options that the user has saved in gmsh, and of what else gmsh gets.
    pub fn digest(&self, arguments: &[OsString], last: &str) -> String {
        let options = env::home_dir().and_then(|home| fs::read(home.join(".gmsh-options")).ok());
        let files: Vec<_> = self.contents.iter().chain(&options).map(|file| digest(file)).collect();
        digest(format!("{files:?} {arguments:?} {last:?}").as_bytes())
    }
}

/// The parts of the text of a `file` between quotes, and for each name of a file to read the paths of files with this name. Most
/// names are relative to the file that contains them, those of size fields to the working folder.
fn parts<'a>(file: &'a Path, text: &'a str) -> impl Iterator<Item = (&'a str, Vec<PathBuf>)> {
    let mut before = "";
    text.split('"').map(move |part| {
        let is_name = READERS.iter().any(|reader| before.ends_with(reader));
        before = part.trim_end_matches(BEFORE_NAME);
        let paths = [file.with_file_name(part), PathBuf::from(part)].into_iter();
        let paths = paths.filter(|_| is_name).flat_map(fs::canonicalize);
        (part, paths.filter(|path| path.is_file()).collect())
    })
}

/// The contents of a file in which the names of files that it reads are those of their `copies`.
///
/// # Errors
/// The file cannot be read.
pub fn renamed(file: &Path, copies: &[(String, PathBuf)]) -> io::Result<Vec<u8>> {
    let bytes = fs::read(file)?;
    let Ok(text) = str::from_utf8(&bytes) else { return Ok(bytes) };
    let new = |(part, paths): (&str, Vec<PathBuf>)| {
        let copy = copies.iter().find(|(_, of)| paths.first() == Some(of));
        copy.map_or(part, |(name, _)| name).to_owned()
    };
    Ok(Vec::from_iter(parts(file, text).map(new)).join("\"").into_bytes())
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
/// would take as long as a small mesh.
pub fn program() -> Option<String> {
    let program = fs::canonicalize(gmsh()?).ok()?;
    let data = fs::metadata(&program).ok()?;
    let identity = format!("{program:?} {} {:?}", data.len(), data.modified().ok()?);
    Some(digest(identity.as_bytes()))
}
