//! The paper's laws at a point: the damage source φ and plane elasticity.

use crate::support::{DAMAGE_LAW, Random, random_strains};
use nalgebra::{Matrix2, Rotation2, Vector3};
use signorini::model::{DamageLaw, Material, Plane};

const LAW: DamageLaw =
    DamageLaw { lambda_u: 100.0, lambda_w: 0.5, strain_cap: 1000.0, ..DAMAGE_LAW };

/// φ of a stretch with this |ε|².
fn source(strain_squared: f64, zeta: f64) -> f64 {
    LAW.source(&Vector3::new(strain_squared.sqrt(), 0.0, 0.0), zeta)
}

/// |ε|² counts the shear twice. Otherwise the source of a strain would change with the axes.
#[test]
fn the_source_does_not_depend_on_the_axes() {
    let mut random = Random::new(2);
    for e in random_strains(&mut random, 100).0 {
        let (tensor, turn) =
            (Matrix2::new(e[0], e[2] / 2.0, e[2] / 2.0, e[1]), Rotation2::new(random.next()));
        let turned = turn.matrix() * tensor * turn.matrix().transpose();
        let turned = Vector3::new(turned.m11, turned.m22, 2.0 * turned.m12);
        let [own, other] = [e, turned].map(|strain| LAW.source(&strain, 0.6));
        assert!((own - other).abs() < 1e-13 * own.abs(), "{own} {other}");
    }
}

#[test]
fn source_never_heals_and_grows_with_strain_up_to_the_cap() {
    assert_eq!(source(0.0, 1.0), 0.0, "λ_W protects the unstrained body");
    assert!((source(0.02, 1.0) + 0.5).abs() < 1e-15);
    assert!(source(0.03, 0.5) < source(0.02, 0.5));
    assert_eq!(source(1000.0, 0.5), source(1e9, 0.5));
}

#[test]
fn truncation_makes_the_source_constant_outside_the_admissible_interval() {
    assert_eq!(source(1.0, 0.01), source(1.0, -0.3));
    assert_eq!(source(1.0, 1.0), source(1.0, 1.2));
}

#[test]
fn von_mises_of_uniaxial_stress_is_that_stress_and_ignores_pressure() {
    let sheet = Material { young: 1.0, poisson: 0.3, plane: Plane::Stress, density: 0.0 };
    assert!((sheet.von_mises(&Vector3::new(0.0, -3.0, 0.0)) - 3.0).abs() < 1e-15);
    let prism = Material { young: 1.0, poisson: 0.5 - 1e-12, plane: Plane::Strain, density: 0.0 };
    assert!(prism.von_mises(&Vector3::new(-5.0, -5.0, 0.0)) < 1e-10);
}
