//! The paper's laws at one point of the body: plane elasticity and the damage source.

mod damage;
mod elasticity;

pub use damage::DamageLaw;
pub use elasticity::{Material, Plane};
