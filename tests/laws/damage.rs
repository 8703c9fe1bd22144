//! The damage equation where its solution is known.

use crate::support::{
    Random, close, close_relative, distorted, history, order, problem, run, square,
};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, Outcome, Step, Stop},
    fem::{Body, DamageCertificate, DamageSystem, Mass},
    mesh::{Mesh, Order},
    petsc::Session,
};
use std::f64::consts::PI;

const YOUNG: f64 = 80.0;
const POISSON: f64 = 0.25;
const MATERIAL: &str = "material = { young = 80, poisson = 0.25, plane = 'stress' }";
/// The strain prescribed by `strained`: ε_xx = 0.02, ε_yy = −0.01, 2ε_xy = 0.03, and |ε|².
const STRAIN_SQUARED: f64 = 0.02 * 0.02 + 0.01 * 0.01 + 2.0 * 0.015 * 0.015;

/// The strain above times `factor` (an expression in t) prescribed on all sides: with a
/// uniform ζ it is the strain of the whole body.
fn strained(mesh: Mesh, factor: &str, damage: &str, step: f64) -> ObservedProblem {
    strained_of_order(1, mesh, factor, damage, step)
}

/// The same with displacements of this order.
fn strained_of_order(
    order: u8,
    mesh: Mesh,
    factor: &str,
    damage: &str,
    step: f64,
) -> ObservedProblem {
    let u = format!("['({factor})*(0.02*x + 0.02*y)', '({factor})*(0.01*x - 0.01*y)']");
    let text = format!(
        "discretisation.displacement = {order}\n{MATERIAL}\n{damage}
         time = {{ end = 1, step = {step:?}, scheme = 'euler' }}
         boundary = [
            {{ name = 'left', displacement = {u} }},
            {{ name = 'right', displacement = {u} }},
            {{ name = 'top', displacement = {u} }},
            {{ name = 'bottom', displacement = {u} }},
         ]"
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn check_uniform(step: &Step, zeta: f64) {
    for z in &step.state.zeta {
        close_relative(*z, zeta, 1e-12);
    }
}

#[test]
fn a_constant_source_is_exact_under_euler() {
    // λ_D = 0: ζ = ζ₀ − s t with s = ½λ_U min(|ε|², q*) − λ_W.
    for (cap, lambda_w) in [(1000.0, 0.0), (5e-4, 0.0), (1000.0, 0.05)] {
        let damage = format!(
            "damage = {{ diffusion = 0.3, lambda_d = 0, lambda_u = 500, lambda_w = {lambda_w},
                         strain_cap = {cap}, threshold = 0.01, initial = 0.9 }}"
        );
        let s = 250.0 * STRAIN_SQUARED.min(cap) - lambda_w;
        for order in [1, 2] {
            let problem = strained_of_order(order, distorted(4), "1", &damage, 0.1);
            let (steps, outcome) = history(&problem, SOLVERS[0]);
            assert_eq!((steps.len(), outcome.skipped_damage_solves), (11, 0));
            for step in &steps {
                check_uniform(step, 0.9 - s * step.state.time);
            }
        }
    }
}

#[test]
fn the_source_is_that_of_the_step_before() {
    // ε = t ε₀: ζ_n = ζ₀ − k ½λ_U |ε₀|² Σ_{m<n} t_m², so the first step changes nothing.
    let damage = "damage = { diffusion = 0.3, lambda_d = 0, lambda_u = 1000, lambda_w = 0,
                             strain_cap = 1000, threshold = 0.01, initial = 1 }";
    let (steps, outcome) = history(&strained(distorted(4), "t", damage, 0.125), SOLVERS[0]);
    assert_eq!(outcome.skipped_damage_solves, 1);
    let mut zeta = 1.0;
    for pair in steps.windows(2) {
        zeta -= 0.125 * 500.0 * STRAIN_SQUARED * pair[0].state.time.powi(2);
        check_uniform(&pair[1], zeta);
    }
    assert!(zeta < 0.95);
}

