//! Studies of [`signorini`]: many solves, and what they say together. [`stability`] shows where methods fail
//! (`validation/STABILITY.md`).
#![forbid(unsafe_code)]

mod error;
pub mod stability;

pub use error::StudyError;
