//! A solver that stops short is rescued by another one, and the run says so.

use crate::support::{difference, problem, run, try_run};
use signorini::{contact::SOLVERS, evolution::ObservedProblem, mesh::Mesh};

/// A thin strip that contact alone keeps from sinking and tilting: its bending is very soft against its
/// other stiffness, and few iterations of penalty-duality do not get far.
fn loose_strip(rescue: bool, iterations: usize) -> ObservedProblem {
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
    assert!(notes.iter().any(|note| note.contains("active-set gave the answer")));
}

#[test]
fn a_variant_that_is_asked_for_is_not_rescued() {
    let variant = "penalty-duality:plain";
    let refused = try_run(&loose_strip(true, 20), variant).unwrap_err().to_string();
    assert!(refused.starts_with("penalty-duality stopped after"), "{refused}");
}

/// A foundation lifts a body without weight, which nothing else supports against a vertical translation. The load does
/// no work on this motion but for rounding, so that rounding decides whether it seems to drive the body down or up.
#[test]
fn a_foundation_lifts_a_body_without_weight_in_all_units_and_meshes() {
    for young in [1.0, 1e3, 1e5, 2e11] {
        for parts in [4, 10, 20] {
            let text = format!(
                "material = {{ young = {young}, poisson = 0.05, plane = 'strain' }}
                 time = {{ end = 1, step = 0.2 }}
                 contact.rescue = false
                 boundary = [
                    {{ name = 'bottom', gap = '1e-3*(1 - 2*t)' }},
                    {{ name = 'left', symmetry = true }},
                    {{ name = 'right', traction = ['-0.03*{young}*(1 - 2*t)*max(0, 1 - abs(y - 0.3)/0.3)', '0'] }},
                 ]"
            );
            let problem = problem(Mesh::rectangle(1.0, 1.0, parts, parts), &text).unwrap();
            assert!(run(&problem, SOLVERS[0]).kkt.within(problem.tolerance), "{young} {parts}");
        }
    }
}
