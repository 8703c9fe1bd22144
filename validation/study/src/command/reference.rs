//! `signorini-study reference`: the reference solution of `converge`.

use super::with_petsc;
use clap::Args;
use serde::Serialize;
use signorini::{
    output::{
        self,
        terminal::{progress_bar, say},
    },
    petsc::Session,
};
use signorini_study::{Reference, ReferenceError, ReferenceOptions, ReferenceSpec, StudyError};
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
    #[command(flatten)]
    options: ReferenceOptions,
    /// Folder of the references.
    #[arg(long, value_name = "DIR", default_value = "out/reference")]
    kept: PathBuf,
}

/// A study against a reference, and where its table goes.
#[derive(Args)]
pub struct StudyArguments {
    #[command(flatten)]
    reference: ReferenceArguments,
    /// Folder for the table [default: out/<study>/<scene>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl ReferenceArguments {
    fn spec(&self) -> Result<ReferenceSpec, StudyError> {
        ReferenceSpec::new(&self.scene, &self.set, &self.options)
    }
}

impl StudyArguments {
    /// Makes the study called `name` against the reference, which must have been computed, shows what
    /// it found, and writes its `rows` to `<name>.csv`.
    pub fn study<T, R: Serialize>(
        &self,
        name: &str,
        make: impl FnOnce(&Session, &Reference, &mut dyn FnMut(usize, usize)) -> Result<T, StudyError>,
        rows: fn(&T) -> &[R],
        show: fn(&Reference, &T),
    ) -> Result<(), StudyError> {
        let reference = self.reference.spec()?.load(&self.reference.kept)?;
        let scene = self.reference.scene.file_stem().unwrap_or_default();
        let usual = || PathBuf::from("out").join(name).join(scene);
        let folder = self.out.clone().unwrap_or_else(usual);
        output::create(&folder)?;
        let bar = progress_bar("{bar:20} {pos} of {len} runs {elapsed}, {eta} left", 1);
        let mut progress = |done: usize, all: usize| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        };
        let made = with_petsc(&[], |session| make(session, &reference, &mut progress));
        bar.finish_and_clear();
        let made = made?;
        show(&reference, &made);
        let path = folder.join(name).with_extension("csv");
        output::write_table(&path, rows(&made))?;
        say(&format!("written to {}", path.display()));
        Ok(())
    }
}

/// Computes the reference unless it is there and belongs to the scene and mesh at hand.
///
/// # Errors
/// Bad input, or the run failed.
pub fn reference(arguments: &ReferenceArguments) -> Result<(), StudyError> {
    let (spec, kept) = (arguments.spec()?, &arguments.kept);
    let path = spec.path(kept);
    match spec.load(kept) {
        Ok(reference) => {
            let states = reference.states.len();
            say(&format!("{}: {states} states, as the scene and mesh want them", path.display()));
            return Ok(());
        }
        Err(StudyError::Reference(ReferenceError::Missing(_))) => {}
        Err(StudyError::Reference(error @ ReferenceError::Useless(..))) => {
            eprintln!("warning: {error}");
        }
        Err(error) => return Err(error),
    }
    output::create(kept)?;
    let started = Instant::now();
    // The bar counts thousandths of the time to be run.
    let bar = progress_bar("{bar:20} {wide_msg} {elapsed}, {eta} left", 1000);
    let computed = with_petsc(&[], |session| {
        spec.compute(session, kept, &mut |record| {
            bar.set_position((1e3 * record.time / spec.end) as u64);
            bar.set_message(format!(
                "step {}  t = {:.4}  min ζ = {:.6}",
                record.step, record.time, record.zeta_min
            ));
        })
    });
    bar.finish_and_clear();
    computed?;
    let size = std::fs::metadata(&path).map_or(0, |data| data.len());
    say(&format!(
        "{}: computed in {:.0} s, {:.1} MB",
        path.display(),
        started.elapsed().as_secs_f64(),
        size as f64 / 1e6
    ));
    Ok(())
}
