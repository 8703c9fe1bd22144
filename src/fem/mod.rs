//! Continuous finite elements (22), (23), P1 for ζ and P1 or P2 for u: from laws to matrices and vectors.
//!
//! - [`Body`]: the nodes and elements of a mesh, and their division among ranks ([`Partition`], `Subdomain`);
//! - [`Elasticity`]: stresses, internal forces and energies of a displacement field;
//! - [`Stiffness`]: K(ζ) for solvers, by elements or by entries;
//! - [`DamageSystem`] solves (28), and [`DamageCertificate`] checks the answer without its matrices.
//!
//! What crosses the door: fields as plain slices over the nodes of this rank's subdomain, owned ones first, then
//! ghosts: one value per vertex (ζ) or two in turn per node (u_x, u_y). [`Partition`] alone knows which are owned.

mod element;
mod triangle;
mod edge;
mod partition;
mod cells;
mod body;
mod subdomain;
mod nodal_bases;
mod elasticity;
mod stiffness;
mod rigid_motion;
mod damage;
mod damage_certificate;
mod loads;
mod location;
mod patches;

pub use body::{Body, Nodes};
pub(crate) use cells::for_elements;
pub use cells::{Cells, Elements};
pub use damage::{DamageSystem, Mass, WrongSource, source, source_load};
pub use damage_certificate::DamageCertificate;
pub(crate) use edge::THREE_GAUSS;
pub use edge::{Edge, GAUSS, gauss_points, normal_error, parabola};
pub use elasticity::Elasticity;
pub(crate) use element::at_vertices;
pub use element::{Element, POINTS, QuadraturePoint, quadratic_values};
pub use loads::{TriangleParts, add_body_force, add_traction, part_point, six_points};
pub(crate) use location::ON_SIDE;
pub use location::{Location, PointValues};
pub use nodal_bases::NodalBases;
pub use partition::Partition;
pub(crate) use patches::{Fits, Patches};
pub use rigid_motion::{RigidMotion, resultant};
pub use stiffness::Stiffness;
pub use subdomain::Subdomain;
pub use triangle::Triangle;
