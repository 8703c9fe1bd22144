//! `signorini floor`: the cost of a time step that no method can avoid.

use super::{Failure, run::read_scene, screen::say};
use clap::Args;
use signorini::{evolution::DiscreteProblem, mesh, petsc::Session, study};
use std::path::PathBuf;

/// Arguments of `signorini floor`.
#[derive(Args)]
pub struct FloorArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Use this .geo or .msh instead of the scene's.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Override a key of the scene, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// How often each part is timed; medians are given.
    #[arg(long, default_value_t = 20)]
    rounds: usize,
    /// PETSc options.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

/// Times the unavoidable work of a scene's step and prints it as JSON.
///
/// # Errors
/// Bad input, or PETSc fails.
pub fn floor(arguments: &FloorArguments) -> Result<(), Failure> {
    let scene = read_scene(&arguments.scene, arguments.mesh.as_deref(), &arguments.set)?;
    let mesh = mesh::load(&scene.mesh.file, &scene.mesh.parameters).map_err(Failure::input)?;
    let problem = DiscreteProblem::new(scene, mesh).map_err(Failure::input)?;
    let session = Session::start(&arguments.petsc).map_err(Failure::solver)?;
    let floor =
        study::floor(&session, &problem, arguments.rounds.max(1)).map_err(Failure::solver)?;
    say(&serde_json::to_string_pretty(&floor).map_err(Failure::solver)?);
    session.finalize().map_err(Failure::solver)
}
