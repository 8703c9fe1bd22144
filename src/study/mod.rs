//! Studies: many runs and what they say together.

mod chart;
mod compare;
mod converge;
mod error;
mod floor;
mod front;
mod grid;
mod norms;
mod reference;
pub mod stability;
mod store;
mod trial;

pub use chart::{ChartRow, chart};
pub use compare::{Comparison, Entry, compare};
pub use converge::{Convergence, ErrorRow, MEASURES, Measure, converge};
pub use error::StudyError;
pub use floor::{Floor, Part, floor};
pub use front::Front;
pub use grid::{Grid, rectangle};
pub use norms::{Embedding, Fields, Norms};
pub use reference::{Plan, Reference};
pub use store::ReferenceError;
