//! Studies of [`signorini`]: many solves, and what they say together. [`stability`] shows where methods fail
//! (`validation/STABILITY.md`), [`bounds`] how far the proved
//! error of u is from the true one.
#![forbid(unsafe_code)]

pub mod bounds;
mod error;
pub mod stability;

pub use error::StudyError;
