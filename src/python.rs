//! The Python of the scripts in scripts/.

use std::{
    collections::BTreeMap,
    env,
    ffi::{OsStr, OsString},
    io::{self, Seek},
    path::PathBuf,
    process::Command,
};

/// Names and sources of files in scripts/.
macro_rules! scripts {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("../scripts/", $name, ".py")))),*]
    };
}

/// The scripts and the modules that they import from each other.
pub(crate) const SCRIPTS: [(&str, &str); 41] = scripts! {
    "animation" "bars" "compare" "contact_pressure" "drawing" "driven" "elements" "expressions"
    "histories" "info" "latex" "limits" "lines" "maps" "meshes/abaqus" "meshes/abaqus_keywords" "meshes/by_meshio" "meshes/convert"
    "meshes/description" "meshes/msh" "meshes/nastran" "meshes/universal" "paraview_script" "paraview_view" "plot" "principal"
    "reading" "report" "report_pdf" "results" "server" "setting" "signorini_files" "signorini_movies" "signorini_results"
    "signorini_summaries" "study" "study_pictures" "table" "view" "viewer"
};
/// Names and texts of files in scripts/page/.
macro_rules! page {
    ($($name:literal)*) => {
        [$((concat!("page/", $name), include_str!(concat!("../scripts/page/", $name)))),*]
    };
}

/// The templates, libraries and scripts of the page that `report` writes.
const PAGE: [(&str, &str); 10] = page! {
    "body.js" "charts.js" "data.js" "libraries.css" "libraries.js" "locator.js" "overlay.js" "report.html" "viewer.html"
    "viewer.js"
};
/// The Python program that runs one of them.
const EMBEDDED: &str = include_str!("../scripts/embedded.py");

/// The first arguments of every Python: it finds modules neither in the current folder nor by `PYTHONPATH` nor among the
/// packages of the user (`-I`), and its texts are in UTF-8, except paths, which may be any bytes.
const ISOLATED: [&str; 3] = ["-I", "-X", "utf8"];

/// The Python program that prints which of the modules in its arguments are missing.
const PROBE: &str = "import sys, importlib.util as util\n\
    lacks = [m for m in sys.argv[1:] if not util.find_spec(m)]\n\
    sys.exit(', '.join(lacks) or None)";

/// The folder of programs of the virtual environment into which pip has installed this program (venv writes `pyvenv.cfg`). `None`
/// for a program in any other folder.
fn environment() -> Option<PathBuf> {
    let folder = env::current_exe().ok()?.parent()?.to_owned();
    folder.parent()?.join("pyvenv.cfg").is_file().then_some(folder)
}

/// The file of the gmsh that runs: that of the virtual environment of this program, or the first one in `PATH`.
pub(crate) fn gmsh() -> Option<PathBuf> {
    let paths = env::var_os("PATH");
    let folders = environment().into_iter().chain(paths.iter().flat_map(env::split_paths));
    folders.map(|folder| folder.join("gmsh")).find(|program| program.is_file())
}

/// The command that runs this gmsh. The gmsh of pip is a script that names no particular Python, so that of the environment
/// runs it. Its library needs libraries of windows, which a server may lack; it never uses them in a run without a window. The wheel
/// of this program has stand-ins for them (scripts/wheel/stand_ins.sh).
pub(crate) fn gmsh_command() -> Command {
    let Some((folder, gmsh)) =
        environment().zip(gmsh()).filter(|(folder, gmsh)| gmsh.starts_with(folder))
    else {
        return Command::new("gmsh");
    };
    let mut command = Command::new(folder.join("python3"));
    let stand_ins = folder.with_file_name("lib").join("signorini");
    if stand_ins.is_dir() {
        // An empty part would be the current folder.
        let others = env::var_os("LD_LIBRARY_PATH").filter(|others| !others.is_empty());
        let mut all = stand_ins.into_os_string();
        others.into_iter().for_each(|others| all.extend([OsStr::new(":"), &others]));
        command.env("LD_LIBRARY_PATH", all);
    }
    command.args(ISOLATED).arg(gmsh);
    command
}

/// The Python of the variable `PYTHON`; without it, the first usual one that has these modules: that of the virtual environment
/// of this program, then those of the system. `tomllib` is part of Python from version 3.11 on.
///
/// # Errors
/// No Python has them. The message names the packages.
pub fn python(modules: &[&str]) -> Result<OsString, String> {
    let usual = || {
        let own = environment().map(|folder| folder.join("python3"));
        let system = ["/usr/bin/python3", "python3"].map(PathBuf::from);
        own.into_iter().chain(system).map(PathBuf::into_os_string).collect()
    };
    let candidates = env::var_os("PYTHON").map_or_else(usual, |python| vec![python]);
    let mut problems = Vec::new();
    for python in candidates {
        let problem =
            match Command::new(&python).args(ISOLATED).args(["-c", PROBE]).args(modules).output() {
                Ok(probe) if probe.status.success() => return Ok(python),
                Ok(probe) => format!("lacks {}", String::from_utf8_lossy(&probe.stderr).trim()),
                Err(error) => error.to_string(),
            };
        problems.push(format!("{} {problem}", python.display()));
    }
    let named: Vec<_> = modules.iter().filter(|module| **module != "tomllib").copied().collect();
    Err(format!(
        "this is done by Python 3.11 or newer with {} (Debian: apt install python3-{}; or PYTHON=… for another one), but {}",
        named.join(" and "),
        named.join(" python3-"),
        problems.join("; ")
    ))
}

/// The command that runs the script `name` with this Python; arguments may follow. The script gets the sources of all modules
/// on standard input.
///
/// # Errors
/// There is no room for temporary files.
pub fn script_command(python: &OsStr, name: &str) -> io::Result<Command> {
    let all: BTreeMap<_, _> = SCRIPTS.into_iter().chain(PAGE).collect();
    let mut sources = tempfile::tempfile()?;
    serde_json::to_writer(&sources, &all)?;
    sources.rewind()?;
    // Python would answer Ctrl-C with a traceback until its first line: so Ctrl-C has no effect before.
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' INT; exec \"$@\"", "sh"]).arg(python).args(ISOLATED);
    command.args(["-c", EMBEDDED, name]).stdin(sources);
    Ok(command)
}
