//! Runs the gmsh command line.

use crate::interrupt::{Interrupts, received};
use crate::mesh::{MeshError, msh::is_complete};
use crate::printable::print_error;
use crate::python::gmsh_command;
use std::{
    collections::HashSet,
    env,
    ffi::OsString,
    fs::{self, File},
    io,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::{Child, ExitStatus, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// The number of different lines of gmsh in a message. gmsh can repeat an error hundreds of times.
const SHOWN: usize = 5;
/// The time limit of gmsh, s. An environment variable sets another limit.
const SECONDS: f64 = 600.0;
const SECONDS_VARIABLE: &str = "SIGNORINI_GMSH_SECONDS";
/// The interval at which the program checks whether gmsh has ended.
const POLL: Duration = Duration::from_millis(5);
/// After this time a message says that gmsh is at work.
const NOTE_AFTER: Duration = Duration::from_secs(5);

/// From this number of triangles on, the message comes at once. gmsh makes about 1e5 in a second.
const ANNOUNCED: f64 = 1e6;

/// gmsh's expressions for the width and the height of the box around the geometry, after `BoundingBox;`.
pub const SIDES_OF_BOX: &str = "General.MaxX - General.MinX, General.MaxY - General.MinY";
/// gmsh's expression for the number of squares in this box whose side is the largest size.
pub const SQUARES: &str =
    "(General.MaxX - General.MinX) * (General.MaxY - General.MinY) / Mesh.MeshSizeMax^2";
/// The equilateral triangles of this side that fill a square: 4/√3.
const TRIANGLES_PER_SQUARE: f64 = 2.31;
/// The command that writes gmsh's version, as [`Mesh::gmsh`](crate::mesh::Mesh::gmsh) has it.
const VERSION: &str =
    "Printf(\"gmsh %g.%g.%g\", GMSH_MAJOR_VERSION, GMSH_MINOR_VERSION, GMSH_PATCH_VERSION)";

/// Whether gmsh runs this file as a program.
pub fn is_script(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("geo"))
}

/// Runs gmsh with `arguments` on the file `input` and then on a file with the text `last`. Returns the bytes
/// of the MSH 4.1 file that gmsh makes, with gmsh's version as a comment at its end.
///
/// # Errors
/// gmsh is missing, takes too long, reports an error or makes an incomplete file, or a signal came.
pub fn run(
    input: &Path,
    arguments: impl IntoIterator<Item = OsString>,
    last: &str,
) -> Result<Vec<u8>, MeshError> {
    let scratch = tempfile::tempdir().map_err(MeshError::io(&env::temp_dir()))?;
    let [made, second, version, squares, log] =
        ["made.msh", "second.geo", "version", "squares", "log"]
            .map(|name| scratch.path().join(name));
    let last = format!(
        "{last}{VERSION} > \"{}\";\nBoundingBox;\nPrintf(\"%g\", {SQUARES}) > \"{}\";\n",
        version.display(),
        squares.display()
    );
    fs::write(&second, last).map_err(MeshError::io(&second))?;
    let mut command = gmsh_command();
    command.args(["-format", "msh41", "-v", "1"]).args(arguments).arg("-o").arg(&made);
    if is_script(input) {
        // Without "./" gmsh would take a path that begins with a dash for an option.
        command.arg(Path::new(".").join(input));
    } else {
        // gmsh would run a file with an ending in other letters, as .Step, and options beside it, as scripts.
        let ending = input.extension().unwrap_or_default().to_ascii_lowercase();
        let link = scratch.path().join("geometry").with_extension(ending);
        let target = fs::canonicalize(input).map_err(MeshError::io(input))?;
        symlink(target, &link).map_err(MeshError::io(&link))?;
        command.arg(link);
    }
    // Without a home gmsh would run the scripts .gmshrc and .gmsh-options in the current folder.
    if env::var_os("HOME").is_none_or(|home| home.is_empty()) {
        command.env("HOME", "/");
    }
    command.arg(&second);
    // The messages go to a file, as a pipe could fill up while gmsh works.
    let said = File::create(&log).and_then(|file| Ok([file.try_clone()?, file]));
    let [out, err] = said.map_err(MeshError::io(&log))?;
    let child = command.stdin(Stdio::null()).stdout(out).stderr(err).spawn();
    let child = child.map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => {
            let problem = "gmsh is needed to mesh it and was not found; install it with `make deps` (Debian: apt install \
                           gmsh)";
            MeshError::file(input, problem)
        }
        _ => MeshError::io(Path::new("gmsh"))(source),
    })?;
    let status = wait(child, &squares, input)?;

    let said = fs::read(&log).map_err(MeshError::io(&log))?;
    // OpenCASCADE colours its messages: \x1b[…m.
    let plain =
        |part: &str| part.split_once('m').map_or(String::new(), |(_, text)| text.to_owned());
    let said = format!("\x1b[m{}", String::from_utf8_lossy(&said));
    let said: String = said.split("\x1b[").map(plain).collect();
    // gmsh can report errors and still exit with success.
    let is_error = |line: &str| line.trim_start().starts_with("Error");
    if status.success() && made.exists() && !said.lines().any(is_error) {
        let read = |file: PathBuf| fs::read(&file).map_err(MeshError::io(&file));
        let (mesh, version) = (read(made)?, read(version)?);
        // gmsh does not report a full disk.
        if !is_complete(&mesh) {
            let problem = format!(
                "the file that gmsh made in {} was cut off: the disk may be full; free some space, or set the \
                 environment variable TMPDIR to another folder",
                env::temp_dir().display()
            );
            return Err(MeshError::file(input, problem));
        }
        return Ok([&mesh, &b"$Comments\n"[..], &version, b"$EndComments\n"].concat());
    }
    let mut seen = HashSet::new();
    let lines: Vec<&str> = said.lines().filter(|line| seen.insert(*line)).take(SHOWN).collect();
    let message = if lines.is_empty() { format!("no message, {status}") } else { lines.join("\n") };
    Err(MeshError::file(input, format!("gmsh could not mesh it:\n{message}")))
}

