//! Small copies of the maps of the atlas of failure.

mod penalty;
mod random_contact;
mod step_size;
mod tao_types;

use signorini::{
    contact::ContactReport,
    evolution::{ContactStep, DiscreteProblem, Phases, RunError, State},
    petsc::Session,
    scene::Scene,
    study::rectangle,
};
use std::path::Path;

/// The square of map 3 on n × n cells, pressed on the left and lifted on the right.
fn solve(
    session: &Session,
    n: usize,
    solver: &str,
    keys: &[String],
) -> Result<(State, ContactReport), RunError> {
    let mut scene = Scene::parse(include_str!("d40.toml"), Path::new("d40.toml"), keys).unwrap();
    // What a solver does by itself.
    scene.contact.rescue = false;
    let problem = DiscreteProblem::new(scene, rectangle(1.0, 1.0, n, n)).unwrap();
    let phases = Phases::default();
    let mut contact_step = ContactStep::new(session, &problem, solver, &phases).unwrap();
    let step = contact_step.solve(0, problem.start(), &problem.initial_damage())?;
    Ok((step.state, step.report))
}

/// max |a − b| / max |b|.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size
}
