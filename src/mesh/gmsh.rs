//! Meshes `.geo` files with the gmsh command line.

use super::{Mesh, MeshError, read};
use crate::interrupt::Interrupts;
use std::{
    collections::{BTreeMap, HashSet},
    env,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread::sleep,
    time::{Duration, Instant, SystemTime},
};

/// How many different lines of gmsh are shown; it can repeat an error by the hundred.
const SHOWN: usize = 5;
/// Seconds that gmsh may take, and the variable of the environment that sets another number.
const SECONDS: f64 = 600.0;
const SECONDS_VARIABLE: &str = "SIGNORINI_GMSH_SECONDS";
/// How often it is looked whether gmsh has ended.
const POLL: Duration = Duration::from_millis(5);
/// The folders in which gmsh works begin with this.
const SCRATCH: &str = ".meshing-";
/// Such a folder is old after so long.
const ABANDONED: Duration = Duration::from_secs(10);

/// The order of the elements that gmsh makes of a `.geo`.
///
/// Vertices and triangles are the same; of order 2 gmsh also places midpoints of curved edges, for
/// six times its time and three times the file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Order {
    /// Order 1, every edge straight.
    #[default]
    Linear,
    /// Order 2.
    Quadratic,
}

/// Reads the mesh in [`file()`]; nodes and triangles in an order of their own ([`Mesh::in_morton_order`]).
///
/// # Errors
/// Those of [`file()`] and [`read`].
pub fn load(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<Mesh, MeshError> {
    read(&file(path, parameters, order)?).map(Mesh::in_morton_order)
}

/// The `.msh` of a mesh: itself, or that which [`mesh_geo`] makes of a `.geo`.
///
/// `parameters` and `order` are for a `.geo` and have no meaning for a `.msh`.
///
/// # Errors
/// Those of [`mesh_geo`], and any other extension.
pub fn file(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<PathBuf, MeshError> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    match extension.as_ref().and_then(|e| e.to_str()) {
        Some("msh") => Ok(path.to_owned()),
        Some("geo") => mesh_geo(path, parameters, order),
        _ => Err(MeshError::file(path, "a mesh is a .msh file or a .geo file for gmsh")),
    }
}

/// Meshes a `.geo` file and returns the path of the `.msh` beside it.
///
/// Each parameter is set over the `DefineConstant` of its name and appears in the name of the mesh, as
/// in `bridge-grading3-size0.25.msh`, and so does order 2, as in `hertz.order2.msh`. `size`, in m, also
/// bounds the length of the edges. A mesh that is not older than its `.geo` and the files this takes in
/// by `Include` and `Merge` is kept as it is; a new one appears complete or not at all.
///
/// # Errors
/// The `.geo` cannot be read or the `.msh` written, a parameter makes no sense or occurs
/// nowhere in the `.geo`, gmsh is missing, or gmsh reports an error.
pub fn mesh_geo(
    geo: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<PathBuf, MeshError> {
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    let mut name = geo.file_stem().unwrap_or_default().to_owned();
    for (parameter, &value) in parameters {
        if let Some(reason) = refusal(&text, parameter, value) {
            let problem = format!("mesh parameter `{parameter}` = {value}: {reason}");
            return Err(MeshError::file(geo, problem));
        }
        name.push(format!("-{parameter}{value}"));
    }
    // No parameter makes such a name: theirs have no point.
    name.push(if order == Order::Quadratic { ".order2.msh" } else { ".msh" });
    let mesh = geo.with_file_name(name);
    let last_change = last_change(geo).map_err(MeshError::io(geo))?;
    if modified(&mesh).is_ok_and(|meshed| meshed >= last_change) {
        return Ok(mesh);
    }

    // A directory rather than a file: gmsh creates the file with the usual permissions.
    let folder = geo.with_file_name(".");
    remove_abandoned(&folder);
    let scratch = tempfile::Builder::new().prefix(SCRATCH).tempdir_in(folder);
    let scratch = scratch.map_err(MeshError::io(&mesh))?;
    // Locked until the mesh is made.
    let lock = File::open(scratch.path()).map_err(MeshError::io(&mesh))?;
    let _ = lock.try_lock();
    let fresh = scratch.path().join("fresh.msh");
    run((geo, &text), parameters, order, &fresh)?;
    fs::rename(&fresh, &mesh).map_err(MeshError::io(&mesh))?;
    Ok(mesh)
}

/// By what gmsh multiplies the lengths of a `.geo` file, `size` among them, when it writes the mesh:
/// `Mesh.ScalingFactor`, 1 where it is not set.
///
/// # Errors
/// The `.geo` cannot be read, or sets it to something else than a positive number.
pub fn scaling_factor(geo: &Path) -> Result<f64, MeshError> {
    const OPTION: &str = "Mesh.ScalingFactor";
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    let code: String = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
    let Some((_, rest)) = code.rsplit_once(OPTION) else { return Ok(1.0) };
    let number = rest.trim_start().strip_prefix('=').and_then(|rest| rest.split(';').next());
    let factor = number.and_then(|number| number.trim().parse().ok()).filter(|&f: &f64| f > 0.0);
    factor.ok_or_else(|| {
        let problem =
            format!("for an accuracy {OPTION} must be a number, as in `{OPTION} = 0.001;`");
        MeshError::file(geo, problem)
    })
}

/// Removes the folders of runs of gmsh that were killed: nobody has their locks.
fn remove_abandoned(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        // A new one may not be locked yet.
        let old = || modified(&path).is_ok_and(|at| at.elapsed().is_ok_and(|age| age > ABANDONED));
        let abandoned = entry.file_name().to_string_lossy().starts_with(SCRATCH)
            && old()
            && File::open(&path).is_ok_and(|folder| folder.try_lock().is_ok());
        if abandoned {
            // What cannot be removed harms nobody.
            let _ = fs::remove_dir_all(path);
        }
    }
}

fn read_text(path: &Path) -> io::Result<String> {
    fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

/// Why gmsh would misread or silently ignore a parameter of the .geo file `text`, if it would.
fn refusal(text: &str, name: &str, value: f64) -> Option<&'static str> {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    // An included file may define the parameter.
    let includes = text.contains("Include") || text.contains("Merge");
    let defined = || includes || text.split(|c| !word(c)).any(|w| w == name);
    if !name.chars().all(word) || !name.starts_with(|c: char| !c.is_ascii_digit()) {
        Some("the name must consist of letters, digits and underscores")
    } else if !value.is_finite() {
        Some("the value must be finite")
    } else if name == "size" {
        (value <= 0.0).then_some("the size must be positive")
    } else {
        (!defined()).then_some("the .geo file has no such parameter")
    }
}

/// When the `.geo`, or a file that it takes in by `Include "name"` or `Merge "name"`, directly or
/// through others, was last changed. Files that are not there are for gmsh to tell.
fn last_change(geo: &Path) -> io::Result<SystemTime> {
    let mut files = vec![fs::canonicalize(geo)?];
    let mut last = SystemTime::UNIX_EPOCH;
    let mut next = 0;
    while let Some(file) = files.get(next).cloned() {
        next += 1;
        last = last.max(modified(&file)?);
        let text = read_text(&file)?;
        let commands = ["Include", "Merge"].into_iter().flat_map(|word| text.split(word).skip(1));
        let quoted = commands.filter_map(|rest| rest.trim_start().strip_prefix('"'));
        for name in quoted.filter_map(|rest| rest.split('"').next()) {
            // Names are relative to the file they stand in.
            let path = fs::canonicalize(file.with_file_name(name)).ok();
            let new = path.filter(|path| path.is_file() && !files.contains(path));
            files.extend(new);
        }
    }
    Ok(last)
}

fn modified(path: &Path) -> io::Result<SystemTime> {
    fs::metadata(path).and_then(|data| data.modified())
}

/// Whether the `.geo` file `text` makes the largest length of an edge of the parameter `size`.
fn bounds_by_size(text: &str) -> bool {
    let values = ["Mesh.MeshSizeMax", "Mesh.CharacteristicLengthMax"].into_iter();
    let mut values = values.flat_map(|option| text.split(option).skip(1));
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let of_size = |value: &str| value.split(|c| !word(c)).any(|w| w == "size");
    values.any(|rest| rest.split(';').next().is_some_and(of_size))
}

/// What gmsh reads behind the `.geo` file `text`: that a parameter has not its value there is an error, and the
/// options -order and -clmax would give way to a Mesh.ElementOrder and a Mesh.MeshSizeMax in the `.geo`.
fn last_words(text: &str, parameters: &BTreeMap<String, f64>, order: Order) -> String {
    let kept = parameters.iter().map(|(name, value)| {
        format!(
            "If ({name} != {value})\n Error(\"`{name}` = {value}: the .geo file assigns it, which \
             overrules this value; write DefineConstant[ … ] there\");\nEndIf\n"
        )
    });
    let order = if order == Order::Quadratic { "Mesh.ElementOrder = 2;\n" } else { "" };
    let size = parameters.get("size").filter(|_| !bounds_by_size(text));
    let size = size.map_or(String::new(), |size| format!("Mesh.MeshSizeMax = {size};\n"));
    kept.chain([order.to_owned(), size]).collect()
}

/// Runs gmsh, which must leave `fresh` behind without a word of error.
fn run(
    (geo, text): (&Path, &str),
    parameters: &BTreeMap<String, f64>,
    order: Order,
    fresh: &Path,
) -> Result<(), MeshError> {
    let mut command = Command::new("gmsh");
    // One thread: the same input then gives the same mesh, node by node.
    command.args(["-2", "-format", "msh41", "-v", "1", "-nt", "1"]);
    for (name, value) in parameters {
        command.args(["-setnumber", name, &value.to_string()]);
        if name == "size" {
            command.args(["-clmax", &value.to_string()]);
        }
    }
    let second = fresh.with_file_name("second.geo");
    fs::write(&second, last_words(text, parameters, order)).map_err(MeshError::io(&second))?;
    // "./" keeps a path that begins with a dash from being taken for an option.
    command.arg("-o").arg(fresh).arg(Path::new(".").join(geo)).arg(second);
    // A file takes what it says, however much: a pipe would have to be read meanwhile.
    let log = fresh.with_file_name("log");
    let said = File::create(&log).and_then(|file| Ok([file.try_clone()?, file]));
    let [out, err] = said.map_err(MeshError::io(&log))?;
    let child = command.stdin(Stdio::null()).stdout(out).stderr(err).spawn();
    let child = child.map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => MeshError::file(
            geo,
            "gmsh is needed to mesh this file and was not found; install it with `make deps` \
             (Debian: apt install gmsh), or give a .msh file",
        ),
        _ => MeshError::io(Path::new("gmsh"))(source),
    })?;
    let status = wait(child, geo)?;

    let said = read_text(&log).map_err(MeshError::io(&log))?;
    // gmsh can report errors and still exit with success.
    let is_error = |line: &str| line.trim_start().starts_with("Error");
    if status.success() && fresh.exists() && !said.lines().any(is_error) {
        return Ok(());
    }
    let mut seen = HashSet::new();
    let lines: Vec<&str> = said.lines().filter(|line| seen.insert(*line)).take(SHOWN).collect();
    let message = match lines.is_empty() {
        true => format!("no message, {status}"),
        false => lines.join("\n"),
    };
    Err(MeshError::file(geo, format!("gmsh could not mesh it:\n{message}")))
}

/// Waits for gmsh, which is ended with its time or by a signal to this process.
fn wait(mut gmsh: Child, geo: &Path) -> Result<ExitStatus, MeshError> {
    let (started, interrupts) = (Instant::now(), Interrupts::defer());
    let limit = env::var(SECONDS_VARIABLE).ok().and_then(|text| text.parse().ok());
    let limit = limit.unwrap_or(SECONDS);
    loop {
        if let Some(status) = gmsh.try_wait().map_err(MeshError::io(Path::new("gmsh")))? {
            return Ok(status);
        }
        let late = started.elapsed().as_secs_f64() > limit;
        let signal = interrupts.received();
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
                "gmsh has not meshed it in {limit} s and was ended; give a larger size, or more time \
                 in the environment variable {SECONDS_VARIABLE}"
            );
            return Err(MeshError::file(geo, problem));
        }
        sleep(POLL);
    }
}
