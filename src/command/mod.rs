//! What the subcommands do.

mod chart;
mod compare;
mod converge;
mod floor;
mod profile;
mod ranks;
mod recorder;
mod reference;
mod run;
mod screen;
mod stability;

pub use chart::{ChartArguments, speed_chart};
pub use compare::{CompareArguments, compare_scenes};
pub use converge::{ConvergeArguments, convergence};
pub use floor::{FloorArguments, floor};
pub use ranks::refuse_ranks;
pub use reference::{ReferenceArguments, reference};
pub use run::{RunArguments, run};
pub use stability::{StabilityArguments, stability};

use signorini::{
    contact::{self, REGISTRY, TAO_TYPES},
    mesh,
    scene::Scene,
};
use std::{fmt, path::PathBuf};

/// Why a command failed, by whose turn it is now.
#[derive(Debug)]
pub enum Failure {
    /// The user's: bad input.
    Input(String),
    /// The solver's: it did not reach its tolerance.
    Solver(String),
    /// Another rank's.
    OnAnotherRank,
    /// One rank has told it for all; with the exit code.
    AlreadyReported(u8),
}

impl Failure {
    fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    fn solver(error: impl fmt::Display) -> Self {
        Self::Solver(error.to_string())
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Self::Solver(_) | Self::OnAnotherRank => 1,
            Self::Input(_) => 2,
            Self::AlreadyReported(code) => *code,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Solver(text) => f.write_str(text),
            Self::OnAnotherRank | Self::AlreadyReported(_) => f.write_str("another rank failed"),
        }
    }
}

/// Refuses a solver that `option` names and nobody knows.
fn check_solver(option: &str, name: &str) -> Result<(), Failure> {
    let found = contact::find(name).map(|_| ());
    found.map_err(|unknown| Failure::Input(format!("{option}: {unknown}")))
}

/// Refuses PETSc options that would end a run after its first results are written.
fn check_petsc(options: &[String]) -> Result<(), Failure> {
    if let Some(word) = options.first().filter(|word| !word.starts_with('-')) {
        let problem = format!("PETSc options begin with a dash, but the first is `{word}`");
        return Err(Failure::Input(problem));
    }
    match options.windows(2).find(|pair| pair[0] == "-tao_type") {
        Some([_, kind]) if !TAO_TYPES.contains(&kind.as_str()) => Err(Failure::Input(format!(
            "-tao_type: `{kind}` is none of TAO's types for bounds: {}",
            TAO_TYPES.join(", ")
        ))),
        _ => Ok(()),
    }
}

/// `signorini solvers`.
pub fn solvers() -> Result<(), Failure> {
    REGISTRY.iter().for_each(|entry| screen::say(&format!("{}\t{}", entry.name, entry.summary)));
    Ok(())
}

/// `signorini mesh SCENE…`.
pub fn mesh(scenes: &[PathBuf]) -> Result<(), Failure> {
    for path in scenes {
        let scene = Scene::read(path, &[]).map_err(Failure::input)?;
        let mesh = mesh::load(&scene.mesh.file, &scene.mesh.parameters).map_err(Failure::input)?;
        let (nodes, triangles) = (mesh.nodes.len(), mesh.triangles.len());
        screen::say(&format!("{}: {nodes} nodes, {triangles} triangles", scene.name));
    }
    Ok(())
}
