//! Stresses at the nodes: exact if uniform, of a higher order than the stresses of the triangles elsewhere, and
//! discontinuous where materials meet.

use crate::support::{
    ORDERS, bent, close, distorted, largest, layered, moved, order, problem, run, square, turn,
    unstructured,
};
use signorini::{
    contact::SOLVERS,
    evolution::ObservedProblem,
    mesh::{Mesh, Order},
    observe::{NodalStress, principal, principal_direction},
};
use std::f64::consts::FRAC_PI_2;

const YOUNG: f64 = 50.0;
const POISSON: f64 = 0.3;

/// Prescribed displacements on all sides of a square, without a load.
fn prescribed(mesh: Mesh, degree: Order, plane: &str, [x, y]: [&str; 2]) -> ObservedProblem {
    let degree = if degree == Order::Linear { 1 } else { 2 };
    let sides = ["left", "right", "top", "bottom"];
    let sides = sides.map(|name| format!("{{ name = '{name}', displacement = ['{x}', '{y}'] }}"));
    let text = format!(
        "discretisation.displacement = {degree}
         material = {{ young = {YOUNG}, poisson = {POISSON}, plane = '{plane}' }}
         boundary = [{}]",
        sides.join(", ")
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// The points and their stresses in the solution of a static problem.
fn stresses(problem: &ObservedProblem) -> Vec<([f64; 2], [f64; 4])> {
    let state = run(problem, SOLVERS[0]).last.state;
    let nodal = problem.nodal_stress();
    let stresses = nodal.stresses(&NodalStress::strained(problem, &state), None).unwrap();
    nodal.places().into_iter().zip(stresses).collect()
}

#[test]
fn a_uniform_stress_is_exact_at_every_node_and_sigma_zz_is_that_of_plane_strain() {
    for order in ORDERS {
        for (plane, modulus, nu, out) in [
            ("stress", YOUNG, POISSON, 0.0),
            ("strain", YOUNG / (1.0 - POISSON * POISSON), POISSON / (1.0 - POISSON), POISSON),
        ] {
            for mesh in [square(1), distorted(4), unstructured(0.3)] {
                let problem = prescribed(mesh, order, plane, ["0.1*x + 0.04*y", "-0.02*y"]);
                let factor = modulus / (1.0 - nu * nu);
                let (xx, yy) = (factor * (0.1 - nu * 0.02), factor * (-0.02 + nu * 0.1));
                let xy = 0.5 * modulus / (1.0 + nu) * 0.04;
                for (at, found) in stresses(&problem) {
                    let expected = [xx, yy, xy, out * (xx + yy)];
                    let off: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
                    assert!(largest(&off) < 1e-8, "{found:?}, not {expected:?}, at {at:?}");
                }
            }
        }
    }
}

/// σ_xx at the nodes for u = (sin 2x cos 3y, 0). The stresses of the triangles have the order of the degree.
#[test]
fn nodal_stresses_converge_faster_than_those_of_the_triangles() {
    // −div σ = (μ Δ + (λ+μ) ∂xx, (λ+μ) ∂xy) u, plane stress.
    let mu = 0.5 * YOUNG / (1.0 + POISSON);
    let lambda = YOUNG * POISSON / (1.0 - POISSON * POISSON);
    let force = [
        format!("{}*sin(2*x)*cos(3*y)", mu * 13.0 + 4.0 * (lambda + mu)),
        format!("{}*cos(2*x)*sin(3*y)", 6.0 * (lambda + mu)),
    ];
    let sizes = [0.1, 0.05, 0.025];
    for degree in [1, 2] {
        let errors = sizes.map(|size| {
            let sides = ["left", "right", "top", "bottom"].map(|name| {
                format!("{{ name = '{name}', displacement = ['sin(2*x)*cos(3*y)', 0] }}")
            });
            let text = format!(
                "discretisation.displacement = {degree}
                 material = {{ young = {YOUNG}, poisson = {POISSON}, plane = 'stress' }}
                 body.force = ['{}', '{}']
                 boundary = [{}]",
                force[0],
                force[1],
                sides.join(", ")
            );
            let problem = problem(unstructured(size), &text).unwrap_or_else(|e| panic!("{e}"));
            let off: Vec<f64> = stresses(&problem)
                .into_iter()
                .map(|([x, y], stress)| {
                    let strain = 2.0 * (2.0 * x).cos() * (3.0 * y).cos();
                    stress[0] - YOUNG / (1.0 - POISSON * POISSON) * strain
                })
                .collect();
            let mean = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
            [largest(&off), mean]
        });
        let [most, mean] = [0, 1].map(|k| order(&sizes, &errors.map(|errors| errors[k])));
        println!("P{degree}: largest and mean {errors:?}, orders {most:.2} and {mean:.2}");
        let degree = f64::from(degree);
        assert!(
            mean > degree + 0.6 && most > 0.8 * degree,
            "P{degree}: {most:.2}, {mean:.2}: {errors:?}"
        );
    }
}

/// A quarter of a ring with radii 1 and 2 under a pressure of 1 in its bore (Lamé): σ_r = (1 − 4/r²)/3 and
/// σ_θ = (1 + 4/r²)/3.
#[test]
fn nodal_stresses_of_a_ring_under_pressure_converge_to_those_of_lame() {
    let ring = |[x, y]: [f64; 2]| {
        let (s, c) = (FRAC_PI_2 * y).sin_cos();
        [(1.0 + x) * c, (1.0 + x) * s]
    };
    let sizes = [0.1, 0.05, 0.025];
    for (degree, fits) in [(1, 1.5), (2, 2.5)] {
        let errors = sizes.map(|size| {
            let mesh = unstructured(size);
            let mesh = if degree == 1 { moved(mesh, ring) } else { bent(&mesh, ring) };
            let text = format!(
                "discretisation.displacement = {degree}
                 material = {{ young = {YOUNG}, poisson = {POISSON}, plane = 'stress' }}
                 [[boundary]]
                 name = 'left'
                 pressure = 1
                 [[boundary]]
                 name = 'bottom'
                 symmetry = true
                 [[boundary]]
                 name = 'top'
                 symmetry = true"
            );
            let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
            let off = |([x, y], stress): ([f64; 2], [f64; 4])| {
                let square = x * x + y * y;
                let [radial, hoop] = [-4.0, 4.0].map(|sign| (1.0 + sign / square) / 3.0);
                let [cc, ss, cs] = [x * x, y * y, x * y].map(|product| product / square);
                let xx = cc * radial + ss * hoop - stress[0];
                let yy = ss * radial + cc * hoop - stress[1];
                largest(&[xx, yy, cs * (radial - hoop) - stress[2]])
            };
            let off: Vec<f64> = stresses(&problem).into_iter().map(off).collect();
            let mean = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
            [largest(&off), mean]
        });
        let [most, mean] = [0, 1].map(|k| order(&sizes, &errors.map(|errors| errors[k])));
        println!("P{degree}: largest and mean {errors:?}, orders {most:.2} and {mean:.2}");
        let converges = mean > fits && most > fits - 0.6;
        assert!(converges, "P{degree}: {most:.2}, {mean:.2}: {errors:?}");
    }
}

#[test]
fn where_two_materials_meet_each_has_its_own_stress() {
    for degree in [1, 2] {
        // The interface is straight.
        let straight = |[x, y]: [f64; 2]| [x, if (y - 0.5).abs() < 0.06 { 0.5 } else { y }];
        let mesh = layered(moved(distorted(6), straight));
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = {YOUNG}, poisson = 0, plane = 'stress', upper.young = 100 }}
             boundary = [
                {{ name = 'left', displacement = [0, 'free'] }},
                {{ name = 'right', displacement = ['0.1', 'free'] }},
                {{ name = 'bottom', displacement = ['free', 0] }},
             ]"
        );
        // ε_xx = 0.1 everywhere.
        let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
        let mut found = stresses(&problem);
        found.retain(|(at, _)| at[1] == 0.5);
        assert_eq!(found.len(), 2 * (6 * degree + 1), "every node of the interface twice");
        for expected in [5.0, 10.0] {
            let own = found.iter().filter(|(_, stress)| (stress[0] - expected).abs() < 1e-8);
            assert_eq!(own.count(), 6 * degree + 1, "σ_xx = {expected} at every node: {found:?}");
        }
    }
}

