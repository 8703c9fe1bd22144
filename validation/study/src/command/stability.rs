//! `signorini-study stability`: the maps of where methods fail.

use super::with_petsc;
use clap::Args;
use signorini::output::{self, terminal::say};
use signorini_study::{
    StudyError,
    stability::{MAPS, make},
};
use std::{path::PathBuf, time::Instant};

/// Arguments of `signorini-study stability`.
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

/// Makes the maps and counts their rows.
///
/// # Errors
/// An unknown map, a study that cannot be carried out, or a wrong answer.
pub fn stability(arguments: &StabilityArguments) -> Result<(), StudyError> {
    let StabilityArguments { maps, out, petsc } = arguments;
    let names: Vec<&str> = MAPS.iter().map(|(name, _)| *name).collect();
    if let Some(unknown) = maps.iter().find(|map| !names.contains(&map.as_str())) {
        let known = names.join(", ");
        return Err(StudyError::Unsuitable(format!(
            "there is no map `{unknown}`; there are {known}"
        )));
    }
    output::create(out)?;
    let asked = |name: &str| maps.is_empty() || maps.iter().any(|map| map == name);
    let wrong = with_petsc(petsc, |session| {
        let mut wrong = 0;
        for &(name, map) in MAPS.iter().filter(|(name, _)| asked(name)) {
            let started = Instant::now();
            let counts = make(session, (name, map), out)?;
            wrong += counts.wrong;
            say(&format!(
                "{name:<18} {:>5} correct {:>5} refused {:>5} wrong  {:>6.1} s",
                counts.correct,
                counts.refused,
                counts.wrong,
                started.elapsed().as_secs_f64()
            ));
        }
        Ok(wrong)
    })?;
    match wrong {
        0 => Ok(()),
        n => Err(StudyError::Wrong(n)),
    }
}
