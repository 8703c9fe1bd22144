//! The estimated error of the time steps is the true one where that is known: in a body with the same
//! strain everywhere ζ is uniform and obeys an ordinary differential equation.

use crate::support::{distorted, history, problem, run, shipped};
use signorini::{contact::SOLVERS, evolution::DiscreteProblem};

/// A square with these laws of damage and supports, in uniform two-step backward differences.
fn uniform(damage: &str, boundary: &str) -> DiscreteProblem {
    let text = format!(
        "material = {{ young = 100, poisson = 0, plane = 'stress' }}
         damage = {{ diffusion = 1, lambda_w = 0, strain_cap = 1000, threshold = 0.01,
                     initial = 1, {damage} }}
         time = {{ end = 1, step = 0.04, scheme = 'bdf2' }}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'bottom', symmetry = true }},
            {boundary}
         ]"
    );
    problem(distorted(2), &text).unwrap_or_else(|e| panic!("{e}"))
}

/// The estimated error of the damage over the true one, where ζ(1) = `exact`.
fn estimated_over_true(problem: &DiscreteProblem, exact: f64) -> f64 {
    let (steps, outcome) = history(problem, SOLVERS[0]);
    let last = steps.last().unwrap().record;
    assert!((last.zeta_mean - last.zeta_min).abs() < 1e-12 && last.time == 1.0);
    let error = (last.zeta_mean - exact).abs() / (1.0 - exact);
    let ratio = outcome.errors.damage_steps.unwrap() / error;
    println!("ζ = {exact}, error {error:.2e}, estimated over true: {ratio:.3}");
    ratio
}

/// ζ(1) from ζ(0) = 1 and ζ' = `rate`(t, ζ), by Runge and Kutta's fourth-order method.
fn integrated(rate: impl Fn(f64, f64) -> f64) -> f64 {
    const STEPS: usize = 1000;
    let k = 1.0 / STEPS as f64;
    (0..STEPS).fold(1.0, |z, n| {
        let t = n as f64 * k;
        let a = rate(t, z);
        let b = rate(t + 0.5 * k, z + 0.5 * k * a);
        let c = rate(t + 0.5 * k, z + 0.5 * k * b);
        let d = rate(t + k, z + k * c);
        z + k / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    })
}

/// A prescribed strain ε_xx.
fn stretched(strain: &str) -> String {
    format!("{{ name = 'right', displacement = ['{strain}', 'free'] }}")
}

#[test]
fn errors_that_add_up_or_grow_are_estimated() {
    let strain = |t: f64| 0.05 * (1.0 - (-12.0 * t).exp());
    let stress = |t: f64| 5.0 * (1.0 - (-12.0 * t).exp());
    let load = "{ name = 'right', traction = ['5*(1 - exp(-12*t))', 0] }".to_owned();
    let cases = [
        // ε = 0.05 t², ζ' = −½ λ_U ε²: no error of an early step changes what later ones add, and so little
        // damage is done that none is taken to grow.
        ("lambda_d = 0, lambda_u = 40", stretched("0.05*t^2"), 1.0 - 0.05 / 5.0, 0.9..=1.1),
        // ζ' = −(λ_D (1 − ζ)/ζ + ½ λ_U ε²) under a strain that comes early and stays: errors grow with the
        // damage itself.
        (
            "lambda_d = 1.2, lambda_u = 80",
            stretched("0.05*(1 - exp(-12*t))"),
            integrated(|t, z| -(1.2 * (1.0 - z) / z + 40.0 * strain(t).powi(2))),
            0.8..=1.25,
        ),
        // A stress σ that comes early and stays: ε = σ/(E ζ), ζ' = −½ λ_U ε². Errors grow, as the load strains a
        // weaker body more.
        (
            "lambda_d = 0, lambda_u = 210",
            load,
            integrated(|t, z| -105.0 * (0.01 * stress(t) / z).powi(2)),
            0.8..=1.25,
        ),
    ];
    for (damage, boundary, exact, expected) in cases {
        let ratio = estimated_over_true(&uniform(damage, &boundary), exact);
        assert!(expected.contains(&ratio), "{damage}: {ratio}");
    }
}

/// At the singular end of its contact the source is far larger than the damage that diffusion leaves there.
#[test]
fn the_error_is_known_where_a_singular_point_drives_the_damage() {
    let [coarse, fine] =
        ["time.step=0.02", "time.step=0.0025"].map(|step| shipped("lshape", &[step]));
    let estimated = run(&coarse, SOLVERS[0]);
    let exact = run(&fine, SOLVERS[0]).last.state.zeta;
    let norm = |values: &mut dyn Iterator<Item = f64>| -> f64 {
        coarse.body.vertices.weights.iter().zip(values).map(|(w, v)| w * v * v).sum::<f64>().sqrt()
    };
    let error = norm(&mut estimated.last.state.zeta.iter().zip(&exact).map(|(a, b)| a - b));
    let ratio =
        estimated.errors.damage_steps.unwrap() * norm(&mut exact.iter().map(|z| 1.0 - z)) / error;
    assert!((0.7..1.5).contains(&ratio), "estimated over true: {ratio:.2}");
}
