//! Studies: many runs and what they say together.

mod compare;

pub use compare::{Comparison, Entry, compare};
