//! Errors against a reference solution: their norms, the file the reference is kept in, and the
//! orders they show.

mod chart;
mod converge;
mod front;
mod grid;
mod norms;
mod store;
