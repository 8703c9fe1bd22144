//! The command line of signorini.
#![forbid(unsafe_code)]

mod command;

use clap::{
    CommandFactory, Parser, Subcommand,
    error::{ContextKind, ContextValue},
};
use command::Failure;
use signorini::{
    output::terminal::{keep, lost},
    petsc::Allocator,
    printable::printable,
    suggestion::most_similar,
};
use std::{ffi::OsString, path::PathBuf, process::ExitCode};

#[global_allocator]
static ALLOCATOR: Allocator = Allocator { out_of_memory: command::out_of_memory };

/// Contact of a damageable elastic body with a rigid foundation (plane, quasistatic, frictionless).
#[derive(Parser)]
#[command(
    version,
    long_version = command::version(),
    about,
    after_help = "Scenes are TOML files beside a gmsh geometry: `signorini keys` describes every key, \
    `signorini new NAME` writes a first scene, geo/TUTORIAL.md (in the sources, or in \
    share/doc/signorini of the installation) goes on from there.\n\
    Exit codes: 0 finished or stopped at ζ_*, 1 the run ended early, e.g. a solver missed its tolerance \
    (state saved), 2 bad input, 130 and 143 ended by SIGINT and SIGTERM."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a scene; results go to out/<scene>/. On several cores: --ranks auto.
    Run(command::RunArguments),
    /// Write NAME.geo and NAME.toml: a small geometry and scene, which run as they are, as a start.
    New {
        /// The name; it may contain a folder. [default: that of the scene of the gallery]
        #[arg(required_unless_present_any = ["from", "list"])]
        name: Option<PathBuf>,
        /// Start from a scene of the gallery.
        #[arg(long, value_name = "SCENE")]
        from: Option<String>,
        /// List the scenes of the gallery: bodies with published or closed answers.
        #[arg(long, conflicts_with_all = ["name", "from"])]
        list: bool,
    },
    /// Describe a scene without solving it: mesh, boundaries, loads, support, unknowns, cost. Like
    /// `mesh`, it meshes a .geo unless this was done before.
    Check(command::SceneArguments),
    /// Write the matrices, loads and constraints of a step as Matrix Market files, for other solvers.
    Export(command::ExportArguments),
    /// Explain the topics that notes end with, or list all topics.
    Explain {
        /// The topics, e.g. singular.
        topics: Vec<String>,
    },
    /// Describe a folder of results: scene, program, outcome, errors, frames.
    Info(command::ScriptArguments),
    /// Run scenes with every contact solver and compare cost and answers.
    Compare(command::ScriptArguments),
    /// Run a scene with all combinations of some values, side by side: --set KEY=A,B,C (--help).
    Study(command::ScriptArguments),
    /// Print the summaries of runs as a table, aligned or as CSV.
    Table(command::ScriptArguments),
    /// Draw pictures of runs into their folders; also at other times, as vector graphics, animated (--help).
    Plot(command::ScriptArguments),
    /// The old name of `plot`.
    #[command(hide = true)]
    Figures(command::ScriptArguments),
    /// Write report.html, a page about a run to look at in a browser, into its folder.
    Report(command::ScriptArguments),
    /// Write report.html and open it in the browser: fields at all times, values, curves.
    View(command::ScriptArguments),
    /// List the contact solvers, one per line: name, tab, description.
    Solvers,
    /// Print the reference of all keys of a scene, in Markdown.
    Keys {
        /// The figures of a run, as a table.
        #[arg(long, conflicts_with = "schema")]
        figures: bool,
        /// As a JSON schema, for editors.
        #[arg(long)]
        schema: bool,
    },
    /// Print a shell's completions, e.g. for bash into
    /// ~/.local/share/bash-completion/completions/signorini.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages into a folder, one per subcommand.
    #[command(hide = true)]
    Man {
        /// The folder.
        folder: PathBuf,
    },
    /// Do the commands on standard input in forks of this process, e.g. ["run", "scene.toml"].
    #[command(hide = true)]
    Serve {
        /// Their output goes to standard error.
        #[arg(long)]
        output: bool,
    },
    /// Mesh the .geo files of scenes with gmsh, unless this was done before.
    Mesh {
        /// Scene files.
        #[arg(required = true, value_name = "SCENE")]
        scenes: Vec<PathBuf>,
        /// Override a key of each scene, e.g. --set mesh.size=0.1; may be repeated.
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
}

