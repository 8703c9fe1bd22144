//! Factors against dense algebra.

use super::*;
use nalgebra::{DMatrix, DVector};

const BOTH: [Precision; 2] = [Precision::Preconditioner, Precision::Full];

/// The part of a dense matrix that is not zero, from the diagonal down.
fn lower(a: &DMatrix<f64>) -> Lower {
    let mut lower = Lower::new();
    for j in 0..a.ncols() {
        (j..a.nrows()).filter(|&i| a[(i, j)] != 0.0).for_each(|i| lower.push(i, a[(i, j)]));
        lower.end_column();
    }
    lower
}

/// A definite matrix of rows coupled at random, `sparsity` of 8 entries missing.
fn coupled(size: usize, sparsity: usize) -> DMatrix<f64> {
    let number = |i: usize, j: usize| (i * 31 + j * 17 + i * j) % 101;
    let entry = |i: usize, j: usize| match number(i.max(j), i.min(j)) {
        n if n % 8 < sparsity => 0.0,
        n => n as f64 / 101.0 - 0.4,
    };
    let mut a = DMatrix::from_fn(size, size, entry);
    (0..size).for_each(|i| a[(i, i)] = 1.0 + a.row(i).abs().sum());
    a
}

fn factor(a: &DMatrix<f64>, precision: Precision) -> Cholesky {
    let mut cholesky = Cholesky::analyse(&mut lower(a), None, 0, precision).unwrap();
    // Twice: values are replaced, not added.
    assert!(cholesky.factorise(&mut lower(&(a * 2.0))).unwrap().is_some());
    assert!(cholesky.factorise(&mut lower(a)).unwrap().is_some());
    cholesky
}

/// max |b − A x| / max |b|.
fn left(a: &DMatrix<f64>, cholesky: &mut Cholesky, b: &DVector<f64>) -> f64 {
    let mut x = DVector::zeros(b.len());
    cholesky.triangle().forward(b.as_slice());
    cholesky.triangle().backward(x.as_mut_slice());
    (b - a * x).amax() / b.amax()
}

#[test]
fn solves_solve_whatever_the_shape_of_the_supernodes() {
    for size in (1..30).chain([100, 211]) {
        for sparsity in [0, 3, 6, 7, 8] {
            let a = coupled(size, sparsity);
            // Loads of any size: exponents of single precision end at 1e±38.
            for scale in [1.0, 1e-200, 1e200] {
                let b = DVector::from_fn(size, |i, _| scale * (i as f64 + 1.0).sin());
                for (precision, rounding) in BOTH.into_iter().zip([3e-6, 1e-14]) {
                    let left = left(&a, &mut factor(&a, precision), &b);
                    assert!(left < rounding, "{size} {sparsity} {precision:?}: {left:e}");
                }
            }
        }
    }
}

#[test]
fn halves_make_the_energy_of_the_solution() {
    // |L⁻¹Pb|² = b A⁻¹ b.
    let a = coupled(50, 5);
    let b = DVector::from_element(50, 1.0);
    let energy = b.dot(&a.clone().cholesky().unwrap().solve(&b));
    for (precision, rounding) in BOTH.into_iter().zip([1e-6, 1e-14]) {
        let mut cholesky = factor(&a, precision);
        cholesky.triangle().forward(b.as_slice());
        let y = DVector::from_vec(cholesky.triangle().last(50));
        assert!((y.norm_squared() / energy - 1.0).abs() < rounding);
    }
}

#[test]
fn rows_that_are_kept_are_left_to_the_caller() {
    const KEPT: usize = 7;
    let mut a = coupled(61, 5);
    a.view_mut((61 - KEPT, 61 - KEPT), (KEPT, KEPT)).add_scalar_mut(1e-3);
    let b = DVector::from_fn(61, |i, _| (i as f64).cos());
    let x = a.clone().cholesky().unwrap().solve(&b);
    let (inside, coupling) = (a.view((0, 0), (54, 54)), a.view((54, 0), (KEPT, 54)));
    let y = inside.clone_owned().cholesky().unwrap().solve(&b.rows(0, 54).clone_owned());
    let reduced = b.rows(54, KEPT) - coupling * y;
    for (precision, rounding) in BOTH.into_iter().zip([1e-6, 1e-14]) {
        let order = Some((0..61).collect());
        let mut cholesky = Cholesky::analyse(&mut lower(&a), order, KEPT, precision).unwrap();
        let block = cholesky.factorise(&mut lower(&a)).unwrap().unwrap();
        // L₂₂ L₂₂ᵀ = A₂₂ − A₂₁ A₁₁⁻¹ A₁₂.
        let block = DMatrix::from_vec(KEPT, KEPT, block);
        let schur = &block * block.transpose();
        assert!((schur * x.rows(54, KEPT) - &reduced).amax() < 1e-14);
        let triangle = cholesky.triangle();
        triangle.forward(b.as_slice());
        assert!((DVector::from_vec(triangle.last(KEPT)) - &reduced).amax() < rounding);
        // Far larger than what is there: the scale follows.
        for scale in [1.0, 1e60] {
            let mut found = DVector::zeros(61);
            triangle.forward(b.as_slice());
            triangle.set_last((x.rows(54, KEPT) * scale).as_slice());
            triangle.backward(found.as_mut_slice());
            assert!((found.rows(54, KEPT) / scale - x.rows(54, KEPT)).amax() < rounding);
            assert!(scale > 1.0 || (found - &x).amax() < rounding);
        }
    }
}

#[test]
fn a_matrix_that_needs_all_digits_gets_them() {
    // Springs in a row, the last held by almost nothing: condition 1e12.
    let mut a = DMatrix::from_fn(40, 40, |i, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    (a[(0, 0)], a[(39, 39)]) = (1.0, 1.0 + 1e-9);
    let mut cholesky = factor(&a, Precision::Preconditioner);
    assert_eq!(cholesky.precision, Precision::Full);
    assert!(left(&a, &mut cholesky, &DVector::from_element(40, 1.0)) < 1e-5);
}

#[test]
fn a_matrix_that_is_not_definite_is_told_and_forgotten() {
    let good = coupled(20, 4);
    let mut bad = good.clone();
    bad[(7, 7)] = -1.0;
    for precision in BOTH {
        let mut cholesky = factor(&good, precision);
        assert!(cholesky.factorise(&mut lower(&bad)).unwrap().is_none());
        assert!(cholesky.factorise(&mut lower(&good)).unwrap().is_some());
        assert!(left(&good, &mut cholesky, &DVector::from_element(20, 1.0)) < 1e-5);
    }
}