#[test]
fn the_run_stops_at_the_threshold_with_the_last_admissible_state() {
    // ζ = 0.9 − s t reaches ζ_* = 0.7 in the step after 0.2/s.
    let damage = "damage = { diffusion = 0.3, lambda_d = 0, lambda_u = 1000, lambda_w = 0,
                             strain_cap = 1000, threshold = 0.7, initial = 0.9 }";
    let s = 500.0 * STRAIN_SQUARED;
    let (steps, outcome) = history(&strained(square(3), "1", damage, 0.05), SOLVERS[0]);
    let first = (0.2 / s / 0.05).ceil();
    let Stop { time, zeta_min: least, .. } = outcome.stopped.unwrap();
    close(time, 0.05 * first, 1e-14);
    close(least, 0.9 - s * time, 1e-13);
    assert!(least <= 0.7);
    close(outcome.last.state.time, time - 0.05, 1e-14);
    assert_eq!(steps.last().unwrap().state.zeta, outcome.last.state.zeta);
    check_uniform(&outcome.last, 0.9 - s * (time - 0.05));
}

/// No load and λ_D = 0: ζ only diffuses from c + a cos(πx).
fn diffusing(mesh: Mesh, diffusion: f64, step: f64, mass: &str) -> ObservedProblem {
    let text = format!(
        "{MATERIAL}
         damage = {{ diffusion = {diffusion:?}, lambda_d = 0, lambda_u = 1, lambda_w = 0,
                     strain_cap = 1, threshold = 0.01, initial = '0.7 + 0.25*cos(pi*x)',
                     mass = '{mass}' }}
         time = {{ end = 1, step = {step:?}, scheme = 'euler' }}
         boundary = [{{ name = 'left', displacement = [0, 0] }}]"
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// The distance in L² of ζ from 0.7 + `amplitude` cos(πx) at the end, by nodal values.
fn distance(problem: &ObservedProblem, amplitude: f64) -> f64 {
    let outcome = run(problem, SOLVERS[0]);
    assert_eq!(outcome.skipped_damage_solves, 0, "ζ that is not uniform diffuses without a source");
    // ∫φ = 0: the mean stays.
    let initial = problem.body.mean(&problem.initial_damage());
    close(outcome.last.record.zeta_mean, initial, 1e-13);
    let error = |([x, _], z): (&[f64; 2], &f64)| (z - 0.7 - amplitude * (PI * x).cos()).powi(2);
    let nodes = problem.body.mesh.nodes.iter().zip(&outcome.last.state.zeta);
    let squares: Vec<f64> = nodes.map(error).collect();
    // The area of the square is 1.
    problem.body.mean(&squares).sqrt()
}

/// κ of the diffusion tests, m²/s: e^(−κπ²) ≈ 0.37.
const DIFFUSION: f64 = 0.1;

#[test]
fn damage_without_strain_decays_as_the_cosine_mode_with_order_one_in_time() {
    // ζ = c + a e^(−κπ²t) cos(πx), on a mesh whose own error is a few percent of the last step's.
    let steps = [0.1, 0.05, 0.025];
    let amplitude = 0.25 * (-DIFFUSION * PI * PI).exp();
    let errors = steps
        .map(|step| distance(&diffusing(square(64), DIFFUSION, step, "consistent"), amplitude));
    let order = order(&steps, &errors);
    println!("errors {errors:?}: order {order:.3} in k");
    assert!((order - 1.0).abs() < 0.05, "{order}: {errors:?}");
}

#[test]
fn damage_without_strain_decays_as_the_cosine_mode_with_order_two_in_space() {
    // Euler's N steps multiply the mode by exactly (1 + kκπ²)^−N: what is left is in h.
    let amplitude = 0.25 * (1.0 + 0.125 * DIFFUSION * PI * PI).powi(-8);
    let cells = [12, 24, 48];
    for mass in ["consistent", "lumped"] {
        let end = |n| distance(&diffusing(distorted(n), DIFFUSION, 0.125, mass), amplitude);
        let errors = cells.map(end);
        let order = order(&cells.map(|n| 1.0 / n as f64), &errors);
        println!("{mass}: errors {errors:?}: order {order:.3} in h");
        assert!((order - 2.0).abs() < 0.15, "{mass}: {order}: {errors:?}");
    }
}

/// λ_D and λ_U of the uniaxial tests, 1/s, and the pressure on the top at t = 1, Pa.
const LAMBDA_D: f64 = 0.4;
const LAMBDA_U: f64 = 90.0;
const PRESSURE: f64 = 6.0;

/// Pressed on the foundation by p = t PRESSURE, ζ₀ = 0.95, in these steps to ζ_* = `threshold`.
fn uniaxial(order: u8, mesh: Mesh, steps: &str, threshold: f64) -> ObservedProblem {
    let text = format!(
        "discretisation.displacement = {order}
         {MATERIAL}
         damage = {{ diffusion = 0.2, lambda_d = {LAMBDA_D}, lambda_u = {LAMBDA_U}, lambda_w = 0,
                     strain_cap = 1000, threshold = {threshold}, initial = 0.95 }}
         time = {{ end = 1, {steps} }}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'bottom', gap = 0 }},
            {{ name = 'top', traction = [0, '-{PRESSURE}*t'] }},
         ]"
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// ζ' = φ under σ_yy = −t PRESSURE: |ε|² = (1 + ν²)(σ/(ζE))² in plane stress.
fn rate(t: f64, zeta: f64) -> f64 {
    let strain = t * PRESSURE / (zeta * YOUNG);
    let squared = (1.0 + POISSON * POISSON) * strain * strain;
    -(LAMBDA_D * (1.0 - zeta) / zeta + 0.5 * LAMBDA_U * squared)
}

#[test]
fn uniform_stress_keeps_damage_uniform_and_follows_the_scalar_recursion() {
    // ζ_n = ζ_{n−1} + k φ(t_{n−1}, ζ_{n−1}), for every solver of the contact.
    for (solver, order) in SOLVERS.into_iter().flat_map(|solver| [(solver, 1), (solver, 2)]) {
        let (steps, _) =
            history(&uniaxial(order, distorted(4), "step = 0.05, scheme = 'euler'", 0.01), solver);
        let mut zeta = 0.95;
        for pair in steps.windows(2) {
            zeta += 0.05 * rate(pair[0].state.time, zeta);
            for z in &pair[1].state.zeta {
                // The contact is solved to 1e-10 at each of 20 steps.
                close_relative(*z, zeta, 1e-9);
            }
        }
        assert!(zeta < 0.85, "the law is at work: {zeta}");
    }
}

/// ζ' = φ from ζ₀ = 0.95 to the time `end`, by so many steps of Runge and Kutta's fourth order that it
/// is exact here.
fn exact(end: f64) -> f64 {
    let h = 1e-3 * end;
    (0..1000).fold(0.95, |z, n| {
        let t = f64::from(n) * h;
        let a = rate(t, z);
        let b = rate(t + 0.5 * h, z + 0.5 * h * a);
        let c = rate(t + 0.5 * h, z + 0.5 * h * b);
        z + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(t + h, z + h * c))
    })
}