fn main() -> ExitCode {
    if let Err(error) = command::install() {
        command::tell("warning", &format!("no handlers for signals: {error}"));
    }
    execute().into()
}

/// The words of the command line. `help NAME` is `NAME --help`, as a script prints its own help.
fn words() -> Vec<OsString> {
    let mut words = command::words();
    if words.len() == 3 && words[1] == "help" {
        words.remove(1);
        words.push("--help".into());
    }
    words
}

/// Adds the most similar subcommand to the error of an unknown one. clap finds none that differs by swapped letters in a short word.
fn suggest(error: &mut clap::Error) {
    if let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) {
        let (program, word) = (Arguments::command(), word.clone());
        let names = program.get_subcommands().map(clap::Command::get_name);
        let near =
            most_similar(&word, names).map(|name| ContextValue::Strings(vec![name.to_owned()]));
        near.map(|near| error.insert(ContextKind::SuggestedSubcommand, near));
    }
}

/// Does the command of the command line, and returns the exit code.
fn execute() -> u8 {
    let command = match Arguments::try_parse_from(words()) {
        Ok(arguments) => arguments.command,
        Err(error) => return refuse(error),
    };
    // The server has no other thread: it forks.
    if !matches!(command, Command::Serve { .. }) {
        command::watch();
    }
    let result = match command {
        Command::Run(arguments) => command::run(&arguments),
        Command::New { list: true, .. } => command::list_gallery(),
        Command::New { name, from, .. } => command::new(name.as_deref(), from.as_deref()),
        Command::Check(arguments) => command::check(&arguments),
        Command::Explain { topics } => command::explain(&topics),
        Command::Export(arguments) => command::export(&arguments),
        Command::Info(arguments) => command::script("info", &arguments),
        Command::Compare(arguments) => command::script("compare", &arguments),
        Command::Study(arguments) => command::script("study", &arguments),
        Command::Table(arguments) => command::script("table", &arguments),
        Command::Plot(arguments) => command::script("plot", &arguments),
        Command::Figures(arguments) => {
            command::tell("note", "`figures` is now `signorini plot`; the old name will go");
            command::script("plot", &arguments)
        }
        Command::Report(arguments) => command::script("report", &arguments),
        Command::View(arguments) => command::script("view", &arguments),
        Command::Solvers => command::solvers(),
        Command::Keys { schema, figures } => command::keys(schema, figures),
        Command::Completions { shell } => command::completions(shell, Arguments::command()),
        Command::Man { folder } => command::man(&folder, Arguments::command()),
        Command::Serve { output } => command::serve(output, execute),
        Command::Mesh { scenes, set } => command::mesh(&scenes, &set),
    };
    let lost = lost().map_or(Ok(()), |error| Err(Failure::from(error)));
    match result.and(lost) {
        Ok(()) => 0,
        Err(failure) => {
            failure.message.iter().for_each(|message| command::tell("error", message));
            failure.code
        }
    }
}

/// Prints an error of the arguments, or the help, and returns the exit code. The error shows the arguments as the terminal may
/// have them.
fn refuse(error: clap::Error) -> u8 {
    let words = words().into_iter().map(|word| printable(&word.to_string_lossy()));
    let mut error = Arguments::try_parse_from(words).err().unwrap_or(error);
    suggest(&mut error);
    for kind in [ContextKind::Usage, ContextKind::Suggested] {
        error.remove(kind);
    }
    keep(error.print());
    lost().iter().for_each(|error| command::tell("error", error));
    if lost().is_some() { 1 } else { error.exit_code() as u8 }
}
