//! Continuous piecewise affine finite elements (22), (23): from laws to matrices and vectors.
//!
//! Fields are plain slices over the nodes of this rank's subdomain, owned ones first, then ghosts:
//! one value per node (ζ) or two in turn (u_x, u_y). [`Partition`] alone knows which are owned.

mod triangle;
mod partition;
mod body;
mod subdomain;
mod nodal_bases;
mod elasticity;
mod stiffness;
mod recovery;
mod rigid_part;
mod damage;
mod loads;

pub use body::Body;
pub use damage::{DamageCertificate, DamageSystem, Mass, source, source_load};
pub use elasticity::Elasticity;
pub use loads::{add_body_force, add_traction, gauss_points, midpoint};
pub use nodal_bases::NodalBases;
pub use partition::Partition;
pub use rigid_part::RigidPart;
pub use stiffness::Stiffness;
pub use subdomain::Subdomain;
pub use triangle::Triangle;
