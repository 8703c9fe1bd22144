//! **signorini**: an elastic body pressed against a rigid foundation while its
//! material is damaged.
//!
//! The scheme is Problem VP^hk of Campo, Fernández and Silva, "Damageable contact
//! between an elastic body and a rigid foundation". The modules stand in the order
//! of their dependence: each uses only those above it.
#![deny(unsafe_code)]

pub mod phases;
pub mod petsc;
pub mod cholesky;
pub mod mesh;
pub mod model;
pub mod fem;
pub mod contact;
pub mod scene;
pub mod evolution;
pub mod output;
