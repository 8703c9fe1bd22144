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

use super::{ContactError, ContactProblem};
use crate::{
    cholesky::{Factor, LinearSolver},
    petsc::{Session, Vector},
    suggestion::suggestion,
};
use active_set::ActiveSet;
use serde::Deserialize;

/// A method for the contact problem.
pub trait ContactSolver {
    /// The name a scene or `--solver` calls it by.
    fn name(&self) -> &'static str;

    /// What the method keeps for the next solve besides `c` (a set, a multiplier), as numbers.
    fn warm_start(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Goes back to an earlier [`Self::warm_start`], as if the solves since then had not been;
    /// with nothing, to that of a new solver.
    fn set_warm_start(&mut self, _kept: &[f64]) {}

    /// The factor that it keeps from solve to solve, if it does: with the warm start all that a
    /// checkpoint needs.
    fn factor(&mut self) -> Option<&mut Factor> {
        None
    }

    /// The solver of linear systems with K, of an earlier ζ and another active set, if the method keeps one.
    fn into_linear_solver(self: Box<Self>) -> Option<LinearSolver> {
        None
    }

    /// Solves from the start `c` and leaves the solution there.
    ///
    /// # Errors
    /// The method stopped short of the tolerance, or PETSc failed.
    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError>;
}

/// A solver of one kind or another.
pub type BoxedSolver<'s> = Box<dyn ContactSolver + 's>;

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
    pub construct: for<'s> fn(&'s Session, &str, &ContactOptions) -> BoxedSolver<'s>,
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
pub fn solvers<'s>(
    session: &'s Session,
    name: &str,
    bounded: bool,
    options: &ContactOptions,
) -> Result<(BoxedSolver<'s>, Option<BoxedSolver<'s>>), SolverError> {
    let (entry, variant) = find(name)?;
    if !bounded {
        return Ok((Box::new(ActiveSet::new(session, "linear")), None));
    }
    let rescuer = entry.rescuer.filter(|_| options.rescue && variant.is_empty());
    let rescuer = rescuer.map(find).transpose()?;
    let construct = |entry: &SolverEntry, variant| (entry.construct)(session, variant, options);
    Ok((construct(entry, variant), rescuer.map(|(entry, variant)| construct(entry, variant))))
}
