//! `signorini reference`: the reference solution of the convergence study.

use super::{
    Failure,
    screen::{Screen, say},
};
use clap::Args;
use signorini::{
    output,
    petsc::Session,
    study::{Plan, Reference, ReferenceError},
};
use std::{path::PathBuf, time::Instant};

/// Which reference, and where it is kept.
#[derive(Args)]
pub struct ReferenceArguments {
    /// Cells per side of the reference.
    #[arg(long, value_name = "N", default_value_t = 256)]
    cells: usize,
    /// Time step of the reference, s; it must divide 0.02.
    #[arg(long, value_name = "K", default_value_t = 1e-4)]
    step: f64,
    /// Grading of the reference's grid, as of geo/square.geo; 1: uniform, as in the paper.
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    grading: f64,
    /// Folder of the references.
    #[arg(long, value_name = "DIR", default_value = "out/reference")]
    kept: PathBuf,
}

impl ReferenceArguments {
    fn plan(&self) -> Plan {
        Plan { cells: self.cells, grading: self.grading, step: self.step }
    }

    /// The reference that has been computed.
    pub fn load(&self) -> Result<Reference, Failure> {
        self.plan().load(&self.kept).map_err(Failure::input)
    }
}

/// Computes the reference unless it is there and belongs to the scene and mesh at hand.
///
/// # Errors
/// Bad input, or the run failed.
pub fn reference(arguments: &ReferenceArguments) -> Result<(), Failure> {
    let (plan, kept) = (arguments.plan(), &arguments.kept);
    let path = plan.path(kept);
    match plan.load(kept) {
        Ok(reference) => {
            let states = reference.states.len();
            say(&format!("{}: {states} states, as the scene and mesh want them", path.display()));
            return Ok(());
        }
        Err(ReferenceError::Missing { .. }) => {}
        Err(error @ (ReferenceError::Other { .. } | ReferenceError::Damaged { .. })) => {
            eprintln!("warning: {error}");
        }
        Err(error) => return Err(Failure::input(error)),
    }
    output::create(kept).map_err(Failure::input)?;
    let session = Session::start(&[]).map_err(Failure::solver)?;
    let (started, screen) = (Instant::now(), Screen::until(1.0));
    let computed = plan.compute(&session, kept, &mut |record| screen.show(record));
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
