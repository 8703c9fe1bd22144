//! PETSc: the only unsafe code of the crate.
//!
//! `raw` holds the C names one to one (bindgen, an explicit list in `build.rs`);
//! the other files are small owners above them: every call's error code becomes a
//! [`PetscError`] with PETSc's own message, every handle is destroyed on drop, and
//! sizes are checked here because PETSc does not.
//!
//! Beside PETSc it calls MPI, for sums over ranks, and CHOLMOD, for factors whose solves are ours.
//!
//! All objects live on `PETSC_COMM_WORLD`; sizes and slices are those owned by this rank.
#![allow(unsafe_code)]

mod direct;
mod error;
mod factor;
mod ghosts;
mod graph;
mod ksp;
mod mat;
mod communicator;
mod refactorisation;
mod session;
mod shell;
mod tao;
mod vec;

#[allow(
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    missing_docs,
    unsafe_op_in_unsafe_fn,
    clippy::all
)]
mod raw {
    include!(concat!(env!("OUT_DIR"), "/petsc.rs"));
}

pub use communicator::Communicator;
pub use direct::Precision;
pub use error::PetscError;
pub use factor::Factor;
pub use ghosts::Ghosts;
pub use graph::divide;
pub use ksp::{Krylov, LinearSolver};
pub use mat::Matrix;
pub use refactorisation::Refactorisation;
pub use session::Session;
pub use tao::{BoundedQuadratic, TaoReport};
pub use vec::Vector;

use error::check;
