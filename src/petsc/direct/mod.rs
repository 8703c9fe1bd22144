//! Cholesky factors: CHOLMOD makes them, the solves with them are our own.

mod cholmod;
mod lower;
mod substructure;
mod supernodal;
mod tiles;

pub use cholmod::Precision;
pub(super) use substructure::Substructure;

use cholmod::Cholesky;
use lower::Lower;
