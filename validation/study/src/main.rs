//! The command line of the studies.
#![forbid(unsafe_code)]

use clap::{Parser, Subcommand};
use signorini::{
    output::{self, terminal::say},
    petsc::{Communicator, Session},
};
use signorini_study::{
    StudyError,
    bounds::errors,
    stability::{MAPS, make},
};
use std::{
    env,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

/// Studies of signorini: where methods fail.
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
    Stability {
        /// Maps to make [default: all].
        #[arg(value_name = "MAP")]
        maps: Vec<String>,
        /// Folder for the tables.
        #[arg(long, value_name = "DIR", default_value = "out/stability")]
        out: PathBuf,
        /// PETSc options.
        #[arg(last = true, value_name = "PETSC OPTIONS")]
        petsc: Vec<String>,
    },
    /// Compare the proved bound on the error of u with the true error: a line of JSON.
    Bounds {
        /// The scene.
        scene: PathBuf,
        /// Sets a key of the scene.
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
}

fn main() -> ExitCode {
    let command = Arguments::parse().command;
    if Communicator::launched().is_some_and(|ranks| ranks > 1) {
        // Every rank comes here; choosing the one that writes needs no communication.
        let rank =
            ["OMPI_COMM_WORLD_RANK", "PMI_RANK"].into_iter().find_map(|name| env::var(name).ok());
        if rank.is_none_or(|rank| rank == "0") {
            eprintln!("error: studies run in one process; start them without mpiexec");
        }
        return ExitCode::from(2);
    }
    let done = match command {
        Command::Stability { maps, out, petsc } => stability(&maps, &out, &petsc),
        Command::Bounds { scene, set } => bounds(&scene, &set),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(if error.is_input() { 2 } else { 1 })
        }
    }
}

/// Prints the errors of a scene.
fn bounds(scene: &Path, overrides: &[String]) -> Result<(), StudyError> {
    let session = Session::start(&[])?;
    let errors = errors(&session, scene, overrides)?;
    say(&serde_json::json!(errors).to_string());
    Ok(session.finalize()?)
}

/// Makes the maps and counts their rows.
fn stability(maps: &[String], out: &Path, petsc: &[String]) -> Result<(), StudyError> {
    let names: Vec<&str> = MAPS.iter().map(|(name, _)| *name).collect();
    if let Some(unknown) = maps.iter().find(|map| !names.contains(&map.as_str())) {
        let known = names.join(", ");
        return Err(StudyError::UnknownMap(format!(
            "there is no map `{unknown}`; there are {known}"
        )));
    }
    output::create(out)?;
    let session = Session::start(petsc)?;
    let mut wrong = 0;
    for &(name, map) in MAPS {
        if !maps.is_empty() && !maps.iter().any(|map| map == name) {
            continue;
        }
        let started = Instant::now();
        let counts = make(&session, (name, map), out)?;
        wrong += counts.wrong;
        say(&format!(
            "{name:<18} {:>5} correct {:>5} refused {:>5} wrong  {:>6.1} s",
            counts.correct,
            counts.refused,
            counts.wrong,
            started.elapsed().as_secs_f64()
        ));
    }
    session.finalize()?;
    match wrong {
        0 => Ok(()),
        n => Err(StudyError::Wrong(n)),
    }
}