#[test]
fn uniform_damage_converges_to_its_differential_equation_with_the_order_of_the_scheme() {
    let expected = exact(1.0);
    let outcome = |steps: &str| run(&uniaxial(1, square(2), steps, 0.01), SOLVERS[0]);
    let error = |outcome: &Outcome| (outcome.last.record.zeta_mean - expected).abs();
    for (scheme, expected) in [("euler", 1.0), ("bdf2", 2.0)] {
        let steps = [0.01, 0.005, 0.0025];
        let errors = steps.map(|k| error(&outcome(&format!("step = {k}, scheme = '{scheme}'"))));
        let order = order(&steps, &errors);
        println!("{scheme}: errors {errors:?}: order {order:.3}");
        assert!((order - expected).abs() < 0.1, "{scheme}: {order}: {errors:?}");
    }
    let chosen = [1e-3, 1e-4, 1e-5].map(|e| outcome(&format!("step = 'auto', tolerance = {e:?}")));
    let lengths = chosen.each_ref().map(|outcome| 1.0 / outcome.last.record.step as f64);
    let errors = chosen.each_ref().map(error);
    let order = order(&lengths, &errors);
    println!("chosen: 1 / {lengths:?} steps, errors {errors:?}: order {order:.3}");
    assert!((order - 2.0).abs() < 0.3, "{order}: {errors:?}");
}

#[test]
fn the_time_at_which_damage_reaches_its_threshold_is_of_second_order_too() {
    let time = 0.8;
    let error = |steps: &str| {
        let stop = run(&uniaxial(1, square(2), steps, exact(time)), SOLVERS[0]).stopped.unwrap();
        let error = (stop.time - time).abs();
        assert!(error <= stop.uncertainty, "{steps}: {stop:?}");
        error
    };
    // None of these steps ends at 0.8.
    let counts = [17.0, 34.0, 67.0];
    let errors = counts.map(|n: f64| error(&format!("step = {:?}, scheme = 'bdf2'", 1.0 / n)));
    let order = order(&counts.map(|n| 1.0 / n), &errors);
    println!("errors {errors:?}: order {order:.3}");
    assert!(order > 1.7, "{order}: {errors:?}");
}

