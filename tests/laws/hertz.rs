//! The shipped Hertz scene against the half-space theory of line contact.

use crate::support::{close_relative, order, run, shipped, shipped_with};
use signorini::contact::SOLVERS;
use std::f64::consts::PI;

/// a(u, u)^½ of the fine answers below.
const ENERGY_NORM: f64 = 127.60;

/// The force on the whole disc, N per metre of thickness, and its radius, m.
const FORCE: f64 = 35e6;
const RADIUS: f64 = 0.05;

/// a = √(4FR/(πE*)) and p₀ = √(FE*/(πR)) of p(x) = p₀ √(1 − x²/a²), E* = E/(1−ν²): the plane is rigid.
fn theory(e: f64) -> [f64; 2] {
    [(4.0 * FORCE * RADIUS / (PI * e)).sqrt(), (FORCE * e / (PI * RADIUS)).sqrt()]
}

#[test]
fn a_disc_on_a_plane_has_the_pressure_of_hertz() {
    // The quadratic elements have larger triangles.
    let scenes = [
        &["discretisation.displacement=1"][..],
        &["discretisation.displacement=2", "mesh.size=0.008"],
    ];
    for sets in scenes {
        let problem = shipped("hertz", sets);
        let material = problem.scene().material;
        let [half_width, peak] = theory(material.young / (1.0 - material.poisson.powi(2)));
        assert!((half_width - 5.382e-3).abs() < 1e-6 && (peak - 4140e6).abs() < 1e6);

        for solver in SOLVERS {
            let last = run(&problem, solver).last;
            // Vertical equilibrium of the half that is modelled.
            close_relative(last.record.contact_force, 0.5 * FORCE, 1e-9);

            let mut points: Vec<_> = (last.state.contact.iter())
                .map(|point| (problem.body.nodes.points[point.node][0], point))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let most = points.iter().map(|(_, p)| p.pressure).fold(0.0, f64::max);
            let end = points.iter().position(|(_, p)| !p.active).unwrap();
            assert!(points[end..].iter().all(|(_, p)| !p.active), "one piece of contact");
            // The edge of contact is between the last node that presses and the next.
            let edge = 0.5 * (points[end - 1].0 + points[end].0);
            println!(
                "{sets:?}, {solver}: p₀ {:.4}, a {:.4} of theory",
                most / peak,
                edge / half_width
            );
            // Half a node spacing is 1.5 % of a; R/a = 9 is no half-space: percents.
            close_relative(most, peak, 0.01);
            close_relative(edge, half_width, 0.02);
            let (mut square, mut whole) = (0.0, 0.0);
            for (x, point) in &points {
                let theory = peak * (1.0 - (x / half_width).powi(2)).max(0.0).sqrt();
                square += (point.pressure - theory).powi(2);
                whole += theory.powi(2);
            }
            let distance = (square / whole).sqrt();
            println!("{solver}: the pressures are {distance:.4} from the ellipse");
            assert!(distance < 0.01, "{solver}: {distance}");
        }
    }
}

/// An answer on a mesh of which all edges are proportional to `size`: the energy ½a(u, u) − f(u), N m per metre of thickness;
/// the estimated relative error of u; the L²(Γ_C) distance of the pressure from Hertz's ellipse over the ellipse; the largest
/// edge in contact over the half-width.
fn answer(size: f64, degree: u8) -> [f64; 4] {
    let sets = [format!("mesh.size={size}"), format!("discretisation.displacement={degree}")];
    let growth = format!("{} * (sqrt", 25.0 * size);
    let sets = [&sets[0], &sets[1], "mesh.parameters.grading=25"];
    let problem = shipped_with("hertz", &sets, ["0.2 * (sqrt", &growth]);
    let outcome = run(&problem, SOLVERS[0]);
    let (body, state) = (&problem.body, &outcome.last.state);
    let zeta = problem.zeta_at_points(&state.zeta);
    let energies: f64 = problem.elasticity.energies(body, &zeta, &state.u).iter().sum();
    let load = problem.loads.at(body, 1.0);
    let work: f64 = load.iter().zip(&state.u).map(|(f, u)| f * u).sum();

    let [half_width, peak] = theory(70e9 / (1.0 - 0.3 * 0.3));
    let (mut square, mut whole, mut longest) = (0.0, 0.0, 0.0_f64);
    for pair in problem.supports.contact.rows(body, state).0.windows(2) {
        let length = pair[1].arc_length - pair[0].arc_length;
        for row in pair {
            let theory = peak * (1.0 - (row.x / half_width).powi(2)).max(0.0).sqrt();
            square += length * (row.pressure - theory).powi(2);
            whole += length * theory.powi(2);
            // The theory is of a half-space, and R/a = 9.
            assert!(row.pressure < 1.02 * peak, "{row:?}");
        }
        if pair[0].active == 1 {
            longest = longest.max(length * f64::from(degree) / half_width);
        }
    }
    [0.5 * energies - work, outcome.errors.displacement_mesh, (square / whole).sqrt(), longest]
}

#[test]
fn the_disc_converges_with_the_order_of_the_element_on_its_curved_boundary() {
    // The energy of u_h exceeds that of u by ½‖u − u_h‖², but for what contact adds at its edge.
    let [fine, ..] = answer(0.004, 2);
    for (degree, sizes) in [(1, [0.016, 0.008, 0.004]), (2, [0.016, 0.0113, 0.008])] {
        let errors = sizes.map(|size| {
            let [energy, estimate, distance, edge] = answer(size, degree);
            let error = (2.0 * (energy - fine)).sqrt() / ENERGY_NORM;
            println!(
                "P{degree}, size {size}: {estimate:.2e} estimated, {error:.2e} true; \
                 pressure {distance:.5}, edge {edge:.4}"
            );
            let ratio = estimate / error;
            assert!((0.7..1.4).contains(&ratio), "P{degree}, size {size}: {ratio:.3}");
            // At the end of contact p ~ √r; the error of an edge there is √h on a length h, so h in L².
            assert!(distance < 0.5 * edge, "P{degree}, {size}: {distance} for {edge}");
            error
        });
        let order = order(&sizes, &errors);
        println!("P{degree}: order {order:.3}");
        assert!((order - f64::from(degree)).abs() < 0.2, "{order}: {errors:?}");
    }
}
