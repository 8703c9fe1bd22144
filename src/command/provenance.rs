//! The origin of a result: program, date, machine and command line.

use serde_json::{Value, json};
use std::{env, fs, thread, time::SystemTime};

/// `provenance` of `summary.json` of a run whose mesh this version of gmsh made. Unknown values are null.
pub fn provenance(gmsh: Option<&str>) -> Value {
    let now = humantime::format_rfc3339_seconds(SystemTime::now());
    let arguments = env::args_os().map(|word| word.to_string_lossy().into_owned());
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        // The commit that `make build` found in a git checkout (git describe).
        "commit": option_env!("SIGNORINI_COMMIT").filter(|commit| !commit.is_empty()),
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

/// The files of PETSc, of its factors and of BLAS that this process has loaded, from Linux (proc(5), maps). Their
/// names end with their versions.
fn libraries() -> Vec<String> {
    const LIBRARIES: [&str; 5] = ["libpetsc", "libcholmod", "libdmumps", "libopenblas", "libblas"];
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let files = maps.lines().filter_map(|line| line.rsplit_once('/').map(|(_, file)| file));
    let mut files: Vec<_> =
        files.filter(|file| LIBRARIES.iter().any(|name| file.starts_with(name))).collect();
    files.sort_unstable();
    files.dedup();
    files.into_iter().map(str::to_owned).collect()
}

/// The name of the processor from Linux (proc(5), cpuinfo).
fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
