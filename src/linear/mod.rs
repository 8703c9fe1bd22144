//! Linear systems: PETSc's KSP with a Cholesky factor that is kept across matrices.
//!
//! Every linear system of a run is symmetric positive definite: (M + kκL) ζ = b of the damage step
//! and K(ζ) u = f of the contact step, with prescribed or penalised unknowns. The factor of one
//! matrix preconditions conjugate gradients for the next ones, until it costs more iterations than
//! a new one ([`RefactorisationPolicy`]). A [`LinearSolver`] has both.
//!
//! - On one rank CHOLMOD computes L Lᵀ = P A Pᵀ. The triangular solves L y = P b and Lᵀ (P x) = y are our own
//!   ([`Cholesky`]).
//! - The unknowns Γ between ranks, and those of contact, come last. Each rank eliminates its interior
//!   unknowns I. All ranks share the dense Schur complement S = A_ΓΓ − Σ A_ΓI A_II⁻¹ A_IΓ (`substructure`).
//!   Prescribed and penalised contact unknowns change S alone.
//! - If Γ is too large, or PETSc options choose it, a preconditioner of PETSc replaces the factor ([`Factor`]).
//!
//! What crosses the door: a [`LinearSystem`] and the largest residual of its solution. Contact solvers also
//! get the small problem of the unknowns that may be prescribed ([`CondensedSystem`]). They solve it by their own
//! methods.
//!
//! Unsafe code is where CHOLMOD and LAPACK are called, in `cholmod.rs` and `dense.rs`.

mod cholesky;
#[allow(unsafe_code)]
mod cholmod;
#[allow(unsafe_code)]
mod dense;
mod extrapolation;
mod factor;
mod linear_solver;
mod linear_system;
mod lower_triangle;
mod refactorisation;
mod scaling;
mod schur;
mod substructure;
mod supernodal;
mod tiles;

#[allow(warnings, unsafe_code, clippy::all)]
mod raw {
    include!(concat!(env!("OUT_DIR"), "/cholmod.rs"));
}

pub use cholesky::{Cholesky, Precision};
pub use extrapolation::Extrapolation;
pub use factor::{Factor, FactorState};
pub use linear_solver::{LinearSolver, SolveReport};
pub use linear_system::LinearSystem;
pub use lower_triangle::LowerTriangle;
pub use refactorisation::{Reduction, RefactorisationPolicy};
pub use schur::CondensedSystem;
