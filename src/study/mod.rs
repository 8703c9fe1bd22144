//! Studies: many runs and what they say together.

mod chart;
mod converge;
mod error;
mod floor;
mod front;
mod grid;
mod locate;
mod norms;
mod reference;
pub mod stability;
mod store;
mod study_run;

pub use chart::{ChartRow, chart};
pub use converge::{Convergence, ErrorRow, MEASURES, Measure, converge};
pub use error::StudyError;
pub use floor::{Floor, Part, floor};
pub use front::Front;
pub use grid::rectangle;
pub use norms::{Embedding, Fields, Norms};
pub use reference::{Reference, ReferenceOptions, ReferenceSpec};
pub use store::ReferenceError;
