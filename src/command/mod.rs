//! What the subcommands do.

mod compare;
mod run;
mod screen;
mod stability;

pub use compare::{CompareArguments, compare_scenes};
pub use run::{RunArguments, run};
pub use stability::{StabilityArguments, stability};

use signorini::{mesh, scene::Scene};
use std::{fmt, path::PathBuf};

/// Why a command failed, by whose turn it is now.
#[derive(Debug)]
pub enum Failure {
    /// The user's: bad input.
    Input(String),
    /// The solver's: it did not reach its tolerance.
    Solver(String),
}

impl Failure {
    fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    fn solver(error: impl fmt::Display) -> Self {
        Self::Solver(error.to_string())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Solver(text) => f.write_str(text),
        }
    }
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
