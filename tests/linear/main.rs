//! Factors, triangular solves and the solver above them, against dense algebra.

use nalgebra::{DMatrix, DVector};
use signorini::{
    linear::{
        Cholesky, Factor, LinearSolver, LinearSystem, LowerTriangle, Precision, Reduction,
        RefactorisationPolicy,
    },
    petsc::{Matrix, Pattern, Session, Vector},
};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

/// The library sets no allocator: with a second one this would not compile.
#[global_allocator]
static OWN: std::alloc::System = std::alloc::System;

const BOTH: [Precision; 2] = [Precision::Preconditioner, Precision::Full];

/// The part of a dense matrix that is not zero, from the diagonal down.
fn lower(a: &DMatrix<f64>) -> LowerTriangle {
    let mut lower = LowerTriangle::default();
    for j in 0..a.ncols() {
        (j..a.nrows()).filter(|&i| a[(i, j)] != 0.0).for_each(|i| lower.push(i, a[(i, j)]));
        lower.end_column();
    }
    lower
}

/// Tests of CHOLMOD alone take turns too: the BLAS it calls has no locks.
fn turn() -> Session {
    Session::start(&[]).unwrap()
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

fn cholesky(a: &DMatrix<f64>, precision: Precision) -> Cholesky {
    let mut cholesky = Cholesky::analyse(&mut lower(a), 0, precision).unwrap();
    // Twice: values are replaced, not added.
    assert!(cholesky.factorise(&mut lower(&(a * 2.0))).unwrap().is_some());
    assert!(cholesky.factorise(&mut lower(a)).unwrap().is_some());
    cholesky
}

/// max |b − A x| / max |b|. Two right sides solved together have the same solutions, bit by bit.
fn residual(a: &DMatrix<f64>, cholesky: &mut Cholesky, b: &DVector<f64>) -> f64 {
    let mut x = DVector::zeros(b.len());
    let (other, mut of_other) = (b.map(f64::abs), x.clone());
    let mut both = [x.clone(), x.clone()];
    let [first, second] = both.each_mut().map(|x| x.as_mut_slice());
    cholesky.solve_two([other.as_slice(), b.as_slice()], [first, second]);
    cholesky.solve(other.as_slice(), of_other.as_mut_slice());
    cholesky.solve(b.as_slice(), x.as_mut_slice());
    assert_eq!(both, [of_other, x.clone()]);
    (b - a * x).amax() / b.amax()
}

#[test]
fn solves_solve_whatever_the_shape_of_the_supernodes() {
    let _turn = turn();
    for size in (1..30).chain([100, 211]) {
        for sparsity in [0, 3, 6, 7, 8] {
            let a = coupled(size, sparsity);
            // Loads of any size: exponents of single precision end at 1e±38.
            for scale in [1.0, 1e-200, 1e200] {
                let b = DVector::from_fn(size, |i, _| scale * (i as f64 + 1.0).sin());
                for (precision, rounding) in BOTH.into_iter().zip([3e-6, 1e-14]) {
                    let left = residual(&a, &mut cholesky(&a, precision), &b);
                    assert!(left < rounding, "{size} {sparsity} {precision:?}: {left:e}");
                }
            }
        }
    }
}

#[test]
fn the_schur_complement_of_the_interface_is_left_to_the_caller() {
    let _turn = turn();
    const INTERFACE: usize = 7;
    let mut a = coupled(61, 5);
    a.view_mut((61 - INTERFACE, 61 - INTERFACE), (INTERFACE, INTERFACE)).add_scalar_mut(1e-3);
    let b = DVector::from_fn(61, |i, _| (i as f64).cos());
    let x = a.clone().cholesky().unwrap().solve(&b);
    let (inside, coupling) = (a.view((0, 0), (54, 54)), a.view((54, 0), (INTERFACE, 54)));
    let y = inside.clone_owned().cholesky().unwrap().solve(&b.rows(0, 54).clone_owned());
    let reduced = b.rows(54, INTERFACE) - coupling * y;
    for (precision, rounding) in BOTH.into_iter().zip([1e-6, 1e-14]) {
        let mut cholesky = Cholesky::analyse(&mut lower(&a), INTERFACE, precision).unwrap();
        let block = cholesky.factorise(&mut lower(&a)).unwrap().unwrap();
        // L₂₂ L₂₂ᵀ = A₂₂ − A₂₁ A₁₁⁻¹ A₁₂.
        let schur = &block * block.transpose();
        assert!((schur * x.rows(54, INTERFACE) - &reduced).amax() < 1e-14);
        // Far larger than what is there: the scale follows.
        for scale in [1.0, 1e60] {
            let mut found = DVector::zeros(61);
            let solution = x.rows(54, INTERFACE) * scale;
            let left = DVector::from_vec(cholesky.forward(b.as_slice()));
            assert!((left - &reduced).amax() < rounding);
            cholesky.backward(solution.clone_owned().as_slice(), found.as_mut_slice());
            let interface = found.rows(54, INTERFACE) / scale;
            assert!((interface - x.rows(54, INTERFACE)).amax() < rounding);
            assert!(scale > 1.0 || (found - &x).amax() < rounding);
        }
    }
}

#[test]
fn a_matrix_that_needs_all_digits_gets_them() {
    let _turn = turn();
    // Springs in a row, the last supported by almost nothing: condition 1e12.
    let mut a = DMatrix::from_fn(40, 40, |i, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    (a[(0, 0)], a[(39, 39)]) = (1.0, 1.0 + 1e-9);
    let mut kept = cholesky(&a, Precision::Preconditioner);
    assert!(residual(&a, &mut kept, &DVector::from_element(40, 1.0)) < 1e-5);
    // Others get half of them, and half of the memory.
    let (easy, [half, full]) = (coupled(40, 5), BOTH);
    assert_eq!(2.0 * cholesky(&easy, half).bytes(), cholesky(&easy, full).bytes());
}

#[test]
fn a_matrix_that_is_not_definite_is_told_and_forgotten() {
    let _turn = turn();
    let good = coupled(20, 4);
    let mut bad = good.clone();
    bad[(7, 7)] = -1.0;
    for precision in BOTH {
        let mut cholesky = cholesky(&good, precision);
        assert!(cholesky.factorise(&mut lower(&bad)).unwrap().is_none());
        assert!(cholesky.factorise(&mut lower(&good)).unwrap().is_some());
        assert!(residual(&good, &mut cholesky, &DVector::from_element(20, 1.0)) < 1e-5);
    }
}

/// The matrix of a dense one, all entries in its pattern.
fn matrix(session: &Session, a: &DMatrix<f64>) -> Matrix {
    let entries = (0..a.nrows()).flat_map(|i| (0..a.nrows() as i32).map(move |j| (i, j)));
    let pattern = Pattern::new(a.nrows(), entries);
    Matrix::with_pattern(session, 1, &pattern, a.as_slice()).unwrap()
}

fn vector(session: &Session, values: &DVector<f64>) -> Vector {
    let mut vector = Vector::zeros(session, values.len()).unwrap();
    vector.set(values.as_slice()).unwrap();
    vector
}

/// Three blocks [[2, 1], [1, 2]] on the diagonal, the middle one [[a, b], [b, a]] with the
/// eigenvalues a ± b.
fn blocks([a, b]: [f64; 2]) -> DMatrix<f64> {
    DMatrix::from_fn(6, 6, |i, j| match (i / 2 == j / 2, i == j, i / 2) {
        (false, ..) => 0.0,
        (true, true, 1) => a,
        (true, false, 1) => b,
        (true, true, _) => 2.0,
        (true, false, _) => 1.0,
    })
}

#[test]
fn what_is_not_positive_definite_does_not_converge_and_does_no_harm() {
    let session = Session::start(&[]).unwrap();
    let b = vector(&session, &DVector::from_element(6, 1.0));
    let mut solver = LinearSolver::new(&session, "test_", 6, Precision::Full).unwrap();
    // Whether the solve converges, and the first unknown.
    let mut solve = |a: DMatrix<f64>| {
        let (matrix, mut x) = (matrix(&session, &a), Vector::zeros(&session, 6).unwrap());
        let system = LinearSystem::of(&matrix);
        let definite = solver.factorise(system).unwrap();
        let report = solver.solve_renewing(system, &b, &mut x, 1e-12).unwrap();
        assert!(definite || !report.converged);
        (report.converged, x.read(|x| x[0]).unwrap())
    };
    for bad in [[1.0, 2.0], [-2.0, 1.0], [1.0, 1.0], [0.0, 0.0], [f64::NAN, 0.0]] {
        // First of all, and after a factorisation that went well.
        for _ in 0..2 {
            assert_eq!(solve(blocks(bad)), (false, 0.0), "{bad:?}");
            let (converged, x) = solve(blocks([2.0, 1.0]));
            assert!(converged && (x - 1.0 / 3.0).abs() < 1e-15, "after {bad:?}: {x}");
        }
    }
    // All pivots negative: conjugate gradients alone would not notice, r·z and p·Ap keep their sign.
    assert!(!solve(-blocks([2.0, 1.0])).0);
}

#[test]
fn an_old_factor_solves_other_values_other_prescribed_unknowns_and_another_diagonal() {
    const SIZE: usize = 61;
    let session = Session::start(&[]).unwrap();
    let mut solver = LinearSolver::new(&session, "test_", SIZE, Precision::Preconditioner).unwrap();
    let b = DVector::from_fn(SIZE, |i, _| (i as f64).cos());
    let right = vector(&session, &b);
    let (mut factorisations, mut worst) = (0, 0.0_f64);
    for turn in 0..8 {
        let mut a = coupled(SIZE, 5) * (1.0 + 0.01 * turn as f64);
        [(3, 0.5), (turn, 0.1)].iter().for_each(|&(i, d)| a[(i, i)] += d);
        let matrix = matrix(&session, &a);
        let prescribed: Vec<usize> = (20..22 + turn / 4).collect();
        let system = LinearSystem { prescribed: Some(&prescribed), ..LinearSystem::of(&matrix) };
        let mut x = vector(&session, &DVector::from_element(SIZE, 0.25));
        let report = solver.solve_renewing(system, &right, &mut x, 1e-11).unwrap();
        assert!(report.converged);
        factorisations += report.factorisations;
        let x = DVector::from_vec(x.read(<[f64]>::to_vec).unwrap());
        let mut residual = &b - &a * &x;
        let told = solver.residual().read(<[f64]>::to_vec).unwrap();
        worst = worst.max((DVector::from_vec(told) - &residual).amax());
        prescribed.iter().for_each(|&i| assert_eq!(x[i], 0.25));
        prescribed.iter().for_each(|&i| residual[i] = 0.0);
        assert!(residual.norm() < 2e-11, "{:e}", residual.norm());
    }
    assert!(worst < 1e-11, "the residual on all unknowns is told: {worst:e}");
    assert!(factorisations < 8, "the factor is kept: {factorisations}");
}

#[test]
fn a_factor_takes_over_matrices_of_another_size() {
    let session = Session::start(&[]).unwrap();
    let mut factor = Factor::new(&session, Precision::Full);
    for size in [30, 50, 20] {
        let (a, b) = (coupled(size, 5), DVector::from_element(size, 1.0));
        assert!(factor.factorise(&matrix(&session, &a)).unwrap());
        let (b, mut x) = (vector(&session, &b), Vector::zeros(&session, size).unwrap());
        factor.apply(&b, &mut x).unwrap();
        let x = DVector::from_vec(x.read(<[f64]>::to_vec).unwrap());
        assert!((a * x).add_scalar(-1.0).amax() < 1e-13);
    }
    let (short, mut x) =
        (Vector::zeros(&session, 3).unwrap(), Vector::zeros(&session, 20).unwrap());
    assert!(factor.apply(&short, &mut x).is_err());
}

#[test]
fn a_factor_is_replaced_when_its_age_has_cost_as_much_as_a_new_one() {
    let solved = |policy: &mut RefactorisationPolicy, iterations, asked| {
        policy.solved(iterations, Reduction { asked, reached: asked });
    };
    let mut policy = RefactorisationPolicy::new(8.0);
    solved(&mut policy, 1, 60.0);
    solved(&mut policy, 4, 6.0);
    solved(&mut policy, 1, 6.0);
    assert!(policy.iteration_limit(6.0).is_some(), "its own matrix is no example for later ones");
    solved(&mut policy, 0, 6.0);
    solved(&mut policy, 2, 12.0);
    solved(&mut policy, 4, 6.0);
    assert_eq!(policy.iteration_limit(6.0), Some(1 + 5), "3 iterations lost of 8");
    assert_eq!(policy.iteration_limit(7.0), Some(2 + 5), "an iteration divides by e^6 at most");
    solved(&mut policy, 6, 6.0);
    assert!(policy.iteration_limit(6.0).is_none());
    let mut policy = RefactorisationPolicy::new(8.0);
    solved(&mut policy, 13, 6.0);
    assert!(policy.iteration_limit(6.0).is_none(), "a factor that helps so little is due at once");
}

/// While an object of PETSc exists, no other thread gets a session, whether or not the session that made it does.
#[test]
fn an_object_keeps_the_turn_of_its_session() {
    let session = turn();
    let (mut vector, is_gone) = (vector(&session, &DVector::from_element(3, 2.0)), Arc::default());
    drop(session);
    let seen: Arc<AtomicBool> = Arc::clone(&is_gone);
    let other = thread::spawn(move || {
        let _session = turn();
        seen.load(Ordering::SeqCst)
    });
    // A thread that does not wait has its session meanwhile.
    thread::sleep(Duration::from_millis(50));
    // The thread itself may have further sessions, none of which ends PETSc before its objects.
    let refused = turn().finalize().expect_err("a vector exists").to_string();
    assert!(refused.starts_with("1 PETSc objects outlive"), "{refused}");
    vector.write(|values| assert_eq!(values, [2.0; 3])).unwrap();
    is_gone.store(true, Ordering::SeqCst);
    drop(vector);
    assert!(other.join().unwrap(), "the other thread had a session too early");
}

/// PETSc lends null for no entries, which is no slice.
#[test]
fn a_vector_without_entries_has_an_empty_slice() {
    let session = turn();
    let mut empty = Vector::zeros(&session, 0).unwrap();
    assert!(empty.read(<[f64]>::is_empty).unwrap());
    assert!(empty.write(|values| values.is_empty()).unwrap());
}
