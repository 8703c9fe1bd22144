//! `signorini plot`, `report`, `info` and `compare`: Python scripts embedded in the program.

use super::{Failure, ranks::require_one_process};
use clap::Args;
use signorini::python::{python, script_command};
use std::{env, ffi::OsString, os::unix::process::CommandExt};

/// Arguments of a script.
#[derive(Args)]
#[command(disable_help_flag = true)]
pub struct ScriptArguments {
    /// Arguments of the script; `--help` lists them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENT")]
    arguments: Vec<OsString>,
}

/// Runs the script `name`, and returns only if it cannot start. The script itself reports problems of its input.
pub fn script(name: &str, ScriptArguments { arguments }: &ScriptArguments) -> Result<(), Failure> {
    require_one_process()?;
    let python = python(&["matplotlib", "meshio", "tomllib"]).map_err(Failure::input)?;
    let mut command = script_command(&python, name).map_err(|error| {
        let folder = env::temp_dir();
        format!("{}: {error}; set TMPDIR to another folder for temporary files", folder.display())
    })?;
    // Python takes the place of this process, and gets its signals.
    let error = command
        .args(arguments)
        // `compare` runs this program.
        .env("SIGNORINI", env::current_exe().map_err(Failure::from)?)
        .exec();
    Err(Failure::from(format!("{}: {error}", python.display())))
}
