//! Frictionless contact: the discrete problem (26), its solvers, and the residuals that judge them.
//!
//! A solver is one file that implements [`ContactSolver`]; [`solver`] knows them by name.

mod anderson;
mod certificate;
mod constraints;
mod linear;
mod penalty_duality;
mod problem;
mod rigid;
mod tao;

pub use certificate::Kkt;
pub use constraints::{Bound, ConstraintError, Constraints, FixedRow, GapRow};
pub use problem::{ContactError, ContactProblem, ContactReport, ContactSolver};
pub use rigid::{DrivenMotion, RigidMotion, RigidMotions};

use crate::petsc::Session;

/// The solvers a scene or `--solver` may name, the default first.
pub const SOLVERS: [&str; 2] = ["tao", "penalty-duality"];

/// The solver called `name`, the default if there is none of that name. Without bounds
/// every name means one linear solve.
pub fn solver<'s>(session: &'s Session, name: &str, bounded: bool) -> Box<dyn ContactSolver + 's> {
    match name {
        _ if !bounded => Box::new(linear::Linear::new(session)),
        "penalty-duality" => Box::new(penalty_duality::PenaltyDuality::new(session)),
        _ => Box::new(tao::Tao::new(session)),
    }
}
