//! Anderson's acceleration, on maps whose fixed points are known.

use nalgebra::{DMatrix, DVector};
use signorini::{contact::Anderson, petsc::Communicator};

#[test]
fn solves_an_affine_map_in_as_many_steps_as_unknowns() {
    // T(q) = Mq + b with a spectral radius of 0.99: plain iteration needs over 2000 steps.
    let m = DMatrix::from_row_slice(3, 3, &[0.9, 0.3, 0.0, -0.3, 0.9, 0.1, 0.0, 0.1, -0.8]);
    let b = DVector::from_row_slice(&[1.0, 2.0, 3.0]);
    let mut anderson = Anderson::new(Communicator::serial(), [1.0, 2.0, 0.5].into_iter());
    let mut q = vec![0.0; 3];
    for _ in 0..5 {
        let image = &m * DVector::from_row_slice(&q) + &b;
        q = anderson.next(&q, image.as_slice().to_vec());
    }
    let image = &m * DVector::from_row_slice(&q) + &b;
    let error = (image - DVector::from_row_slice(&q)).norm();
    assert!(error < 1e-12, "residual {error}");
}

#[test]
fn an_overshoot_restarts_from_the_mean() {
    let mut anderson = Anderson::new(Communicator::serial(), [1.0].into_iter());
    assert_eq!(anderson.next(&[0.0], vec![1e-3]), vec![1e-3]);
    assert_eq!(anderson.next(&[1.0], vec![3.0]), vec![2.0]);
}
