//! The contact solvers and the one table of them.
//!
//! To add a solver, write a file that implements [`ContactSolver`] and defines a [`SolverEntry`]. In this
//! file add its `mod` line, its entry in [`REGISTRY`] and, if it has options, a field of [`ContactOptions`].

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
use std::rc::Rc;

/// The prefix of PETSc options for linear systems with K.
pub const PREFIX: &str = "elastic_";

/// A method for the contact problem. It keeps nothing between solves.
///
/// To write one in a crate of your own, implement this trait and hand it to a
/// [`Simulation`](crate::estimate::Simulation): the certificate checks its answers, and bars, accuracy and restart work
/// as with ours; `examples/own_solver.rs` does so. A solver of this crate is a file of `src/contact/solvers` and a line of
/// [`REGISTRY`]: the command line, `compare` and the tests then know it.
pub trait ContactSolver {
    /// Its name in a scene and for `--solver`.
    fn name(&self) -> &'static str;

    /// Solves from the start `c` and replaces it by the solution. `elastic` solves linear systems with K; its
    /// factor may be that of an earlier K. `warm` is the warm start that the method left in the last solve
    /// (an active set, a parameter), empty at first.
    ///
    /// # Errors
    /// The method stopped above the tolerance, or PETSc failed.
    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError>;
}

/// A contact solver that several runs share.
pub type SharedSolver = Rc<dyn ContactSolver>;

/// The contact solver of a run: a name of [`REGISTRY`], perhaps with a variant, or a solver of another author.
#[derive(Clone)]
pub enum ChosenSolver {
    /// The solver of this name.
    Named(String),
    /// A solver that another author wrote.
    Own(SharedSolver),
}

/// The cost of a contact solve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactReport {
    /// Iterations of the method itself.
    pub iterations: usize,
    /// Iterations of linear solvers inside, each a pair of triangular solves.
    pub linear_iterations: usize,
    /// Factorisations of our own factor. Those of a preconditioner that PETSc options choose are not counted.
    pub factorisations: usize,
    /// How often another solver replaced the method.
    pub fallbacks: usize,
    /// The solver that computed the answer in place of the chosen one.
    pub rescued_by: Option<&'static str>,
    /// Mean contraction of the multiplier's change per iteration, for a fixed-point method.
    pub contraction: Option<f64>,
    /// ω of penalty-duality, Pa/m.
    pub omega: Option<f64>,
    /// Calls of TAO that reported convergence although the KKT residuals were too large.
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
        let detail = solve.gave_up.map_or_else(
            || {
                "the stiffness of its linear system is not positive definite, or too ill-conditioned for the \
                 tolerance"
                    .to_owned()
            },
            |reason| format!("PETSc's KSP ended with {reason} above its tolerance"),
        );
        let stopped = || ContactError::stopped(method, *self, Kkt::UNKNOWN, &detail);
        solve.converged.then_some(()).ok_or_else(stopped)
    }

    /// Adds the cost of a further solve of the same problem.
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

/// An entry of the table of solvers.
pub struct SolverEntry {
    /// Its name in a scene and for `--solver`.
    pub name: &'static str,
    /// Its line in `--help`.
    pub summary: &'static str,
    /// Its variants, written `name:VARIANT`.
    pub variants: &'static [&'static str],
    /// The solver that replaces it if it stops above the tolerance.
    pub rescuer: Option<&'static str>,
    /// Makes a solver; the text is the variant, or empty.
    pub construct: fn(&str, &ContactOptions) -> SharedSolver,
}

/// All contact solvers, the default first.
pub const REGISTRY: &[SolverEntry] =
    &[active_set::ACTIVE_SET, penalty_duality::PENALTY_DUALITY, tao::TAO];

/// Their names.
pub const SOLVERS: [&str; REGISTRY.len()] = {
    let (mut names, mut i) = ([""; REGISTRY.len()], 0);
    while i < names.len() {
        names[i] = REGISTRY[i].name;
        i += 1;
    }
    names
};

/// There is no contact solver of that name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no contact solver `{0}`{known}", known = suggestion(.0, &names()))]
pub struct SolverError(pub String);

/// `[contact]` of a scene: how the contact problem is solved.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactOptions {
    /// The solver's name, if the scene asks for one.
    pub solver: Option<String>,
    /// Relative tolerance of the KKT residuals, in (0, 1).
    pub tolerance: f64,
    /// May another solver replace one that stops above the tolerance?
    pub rescue: bool,
    /// Parameters of the penalty-duality method.
    pub penalty_duality: PenaltyOptions,
}

impl ContactOptions {
    /// The name of the solver: the one asked for, or the default.
    pub fn solver_name(&self) -> &str {
        self.solver.as_deref().unwrap_or(SOLVERS[0])
    }
}

impl Default for ContactOptions {
    fn default() -> Self {
        let penalty_duality = PenaltyOptions::default();
        Self { solver: None, tolerance: 1e-10, rescue: true, penalty_duality }
    }
}

/// The solver `name` and its variant, the text behind a colon.
///
/// # Errors
/// There is no solver of this name.
pub fn find(name: &str) -> Result<(&'static SolverEntry, &str), SolverError> {
    let (solver, variant) = name.split_once(':').unwrap_or((name, ""));
    let known = |entry: &&SolverEntry| {
        entry.name == solver && (name == solver || entry.variants.contains(&variant))
    };
    let found = REGISTRY.iter().find(known).map(|entry| (entry, variant));
    found.ok_or_else(|| SolverError(name.to_owned()))
}

/// The names that [`find`] knows.
fn names() -> Vec<String> {
    let of = |entry: &SolverEntry| {
        let variants = entry.variants.iter().map(|variant| format!("{}:{variant}", entry.name));
        [entry.name.to_owned()].into_iter().chain(variants).collect::<Vec<_>>()
    };
    REGISTRY.iter().flat_map(of).collect()
}

/// The chosen solver, then the one that replaces it if it stops above the tolerance: for a solver of another author
/// the default one. A variant has no replacement, so that its own result is seen, and `rescue = false` forbids one.
/// Without bounds every choice means one linear solve, by the active set method.
///
/// # Errors
/// There is none of that name.
pub fn solvers(
    chosen: &ChosenSolver,
    has_bounds: bool,
    options: &ContactOptions,
) -> Result<Vec<SharedSolver>, SolverError> {
    let named = |name| find(name).map(|(entry, variant)| (entry.construct)(variant, options));
    let (solver, rescuer) = match chosen {
        ChosenSolver::Own(solver) => (Rc::clone(solver), Some(SOLVERS[0])),
        ChosenSolver::Named(name) => {
            let (entry, variant) = find(name)?;
            (named(name)?, entry.rescuer.filter(|_| variant.is_empty()))
        }
    };
    if !has_bounds {
        return Ok(vec![Rc::new(ActiveSet { name: "linear" })]);
    }
    let rescuer = rescuer.filter(|_| options.rescue).map(named).transpose()?;
    Ok([solver].into_iter().chain(rescuer).collect())
}
