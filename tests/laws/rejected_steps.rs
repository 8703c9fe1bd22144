//! A rejected step leaves no trace: the steps after it are those that would have followed without it.

use crate::support::{Random, close, difference, distorted, history, problem, same_iterations};
use signorini::{
    contact::SOLVERS,
    estimate::Simulation,
    evolution::{ContactStep, ObservedProblem, RunError, RunOptions, Step},
    petsc::Session,
};

/// Pressed on a wavy foundation until t = 1, harder on the left; then torn off it on the right.
/// Where the left is an axis, only contact supports the body.
fn scene(left: &str, iterations: &str) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 100, poisson = 0.3, plane = 'strain' }}
         time = {{ end = 2, step = 0.1 }}
         contact.penalty_duality.iterations = {iterations}
         boundary = [
            {{ name = 'left', {left} }},
            {{ name = 'bottom', gap = '0.01 + 0.01*cos(9*x)' }},
            {{ name = 'top', traction = ['0.5*t', '-3*t*(1.2 - x) + 3*max(0, t - 1)*x'] }},
         ]"
    );
    problem(distorted(8), &text).unwrap_or_else(|e| panic!("{e}"))
}

/// ζ around `mean` at the nodes.
fn zeta(problem: &ObservedProblem, mean: f64) -> Vec<f64> {
    let field = Random::new(7).field(problem.body.mesh.nodes.len());
    field.iter().map(|v| mean + 0.1 * v).collect()
}

/// Two accepted steps by one solver, with `tries` (time, ζ, whether it succeeds) made between them
/// and not accepted; the second step.
fn second_step(problem: &ObservedProblem, solver: &str, tries: &[(f64, Vec<f64>, bool)]) -> Step {
    let session = Session::start(&[]).unwrap();
    let mut contact_step =
        ContactStep::new(&session, problem, &RunOptions::of(problem.scene()).solver_named(solver))
            .unwrap();
    contact_step.solve(1, 0.9, &zeta(problem, 0.9)).unwrap();
    contact_step.accept(0.9).unwrap();
    for (time, zeta, succeeds) in tries {
        let tried = contact_step.solve(2, *time, zeta);
        match tried {
            Ok(_) => assert!(succeeds, "{solver} solved with ζ = {} …", zeta[0]),
            Err(RunError::Contact { .. }) => assert!(!succeeds, "{solver}, ζ = {} …", zeta[0]),
            Err(other) => panic!("{solver}: {other}"),
        }
    }
    contact_step.solve(2, 1.0, &zeta(problem, 0.88)).unwrap_or_else(|e| panic!("{solver}: {e}"))
}

#[test]
fn a_rejected_step_leaves_no_trace() {
    for left in ["displacement = [0, 0]", "symmetry = true"] {
        let problem = scene(left, "1000");
        // Another contact zone; a stiffness that is not positive definite; none at all.
        let torn = (1.8, zeta(&problem, 0.4), true);
        let negative = (1.0, zeta(&problem, -0.5), false);
        let none = (1.0, vec![f64::NAN; problem.body.mesh.nodes.len()], false);
        for solver in SOLVERS {
            let plain = second_step(&problem, solver, &[]);
            for tries in [
                vec![torn.clone()],
                vec![negative.clone()],
                vec![none.clone()],
                vec![none.clone(), torn.clone(), negative.clone()],
            ] {
                let step = second_step(&problem, solver, &tries);
                let active: Vec<bool> = step.state.contact.iter().map(|p| p.active).collect();
                assert!(active.iter().eq(plain.state.contact.iter().map(|p| &p.active)));
                assert!(active.contains(&true) && active.contains(&false));
                // A factor of another step may ask penalty-duality for another outer iteration.
                if solver != "penalty-duality" {
                    same_iterations(solver, step.record.iterations, plain.record.iterations);
                }
                // The factor may be of another step, which conjugate gradients make up for.
                let apart = difference(&step.state.u, &plain.state.u);
                assert!(apart < 1e-10, "{left} {solver}: {apart}");
            }
        }
    }
}

