//! PETSc and MPI, safely.
//!
//! `raw` holds the C names one to one (bindgen, an explicit list in `build.rs`). The other files
//! are small owners above them. The error code of every call becomes a [`PetscError`] with PETSc's own
//! message. Every object is destroyed when its owner is dropped. This room checks the lengths of arrays;
//! PETSc checks the sizes of its own objects. A C name in parentheses has its page under
//! <https://petsc.org/release/manualpages/>.
//!
//! The crate petsc-rs is not used: it has no TAO, and calls itself a work in progress whose wrappers may be incorrect
//! (its README).
//!
//! All objects live on `PETSC_COMM_WORLD`; sizes and slices are those owned by this rank.
#![allow(unsafe_code)]

mod allocator;
mod communicator;
mod error;
mod fork;
mod ghosts;
mod graph;
mod handle;
mod shell_preconditioner;
mod ksp;
mod matrix;
mod options;
mod session;
mod stage;
mod tao;
mod vector;
#[cfg(petsc_without_mpi)]
#[allow(non_snake_case)]
mod without_mpi;

#[allow(warnings, clippy::all)]
mod raw {
    #[cfg(petsc_without_mpi)]
    pub use super::without_mpi::*;

    include!(concat!(env!("OUT_DIR"), "/petsc.rs"));
}

pub use allocator::Allocator;
pub use communicator::Communicator;
pub use error::PetscError;
pub use matrix::{Matrix, Pattern};
pub use session::{Session, version};
pub use stage::{stage, stage_seconds};
pub use vector::Vector;

pub(crate) use ghosts::Ghosts;
pub(crate) use graph::divide;
pub(crate) use ksp::{Ksp, KspProblem};
pub(crate) use matrix::Operator;
pub(crate) use options::{has_option, set_default_option};
pub(crate) use shell_preconditioner::ShellPreconditioner;
pub(crate) use tao::{BoundedQuadratic, TaoReport};

use error::check;
