//! Scenes: what to solve, read from a TOML file and checked before anything runs.

mod error;
mod expression;
mod grammar;

pub use error::{ExpressionError, Place, SceneError};
pub use expression::Expression;
