//! The atlas of failure: sweeps into the places where methods break.
//!
//! A map is a table; each of its cells is *correct*, *refused* with a reason, or *wrong*.
//! The page `validation/STABILITY.md` tells what the maps show.

mod statics;
mod step_size;
mod maximum_principle;
mod penalty;
mod tao_types;
mod random_contact;
mod conditioning;
mod lost_contact;
mod scales;

pub use random_contact::sample as random_sample;

use super::StudyError;
use crate::petsc::Session;
use serde::Serialize;
use std::path::Path;

/// Makes one map: writes `<name>.csv` into the folder.
pub type Map = fn(&Session, &Path) -> Result<Counts, StudyError>;

/// The maps by name.
pub const MAPS: &[(&str, Map)] = &[
    ("step-size", step_size::run),
    ("maximum-principle", maximum_principle::run),
    ("penalty-duality", penalty::run),
    ("tao-types", tao_types::run),
    ("active-set", random_contact::run),
    ("conditioning", conditioning::run),
    ("lost-contact", lost_contact::run),
    ("scales", scales::run),
];

/// What a cell of a map turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The answer is right to the accuracy promised.
    Correct,
    /// The program gave no answer and said why.
    Refused,
    /// The program gave a wrong answer without saying so.
    Wrong,
}

/// How many cells of a map were of which kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Right answers.
    pub correct: usize,
    /// Refusals with a reason.
    pub refused: usize,
    /// Wrong answers that the program did not report.
    pub wrong: usize,
}

impl FromIterator<Verdict> for Counts {
    fn from_iter<I: IntoIterator<Item = Verdict>>(verdicts: I) -> Self {
        let mut counts = Self::default();
        for verdict in verdicts {
            match verdict {
                Verdict::Correct => counts.correct += 1,
                Verdict::Refused => counts.refused += 1,
                Verdict::Wrong => counts.wrong += 1,
            }
        }
        counts
    }
}
