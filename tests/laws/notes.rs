//! What is told of an answer, or refused, besides its residuals.

use crate::support::{bent, problem, run, square};
use signorini::{
    contact::{SOLVERS, SolverError},
    evolution::{self, DiscreteProblem, Phases, RunError, SetupError},
    petsc::Session,
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

/// The square on a foundation `gap` below it, supported sideways by an axis, pressed by
/// `traction`; static.
fn pressed(gap: f64, traction: &str) -> Result<DiscreteProblem, SetupError> {
    let text = format!(
        "{MATERIAL}
         boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = {gap} }},
                     {{ name = 'top', traction = [0, '{traction}'] }}]"
    );
    problem(square(4), &text)
}

#[test]
fn large_strains_and_rotations_are_noted_and_long_ways_are_not() {
    let notes = |problem: DiscreteProblem| run(&problem, SOLVERS[0]).notes(&problem);
    // |∇u| = (p/E) √(1 + ν²).
    assert_eq!(notes(pressed(0.0, "-9").unwrap()), [""; 0]);
    let large = notes(pressed(0.0, "-10").unwrap());
    assert!(large.len() == 1 && large[0].starts_with("|∇u| exceeds 0.1 in 100 % of"), "{large:?}");
    // Ten times the body's size down to the foundation.
    assert_eq!(notes(pressed(10.0, "-9").unwrap()), [""; 0]);
    // A linearised rotation of θ has |∇u| = √2 θ, whatever the strain.
    for (angle, told) in [(0.07, 0), (0.0708, 1)] {
        let turned = format!(
            "{MATERIAL}
             boundary = [{{ name = 'left', displacement = ['-{angle}*y', '{angle}*x'] }},
                         {{ name = 'right', displacement = ['-{angle}*y', '{angle}*x'] }}]"
        );
        let notes = notes(problem(square(4), &turned).unwrap());
        assert_eq!(notes.iter().filter(|n| n.contains("|∇u|")).count(), told, "{angle}: {notes:?}");
    }
}

#[test]
fn a_traction_narrower_than_the_edges_is_noted() {
    // Of 4 edges; the Gauss points next to ½ are 0.053 from it. A hat of half width w.
    let notes = |traction: &str| pressed(0.0, traction).unwrap().notes();
    let [note] = &notes("-100*max(0, 1 - abs(x - 0.5)/0.05)")[..] else { panic!("one note") };
    let told = "the traction of boundary \"top\" varies within the mesh's edges: its resultant on \
                this mesh is (0.0000e0, 0.0000e0) N/m, integrated finely (0.0000e0, -4.99";
    assert!(note.starts_with(told) && note.ends_with("; refine there"), "{note}");
    // Balanced, of no resultant in truth; smooth on the mesh; constant.
    assert_eq!(notes("-1 - cos(8*pi*(x - 0.0528))").len(), 1);
    for resolved in ["-1 - x^3", "-1 - sin(2*pi*x)", "-2"] {
        assert_eq!(notes(resolved), [""; 0], "{resolved}");
    }
    // It runs over the top and is 0 at first.
    let running = "-t*max(0, 1 - abs(x - t)/0.05)";
    let text = format!(
        "{MATERIAL}
         time = {{ end = 1, step = 0.1 }}
         boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = 0 }},
                     {{ name = 'top', traction = [0, '{running}'] }}]"
    );
    let notes = problem(square(4), &text).unwrap().notes();
    // It also runs on within the steps.
    let told = ["change within a time step", " N/m at t = "];
    assert_eq!(notes.len(), told.len(), "{notes:?}");
    assert!(told.iter().all(|told| notes.iter().any(|note| note.contains(told))), "{notes:?}");
}

#[test]
fn curved_sides_that_order_1_does_not_follow_are_noted() {
    for (order, told) in [(1, true), (2, false)] {
        let text = format!(
            "discretisation.displacement = {order}\n{MATERIAL}\n\
             boundary = [{{ name = 'left', displacement = [0, 0] }}]"
        );
        let mesh = bent(&square(2), |[x, y]| [x, y + 0.1 * x * x]);
        let notes = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}")).notes();
        let noted = notes.iter().any(|note| note.contains("curved sides count as straight"));
        assert_eq!(noted, told, "{notes:?}");
    }
}

#[test]
fn damage_without_time_is_noted() {
    let text = format!(
        "{MATERIAL}
         damage = {{ diffusion = 1, lambda_d = 0, lambda_u = 1, lambda_w = 0, strain_cap = 1,
                     threshold = 0.01, initial = 0.5 }}
         boundary = [{{ name = 'left', displacement = [0, 0] }}]"
    );
    let notes = problem(square(2), &text).unwrap().notes();
    assert!(notes.len() == 1 && notes[0].starts_with("[damage] without [time]"), "{notes:?}");
}

#[test]
fn steps_off_the_fast_path_are_noted() {
    let problem = pressed(0.0, "-1").unwrap();
    let mut outcome = run(&problem, SOLVERS[0]);
    assert!(outcome.fallbacks == 0 && outcome.rescued.is_none());
    outcome.fallbacks = 3;
    let [note] = &outcome.remarks(&problem)[..] else { panic!("one remark") };
    assert!(note.starts_with("in 3 steps the contact solver left its fast path"), "{note}");
    outcome.rescued = Some((1, "tao".to_owned()));
    let [note] = &outcome.notes(&problem)[..] else { panic!("one note") };
    assert_eq!(
        note,
        "in 1 step the contact solver stopped short of the tolerance, and tao gave the answer in \
         its place"
    );
}

#[test]
fn an_unknown_solver_is_an_error() {
    let (session, problem) = (Session::start(&[]).unwrap(), pressed(0.0, "-1").unwrap());
    for name in ["simplex", "active-set:tron", "tao:", ""] {
        let run = evolution::run(&session, &problem, name, &Phases::default(), &mut |_| Ok(()));
        assert!(matches!(&run, Err(RunError::Solver(SolverError { name: n })) if n == name));
    }
}

#[test]
fn a_static_scene_is_judged_at_its_only_time() {
    // t = 1: what would lift the body or is infinite at t = 0 does not matter.
    assert!(pressed(0.0, "1 - 2*t").is_ok());
    assert!(pressed(0.0, "-1/t").is_ok());
    assert!(matches!(pressed(0.0, "-1 + 2*t"), Err(SetupError::Driven { time: 1.0, .. })));
    let refused = pressed(0.0, "-1/(1 - t)").unwrap_err().to_string();
    assert!(
        refused.contains("traction[1] is -inf at") && refused.contains(", t = 1\n"),
        "{refused}"
    );
}

#[test]
fn what_happens_within_a_uniform_step_is_noted() {
    let note = |load: &str| {
        let text = format!(
            "material = {{ young = 200, poisson = 0.3, plane = 'stress' }}
             time = {{ end = 1, step = 0.02 }}
             boundary = [
                {{ name = 'bottom', displacement = [0, 0] }},
                {{ name = 'top', traction = ['0', '{load}'] }},
             ]"
        );
        let problem = problem(square(4), &text).unwrap_or_else(|e| panic!("{e}"));
        problem.notes().iter().any(|note| note.contains("change within a time step"))
    };
    // A pulse between two steps, and waves of the length of a step.
    assert!(note("if(t > 0.301 and t < 0.302, -4, 0)"));
    assert!(note("-4*sin(50*pi*t)^2"));
    // A ramp, a slow wave, and a jump at the end of a step.
    assert!(!note("-4*t"));
    assert!(!note("-4*sin(pi*t)"));
    assert!(!note("if(t < 0.5, 0, -4)"));
}
