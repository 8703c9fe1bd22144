//! The paper's laws at a point: the damage source φ and plane elasticity.

use nalgebra::Vector3;
use signorini::model::{DamageLaw, Material, Plane};

const LAW: DamageLaw = DamageLaw {
    diffusion: 1.0,
    lambda_d: 0.1,
    lambda_u: 100.0,
    lambda_w: 0.5,
    strain_cap: 1000.0,
    threshold: 0.01,
};

#[test]
fn source_never_heals_and_grows_with_strain_up_to_the_cap() {
    assert_eq!(LAW.source(0.0, 1.0), 0.0, "λ_W protects the unstrained body");
    assert!((LAW.source(0.02, 1.0) + 0.5).abs() < 1e-15);
    assert!(LAW.source(0.03, 0.5) < LAW.source(0.02, 0.5));
    assert_eq!(LAW.source(1000.0, 0.5), LAW.source(1e9, 0.5));
}

#[test]
fn truncation_makes_the_source_constant_outside_the_admissible_interval() {
    assert_eq!(LAW.source(1.0, 0.01), LAW.source(1.0, -0.3));
    assert_eq!(LAW.source(1.0, 1.0), LAW.source(1.0, 1.2));
}

#[test]
fn plane_stress_is_the_papers_tensor() {
    // (Aτ)_αβ = Er/(1−r²) tr(τ) δ_αβ + E/(1+r) τ_αβ, printed in section 4.
    let material = Material { young: 80.0, poisson: 0.3, plane: Plane::Stress, density: 0.0 };
    let (e, r) = (80.0, 0.3);
    let tau = [0.7, -0.2, 0.4]; // τ_11, τ_22, τ_12
    let sigma = material.stiffness() * Vector3::new(tau[0], tau[1], 2.0 * tau[2]);
    let trace = e * r / (1.0 - r * r) * (tau[0] + tau[1]);
    for (value, expected) in [
        (sigma[0], trace + e / (1.0 + r) * tau[0]),
        (sigma[1], trace + e / (1.0 + r) * tau[1]),
        (sigma[2], e / (1.0 + r) * tau[2]),
    ] {
        assert!((value - expected).abs() < 1e-13 * e, "{value} ≠ {expected}");
    }
}

#[test]
fn plane_strain_is_three_dimensional_elasticity_with_no_normal_strain() {
    // Hooke's law inverted: ε = ((1+ν)σ − ν tr σ I)/E with σ_zz such that ε_zz = 0.
    let material = Material { young: 2.0e5, poisson: 0.27, plane: Plane::Strain, density: 0.0 };
    let strain = Vector3::new(1e-3, -4e-4, 7e-4);
    let s = material.stiffness() * strain;
    let (e, nu) = (material.young, material.poisson);
    let trace = s[0] + s[1] + nu * (s[0] + s[1]);
    for (stress, expected) in [(s[0], strain[0]), (s[1], strain[1])] {
        let back = ((1.0 + nu) * stress - nu * trace) / e;
        assert!((back - expected).abs() < 1e-16 + 1e-12 * expected.abs());
    }
}

#[test]
fn von_mises_of_uniaxial_stress_is_that_stress_and_ignores_pressure() {
    let sheet = Material { young: 1.0, poisson: 0.3, plane: Plane::Stress, density: 0.0 };
    assert!((sheet.von_mises(&Vector3::new(0.0, -3.0, 0.0)) - 3.0).abs() < 1e-15);
    let prism = Material { young: 1.0, poisson: 0.5 - 1e-12, plane: Plane::Strain, density: 0.0 };
    assert!(prism.von_mises(&Vector3::new(-5.0, -5.0, 0.0)) < 1e-10);
}
