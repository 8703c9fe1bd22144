//! The command line of signorini.
#![forbid(unsafe_code)]

mod command;

use clap::{Parser, Subcommand};
use command::Failure;
use std::{path::PathBuf, process::ExitCode};

/// Contact of a damageable elastic body with a rigid foundation (plane, quasistatic, frictionless).
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 finished or stopped at ζ_*, \
    1 the run ended early, e.g. a solver missed its tolerance (state saved), 2 bad input."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a scene; results go to out/<scene>/.
    Run(command::RunArguments),
    /// Run scenes with every contact solver and compare cost and answers.
    Compare(command::CompareArguments),
    /// Make the maps of where methods fail.
    Stability(command::StabilityArguments),
    /// Compute the reference solution of `converge` and `chart`, unless it is there.
    Reference(command::ReferenceArguments),
    /// Errors on nested meshes against the reference; by default the paper's Table 1 and Figure 3.
    Converge(command::ConvergeArguments),
    /// Error against seconds: solvers, meshes, steps and tolerances, with the Pareto front.
    Chart(command::ChartArguments),
    /// Time the work of a scene's step that no method can avoid, in isolation (JSON).
    Floor(command::FloorArguments),
    /// List the contact solvers, a line each: its name, a tab, what it does.
    Solvers,
    /// Mesh the .geo files of scenes with gmsh, where their .msh is missing or older.
    Mesh {
        /// Scene files.
        #[arg(required = true, value_name = "SCENE")]
        scenes: Vec<PathBuf>,
    },
}

fn main() -> ExitCode {
    let command = Arguments::parse().command;
    let alone = match &command {
        Command::Run(_) | Command::Solvers => Ok(()),
        Command::Compare(_) => command::refuse_ranks("compare"),
        Command::Stability(_) => command::refuse_ranks("stability"),
        Command::Mesh { .. } => command::refuse_ranks("mesh"),
        Command::Reference(_) => command::refuse_ranks("reference"),
        Command::Converge(_) => command::refuse_ranks("converge"),
        Command::Chart(_) => command::refuse_ranks("chart"),
        Command::Floor(_) => command::refuse_ranks("floor"),
    };
    if let Err(code) = alone {
        return code;
    }
    let result = match command {
        Command::Run(arguments) => command::run(&arguments),
        Command::Compare(arguments) => command::compare_scenes(&arguments),
        Command::Stability(arguments) => command::stability(&arguments),
        Command::Reference(arguments) => command::reference(&arguments),
        Command::Converge(arguments) => command::convergence(&arguments),
        Command::Chart(arguments) => command::speed_chart(&arguments),
        Command::Floor(arguments) => command::floor(&arguments),
        Command::Solvers => command::solvers(),
        Command::Mesh { scenes } => command::mesh(&scenes),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::AlreadyReported(code)) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}
