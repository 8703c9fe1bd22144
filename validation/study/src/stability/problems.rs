//! What the maps solve, how, and how far two answers are apart.

use crate::StudyError;
use signorini::{
    estimate::Simulation,
    evolution::{ContactStep, ObservedProblem, Outcome, RunError, RunOptions, SetupError, Step},
    mesh::Mesh,
    petsc::Session,
    scene::Scene,
};
use std::path::Path;

/// What the scenes have in common.
const HEAD: &str = r#"
mesh = { file = "study.msh" }
material = { young = 80, poisson = 0.3, plane = "stress" }
"#;

/// Square clamped left, pressed down on the left half of its top and pulled up on the right.
pub const PRESSED_AND_LIFTED: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = 0 },
    { name = "top", traction = [0, "-15 + 25*max(-1, min(1, 1e6*(x - 0.5)))"] },
]
"#;

/// The boundaries of Example I: clamped left, sheared on the right, on the foundation.
pub const EXAMPLE_I: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "right", traction = [-10, -10] },
    { name = "bottom", gap = 0 },
]
"#;

/// The scene `text`, without its mesh and material, on `mesh`; `set` overrides keys.
///
/// # Errors
/// The scene is wrong or does not fit the mesh.
pub fn problem(mesh: Mesh, text: &str, set: &[String]) -> Result<ObservedProblem, SetupError> {
    let mut scene = Scene::parse(&format!("{HEAD}{text}"), Path::new("study.toml"), set)?;
    // The maps show where each solver fails by itself.
    scene.contact.rescue = false;
    ObservedProblem::new(scene, mesh)
}

/// As [`problem`], on the unit square in n × n cells.
///
/// # Errors
/// See [`problem`].
pub fn square(n: usize, text: &str, set: &[String]) -> Result<ObservedProblem, SetupError> {
    problem(Mesh::rectangle(1.0, 1.0, n, n), text, set)
}

/// A whole run.
///
/// # Errors
/// See [`RunError`].
pub fn run(
    session: &Session,
    problem: &ObservedProblem,
    solver: &str,
) -> Result<Outcome, RunError> {
    Simulation::new(problem).solver_named(solver).run(session)
}

/// One static solve, from a first guess of the active nodes if there is one; the inner error
/// is the contact solver's.
///
/// # Errors
/// What no contact solver is to blame for.
pub fn solve(
    session: &Session,
    problem: &ObservedProblem,
    solver: &str,
    guess: Option<&[f64]>,
) -> Result<Result<Step, RunError>, StudyError> {
    let mut contact_step =
        ContactStep::new(session, problem, &RunOptions::of(problem.scene()).solver_named(solver))?;
    if let Some(guess) = guess {
        contact_step.set_warm_start(guess);
    }
    match contact_step.solve(0, problem.scene().start(), &problem.initial_damage()) {
        Ok(step) => Ok(Ok(step)),
        Err(failure @ RunError::Contact { .. }) => Ok(Err(failure)),
        Err(other) => Err(other.into()),
    }
}

/// max |a − b| / max |b|; 0 for equal ones, also where both are 0.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    if a == b {
        return 0.0;
    }
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest(b)
}

/// max |v|.
pub fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, v| m.max(v.abs()))
}
