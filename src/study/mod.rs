//! Studies: many runs and what they say together.

mod compare;
mod floor;
mod grid;
pub mod stability;

pub use compare::{Comparison, Entry, compare};
pub use floor::{Floor, Part, floor};
pub use grid::rectangle;
