//! Map 6. Conditioning.

use super::{Counts, StudyError};
use crate::petsc::Session;
use std::path::Path;

/// Makes the map.
pub(super) fn run(_session: &Session, _folder: &Path) -> Result<Counts, StudyError> {
    Ok(Counts::default())
}
