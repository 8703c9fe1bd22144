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
fn von_mises_of_uniaxial_stress_is_that_stress_and_ignores_pressure() {
    let sheet = Material { young: 1.0, poisson: 0.3, plane: Plane::Stress, density: 0.0 };
    assert!((sheet.von_mises(&Vector3::new(0.0, -3.0, 0.0)) - 3.0).abs() < 1e-15);
    let prism = Material { young: 1.0, poisson: 0.5 - 1e-12, plane: Plane::Strain, density: 0.0 };
    assert!(prism.von_mises(&Vector3::new(-5.0, -5.0, 0.0)) < 1e-10);
}
