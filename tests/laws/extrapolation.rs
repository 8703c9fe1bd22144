//! What iterative solvers start from: the solutions so far, carried on in time.

use signorini::{linear::Extrapolation, petsc::Communicator};

#[test]
fn a_quadratic_evolution_is_predicted_exactly_from_uneven_times() {
    let solution = |t: f64| vec![1.0 + t * t, 3.0 * t];
    let mut extrapolation = Extrapolation::default();
    assert_eq!(extrapolation.at(0.0), None);
    for t in [0.0, 0.1, 0.3, 0.35, 0.5, 0.6] {
        extrapolation.accept(Communicator::serial(), t, solution(t));
    }
    let (found, expected) = (extrapolation.at(0.8).unwrap(), solution(0.8));
    assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-13), "{found:?}");
}

#[test]
fn a_jump_lowers_the_degree() {
    let mut extrapolation = Extrapolation::default();
    for (t, s) in [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 2.0), (4.0, 2.0)] {
        extrapolation.accept(Communicator::serial(), t, vec![s]);
    }
    assert_eq!(extrapolation.at(5.0), Some(vec![2.0]));
}
