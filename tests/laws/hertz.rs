//! The shipped Hertz scene against the half-space theory of line contact.

use crate::support::{close_to, run, shipped};
use signorini::contact::SOLVERS;
use std::f64::consts::PI;

#[test]
fn a_disc_on_a_plane_has_the_pressure_of_hertz() {
    // a = √(4FR/(πE*)), p₀ = √(FE*/(πR)), p(x) = p₀ √(1 − x²/a²), E* = E/(1−ν²): the
    // plane is rigid. F = 35 kN per mm of the whole disc.
    let problem = shipped("hertz", &[]);
    let material = problem.elasticity.material;
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
            .map(|point| (problem.body.mesh.nodes[point.node][0], point))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let most = points.iter().map(|(_, p)| p.pressure).fold(0.0, f64::max);
        let end = points.iter().position(|(_, p)| !p.active).unwrap();
        assert!(points[end..].iter().all(|(_, p)| !p.active), "one piece of contact");
        // The edge of contact is between the last node that presses and the next.
        let edge = 0.5 * (points[end - 1].0 + points[end].0);
        println!("{solver}: p₀ {:.4}, a {:.4} of theory", most / peak, edge / half_width);
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
