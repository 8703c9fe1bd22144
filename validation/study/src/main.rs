//! The command line of the studies.
#![forbid(unsafe_code)]

mod command;

use clap::{Parser, Subcommand};
use signorini::petsc::Communicator;
use std::{env, process::ExitCode};

/// Studies of signorini: where methods fail, orders of convergence.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 finished, 1 a run failed or a wrong answer went unreported, \
    2 bad input."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make the maps of where methods fail.
    Stability(command::StabilityArguments),
    /// Compute the reference solution of `converge`, unless it is there.
    Reference(command::ReferenceArguments),
    /// Errors on nested meshes against the reference; by default the paper's Table 1 and Figure 3.
    Converge(command::StudyArguments),
}

fn main() -> ExitCode {
    let command = Arguments::parse().command;
    if Communicator::launched().is_some_and(|ranks| ranks > 1) {
        // Every rank comes here; that one speaks needs no communication.
        let rank =
            ["OMPI_COMM_WORLD_RANK", "PMI_RANK"].into_iter().find_map(|name| env::var(name).ok());
        if rank.is_none_or(|rank| rank == "0") {
            eprintln!("error: studies run in one process; start them without mpiexec");
        }
        return ExitCode::from(2);
    }
    let result = match command {
        Command::Stability(arguments) => command::stability(&arguments),
        Command::Reference(arguments) => command::reference(&arguments),
        Command::Converge(arguments) => command::convergence(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(if error.is_input() { 2 } else { 1 })
        }
    }
}
