//! The builder of a run.

use super::estimated;
use crate::{
    contact::ContactSolver,
    evolution::{Observer, Outcome, RunError, RunOptions, RunState, Step, all_steps},
    model::DamageSource,
    observe::ObservedProblem,
    petsc::Session,
};

/// A run of Problem VP^hk, with contact solver and damage source of one's choice. The program itself starts its runs so.
///
/// ```no_run
/// # use signorini::{contact::ContactSolver, estimate::Simulation, model::DamageSource};
/// # use signorini::{evolution::{RunError, Step}, petsc::Session, observe::ObservedProblem};
/// # fn run(problem: ObservedProblem, own_solver: Box<dyn ContactSolver>, own_law: Box<dyn DamageSource>)
/// # -> Result<(), RunError> {
/// let session = Session::start(&[])?;
/// let outcome = Simulation::new(&problem)
///     .solver(own_solver) // or .solver_named("tao")
///     .law(own_law)
///     .observer(&mut |step: &Step| {
///         println!("t = {}: min ζ = {}", step.record.time, step.record.zeta_min);
///         Ok(())
///     })
///     .run(&session)?;
/// # Ok(())
/// # }
/// ```
pub struct Simulation<'a> {
    problem: &'a ObservedProblem,
    run_options: RunOptions,
    observer: Option<&'a mut dyn Observer>,
    saved: Option<RunState>,
    bounds_error: bool,
}

impl<'a> Simulation<'a> {
    /// A run with the contact solver of the scene, or the default one, and the paper's damage source.
    pub fn new(problem: &'a ObservedProblem) -> Self {
        let run_options = RunOptions::of(problem.scene());
        Self { problem, run_options, observer: None, saved: None, bounds_error: false }
    }

    /// Takes a contact solver of another author. Its answers are certified as ours are, and the default solver gives the
    /// answer of a step that it misses, unless the scene says `contact.rescue = false`.
    #[must_use]
    pub fn solver(self, solver: Box<dyn ContactSolver>) -> Self {
        Self { run_options: self.run_options.solver(solver), ..self }
    }

    /// Takes the contact solver of this name, see [`REGISTRY`](crate::contact::REGISTRY).
    #[must_use]
    pub fn solver_named(self, name: &str) -> Self {
        Self { run_options: self.run_options.solver_named(name), ..self }
    }

    /// Takes a damage source of another author. The scene must have `[damage]`, whose constants the source may use, and
    /// `[time]`; otherwise the run is refused.
    #[must_use]
    pub fn law(self, source: Box<dyn DamageSource>) -> Self {
        Self { run_options: self.run_options.law(source), ..self }
    }

    /// Takes the contact solver and the damage source of another run.
    #[must_use]
    pub fn run_options(self, run_options: &RunOptions) -> Self {
        Self { run_options: run_options.clone(), ..self }
    }

    /// Adds the observer, which sees every accepted step, and may keep checkpoints and end the run.
    #[must_use]
    pub fn observer(self, observer: &'a mut dyn Observer) -> Self {
        Self { observer: Some(observer), ..self }
    }

    /// Starts from a checkpoint, of a run with the same problem and run_options.
    #[must_use]
    pub fn resume(self, saved: RunState) -> Self {
        Self { saved: Some(saved), ..self }
    }

    /// Also proves a bound on the error of u from the mesh, which takes a linear solve and about five passes over the mesh.
    #[must_use]
    pub fn bound(self) -> Self {
        Self { bounds_error: true, ..self }
    }

    /// Solves the problem, and estimates the errors of the answer at the end. Collective.
    ///
    /// # Errors
    /// See [`RunError`]; every accepted step has been seen by then.
    pub fn run(self, session: &Session) -> Result<Outcome, RunError> {
        let Self { problem, run_options, observer, saved, bounds_error } = self;
        let mut ignore = |_: &Step| Ok(());
        let observer = observer.unwrap_or(&mut ignore);
        let run = all_steps(session, problem, &run_options, observer, saved, &[])?;
        estimated(run, bounds_error)
    }
}
