//! The laws of the discrete problem: what must hold to round-off, at a known order, or
//! between two ways of computing the same thing.
//!
//! Meshes are small and made here or by gmsh in a temporary folder; a tolerance that is not
//! round-off says where it comes from.

mod support;

mod adaptive;
mod anderson;
mod bars;
mod bore;
mod certificate;
mod chosen_steps;
mod collapse;
mod conditioning;
mod constraints;
mod conservation;
mod contact;
mod contact_pressure;
mod damage;
mod elements;
mod equilibrated;
mod extrapolation;
mod foreign;
mod hertz;
mod loads;
mod lost_contact;
mod material;
mod mesh_error;
mod maximum_principle;
mod notes;
mod observed;
mod orders;
mod patch;
mod pivoting;
mod posed;
mod quadratic_elements;
mod recovery;
mod punch;
mod regression;
mod rescue;
mod resultants;
mod rigid;
mod scales;
mod shipped_scenes;
mod singular;
mod step_errors;
mod stress;
mod undo;
mod units;
