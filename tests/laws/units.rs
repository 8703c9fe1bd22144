//! Nothing depends on the units: the same scene in metres and pascals, in millimetres and
//! gigapascals, or made of stiffer stuff under larger loads takes the same iterations to the
//! same answer, by every solver, in the damage loop too.

use crate::support::{close, difference, distorted, history, moved, problem, same_iterations};
use signorini::{contact::SOLVERS, evolution::Step};

/// All steps of a small square that is bent down and damaged on a foundation that falls away from
/// it, with lengths in units of 1/`length` m and stresses in units of 1/`stress` Pa.
fn scene(length: f64, stress: f64, stepping: &str, solver: &str, order: u8) -> Vec<Step> {
    let text = format!(
        "discretisation.displacement = {order}
         material = {{ young = {:e}, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = {:e}, lambda_d = 0.25, lambda_u = 40, lambda_w = 0,
                     strain_cap = 1000, threshold = 0.01, initial = 1 }}
         time = {{ end = 1, {stepping} }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = '{:e}*(x/{length:e})^2*(1 - 0.5*t)' }},
            {{ name = 'top', traction = ['{:e}*t', '-{:e}*(0.2 + t)'] }},
            {{ name = 'right', pressure = '{stress:e}*if(t < 0.5, t, 1 - t)' }},
         ]",
        80.0 * stress,
        0.1 * length * length,
        0.125 * length,
        4.0 * stress,
        3.0 * stress,
    );
    let mesh = moved(distorted(8), |x| x.map(|x| length * x));
    history(&problem(mesh, &text).unwrap_or_else(|e| panic!("{e}")), solver).0
}

#[test]
fn units_do_not_matter() {
    let units = [(1e3, 1e-9), (1.0, 1e9), (1e-3, 1.0), (1.0, 1e-6)];
    for solver in SOLVERS {
        let stepping = ["step = 0.1", "step = 'auto', tolerance = 0.002"];
        for (stepping, order) in stepping.into_iter().flat_map(|s| [(s, 1), (s, 2)]) {
            let si = scene(1.0, 1.0, stepping, solver, order);
            let active = si.iter().map(|step| step.record.active_nodes);
            assert!(
                active.clone().max().unwrap() < 8 * usize::from(order) + 1
                    && active.min().unwrap() > 0
            );
            assert!(si.last().unwrap().record.zeta_min < 0.9, "the damage law is at work");
            for (length, stress) in units {
                let name =
                    format!("P{order}, {solver}, {stepping}, m * {length:e}, Pa * {stress:e}");
                let other = scene(length, stress, stepping, solver, order);
                assert_eq!(si.len(), other.len(), "{name}");
                let all = |steps: &[Step]| steps.iter().map(|s| s.record.iterations).sum();
                same_iterations(solver, all(&si), all(&other));
                for (a, b) in si.iter().zip(&other) {
                    let u: Vec<f64> = b.state.u.iter().map(|u| u / length).collect();
                    assert!(difference(&u, &a.state.u) < 1e-9, "{name}");
                    assert!(difference(&b.state.zeta, &a.state.zeta) < 1e-9, "{name}");
                    let most = a.state.contact.iter().map(|p| p.pressure).fold(0.0, f64::max);
                    for (p, q) in a.state.contact.iter().zip(&b.state.contact) {
                        close(q.pressure / stress / most, p.pressure / most, 1e-8);
                        assert_eq!(p.active, q.active, "{name}");
                    }
                }
            }
        }
    }
}
