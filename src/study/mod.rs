//! Studies: many runs and what they say together.

mod compare;
mod grid;
pub mod stability;

pub use compare::{Comparison, Entry, compare};
pub use grid::rectangle;
