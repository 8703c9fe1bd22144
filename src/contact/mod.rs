//! Frictionless contact: the discrete problem (26), its solvers, and the residuals that judge them.
//!
//! A solver is one file that implements [`ContactSolver`]; [`solver`] knows them by name.

mod active_set;
mod anderson;
mod approach;
mod certificate;
mod constraint_error;
mod constraints;
mod elastic;
mod kkt;
mod linear;
mod nonnegative;
mod penalty_duality;
mod problem;
mod rigid;
mod rows;
mod tao;

pub(crate) use approach::approach;
pub use certificate::{Answer, Certificate, ContactPoint};
pub use constraint_error::ConstraintError;
pub use constraints::Constraints;
pub(crate) use constraints::join_gap;
pub use kkt::{Kkt, Scales};
pub use penalty_duality::PenaltyOptions;
pub(crate) use problem::unheld;
pub use problem::{ContactError, ContactProblem, ContactReport, ContactSolver};
pub use rigid::{DrivenMotion, Mover, PartMotion, RigidMotion, RigidMotions};
pub use rows::{Bound, FixedRow, GapRow};

use crate::petsc::Session;

/// The solvers a scene or `--solver` may name, the default first.
pub const SOLVERS: [&str; 3] = ["active-set", "penalty-duality", "tao"];

/// TAO's types for bounded variables, reached as `tao:TYPE`; some of them stall or err on
/// contact problems, which their KKT residuals then tell.
pub const TAO_TYPES: [&str; 12] = [
    "tron", "bnls", "bntr", "bntl", "gpcg", "blmvm", "bqnls", "bqnktr", "bqnktl", "bqnkls", "bncg",
    "bqpip",
];

/// Whether `name` is a solver: one of [`SOLVERS`], or `tao:` and one of [`TAO_TYPES`].
pub fn is_solver(name: &str) -> bool {
    SOLVERS.contains(&name) || name.strip_prefix("tao:").is_some_and(|t| TAO_TYPES.contains(&t))
}

/// A name that [`is_solver`] does not accept.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no contact solver `{0}`; there are {names}", names = solver_names())]
pub struct UnknownSolver(pub String);

/// What [`is_solver`] accepts, in words.
pub fn solver_names() -> String {
    format!("{}, and tao:TYPE with TYPE one of {}", SOLVERS.join(", "), TAO_TYPES.join(", "))
}

/// The solver called `name`. Without bounds every name means one linear solve.
///
/// # Errors
/// There is none of that name.
pub fn solver<'s>(
    session: &'s Session,
    name: &str,
    bounded: bool,
    penalty: PenaltyOptions,
) -> Result<Box<dyn ContactSolver + 's>, UnknownSolver> {
    if !is_solver(name) {
        return Err(UnknownSolver(name.to_owned()));
    }
    let (family, kind) = name.split_once(':').unwrap_or((name, "tron"));
    Ok(match family {
        _ if !bounded => Box::new(linear::Linear::new(session)),
        "active-set" => Box::new(active_set::ActiveSet::new(session)),
        "penalty-duality" => Box::new(penalty_duality::PenaltyDuality::new(session, penalty)),
        _ => Box::new(tao::Tao::new(session, kind)),
    })
}
