//! What the subcommands do.

mod converge;
mod reference;
mod stability;

pub use converge::convergence;
pub use reference::{ReferenceArguments, StudyArguments, reference};
pub use stability::{StabilityArguments, stability};

use signorini::petsc::Session;
use signorini_study::StudyError;

/// Makes a study while PETSc runs.
fn with_petsc<T>(
    options: &[String],
    study: impl FnOnce(&Session) -> Result<T, StudyError>,
) -> Result<T, StudyError> {
    let session = Session::start(options)?;
    let made = study(&session);
    session.finalize()?;
    made
}
