//! Plane linear elasticity, the tensor A of the paper's section 4.

use nalgebra::{Matrix3, Vector3};

/// Which plane reduction of three-dimensional elasticity holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// σ_zz = 0: a thin sheet (the paper's choice).
    Stress,
    /// ε_zz = 0: a long prism.
    Strain,
}

/// An isotropic linear elastic material in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E > 0, Pa.
    pub young: f64,
    /// Poisson's ratio ν in (−1, ½).
    pub poisson: f64,
    /// Plane stress or plane strain.
    pub plane: Plane,
}

impl Material {
    /// The 3×3 matrix D with (σ_xx, σ_yy, σ_xy) = D (ε_xx, ε_yy, 2ε_xy), Pa.
    ///
    /// Plane stress is the paper's A (section 4); plane strain is the same formula
    /// with E/(1−ν²) for E and ν/(1−ν) for ν.
    pub fn stiffness(&self) -> Matrix3<f64> {
        let (e, nu) = match self.plane {
            Plane::Stress => (self.young, self.poisson),
            Plane::Strain => (
                self.young / (1.0 - self.poisson * self.poisson),
                self.poisson / (1.0 - self.poisson),
            ),
        };
        let d = e / (1.0 - nu * nu);
        Matrix3::new(
            d,
            d * nu,
            0.0, //
            d * nu,
            d,
            0.0, //
            0.0,
            0.0,
            0.5 * e / (1.0 + nu),
        )
    }

    /// Von Mises stress of (σ_xx, σ_yy, σ_xy), Pa; in plane strain with the
    /// out-of-plane σ_zz = ν(σ_xx + σ_yy).
    pub fn von_mises(&self, stress: &Vector3<f64>) -> f64 {
        let (x, y, xy) = (stress[0], stress[1], stress[2]);
        let z = match self.plane {
            Plane::Stress => 0.0,
            Plane::Strain => self.poisson * (x + y),
        };
        (0.5 * ((x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2)) + 3.0 * xy * xy).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plane_stress_is_the_papers_tensor() {
        // (Aτ)_αβ = Er/(1−r²) tr(τ) δ_αβ + E/(1+r) τ_αβ, printed in section 4.
        let material = Material { young: 80.0, poisson: 0.3, plane: Plane::Stress };
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
        let material = Material { young: 2.0e5, poisson: 0.27, plane: Plane::Strain };
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
        let sheet = Material { young: 1.0, poisson: 0.3, plane: Plane::Stress };
        assert!((sheet.von_mises(&Vector3::new(0.0, -3.0, 0.0)) - 3.0).abs() < 1e-15);
        let prism = Material { young: 1.0, poisson: 0.5 - 1e-12, plane: Plane::Strain };
        assert!(prism.von_mises(&Vector3::new(-5.0, -5.0, 0.0)) < 1e-10);
    }
}
