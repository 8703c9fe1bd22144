//! `signorini stability`: the maps of the atlas of failure.

use super::{Failure, screen::say};
use clap::Args;
use signorini::{output, petsc::Session, study::stability::MAPS};
use std::{path::PathBuf, time::Instant};

/// Arguments of `signorini stability`.
#[derive(Args)]
pub struct StabilityArguments {
    /// Maps to make [default: all].
    #[arg(value_name = "MAP")]
    maps: Vec<String>,
    /// Folder for the tables.
    #[arg(long, value_name = "DIR", default_value = "out/stability")]
    out: PathBuf,
    /// PETSc options.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

/// Makes the maps and counts their cells.
///
/// # Errors
/// An unknown map, a study that cannot be carried out, or a wrong cell.
pub fn stability(arguments: &StabilityArguments) -> Result<(), Failure> {
    let names: Vec<&str> = MAPS.iter().map(|(name, _)| *name).collect();
    if let Some(unknown) = arguments.maps.iter().find(|m| !names.contains(&m.as_str())) {
        let known = names.join(", ");
        return Err(Failure::Input(format!("there is no map `{unknown}`; there are {known}")));
    }
    output::create(&arguments.out).map_err(Failure::input)?;
    let session = Session::start(&arguments.petsc).map_err(Failure::solver)?;
    let mut wrong = 0;
    for (name, map) in MAPS {
        if !arguments.maps.is_empty() && !arguments.maps.iter().any(|m| m == name) {
            continue;
        }
        let started = Instant::now();
        let counts = map(&session, &arguments.out).map_err(Failure::solver)?;
        wrong += counts.wrong;
        say(&format!(
            "{name:<18} {:>5} correct {:>5} refused {:>5} wrong  {:>6.1} s",
            counts.correct,
            counts.refused,
            counts.wrong,
            started.elapsed().as_secs_f64()
        ));
    }
    session.finalize().map_err(Failure::solver)?;
    match wrong {
        0 => Ok(()),
        n => Err(Failure::Solver(format!("{n} wrong answers went unreported; see the tables"))),
    }
}
