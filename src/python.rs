//! The Python of the scripts in scripts/.

use std::{env, ffi::OsString, process::Command};

/// The first arguments of every Python: it finds modules neither in the current folder nor by `PYTHONPATH` nor among the
/// packages of the user (`-I`), and its texts are in UTF-8, except paths, which may be any bytes.
pub const ISOLATED: [&str; 3] = ["-I", "-X", "utf8"];

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
