//! The Python of the scripts in scripts/.

use std::{
    collections::BTreeMap,
    env,
    ffi::{OsStr, OsString},
    io::{self, Seek},
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

/// The Python of the variable `PYTHON`; without it, the first usual one that has these modules. `tomllib` is part of Python
/// from version 3.11 on.
///
/// # Errors
/// No Python has them. The message names the packages.
pub fn python(modules: &[&str]) -> Result<OsString, String> {
    let usual = || vec!["/usr/bin/python3".into(), "python3".into()];
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
