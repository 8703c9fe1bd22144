//! The contact solvers and the one table of them.
//!
//! A solver is a file that implements [`ContactSolver`] and defines its [`SolverEntry`] (and the
//! struct of its own options, if it has any); it becomes one of the program's by its `mod` line,
//! its place in [`REGISTRY`] and, for options, its field of [`ContactOptions`], all in this file.

mod active_set;
mod anderson;
mod penalty_duality;
mod tao;

pub use anderson::Anderson;
pub use penalty_duality::PenaltyOptions;
pub use tao::TAO_TYPES;

use super::{ContactError, ContactProblem, Kkt};
use crate::{
    linear::{LinearSolver, SolveReport},
    petsc::Vector,
    suggestion::suggestion,
};
use active_set::ActiveSet;
use serde::Deserialize;

/// What PETSc options of the linear systems with K begin with.
pub const PREFIX: &str = "elastic_";

/// A method for the contact problem. It keeps nothing between solves.
pub trait ContactSolver {
    /// The name a scene or `--solver` calls it by.
    fn name(&self) -> &'static str;

    /// Solves from the start `c` and leaves the solution there. `elastic` solves the linear systems with K;
    /// its factor may be that of an earlier K. `warm` is what the method left for the next solve (a set,
    /// a parameter), empty at first.
    ///
    /// # Errors
    /// The method stopped short of the tolerance, or PETSc failed.
    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError>;
}

/// A solver of one kind or another.
pub type BoxedSolver = Box<dyn ContactSolver>;

/// What a contact solve took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactReport {
    /// Iterations of the method itself.
    pub iterations: usize,
    /// Iterations of linear solvers inside, each a pair of triangular solves.
    pub linear_iterations: usize,
    /// Factorisations (not those of a preconditioner chosen by PETSc options).
    pub factorisations: usize,
    /// Times the method had to leave its fast path for a slower one that always ends, or another
    /// solver was asked in its place.
    pub fallbacks: usize,
    /// The solver that gave the answer in the place of the one that was asked.
    pub rescued_by: Option<&'static str>,
    /// Mean factor by which an iteration shrank the change of the multiplier, where the method
    /// is a fixed-point iteration.
    pub contraction: Option<f64>,
    /// ω of penalty-duality, Pa/m.
    pub omega: Option<f64>,
    /// Calls of TAO that claimed convergence to an answer which the KKT residuals rejected.
    pub false_claims: usize,
}

impl ContactReport {
    /// Adds a linear solve of a method.
    ///
    /// # Errors
    /// It did not converge.
    fn add_solve(&mut self, method: &str, solve: SolveReport) -> Result<(), ContactError> {
        self.linear_iterations += solve.iterations;
        self.factorisations += solve.factorisations;
        let detail = "the stiffness of its linear system is not positive definite, or too \
                      ill-conditioned for the tolerance";
        let stopped = || ContactError::stopped(method, *self, Kkt::UNKNOWN, detail);
        solve.converged.then_some(()).ok_or_else(stopped)
    }

    /// Adds what a further solve of the same problem took.
    pub fn add(&mut self, further: &Self) {
        self.iterations += further.iterations;
        self.linear_iterations += further.linear_iterations;
        self.factorisations += further.factorisations;
        self.fallbacks += further.fallbacks;
        self.rescued_by = further.rescued_by.or(self.rescued_by);
        self.contraction = further.contraction;
        self.omega = further.omega;
        self.false_claims += further.false_claims;
    }
}

/// A solver as the program knows it.
pub struct SolverEntry {
    /// What a scene or `--solver` calls it.
    pub name: &'static str,
    /// What it does, in a line of `--help`.
    pub summary: &'static str,
    /// Its variants, reached as `name:VARIANT`.
    pub variants: &'static [&'static str],
    /// The solver that is asked in its place where it stops short.
    pub rescuer: Option<&'static str>,
    /// A new one; the text is the variant, or empty.
    pub construct: fn(&str, &ContactOptions) -> BoxedSolver,
}

/// All solvers of problems with obstacles, the default first.
pub const REGISTRY: &[SolverEntry] = &[active_set::ENTRY, penalty_duality::ENTRY, tao::ENTRY];

/// Their names.
pub const SOLVERS: [&str; REGISTRY.len()] = {
    let mut names = [""; REGISTRY.len()];
    let mut number = 0;
    while number < names.len() {
        names[number] = REGISTRY[number].name;
        number += 1;
    }
    names
};

/// There is no contact solver of that name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no contact solver `{name}`{}", suggestion(name, &names()))]
pub struct SolverError {
    /// The name.
    pub name: String,
}

/// `[contact]` of a scene: how the contact problem is solved.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactOptions {
    /// The solver's name, if the scene asks for one.
    pub solver: Option<String>,
    /// Relative tolerance of the KKT residuals, in (0, 1).
    pub tolerance: f64,
    /// Whether another solver may answer where the one asked for stops short.
    pub rescue: bool,
    /// Parameters of the penalty-duality method.
    pub penalty_duality: PenaltyOptions,
}

impl Default for ContactOptions {
    fn default() -> Self {
        let penalty_duality = PenaltyOptions::default();
        Self { solver: None, tolerance: 1e-10, rescue: true, penalty_duality }
    }
}

/// The solver called `name`, and its variant: empty, or what stands behind a colon.
///
/// # Errors
/// There is none of that name.
pub fn find(name: &str) -> Result<(&'static SolverEntry, &str), SolverError> {
    let (solver, variant) = name.split_once(':').unwrap_or((name, ""));
    let known = |entry: &&SolverEntry| {
        entry.name == solver && (name == solver || entry.variants.contains(&variant))
    };
    let found = REGISTRY.iter().find(known).map(|entry| (entry, variant));
    found.ok_or_else(|| SolverError { name: name.to_owned() })
}

/// All solvers and what they do, a line each, for `--help`.
pub fn summaries() -> String {
    let line = |entry: &SolverEntry| format!("{:<16} {}", entry.name, entry.summary);
    REGISTRY.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The names that [`find`] knows.
fn names() -> Vec<String> {
    let of = |entry: &SolverEntry| {
        let variants = entry.variants.iter().map(|variant| format!("{}:{variant}", entry.name));
        [entry.name.to_owned()].into_iter().chain(variants).collect::<Vec<_>>()
    };
    REGISTRY.iter().flat_map(of).collect()
}

/// The solver called `name`, and the one to ask in its place where it stops short: none of a variant,
/// so that one sees what that does by itself, nor where the options forbid it. Without bounds every
/// name means one linear solve, which is what the active set makes of them.
///
/// # Errors
/// There is none of that name.
pub fn solvers(
    name: &str,
    bounded: bool,
    options: &ContactOptions,
) -> Result<(BoxedSolver, Option<BoxedSolver>), SolverError> {
    let (entry, variant) = find(name)?;
    if !bounded {
        return Ok((Box::new(ActiveSet { name: "linear" }), None));
    }
    let rescuer = entry.rescuer.filter(|_| options.rescue && variant.is_empty());
    let rescuer = rescuer.map(find).transpose()?;
    let construct = |entry: &SolverEntry, variant| (entry.construct)(variant, options);
    Ok((construct(entry, variant), rescuer.map(|(entry, variant)| construct(entry, variant))))
}
