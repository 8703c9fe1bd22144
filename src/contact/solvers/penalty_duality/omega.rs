//! The ω of a problem for which none is given.

use super::Response;
use crate::contact::{ContactError, ContactProblem};
use nalgebra::{DMatrix, DVector};

/// ω√(s_min s_max), with s the extreme eigenvalues of the boundary compliance.
///
/// Tuned on the 4 penalty-duality runs. Half: 34 % more iterations, 44 % more for `lshape`. Twice: 2 % fewer, but a
/// fifth more for `bridge` and 74 % more for `hertz`.
const OMEGA_COMPLIANCE: f64 = 3.0;
/// Steps of the Lanczos process that estimates the compliance.
const LANCZOS: usize = 25;

/// ω = 3/√(s_min s_max) from the extreme eigenvalues of the compliance S = B K⁻¹BᵀW (normal displacement
/// per pressure), by the eigenvalues θ = s/(1 + ωs) of [`penalised_compliance`] for a trial ω: K may be
/// singular.
pub(super) fn estimate_omega(
    problem: &ContactProblem,
    respond: Response,
) -> Result<f64, ContactError> {
    let trial = problem.stiffness_scale / contact_length(problem);
    let eigenvalues = penalised_compliance(problem, trial, respond)?.symmetric_eigenvalues();
    let compliance = |theta: f64| theta / (1.0 - trial * theta);
    // Rigid motions that contact alone constrains have s = ∞ and do not count.
    let finite = || eigenvalues.iter().filter(|theta| 1.0 - trial * **theta > 1e-6);
    let least = compliance(finite().copied().fold(f64::INFINITY, f64::min));
    let most = compliance(finite().copied().fold(0.0, f64::max));
    let omega = OMEGA_COMPLIANCE / (least * most).sqrt();
    Ok(if omega.is_finite() && omega > 0.0 { omega } else { trial })
}

/// The matrix of W^½ B (K + ω BᵀWB)⁻¹ BᵀW^½ in an orthonormal basis of a Krylov space, by the Lanczos process with
/// two reorthogonalisations (Golub and Van Loan, Matrix Computations, ch. 10).
fn penalised_compliance(
    problem: &ContactProblem,
    omega: f64,
    respond: Response,
) -> Result<DMatrix<f64>, ContactError> {
    let weights = problem.bounds.iter().map(|bound| bound.tributary_length.sqrt());
    let weights = DVector::from_iterator(problem.bounds.len(), weights);
    let unit = problem.scales.force / contact_length(problem);
    let unpressed = DVector::from_vec(respond(omega, &vec![0.0; weights.len()])?);
    // A start with all frequencies in it: smooth plus alternating.
    let start =
        |i: usize| 1.0 + 0.3 * (i as f64).sin() + if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut v = DVector::from_fn(weights.len(), |i, _| start(i) * weights[i]);
    let (mut basis, mut images) = (Vec::<DVector<f64>>::new(), Vec::<DVector<f64>>::new());
    for _ in 0..LANCZOS.min(problem.bound_count()) {
        let norm = |v: &DVector<f64>| problem.comm.total(v.norm_squared()).sqrt();
        let length = norm(&v);
        for earlier in basis.iter().chain(&basis) {
            v.axpy(-problem.comm.total(v.dot(earlier)), earlier, 1.0);
        }
        let left = norm(&v);
        if left <= 1e-10 * length {
            break;
        }
        v /= left;
        let pressed =
            DVector::from_vec(respond(omega, (&v * unit).component_div(&weights).as_slice())?);
        let image = (&unpressed - pressed).component_mul(&weights) / unit;
        basis.push(std::mem::replace(&mut v, image.clone()));
        images.push(image);
    }
    let mut matrix = DMatrix::from_fn(basis.len(), basis.len(), |i, j| basis[i].dot(&images[j]));
    problem.comm.sum(matrix.as_mut_slice());
    Ok(matrix)
}

/// |Γ_C|, m.
fn contact_length(problem: &ContactProblem) -> f64 {
    problem.comm.total(problem.bounds.iter().map(|b| b.tributary_length).sum())
}