#[test]
fn principal_stresses_and_the_direction_of_the_larger_one() {
    // Turned by 30° from (3, -1).
    let (sine, cosine) = (0.5, 0.75_f64.sqrt());
    let (xx, yy) = (3.0 * cosine * cosine - sine * sine, 3.0 * sine * sine - cosine * cosine);
    let stress = [xx, yy, 4.0 * sine * cosine, 0.0];
    let ([first, second], [x, y]) = (principal(stress), principal_direction(stress));
    close(first, 3.0, 1e-14);
    close(second, -1.0, 1e-14);
    close(x, cosine, 1e-14);
    close(y, sine, 1e-14);
}

/// Under a strip of pressure, −σ₂ is largest at the surface of the strip, and bounded at its ends: σ depends on the angle there.
#[test]
fn stresses_do_not_overshoot_where_a_load_jumps() {
    for (degree, n) in [(1, 24), (2, 12)] {
        for angle in [0.0, 0.7] {
            // The end of the load is a vertex, or within an edge.
            for end in [0.5, 0.47, 0.53, 0.55] {
                let [c, s] = turn(angle, [1.0, 0.0]);
                let text = format!(
                    "discretisation.displacement = {degree}
                     material = {{ young = {YOUNG}, poisson = 0, plane = 'stress' }}
                     boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'right', symmetry = true }},
                                 {{ name = 'bottom', symmetry = true }},
                                 {{ name = 'top', pressure = 'if({c}*x + {s}*y < {end}, 1, 0)' }}]"
                );
                let mesh = moved(square(n), |x| turn(angle, x));
                let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
                let [mut near, mut far] = [0.0_f64; 2];
                for (at, stress) in stresses(&problem) {
                    let [x, y] = turn(-angle, at);
                    let is_near = (x - end).hypot(y - 1.0) < 4.0 / n as f64;
                    let size = if is_near { &mut near } else { &mut far };
                    *size = size.max(-principal(stress)[1]);
                }
                println!("P{degree}, {angle}, {end}: {near} at the jump, {far} elsewhere");
                assert!(near < 1.03 * far, "P{degree}, {angle}, {end}: {near}, {far}");
            }
        }
    }
}
