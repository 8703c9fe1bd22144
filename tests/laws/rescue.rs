//! A solver that stops short is rescued by another one, and the run says so.

use crate::support::{difference, problem, run, try_run};
use signorini::{
    contact::{ContactOptions, SOLVERS, solvers},
    evolution::DiscreteProblem,
    mesh::Mesh,
};

/// A thin strip that contact alone keeps from sinking and tilting: its bending is very soft against its
/// other stiffness, and few iterations of penalty-duality do not get far.
fn loose_strip(rescue: bool, iterations: usize) -> DiscreteProblem {
    let text = format!(
        "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         contact.rescue = {rescue}
         contact.penalty_duality.iterations = {iterations}
         body.force = [0, '-1e-6*(1 + x)']
         boundary = [
            {{ name = 'left', displacement = [0, 'free'] }},
            {{ name = 'bottom', gap = '1e-3*(1 + sin(x))' }},
         ]"
    );
    problem(Mesh::rectangle(20.0, 0.02, 80, 1), &text).unwrap()
}

#[test]
fn the_active_set_answers_where_others_stop_short() {
    let exact = run(&loose_strip(false, 20), SOLVERS[0]);
    let solver = "penalty-duality";
    let refused = try_run(&loose_strip(false, 20), solver).unwrap_err().to_string();
    assert!(refused.starts_with(solver), "{refused}");
    let problem = loose_strip(true, 20);
    let outcome = run(&problem, solver);
    assert!(outcome.kkt.within(problem.tolerance));
    assert!(difference(&outcome.last.state.u, &exact.last.state.u) < 1e-8);
    assert_eq!(outcome.rescued, Some((1, "active-set".to_owned())));
    let notes = outcome.notes(&problem);
    assert!(notes.iter().any(|note| note.ends_with("active-set gave the answer")));
}

#[test]
fn a_type_of_tao_that_is_asked_for_is_not_rescued() {
    let refused = try_run(&loose_strip(true, 20), "tao:blmvm").unwrap_err().to_string();
    assert!(refused.starts_with("tao:blmvm stopped after"), "{refused}");
}

#[test]
fn a_rescuer_that_stops_short_is_rescued_too_and_none_tries_twice() {
    let rescuers = |name| -> Vec<_> {
        let (_, rescuers) = solvers(name, true, &ContactOptions::default()).unwrap();
        rescuers.iter().map(|solver| solver.name().to_owned()).collect()
    };
    assert_eq!(rescuers("active-set"), ["tao"]);
    assert_eq!(rescuers("penalty-duality"), ["active-set", "tao"]);
    assert_eq!(rescuers("tao"), ["active-set"]);
    assert!(rescuers("tao:blmvm").is_empty() && rescuers("penalty-duality:plain").is_empty());
}
