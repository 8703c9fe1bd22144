//! The shipped Hertz scene against the half-space theory of line contact.

use crate::support::{close_to, order, run, shipped, shipped_with};
use signorini::contact::SOLVERS;
use std::f64::consts::PI;

/// a(u, u)^½ of the fine answers below.
const ENERGY_NORM: f64 = 127.60;

#[test]
fn a_disc_on_a_plane_has_the_pressure_of_hertz() {
    // a = √(4FR/(πE*)), p₀ = √(FE*/(πR)), p(x) = p₀ √(1 − x²/a²), E* = E/(1−ν²): the
    // plane is rigid. F = 35 kN per mm of the whole disc.
    // The quadratic elements have larger triangles.
    let scenes = [
        &["discretisation.displacement=1"][..],
        &["discretisation.displacement=2", "mesh.size=0.008"],
    ];
    for sets in scenes {
        let problem = shipped("hertz", sets);
        let material = problem.scene().material;
        let (force, radius) = (35e6, 0.05);
        let e = material.young / (1.0 - material.poisson * material.poisson);
        let half_width = (4.0 * force * radius / (PI * e)).sqrt();
        let peak = (force * e / (PI * radius)).sqrt();
        assert!((half_width - 5.382e-3).abs() < 1e-6 && (peak - 4140e6).abs() < 1e6);

        for solver in SOLVERS {
            let last = run(&problem, solver).last;
            // Vertical equilibrium of the half that is modelled.
            close_to(last.record.contact_force, 0.5 * force, 1e-9);

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
            close_to(most, peak, 0.01);
            close_to(edge, half_width, 0.02);
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

/// The energy ½a(u, u) − f(u), N m per metre of thickness, and the estimated relative error of u, on a
/// mesh of which all edges are proportional to `size`.
fn energy(size: f64, degree: u8) -> [f64; 2] {
    let sets = [format!("mesh.size={size}"), format!("discretisation.displacement={degree}")];
    let growth = format!("{} * (sqrt", 25.0 * size);
    let sets = [&sets[0], &sets[1], "mesh.parameters.grading=25"];
    let problem = shipped_with("hertz", &sets, ["0.2 * (sqrt", &growth]);
    let outcome = run(&problem, SOLVERS[0]);
    let (body, u) = (&problem.body, &outcome.last.state.u);
    let zeta = problem.zeta_at_points(&outcome.last.state.zeta);
    let energies: f64 = problem.elasticity.energies(body, &zeta, u).iter().sum();
    let load = problem.loads.at(body, 1.0);
    let work: f64 = load.iter().zip(u).map(|(f, u)| f * u).sum();
    [0.5 * energies - work, outcome.errors.displacement_mesh]
}

#[test]
fn the_disc_converges_with_the_order_of_the_element_on_its_curved_boundary() {
    // The energy of u_h exceeds that of u by ½‖u − u_h‖², but for what contact adds at its edge.
    let [fine, _] = energy(0.004, 2);
    for (degree, sizes) in [(1, [0.016, 0.008, 0.004]), (2, [0.016, 0.0113, 0.008])] {
        let errors = sizes.map(|size| {
            let [energy, estimate] = energy(size, degree);
            let error = (2.0 * (energy - fine)).sqrt() / ENERGY_NORM;
            let ratio = estimate / error;
            println!("P{degree}, size {size}: {estimate:.2e} estimated, {error:.2e} true");
            assert!((0.7..1.4).contains(&ratio), "P{degree}, size {size}: {ratio:.3}");
            error
        });
        let order = order(&sizes, &errors);
        println!("P{degree}: order {order:.3}");
        assert!((order - f64::from(degree)).abs() < 0.2, "{order}: {errors:?}");
    }
}
