//! `signorini plot`, `report`, `info` and `compare`: Python scripts embedded in the program.

use super::{Failure, ranks::require_one_process};
use clap::Args;
use signorini::python::python;
use std::{
    collections::BTreeMap, env, ffi::OsString, io::Seek, os::unix::process::CommandExt,
    process::Command,
};

/// Names and sources of files in scripts/.
macro_rules! scripts {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("../../scripts/", $name, ".py")))),*]
    };
}

/// The scripts and the modules that they import from each other.
const SCRIPTS: [(&str, &str); 25] = scripts! {
    "animation" "bars" "compare" "contact_pressure" "drawing" "elements" "expressions"
    "histories" "info" "limits" "lines" "maps" "paraview_script" "paraview_view" "plot" "principal" "reading" "report"
    "report_pdf" "results" "setting" "signorini_results" "signorini_summaries" "study" "table"
};
/// The template of the report, for `report`.
const REPORT: (&str, &str) = ("report.html", include_str!("../../scripts/report.html"));
/// The Python program that runs one of them.
const EMBEDDED: &str = include_str!("../../scripts/embedded.py");
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
    let all: BTreeMap<_, _> = SCRIPTS.into_iter().chain([REPORT]).collect();
    let sources = (|| {
        let mut file = tempfile::tempfile()?;
        serde_json::to_writer(&file, &all)?;
        file.rewind().map(|()| file)
    })();
    let sources = sources.map_err(|error| {
        let folder = env::temp_dir();
        format!("{}: {error}; set TMPDIR to another folder for temporary files", folder.display())
    })?;
    // Python takes the place of this process, and gets its signals.
    let error = Command::new(&python)
        .args(["-c", EMBEDDED, name])
        .args(arguments)
        // `compare` runs this program.
        .env("SIGNORINI", env::current_exe().map_err(Failure::from)?)
        // The sources and their output are UTF-8, except paths, which may be any bytes.
        .env("PYTHONIOENCODING", "utf-8:surrogateescape")
        .stdin(sources)
        .exec();
    Err(Failure::from(format!("{}: {error}", python.display())))
}
