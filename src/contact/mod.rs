//! Frictionless contact: the discrete problem (26), its solvers, and the certificate of their answers.
//!
//! ```text
//! min ½ cᵀKc − fᵀc   subject to   lower_i ≤ c_i ≤ upper_i on the contact unknowns
//! ```
//!
//! [`Constraints`] chooses unknowns c such that each contact condition bounds one of them. [`RigidMotions`]
//! finds the null space of K. A [`ContactSolver`] solves a [`ContactProblem`]; [`solvers()`] makes one of
//! [`REGISTRY`] by its name. The [`Certificate`] computes the KKT residuals of u without the bases, bounds
//! and matrices of the solvers.

mod certificate;
mod constraints;
mod error;
mod kkt;
mod problem;
mod rigid;
mod nodal_constraint;
mod solvers;

pub use certificate::{Answer, Certificate, ContactPoint};
pub use constraints::Constraints;
pub use error::{Conflict, ConstraintError, ContactError};
pub use kkt::{Kkt, Scales};
pub use nodal_constraint::{Bound, NodalConstraint, RowLaw};
pub use problem::ContactProblem;
pub use rigid::{DrivenMotion, RigidMotions, nonnegative};
pub(crate) use rigid::{least_motion, rigid_motion_until_contact, unconstrained_motions};
pub use solvers::{
    Anderson, ChosenSolver, ContactOptions, ContactReport, ContactSolver, PREFIX as ELASTIC,
    PenaltyOptions, REGISTRY, SOLVERS, SharedSolver, SolverEntry, SolverError, TAO_TYPES, find,
    solvers,
};
