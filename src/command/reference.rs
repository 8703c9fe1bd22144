//! `signorini reference`: the reference solution of `converge` and `chart`.

use super::{
    Failure,
    screen::{Screen, say},
};
use clap::Args;
use signorini::{
    output,
    petsc::Session,
    study::{Reference, ReferenceError, ReferenceOptions, ReferenceSpec, StudyError},
};
use std::{path::PathBuf, time::Instant};

/// Which reference, and where it is kept.
#[derive(Args)]
pub struct ReferenceArguments {
    /// Scene file (TOML).
    #[arg(default_value = "geo/square-table1.toml")]
    scene: PathBuf,
    /// Override a key of the scene, e.g. --set time.end=0.5; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Mesh size of the coarsest mesh, m [default: 8 times the scene's].
    #[arg(long, value_name = "M")]
    size: Option<f64>,
    /// Grading of the coarsest mesh (mesh.parameters.grading) [default: the scene's].
    #[arg(long, value_name = "RATIO")]
    grading: Option<f64>,
    /// How often the coarsest mesh is refined to the mesh of the reference; each time halves all
    /// edges.
    #[arg(long, value_name = "R", default_value_t = ReferenceOptions::default().refinements)]
    refinements: usize,
    /// Time step of the reference, s; it must divide T/50 [default: T/10000].
    #[arg(long, value_name = "K")]
    step: Option<f64>,
    /// Folder of the references.
    #[arg(long, value_name = "DIR", default_value = "out/reference")]
    kept: PathBuf,
}

impl ReferenceArguments {
    fn spec(&self) -> Result<ReferenceSpec, Failure> {
        let Self { size, grading, refinements, step, .. } = *self;
        let options = ReferenceOptions { size, grading, refinements, step };
        ReferenceSpec::new(&self.scene, &self.set, &options).map_err(Failure::input)
    }

    /// The reference that has been computed.
    pub fn load(&self) -> Result<Reference, Failure> {
        self.spec()?.load(&self.kept).map_err(Failure::input)
    }

    /// Where a study of this scene writes to, if not elsewhere.
    pub fn folder(&self, study: &str, out: Option<&PathBuf>) -> PathBuf {
        let name = self.scene.file_stem().unwrap_or_default();
        out.cloned().unwrap_or_else(|| PathBuf::from("out").join(study).join(name))
    }
}

/// Computes the reference unless it is there and belongs to the scene and mesh at hand.
///
/// # Errors
/// Bad input, or the run failed.
pub fn reference(arguments: &ReferenceArguments) -> Result<(), Failure> {
    let (spec, kept) = (arguments.spec()?, &arguments.kept);
    let path = spec.path(kept);
    match spec.load(kept) {
        Ok(reference) => {
            let states = reference.states.len();
            say(&format!("{}: {states} states, as the scene and mesh want them", path.display()));
            return Ok(());
        }
        Err(StudyError::Reference(ReferenceError::Missing { .. })) => {}
        Err(StudyError::Reference(
            error @ (ReferenceError::Other { .. } | ReferenceError::Damaged { .. }),
        )) => eprintln!("warning: {error}"),
        Err(error) => return Err(Failure::input(error)),
    }
    output::create(kept).map_err(Failure::input)?;
    let session = Session::start(&[]).map_err(Failure::solver)?;
    let (started, screen) = (Instant::now(), Screen::until(spec.end));
    let computed = spec.compute(&session, kept, &mut |record| screen.show(record));
    screen.clear();
    session.finalize().map_err(Failure::solver)?;
    computed.map_err(Failure::solver)?;
    let size = std::fs::metadata(&path).map_or(0, |data| data.len());
    say(&format!(
        "{}: computed in {:.0} s, {:.1} MB",
        path.display(),
        started.elapsed().as_secs_f64(),
        size as f64 / 1e6
    ));
    Ok(())
}
