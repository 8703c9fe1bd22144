//! **signorini**: an elastic body pressed against a rigid foundation while its
//! material is damaged.
//!
//! # Read, solve, look
//!
//! | you want to | use |
//! |---|---|
//! | read a scene and its mesh | [`scene::Scene::read`], [`mesh::load`]; from memory [`scene::Scene::parse`], [`mesh::Mesh`] |
//! | solve it | [`estimate::Simulation`] |
//! | look at the figures | [`evolution::Outcome::last`] with [`observe::ObservedProblem::figures`], which has their names and labels |
//! | look at the fields | [`problem::State`]: ζ, u and the contact; [`output::FieldWriter`] writes frames for ParaView |
//! | adapt the mesh, get bars | [`accuracy::adapted`], [`evolution::Outcome::set_bars`]; `examples/own_law.rs` does both |
//! | use your contact solver or damage law | [`contact::ContactSolver`], [`model::DamageSource`]; `examples/own_solver.rs`, `examples/own_law.rs` |
//!
//! A block under a pressure that grows, on a foundation:
//!
//! ```
//! use signorini::{
//!     estimate::Simulation,
//!     evolution::Step,
//!     mesh::Mesh,
//!     observe::ObservedProblem,
//!     petsc::Session,
//!     scene::Scene,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Read. Files are read by Scene::read("block.toml".as_ref(), &[]) and mesh::load(&scene.mesh.file, …).
//! let text = "mesh.file = 'block.msh'
//!     material = { young = 1e5, poisson = 0.3, plane = 'stress' }
//!     time = { end = 1, step = 0.25 }
//!     boundary = [{ name = 'bottom', gap = 0 }, { name = 'top', pressure = '500*t' }]";
//! let scene = Scene::parse(text, "block.toml".as_ref(), &[])?;
//! let problem = ObservedProblem::new(scene, Mesh::rectangle(1.0, 1.0, 8, 8))?;
//!
//! // Solve. The observer sees every accepted step.
//! let session = Session::start(&[])?;
//! let mut show = |step: &Step| {
//!     println!("t = {}: largest |u| = {}", step.record.time, step.record.displacement_max);
//!     Ok(())
//! };
//! let outcome = Simulation::new(&problem).observer(&mut show).run(&session)?;
//!
//! // Look at the figures of the last state, at its fields, and at the estimated error.
//! for (figure, value) in problem.figures.iter().zip(&outcome.last.figures) {
//!     println!("{} ({}): {}", figure.label, figure.name, value.value);
//! }
//! let force = problem.figures.number("bottom.force_y").expect("a support has a force");
//! assert!((outcome.last.figures[force].value - 500.0).abs() < 1e-6, "the foundation carries the pressure");
//! let state = &outcome.last.state; // ζ per vertex of problem.mesh(), u_x and u_y in turn per node
//! assert_eq!(state.u.len(), 2 * problem.mesh().nodes.len());
//! println!("error of u: {:.1} %", 100.0 * outcome.errors.displacement_mesh);
//! # Ok(())
//! # }
//! ```
//!
//! Vectors and matrices are those of [`nalgebra`]. Nodes of fields may have another order than those of a file:
//! neighbouring nodes are close in memory.
//!
//! # The problem
//!
//! A plane body Ω, 1 m thick, is clamped on Γ_D and loaded by f_N on Γ_N and by a body force f_B. It may touch a
//! rigid foundation at the distance g along the outward normal ν of Γ_C, without friction. The unknowns are
//! the displacement u and the damage ζ: 1 in sound material, 0 in broken material. They satisfy
//! σ = ζ𝒜ε(u), −Div σ = f_B, σν = f_N on Γ_N and
//!
//! ```text
//! u·ν ≤ g,   σ_ν ≤ 0,   σ_ν (u·ν − g) = 0,   σ_τ = 0   on Γ_C           (7), (8)
//! ζ′ − κ Δζ = φ(ε(u), ζ)  in Ω,   ∂ζ/∂ν = 0  on ∂Ω,   ζ(0) = ζ₀         (3), (4), (9)
//! φ = −(λ_D (1 − ζ)/ζ + ½ λ_U min(|ε|², q*) − λ_W)₊
//! ```
//!
//! In φ and in σ, ζ is cut to [ζ_*, 1]. Let U be the displacements with the prescribed values on Γ_D and
//! u·ν ≤ g on Γ_C. The weak form is: find u(t) ∈ U and ζ(t) ∈ H¹(Ω) such that
//!
//! ```text
//! ∫ ζ𝒜ε(u)·ε(v − u) ≥ ∫ f_B·(v − u) + ∫_Γ_N f_N·(v − u)   for all v ∈ U         (20)
//! ∫ ζ′ξ + κ∇ζ·∇ξ = ∫ φ(ε(u), ζ) ξ                          for all ξ ∈ H¹(Ω)     (21)
//! ```
//!
//! # The scheme
//!
//! Problem VP^hk of Campo, Fernández and Silva, "Damageable contact between an elastic body and a
//! rigid foundation" (the numbers are theirs), with finite elements of degree 1 (u also 2) on
//! triangles and Euler steps of length k:
//!
//! ```text
//! ∫ (ζₙ − ζₙ₋₁)/k ξ + κ∇ζₙ·∇ξ = ∫ φ(ε(uₙ₋₁), ζₙ₋₁) ξ                             (25)
//! ∫ ζₙ𝒜ε(uₙ)·ε(v − uₙ) ≥ the work of the loads at tₙ on v − uₙ                    (26)
//! ```
//!
//! (27) is (26) at t = 0. A run stops when min ζ reaches ζ_*. Start reading at `Run::step` in [`evolution`].
//!
//! The modules below are listed in the order of their dependence: each uses only those above it.
#![deny(unsafe_code)]

pub use nalgebra;

/// `Debug` of an error is its message, as Rust prints it if `main` returns the error.
macro_rules! debug_is_message {
    ($error:ty) => {
        impl std::fmt::Debug for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                std::fmt::Display::fmt(self, f)
            }
        }
    };
}

pub mod interrupt;
pub mod memory;
pub mod printable;
pub mod python;
pub mod suggestion;
mod whole_file;
pub mod petsc;
pub mod linear;
pub mod mesh;
pub mod model;
pub mod fem;
pub mod contact;
pub mod scene;
pub mod problem;
pub mod observe;
pub mod advice;
pub mod evolution;
pub mod estimate;
pub mod accuracy;
pub mod output;

/// The program in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// Relative rounding of a sum over the nodes of a mesh: √n ε for n = 2²⁴ terms, as rounding errors have random signs
/// (Higham, Accuracy and Stability of Numerical Algorithms, ch. 2). Smaller differences are not seen.
pub(crate) const ROUNDING: f64 = 4096.0 * f64::EPSILON;

/// The maximum; NaN if either is NaN, unlike f64::max. So an error that is no number never looks small.
pub(crate) fn maximum(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// Sorts `items` by their numbers below `count`, in linear time. It also returns per number where its items start, and the end.
pub(crate) fn by_number<T: Copy + Default>(
    count: usize,
    items: impl Iterator<Item = (usize, T)> + Clone,
) -> (Vec<usize>, Vec<T>) {
    let mut starts = vec![0; count + 1];
    items.clone().for_each(|(number, _)| starts[number + 1] += 1);
    (0..count).for_each(|number| starts[number + 1] += starts[number]);
    let (mut next, mut sorted) = (starts.clone(), vec![T::default(); starts[count]]);
    for (number, item) in items {
        sorted[next[number]] = item;
        next[number] += 1;
    }
    (starts, sorted)
}
