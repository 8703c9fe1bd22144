//! The measured error of the damage against the true one.

use crate::support::{problem, run, scene, square};
use signorini::{
    accuracy::{self, Measured},
    contact::SOLVERS,
    evolution::{Outcome, RunOptions},
    petsc::Session,
};

/// The measured errors of a scene on a square of n × n cells.
fn measured(text: &str, n: usize) -> Measured {
    let (scene, session) = (scene(text), Session::start(&[]).unwrap());
    accuracy::measured_errors(&session, &scene, [&square(n); 2], &RunOptions::of(&scene), None)
        .unwrap()
}

/// A sheared square on a foundation.
fn sheared(order: u8) -> String {
    format!(
        "discretisation.displacement = {order}
         material = {{ young = 80, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = 0.01, lambda_d = 0.1, lambda_u = 2, lambda_w = 0,
                     strain_cap = 1000, threshold = 0.01, initial = 1 }}
         time = {{ end = 1, step = 0.05 }}
         boundary = [
            {{ name = 'left', displacement = ['0', '0'] }},
            {{ name = 'bottom', gap = '0' }},
            {{ name = 'right', traction = ['-10', '-10'] }},
         ]"
    )
}

/// ‖ζ − ζ_fine‖ / ‖1 − ζ_fine‖ by the vertices of 4n × 4n cells, ζ being affine on the triangles of
/// n × n cells.
fn true_error(n: usize, coarse: &Outcome, fine: &Outcome) -> f64 {
    let (zeta, fine) = (&coarse.last.state.zeta, &fine.last.state.zeta);
    let interpolated = |i: usize, j: usize| {
        let [column, row] = [i, j].map(|k| (k / 4).min(n - 1));
        let [x, y] = [(i, column), (j, row)].map(|(k, cell)| k as f64 / 4.0 - cell as f64);
        let corner = |dx: usize, dy: usize| zeta[(row + dy) * (n + 1) + column + dx];
        let middle = if x > y { corner(1, 0) } else { corner(0, 1) };
        let (far, near) = (x.min(y), 1.0 - x.max(y));
        near * corner(0, 0) + (1.0 - far - near) * middle + far * corner(1, 1)
    };
    let mut sums = [0.0; 2];
    for (node, fine) in fine.iter().enumerate() {
        let (i, j) = (node % (4 * n + 1), node / (4 * n + 1));
        let inside = |k: usize| if k == 0 || k == 4 * n { 0.5 } else { 1.0 };
        let weight = inside(i) * inside(j);
        sums[0] += weight * (interpolated(i, j) - fine).powi(2);
        sums[1] += weight * (1.0 - fine).powi(2);
    }
    (sums[0] / sums[1]).sqrt()
}

#[test]
fn the_error_of_the_damage_is_measured_within_a_factor_of_two() {
    for n in [10, 16] {
        let fine = run(&problem(square(4 * n), &sheared(2)).unwrap(), SOLVERS[0]);
        for order in [1, 2] {
            let coarse = run(&problem(square(n), &sheared(order)).unwrap(), SOLVERS[0]);
            let error = measured(&sheared(order), n).damage.unwrap();
            let truth = true_error(n, &coarse, &fine);
            println!("n = {n}, order {order}: {error:.3e} for {truth:.3e}, {:.2}", error / truth);
            assert!((0.5..2.0).contains(&(error / truth)), "n = {n}: {error} is not {truth}");
        }
    }
}

#[test]
fn the_bar_of_the_time_of_failure_covers_the_mesh() {
    let failing = |order: u8| {
        format!(
            "discretisation.displacement = {order}
             material = {{ young = 80, poisson = 0.3, plane = 'stress' }}
             damage = {{ diffusion = 0.01, lambda_d = 0.1, lambda_u = 100, lambda_w = 0,
                         strain_cap = 1000, threshold = 0.01, initial = 1 }}
             time = {{ end = 0.06, step = 2.5e-4 }}
             boundary = [
                {{ name = 'left', displacement = ['0', '0'] }},
                {{ name = 'bottom', gap = '0' }},
                {{ name = 'right', traction = ['-10', '-10'] }},
             ]"
        )
    };
    let stop = |n: usize, order: u8| {
        let outcome = run(&problem(square(n), &failing(order)).unwrap(), SOLVERS[0]);
        outcome.stopped.expect("ζ_* is reached")
    };
    let fine = stop(32, 2);
    for (n, order) in [(8, 1), (8, 2), (16, 1), (16, 2)] {
        let (coarse, bar) = (stop(n, order), measured(&failing(order), n).stop.unwrap());
        let off = (coarse.time - fine.time).abs();
        println!("n = {n}, order {order}: {off:.1e} off, bar {bar:.1e}");
        assert!(off > coarse.uncertainty, "the bar of the steps would do: {coarse:?}");
        assert!(off < bar + coarse.uncertainty + fine.uncertainty, "{off} off, not {bar}");
        assert!(bar < 8.0 * off, "a bar of {bar} for {off} says nothing");
    }
}

/// A bound that says nothing, or is no bound, is not shown beside a measured error.
#[test]
fn a_measured_error_stands_alone_unless_a_proof_says_more() {
    let line = |measured: f64, bound: Option<f64>, reservations: &[&'static str]| {
        let mut budget = signorini::evolution::ErrorBudget::default();
        (budget.displacement_mesh, budget.displacement_bound) = (0.02, bound);
        budget.reservations = reservations.to_vec();
        budget.set_measured(measured);
        budget
            .lines(None)
            .0
            .iter()
            .filter(|line| line.contains("mesh: u "))
            .cloned()
            .collect::<Vec<_>>()
    };
    let measured = "from the mesh: u 2.3 % (measured, energy norm)";
    for (bound, reservations) in
        [(Some(2.35), &["x"][..]), (Some(2.35), &[]), (Some(0.5), &["x"]), (None, &["x"])]
    {
        let shown = line(0.023, bound, reservations);
        assert_eq!(shown, [measured], "{bound:?}");
    }
    let proved = "from the mesh: u at most 3.0 % (proved, energy norm)";
    assert_eq!(line(0.023, Some(0.03), &[]), [measured, proved]);
    assert!(line(0.0, Some(2.35), &[])[1].contains("u no useful bound (235 %)"));
    assert!(line(0.0, Some(2.35), &["x"])[1].contains("u 235 % by a bound without proof: x"));
}