/// Sixty iterations of penalty-duality do not solve the body torn off its foundation: the active set does. The next try starts
/// with the ω of the accepted step all the same.
#[test]
fn a_rescued_step_that_is_rejected_leaves_no_trace() {
    let (solver, left) = ("penalty-duality", "displacement = [0, 0]");
    let torn = |problem: &ObservedProblem, succeeds| vec![(1.8, zeta(problem, 0.4), succeeds)];
    let alone = scene(left, "60\n contact.rescue = false");
    second_step(&alone, solver, &torn(&alone, false));
    let problem = scene(left, "60\n contact.rescue = true");
    let plain = second_step(&problem, solver, &[]);
    let step = second_step(&problem, solver, &torn(&problem, true));
    assert!(plain.report.omega.is_some() && plain.report.rescued_by.is_none());
    assert_eq!(step.report.omega, plain.report.omega);
}

/// Pressed on the foundation and let go by a solver of little patience: penalty-duality without
/// acceleration needs fewer iterations the nearer the last step is, and about 375 for one of the last
/// of a few steps, in which the foundation is nearly left.
fn released(stepping: &str, iterations: usize) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = 0.2, lambda_d = 0, lambda_u = 1, lambda_w = 0,
                     strain_cap = 1000, threshold = 0.01, initial = 1 }}
         time = {{ end = 1, {stepping} }}
         contact.rescue = false
         contact.penalty_duality = {{ omega = 666, accelerate = false, iterations = {iterations} }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = 0.1 }},
            {{ name = 'top', traction = [0, '-21 + 20*t'] }},
         ]"
    );
    problem(distorted(6), &text).unwrap_or_else(|e| panic!("{e}"))
}

/// Fewer iterations than the last of `steps` needs, but more than those before: it has not even
/// met the tolerance then.
fn patience(steps: &[Step]) -> usize {
    let (last, before) = steps.split_last().unwrap();
    let most = before.iter().map(|step| step.record.iterations).max().unwrap();
    assert!(last.record.iterations > most + 20, "there is something to fail");
    last.record.iterations - 15
}

const AUTO: &str = "step = 'auto', tolerance = 0.3";

#[test]
fn a_chosen_step_whose_contact_fails_is_tried_again_shorter() {
    let (patient, outcome) = history(&released(AUTO, 1000), "penalty-duality");
    assert_eq!(outcome.rejected, 0);
    assert!(patient.iter().any(|step| step.record.iterations > 300), "there is something to fail");
    let (steps, outcome) = history(&released(AUTO, 300), "penalty-duality");
    assert!(outcome.rejected > 0 && steps.len() > patient.len());
    assert!(steps.iter().all(|step| step.record.iterations <= 300));
    for (n, step) in steps.iter().enumerate() {
        assert_eq!(step.record.step, n, "a rejected step is not counted");
    }
    // The steps before the first failure are those of the patient run.
    let same =
        steps.iter().zip(&patient).take_while(|(a, b)| (a.state.time - b.state.time).abs() < 1e-9);
    let mut common = 0;
    for (a, b) in same {
        assert!(difference(&a.state.u, &b.state.u) < 1e-9);
        assert!(difference(&a.state.zeta, &b.state.zeta) < 1e-9);
        common += 1;
    }
    assert!(common > 2, "{common}");
    // Both come to the same end, but for the error that each step may have.
    let last = [&steps, &patient].map(|steps| steps.last().unwrap().state.clone());
    close(last[0].time, 1.0, 0.0);
    let apart = last[0].zeta.iter().zip(&last[1].zeta).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 0.01);
}

#[test]
fn a_given_step_whose_contact_fails_ends_the_run_with_the_steps_before() {
    let uniform = "step = 0.2";
    let limit = patience(&history(&released(uniform, 1000), "penalty-duality").0);
    let session = Session::start(&[]).unwrap();
    let mut times = Vec::new();
    let problem = released(uniform, limit);
    let mut keep = |step: &Step| {
        times.push(step.state.time);
        Ok(())
    };
    let run = Simulation::new(&problem).solver_named("penalty-duality").observer(&mut keep);
    let run = run.run(&session);
    assert!(matches!(run, Err(RunError::Contact { step: 5, .. })), "{run:?}");
    assert_eq!(times.len(), 5);
}
