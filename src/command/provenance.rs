//! The origin of a result: program, date, machine and command line.

use super::words;
use serde_json::{Value, json};
use signorini::petsc::{self, Communicator};
use std::{env, fs, thread, time::SystemTime};

/// `provenance` of `summary.json` of a run whose mesh this version of gmsh made. Unknown values are null.
pub fn provenance(gmsh: Option<&str>) -> Value {
    let now = humantime::format_rfc3339_seconds(SystemTime::now());
    let arguments = words().into_iter().map(|word| word.to_string_lossy().into_owned());
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "commit": commit(),
        // The end of the run, UTC.
        "date": now.to_string(),
        // The words of the command line, and the folder in which it was run.
        "command": arguments.collect::<Vec<_>>(),
        "libraries": libraries(),
        "gmsh": gmsh,
        "directory": env::current_dir().ok().map(|path| path.to_string_lossy().into_owned()),
        "machine": {
            "host": fs::read_to_string("/proc/sys/kernel/hostname").ok().map(|n| n.trim().to_owned()),
            "processor": processor(),
            "cores": thread::available_parallelism().ok(),
        },
    })
}

/// The commit that `make build` found in a git checkout (git describe).
fn commit() -> Option<&'static str> {
    option_env!("SIGNORINI_COMMIT").filter(|commit| !commit.is_empty())
}

/// The folder is in that of the package or of the virtual environment (wheel); `make licences` writes the file.
const LICENCE: &str = "licence GPL-3.0-or-later; notices of all parts: share/doc/signorini/NOTICES";

/// The version of the program, its commit, PETSc's version and file, and its licence. They stay for the life of the process, as clap wants.
pub fn version() -> &'static str {
    let commit = commit().unwrap_or("not recorded: it was built without make");
    let unknown =
        if Communicator::HAS_MPI { "file unknown" } else { "within the program, without MPI" };
    let petsc = loaded(&["libpetsc"]).pop().unwrap_or_else(|| unknown.into());
    let [version, of_petsc] = [env!("CARGO_PKG_VERSION"), &petsc::version()];
    format!("{version}\ncommit {commit}\nPETSc {of_petsc}: {petsc}\n{LICENCE}").leak()
}

/// The names of the files of PETSc, of its factors and of BLAS; they end with their versions. A PETSc without MPI is within the
/// program, as in the wheel.
fn libraries() -> Vec<String> {
    let files = loaded(&["libpetsc", "libcholmod", "libdmumps", "libopenblas", "libblas"]);
    let within = (!Communicator::HAS_MPI).then(|| format!("petsc-{}", petsc::version()));
    let names = files.iter().filter_map(|file| file.rsplit('/').next()).map(str::to_owned);
    names.chain(within).collect()
}

/// The files of these libraries that this process has loaded, from Linux (proc(5), maps).
fn loaded(libraries: &[&str]) -> Vec<String> {
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let files = maps.lines().filter_map(|line| Some(&line[line.find('/')?..]));
    let is_asked = |file: &&str| {
        let name = file.rsplit('/').next().unwrap_or_default();
        libraries.iter().any(|library| name.starts_with(library))
    };
    let mut files: Vec<_> = files.filter(is_asked).map(str::to_owned).collect();
    files.sort_unstable();
    files.dedup();
    files
}

/// The name of the processor from Linux (proc(5), cpuinfo).
fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
