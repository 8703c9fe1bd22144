//! Studies of [`signorini`]: many runs, and what they say together.
//!
//! - [`stability`]: where methods fail (`validation/STABILITY.md`);
//! - [`converge`](fn@converge): errors against a [`Reference`] solution over mesh size and time step
//!   (`validation/ACCURACY.md`).
#![forbid(unsafe_code)]

mod converge;
mod error;
mod locate;
mod norms;
mod reference;
mod refine;
mod slope;
pub mod stability;
mod store;
mod study_run;

pub use converge::{Convergence, ErrorRow, MEASURES, Measure, converge};
pub use error::StudyError;
pub use norms::{Embedding, Fields, Norms};
pub use reference::{Reference, ReferenceOptions, ReferenceSpec};
pub use refine::{longest_edge, refined};
pub use store::ReferenceError;
pub use study_run::Sampler;
