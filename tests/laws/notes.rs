//! What is told of an answer, or refused, besides its residuals.

use crate::support::{bent, problem, run, square, try_run};
use signorini::{
    contact::{SOLVERS, SolverError},
    estimate::Simulation,
    evolution::{ObservedProblem, RunError, SetupError},
    petsc::Session,
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

/// The square on a foundation `gap` below it, supported sideways by an axis, pressed by
/// `traction`; static.
fn pressed(gap: f64, traction: &str) -> Result<ObservedProblem, SetupError> {
    let text = format!(
        "{MATERIAL}
         boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = {gap} }},
                     {{ name = 'top', traction = [0, '{traction}'] }}]"
    );
    problem(square(4), &text)
}

#[test]
fn large_strains_rotations_and_ways_are_noted() {
    let notes = |problem: ObservedProblem| run(&problem, SOLVERS[0]).notes(&problem);
    // |∇u| = (p/E) √(1 + ν²).
    assert_eq!(notes(pressed(0.0, "-9").unwrap()), [""; 0]);
    let large = notes(pressed(0.0, "-10").unwrap());
    assert!(large.len() == 1 && large[0].starts_with("|∇u| exceeds 0.1 in 100 % of"), "{large:?}");
    // Ten times the body's size down to the foundation, and less than its size.
    let far = notes(pressed(10.0, "-9").unwrap());
    assert!(
        far.len() == 1 && far[0].starts_with("the largest displacement is 10.1 times"),
        "{far:?}"
    );
    assert_eq!(notes(pressed(0.9, "-9").unwrap()), [""; 0]);
    // E in Pa beside N and mm divides displacements by 1e6.
    assert_eq!(notes(pressed(0.0, "-1e-3").unwrap()), [""; 0]);
    let hardly = notes(pressed(0.0, "-1e-9").unwrap());
    assert!(
        hardly.len() == 1 && hardly[0].contains("is only 1e-11 of the body's size"),
        "{hardly:?}"
    );
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
fn materials_of_very_different_stiffness_are_blamed_for_rounding() {
    let scene = |young: &str, tolerance: &str| {
        let mut mesh = square(8);
        let is_low = |t: &[usize; 3]| t.iter().all(|&node| mesh.nodes[node][1] < 0.51);
        let low = (0..mesh.triangles.len()).filter(|&t| is_low(&mesh.triangles[t])).collect();
        mesh.surfaces = [("soil".to_owned(), low)].into();
        let text = format!(
            "material = {{ young = 30e9, poisson = 0.2, plane = 'strain', soil = {{ young = {young} }} }}
             contact = {{ rescue = false, tolerance = {tolerance} }}
             boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = 0 }},
                         {{ name = 'top', traction = [0, '-1e-3*x'] }}]"
        );
        problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
    };
    let names = "3e10 Pa in [material], 3e2 Pa in [material.soil]";
    let contrast = scene("300", "1e-10");
    let before = contrast.notes();
    assert!(before.len() == 1 && before[0].contains(names), "{before:?}");
    let after = run(&contrast, SOLVERS[0]).notes(&contrast);
    let of_residuals = after.iter().find(|note| note.contains("KKT residuals")).expect("a note");
    assert!(of_residuals.contains(names) && !of_residuals.contains("longer"), "{of_residuals}");
    let refused = try_run(&scene("300", "9e-11"), SOLVERS[0]).expect_err("rounding").to_string();
    for fragment in [names, "check the units of both"] {
        assert!(refused.contains(fragment) && !refused.contains("mesh"), "{refused}");
    }
    // Concrete on clay.
    assert_eq!(scene("3e6", "1e-10").notes(), [""; 0]);
}

#[test]
fn what_the_nodes_miss_of_a_displacement_or_the_initial_damage_is_noted() {
    let notes = |initial: &str, displacement: &str| {
        let text = format!(
            "{MATERIAL}
             time = {{ end = 1, step = 0.5 }}
             damage = {{ diffusion = 1, lambda_d = 0, lambda_u = 1, lambda_w = 0, strain_cap = 1,
                         threshold = 0.01, initial = '{initial}' }}
             boundary = [{{ name = 'left', displacement = [0, 0] }},
                         {{ name = 'top', displacement = ['free', '{displacement}'] }}]"
        );
        let notes = problem(square(8), &text).unwrap_or_else(|e| panic!("{e}")).notes();
        notes.into_iter().filter(|note| note.contains("varies within")).collect::<Vec<_>>()
    };
    for (initial, displacement) in
        [("1", "0"), ("1 - 0.5*x", "-0.01*x"), ("1 - 0.1*x*y", "-0.01*x^2*(1 + sin(t))")]
    {
        assert_eq!(notes(initial, displacement), [""; 0], "{initial} {displacement}");
    }
    // Between the nodes at 0 and 1/8; ∫(1 − ζ) = 0.9 · 0.005 √π.
    let [damage] = &notes("1 - 0.9*exp(-((x - 0.06)/0.005)^2)", "0")[..] else { panic!("one") };
    assert!(
        damage.contains("∫(1 − ζ) is 0.000e0 on this mesh, integrated finely 7.97"),
        "{damage}"
    );
    let [missed] = &notes("1", "-0.01*exp(-((x - 0.56)/0.005)^2)")[..] else { panic!("one") };
    let told = ["boundary \"top\"", "near (0.5625, 1.0000): up to 1.0e-2 m", "of 1.0e-2 at most"];
    assert!(told.iter().all(|told| missed.contains(told)), "{missed}");
}

