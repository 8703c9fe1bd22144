//! The stability study: sweeps into the places where methods break.
//!
//! A map is a table; each of its rows is *correct*, *refused* with a reason, or *wrong*.
//! The page `validation/STABILITY.md` tells what the maps show.

mod conditioning;
mod lost_contact;
mod maximum_principle;
mod penalty;
pub mod problems;
mod random_contact;
mod scales;
mod step_size;
mod table;
mod tao_types;

pub use random_contact::sample as random_sample;
pub use table::{Counts, Table, Verdict};

use crate::StudyError;
use signorini::petsc::Session;
use std::path::Path;

/// Fills the table of one map.
pub type Map = fn(&Session, &mut Table) -> Result<(), StudyError>;

/// The maps by name.
pub const MAPS: &[(&str, Map)] = &[
    ("step-size", step_size::fill),
    ("maximum-principle", maximum_principle::fill),
    ("penalty-duality", penalty::fill),
    ("tao-types", tao_types::fill),
    ("active-set", random_contact::fill),
    ("conditioning", conditioning::fill),
    ("lost-contact", lost_contact::fill),
    ("scales", scales::fill),
];

/// Makes a map and writes `<name>.csv` into `folder`, also of a map that breaks off.
///
/// # Errors
/// A problem of the map cannot be set up, PETSc fails, or the table cannot be written.
pub fn make(
    session: &Session,
    (name, fill): (&str, Map),
    folder: &Path,
) -> Result<Counts, StudyError> {
    let mut table = Table::new(folder.join(name).with_extension("csv"));
    let filled = fill(session, &mut table);
    table.write()?;
    filled.map(|()| table.counts())
}
