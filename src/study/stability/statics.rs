//! Static contact problems, for the maps that need no time.

use super::StudyError;
use crate::{
    contact::ContactReport,
    evolution::{ContactStep, DiscreteProblem, Phases, RunError, Step},
    petsc::Session,
    scene::Scene,
    study::rectangle,
};
use std::path::Path;

/// What these scenes have in common.
const HEAD: &str = r#"
mesh = { file = "case.msh" }
material = { young = 80, poisson = 0.3, plane = "stress" }
"#;
/// The rest of a static scene on a rectangle (width, height, cells along each).
pub(super) fn problem(
    text: &str,
    overrides: &[String],
    (width, height, nx, ny): (f64, f64, usize, usize),
) -> Result<DiscreteProblem, StudyError> {
    let scene = Scene::parse(&format!("{HEAD}{text}"), Path::new("study.toml"), overrides)?;
    Ok(DiscreteProblem::new(scene, rectangle(width, height, nx, ny))?)
}

/// One static solve, from a first guess of the pressing nodes if there is one; the inner error
/// is the contact solver's.
pub(super) fn solve(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
    guess: Option<&[f64]>,
) -> Result<Result<(Step, ContactReport), RunError>, StudyError> {
    let phases = Phases::default();
    let mut contact_step = ContactStep::new(session, problem, solver, &phases)?;
    if let Some(guess) = guess {
        contact_step.set_warm_start(guess);
    }
    match contact_step.solve(0, problem.start(), &problem.initial_damage()) {
        Ok(step) => {
            let report = step.report;
            Ok(Ok((step, report)))
        }
        Err(failure @ RunError::Contact { .. }) => Ok(Err(failure)),
        Err(other) => Err(other.into()),
    }
}

/// max |a − b| / max |b|; 0 for equal ones, also where both are 0.
pub(super) fn difference(a: &[f64], b: &[f64]) -> f64 {
    if a == b {
        return 0.0;
    }
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size
}
