//! Plane linear elasticity, the tensor A of the paper's section 4.

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

/// The plane reduction of three-dimensional elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// σ_zz = 0: a thin sheet (the paper's choice).
    Stress,
    /// ε_zz = 0: a long prism.
    Strain,
}

/// An isotropic linear elastic material in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Material {
    /// Young's modulus E > 0, Pa.
    pub young: f64,
    /// Poisson's ratio ν in (−1, ½).
    pub poisson: f64,
    /// Plane stress or plane strain.
    pub plane: Plane,
    /// The density ρ, kg/m³; its weight is ρ times gravity.
    pub density: f64,
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

    /// σ_zz of (σ_xx, σ_yy, σ_xy), Pa: 0 in plane stress, ν(σ_xx + σ_yy) in plane strain.
    pub fn out_of_plane(&self, stress: &Vector3<f64>) -> f64 {
        match self.plane {
            Plane::Stress => 0.0,
            Plane::Strain => self.poisson * (stress[0] + stress[1]),
        }
    }

    /// Von Mises stress of (σ_xx, σ_yy, σ_xy), Pa, with [σ_zz](Self::out_of_plane).
    pub fn von_mises(&self, stress: &Vector3<f64>) -> f64 {
        let [xx, yy, xy] = *stress.as_ref();
        von_mises([xx, yy, xy, self.out_of_plane(stress)])
    }
}

/// The von Mises stress of (σ_xx, σ_yy, σ_xy, σ_zz), Pa.
pub fn von_mises([x, y, xy, z]: [f64; 4]) -> f64 {
    (0.5 * ((x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2)) + 3.0 * xy * xy).sqrt()
}
