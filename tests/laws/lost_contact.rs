//! Bodies about to lose their contact: pulled off, resting on one point, about to tip over.

use crate::support::{close, difference, problem, run, square};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, Outcome, SetupError},
};

/// A square without Γ_D over `gap`, pressed on top by 1 with the resultant at x = ½ + e.
fn eccentric(gap: &str, e: f64) -> Result<ObservedProblem, SetupError> {
    eccentric_with(gap, e, false)
}

fn eccentric_with(gap: &str, e: f64, rescue: bool) -> Result<ObservedProblem, SetupError> {
    let load = format!("-1 - 12*({e:e})*(x - 0.5)");
    let text = format!(
        "contact.rescue = {rescue}
         material = {{ young = 1e4, poisson = 0.3, plane = 'stress' }}
         boundary = [{{ name = 'bottom', gap = '{gap}' }},
                     {{ name = 'top', traction = [0, '{load}'] }}]"
    );
    problem(square(10), &text)
}

/// Touches the foundation at the middle of the foot only.
const CURVED: &str = "0.1*(x - 0.5)^2";

/// Σ p and Σ p x of the contact forces.
fn reaction(problem: &ObservedProblem, outcome: &Outcome) -> [f64; 2] {
    let nodes = &problem.body.mesh.nodes;
    outcome.last.state.contact.iter().fold([0.0; 2], |[force, moment], point| {
        [force + point.force, moment + point.force * nodes[point.node][0]]
    })
}

#[test]
fn a_resultant_within_the_foot_stands_and_one_beyond_its_edge_is_refused() {
    for e in [0.0, 0.3, 0.5 - 1e-6, 0.5, -0.5] {
        assert!(eccentric("0", e).is_ok(), "{e}");
    }
    for (e, edge) in [(0.5 + 1e-6, "(1.0000,"), (0.6, "(1.0000,"), (-0.6, "(0.0000,")] {
        let refusal = eccentric("0", e).unwrap_err().to_string();
        assert!(refusal.contains(&format!("the rotation about {edge}")), "{refusal}");
        assert!(refusal.contains("resultant (0.0000e0, -1.0000e0)"), "{refusal}");
    }
}

#[test]
fn contact_forces_balance_the_force_and_the_moment_of_the_load() {
    for (gap, e) in [("0", 0.0), ("0", 0.3), ("0", -0.45), (CURVED, 0.02), (CURVED, 1e-6)] {
        let problem = eccentric(gap, e).unwrap();
        let [force, moment] = reaction(&problem, &run(&problem, SOLVERS[0]));
        close(force, 1.0, 1e-9);
        close(moment, 0.5 + e, 1e-9);
    }
}

#[test]
fn all_solvers_agree_on_a_body_that_partly_lifts_off() {
    let problem = eccentric("0", 0.3).unwrap();
    let answers = SOLVERS.map(|solver| run(&problem, solver));
    let open = answers[0].last.state.contact.iter().filter(|point| !point.active).count();
    assert!(open > 0, "the foot lifts off on one side");
    for other in &answers[1..] {
        let apart = difference(&other.last.state.u, &answers[0].last.state.u);
        assert!(apart < 1e-8, "{apart}");
        assert!(other.notes(&problem).is_empty());
    }
}

#[test]
fn a_body_balanced_on_one_point_or_on_its_edge_is_noted() {
    for (gap, e, pivot) in [(CURVED, 0.0, "(0.5000,"), ("0", 0.5, "(1.0000,")] {
        for solver in SOLVERS {
            // The fixed point of penalty-duality is slow where nothing stops the rotation: another solver may answer for it.
            let problem = eccentric_with(gap, e, solver == "penalty-duality").unwrap();
            let outcome = run(&problem, solver);
            let mut notes = outcome.notes(&problem);
            notes.retain(|note| !note.contains("gave the answer"));
            assert_eq!(notes.len(), 1, "{solver}: {notes:?}");
            assert!(notes[0].starts_with("no contact force acts against"), "{}", notes[0]);
            assert!(notes[0].contains(&format!("the rotation about {pivot}")), "{}", notes[0]);
        }
    }
}

#[test]
fn a_load_beside_the_only_point_turns_the_body_onto_the_next() {
    // Two supports 0.1 apart: the second carries e/0.1, and the body turns until its gap, 0.001,
    // is closed: by 0.01, less what the indentation of the first support (1e-4) spares it.
    for e in [1e-7, 1e-5, 1e-3, 0.05] {
        let problem = eccentric(CURVED, e).unwrap();
        let outcome = run(&problem, SOLVERS[0]);
        assert!(outcome.notes(&problem).is_empty() && outcome.last.record.fallbacks == 0);
        for point in &outcome.last.state.contact {
            let x = problem.body.mesh.nodes[point.node][0];
            let force = match (10.0 * (x - 0.5)).round() as i32 {
                0 => 1.0 - 10.0 * e,
                1 => 10.0 * e,
                _ => 0.0,
            };
            close(point.force, force, 1e-9);
        }
        let u = |node: usize| outcome.last.state.u[2 * node + 1];
        // The top corners, a unit apart.
        close(u(110) - u(120), 0.01, 1.5e-3);
    }
}

#[test]
fn a_note_is_given_once_with_how_often_and_when() {
    let text = "material = { young = 1e4, poisson = 0.3, plane = 'stress' }
         time = { end = 1, step = 0.25 }
         boundary = [{ name = 'bottom', gap = '0.1*(x - 0.5)^2' },
                     { name = 'top', traction = [0, '-t'] }]";
    let problem = problem(square(10), text).unwrap();
    let notes = run(&problem, SOLVERS[0]).notes(&problem);
    // Without load, at t = 0, the body rests.
    assert!(notes.len() == 1 && notes[0].contains("in 4 steps (t = 0.25 to 1)"), "{notes:?}");
}