/// Shows the user a note on a file at once.
pub fn note(file: &Path, text: &str) {
    print_error(&format!("note: {}: {text}", file.display()));
}

/// Waits for gmsh. Ends it after the time limit or on a signal to this process.
fn wait(mut gmsh: Child, squares: &Path, input: &Path) -> Result<ExitStatus, MeshError> {
    let (started, _interrupts) = (Instant::now(), Interrupts::defer());
    let limit = env::var(SECONDS_VARIABLE).ok().and_then(|text| text.parse().ok());
    let limit = limit.unwrap_or(SECONDS);
    let mut is_noted = false;
    loop {
        if let Some(status) = gmsh.try_wait().map_err(MeshError::io(Path::new("gmsh")))? {
            return Ok(status);
        }
        let triangles = || {
            let squares: f64 = fs::read_to_string(squares).ok()?.trim().parse().ok()?;
            Some(TRIANGLES_PER_SQUARE * squares).filter(|triangles| *triangles >= 1.0)
        };
        if !is_noted
            && (started.elapsed() > NOTE_AFTER || triangles().is_some_and(|all| all > ANNOUNCED))
        {
            let of =
                triangles().map_or(String::new(), |all| format!(" on up to {all:.0e} triangles"));
            note(
                input,
                &format!(
                    "gmsh is at work{of}; a larger size is quicker (sizes are in the unit of the geometry: gmsh reads \
                     .step in mm)"
                ),
            );
            is_noted = true;
        }
        let late = started.elapsed().as_secs_f64() > limit;
        let signal = received();
        if late || signal.is_some() {
            // It may have ended by itself just now.
            let _ = gmsh.kill();
            let _ = gmsh.wait();
        }
        if let Some(signal) = signal {
            return Err(MeshError::Interrupted(signal));
        }
        if late {
            let problem = format!(
                "gmsh could not mesh it in {limit} s and was ended; give a larger size, or more time \
                 in the environment variable {SECONDS_VARIABLE}"
            );
            return Err(MeshError::file(input, problem));
        }
        sleep(POLL);
    }
}