#[test]
fn an_answer_without_any_motion_is_noted_and_the_end_of_a_cycle_is_not() {
    let damaged = |load: &str, damage: &str| {
        let text = format!(
            "{MATERIAL}
             {damage}
             time = {{ end = 1, step = 0.25 }}
             boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = 0 }},
                         {{ name = 'top', traction = [0, '{load}'] }}]"
        );
        problem(square(4), &text).unwrap()
    };
    let in_time = |load: &str| damaged(load, "");
    let notes = |problem: ObservedProblem| run(&problem, SOLVERS[0]).notes(&problem);
    for still in [pressed(1.0, "0").unwrap(), in_time("0")] {
        let notes = notes(still);
        assert!(notes.len() == 1 && notes[0].starts_with("nothing moves:"), "{notes:?}");
    }
    assert_eq!(notes(in_time("-min(t, 1 - t)")), [""; 0]);
    // The body breaks in the first step, before the load has moved it.
    let breaks = "damage = { diffusion = 1, lambda_d = 1, lambda_u = 0, initial = 0.1 }";
    let broken = damaged("-t", breaks);
    let outcome = run(&broken, SOLVERS[0]);
    assert!(outcome.stopped.is_some() && outcome.last.record.step == 0);
    assert!(!outcome.notes(&broken).iter().any(|note| note.contains("nothing moves")));
}

#[test]
fn a_foundation_that_overlaps_the_body_is_named() {
    let [note] = &pressed(-0.05, "-1").unwrap().notes()[..] else { panic!("one note") };
    assert!(note.contains("up to 5.000e-2 m inside the foundation of `bottom`"), "{note}");
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
        let noted = notes.iter().any(|note| note.contains("curved sides are taken as straight"));
        assert_eq!(noted, told, "{notes:?}");
    }
}

#[test]
fn steps_by_another_solver_are_noted() {
    let problem = pressed(0.0, "-1").unwrap();
    let mut outcome = run(&problem, SOLVERS[0]);
    assert!(outcome.rescued.is_none() && outcome.remarks(&problem).is_empty());
    outcome.rescued = Some((1, "tao".to_owned()));
    let [note] = &outcome.notes(&problem)[..] else { panic!("one note") };
    assert_eq!(
        note,
        "in 1 step the contact solver missed its tolerance, and tao gave the answer (explain solvers)"
    );
}

#[test]
fn an_unknown_solver_is_an_error() {
    let (session, problem) = (Session::start(&[]).unwrap(), pressed(0.0, "-1").unwrap());
    for name in ["simplex", "active-set:tron", "tao:", ""] {
        let run = Simulation::new(&problem).solver_named(name).run(&session);
        assert!(matches!(&run, Err(RunError::Solver(SolverError(n))) if n == name));
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
fn what_is_odd_in_a_scene_is_noted_and_nothing_else() {
    let clamped =
        |more: &str| format!("{more}\nboundary = [{{ name = 'left', displacement = [0, 0] }}]");
    let units = |stress: &str| {
        clamped(&format!("units = {{ length = 'mm', force = 'N', stress = '{stress}' }}"))
    };
    let loaded = |load: &str| {
        format!(
            "time = {{ end = 1, step = 0.02 }}
             boundary = [{{ name = 'bottom', displacement = [0, 0] }},
                         {{ name = 'top', traction = [0, '{load}'] }}]"
        )
    };
    let damage = "damage = { diffusion = 1, lambda_d = 0, lambda_u = 1, initial = 0.5 }";
    for (scene, told) in [
        (units("MPa"), ""),
        (units("N/mm²"), ""),
        (units("GPa"), "N/mm² is 1e-3 GPa"),
        (units("N/m²"), "N/mm² is 1e6 N/m²"),
        (units("kN/cm^2"), "N/mm² is 1e-1 kN/cm^2"),
        (units("N/mm^2"), ""),
        (units("psi"), ""),
        (clamped(damage), "[damage] has no effect without [time]"),
        // A pulse between two steps, and waves of the length of a step.
        (loaded("if(t > 0.301 and t < 0.302, -4, 0)"), "change within a time step"),
        (loaded("-4*sin(50*pi*t)^2"), "change within a time step"),
        // A ramp, a slow wave, and a jump at the end of a step.
        (loaded("-4*t"), ""),
        (loaded("-4*sin(pi*t)"), ""),
        (loaded("if(t < 0.5, 0, -4)"), ""),
    ] {
        let problem = problem(square(4), &format!("{MATERIAL}\n{scene}"));
        let notes = problem.unwrap_or_else(|e| panic!("{e}")).notes();
        let is_told = notes.len() == usize::from(!told.is_empty());
        assert!(is_told && notes.iter().all(|note| note.contains(told)), "{scene}: {notes:?}");
    }
}

#[test]
fn an_error_that_main_returns_is_printed_as_its_message() {
    let driven = pressed(0.0, "1").unwrap_err();
    let own = RunError::from(pressed(0.0, "1").unwrap_err());
    for (printed, message) in
        [(format!("{driven:?}"), driven.to_string()), (format!("{own:?}"), own.to_string())]
    {
        assert_eq!(printed, message);
        assert!(message.contains("nothing supports the body"), "{message}");
    }
}
