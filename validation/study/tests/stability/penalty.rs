//! Penalty-duality: its automatic ω, its λω, its acceleration.

use super::solve;
use signorini::petsc::Session;
use signorini_study::stability::problems::difference;

fn keys(omega: f64, lambda_omega: f64, accelerate: bool) -> Vec<String> {
    [
        format!("omega={omega:e}"),
        format!("lambda_omega={lambda_omega}"),
        format!("accelerate={accelerate}"),
        "iterations=600".to_owned(),
    ]
    .map(|key| format!("contact.penalty_duality.{key}"))
    .to_vec()
}

#[test]
fn the_automatic_omega_is_near_the_best_and_anderson_is_faster() {
    let session = Session::start(&[]).unwrap();
    let found = solve(&session, 16, "penalty-duality", &[]).unwrap();
    let automatic = found.report.omega.unwrap();
    let mut at_automatic = Vec::new();
    for accelerate in [false, true] {
        let count = |power: i32| {
            let keys = keys(automatic * 10f64.powf(0.5 * f64::from(power)), 0.5, accelerate);
            solve(&session, 16, "penalty-duality", &keys).map_or(600, |step| step.report.iterations)
        };
        let best = (-4..=4).map(count).min().unwrap();
        at_automatic.push(count(0));
        assert!(count(0) <= 3 * best, "{} against {best}", count(0));
    }
    assert!(2 * at_automatic[1] < at_automatic[0], "{at_automatic:?}");
}

#[test]
fn no_lambda_gives_a_wrong_answer() {
    let session = Session::start(&[]).unwrap();
    let exact = solve(&session, 8, "active-set", &[]).unwrap();
    for lambda_omega in [0.1, 0.3, 0.5, 0.7, 0.9] {
        for omega in [1.0, 1e3, 1e6] {
            let keys = keys(omega, lambda_omega, false);
            if let Ok(step) = solve(&session, 8, "penalty-duality", &keys) {
                assert!(
                    difference(&step.state.u, &exact.state.u) < 1e-8,
                    "ω {omega}, λω {lambda_omega}"
                );
            }
        }
    }
}
