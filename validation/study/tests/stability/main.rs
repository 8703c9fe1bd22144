//! Small copies of the maps of the stability study.

mod penalty;
mod random_contact;
mod step_size;
mod tao_types;

use signorini::{
    evolution::{RunError, Step},
    petsc::Session,
};
use signorini_study::stability::problems::{self, PRESSED_AND_LIFTED};

/// The square of map 3 on n × n cells, pressed on the left and lifted on the right.
fn solve(session: &Session, n: usize, solver: &str, set: &[String]) -> Result<Step, RunError> {
    // What a solver does by itself.
    let set = [set, &["contact.rescue=false".to_owned()]].concat();
    let problem = problems::square(n, PRESSED_AND_LIFTED, &set)?;
    problems::solve(session, &problem, solver, None).unwrap_or_else(|e| panic!("{e}"))
}
