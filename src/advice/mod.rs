//! Advice to the user: notes on a problem, singular points, and data that the mesh does not resolve.
//!
//! - [`DiscreteProblem::notes`](crate::problem::DiscreteProblem::notes): the notes before any solve;
//! - [`Singular`]: peaks of the pressure that the mesh does not resolve, as points at which it grows with every finer mesh;
//! - `Kink`: kinks of the gap in closed contact, where the pressure is infinite;
//! - `unresolved`: edges that must be halved to resolve prescribed displacements and the initial damage;
//! - `Penetration`: where the body penetrates a foundation between the nodes.
//!
//! What crosses the door: `accuracy` marks the mesh at these points, and `command` prints the notes. Nothing here changes an answer.

mod collapse;
mod kinks;
mod notes;
mod peaks;
mod penetration;
mod unresolved;

pub(crate) use crate::problem::SEEN;
pub use crate::problem::Singular;
pub(crate) use kinks::Kink;
pub use notes::locks;
pub(crate) use unresolved::{missed_mean, unresolved};
