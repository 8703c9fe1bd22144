//! The laws of the discrete problem: what must hold to round-off, at a known order, or
//! between two ways of computing the same thing.
//!
//! Meshes are small and made here or by gmsh in a temporary folder; a tolerance that is not
//! round-off says where it comes from.

mod support;

mod adaptive;
mod anderson;
mod bars;
mod certificate;
mod chosen_steps;
mod collapse;
mod conditioning;
mod constraints;
mod conservation;
mod contact;
mod contact_pressure;
mod damage;
mod directions;
mod elements;
mod equilibrated;
mod extrapolation;
mod foreign;
mod free_motions;
mod hertz;
mod loads;
mod lost_contact;
mod material;
mod mesh_error;
mod maximum_principle;
mod notes;
mod observed;
mod obstacles_and_loads;
mod orders;
mod patch;
mod pivoting;
mod quadratic_elements;
mod recovery;
mod rejected_steps;
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
mod units;