#[test]
fn nothing_that_drives_damage_leaves_it_bit_for_bit() {
    // ½λ_U|ε|² ≤ λ_W: φ = 0, and a uniform ζ is not solved for.
    let damage = |lambda_w: f64| {
        format!(
            "damage = {{ diffusion = 0.3, lambda_d = 0, lambda_u = 100, lambda_w = {lambda_w:?},
                         strain_cap = 1000, threshold = 0.01, initial = 0.7 }}"
        )
    };
    let rate = 50.0 * STRAIN_SQUARED;
    let problem = strained(distorted(4), "t", &damage(1.01 * rate), 0.1);
    let (steps, outcome) = history(&problem, SOLVERS[0]);
    assert_eq!(outcome.skipped_damage_solves, 10);
    assert!(steps.iter().flat_map(|s| &s.state.zeta).all(|z| z.to_bits() == 0.7_f64.to_bits()));

    // With a quarter of that λ_W damage begins beyond t = ½: t_m² > 0.2525 from t_6 = 0.6 on,
    // which the steps 7 to 10 see.
    let problem = strained(distorted(4), "t", &damage(0.2525 * rate), 0.1);
    let outcome = run(&problem, SOLVERS[0]);
    assert_eq!(outcome.skipped_damage_solves, 6);
    assert!(outcome.last.record.zeta_min < 0.7);
}

#[test]
fn the_certificate_of_a_damage_step_bounds_its_error_and_catches_a_planted_one() {
    let (session, body) = (Session::start(&[]).unwrap(), Body::new(distorted(8), Order::Linear));
    let (diffusion, step) = (0.3, 0.05);
    let mut random = Random::new(3);
    let nodes = body.mesh.nodes.len();
    let before: Vec<f64> = random.field(nodes).iter().map(|v| 0.6 + 0.3 * v).collect();
    let load: Vec<f64> = random
        .field(nodes)
        .iter()
        .zip(&body.nodes.weights)
        .map(|(v, area)| -v.abs() * area)
        .collect();
    for mass in [Mass::Consistent, Mass::Lumped] {
        let mut system = DamageSystem::new(&session, &body, mass, &[diffusion], step).unwrap();
        let mut zeta = before.clone();
        assert!(system.advance(&load, &mut zeta).unwrap());
        let judge = |zeta: &[f64]| {
            DamageCertificate::of(&body, mass, &[diffusion], step, &load, [&before, zeta])
        };
        let good = judge(&zeta);
        let largest = system.largest_residual();
        assert!(good.residual < 1e-12 && good.residual < largest, "{good:?}");
        assert!(good.error < 1e-10, "{good:?}");
        // One node, or all a little.
        for (node, by) in [(Some(0), 1e-6), (Some(40), -1e-8), (None, 1e-7)] {
            let mut wrong = zeta.clone();
            (0..nodes).filter(|&i| node.is_none_or(|n| n == i)).for_each(|i| wrong[i] += by);
            let found = judge(&wrong);
            assert!(found.residual > largest, "{mass:?} {by}: {found:?}");
            let bound = found.error / by.abs();
            assert!(1.0 < bound && bound < 1e3, "{mass:?} {by}: {found:?}");
        }
        // The solution of another step, diffusion, or source.
        let other =
            DamageCertificate::of(&body, mass, &[diffusion], 1.01 * step, &load, [&before, &zeta]);
        assert!(other.residual > 1e-4, "{other:?}");
    }
}

#[test]
fn every_damage_solve_of_a_run_is_certified() {
    for (stepping, solved) in [("step = 0.1", 9), ("step = 'auto'", 20)] {
        let text = format!(
            "{MATERIAL}
             damage = {{ diffusion = 0.3, lambda_d = 0.1, lambda_u = 50, lambda_w = 0,
                         strain_cap = 1000, threshold = 0.01, initial = 1 }}
             time = {{ end = 1, {stepping} }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'right', traction = ['4*t', 0] }},
             ]"
        );
        let problem = problem(distorted(6), &text).unwrap_or_else(|e| panic!("{e}"));
        let (steps, _) = history(&problem, SOLVERS[0]);
        let records = steps.iter().map(|step| step.record);
        // The first damage step has nothing to solve.
        assert!(records.clone().filter(|r| r.zeta_residual > 0.0).count() >= solved);
        assert!(records.clone().all(|r| r.zeta_residual < 1e-12 && r.zeta_error < 1e-10));
    }
}
