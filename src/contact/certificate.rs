//! The Karush–Kuhn–Tucker residuals of an answer, whoever computed it.

use super::Bound;
use crate::petsc::Ranks;
use std::fmt;

/// Relative KKT residuals of u: forces against the force scale F, displacements against
/// the largest displacement U. The multiplier is the contact force that u itself implies,
/// p_i = (f − Ku)_i on the bounded unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Kkt {
    /// ‖(Ku − f) on the unknowns without a bound‖₂ / F.
    pub stationarity: f64,
    /// max (u_ν − g)₊ / U.
    pub primal: f64,
    /// ‖(−p)₊‖₂ / F: tensile contact forces.
    pub dual: f64,
    /// Σ |p_i (g_i − u_i)| / (F U).
    pub complementarity: f64,
}

impl Kkt {
    /// From r = Ku − f and u, both in the frames' unknowns that this rank owns; `prescribed` ones
    /// do not count.
    pub fn of(
        residual: &[f64],
        c: &[f64],
        bounds: &[Bound],
        prescribed: impl Fn(usize) -> bool,
        force_scale: f64,
        displacement_scale: f64,
        ranks: Ranks,
    ) -> Self {
        let mut bounded = vec![false; residual.len()];
        let (mut primal, mut dual, mut complementarity) = (0.0_f64, 0.0, 0.0);
        for bound in bounds {
            let (gap, p) = (bound.gap - c[bound.dof], -residual[bound.dof]);
            bounded[bound.dof] = true;
            primal = primal.max(-gap);
            dual += p.min(0.0).powi(2);
            complementarity += (p * gap).abs();
        }
        let stationarity: f64 = (0..residual.len())
            .filter(|&dof| !bounded[dof] && !prescribed(dof))
            .map(|dof| residual[dof].powi(2))
            .sum();
        let mut sums = [stationarity, dual, complementarity];
        ranks.sum(&mut sums);
        let [stationarity, dual, complementarity] = sums;
        let primal = ranks.max(primal);
        Self {
            stationarity: relative(stationarity.sqrt(), force_scale),
            primal: relative(primal, displacement_scale),
            dual: relative(dual.sqrt(), force_scale),
            complementarity: relative(complementarity, force_scale * displacement_scale),
        }
    }

    /// The largest of the four; NaN if any is.
    pub fn worst(&self) -> f64 {
        // f64::max would forget a NaN.
        let values = self.named().map(|(_, value)| value);
        values.into_iter().fold(0.0, |worst, v| if v > worst || v.is_nan() { v } else { worst })
    }

    /// Whether all are at most `tolerance` (NaN is not).
    pub fn within(&self, tolerance: f64) -> bool {
        self.named().iter().all(|(_, value)| *value <= tolerance)
    }

    /// Which residuals miss `tolerance`, and by what factor.
    pub fn missed(&self, tolerance: f64) -> String {
        let missed =
            self.named().into_iter().filter(|(_, value)| value.is_nan() || *value > tolerance);
        let told =
            |(name, value)| format!("{name} {value:.1e} ({:.1e} times it)", value / tolerance);
        let missed: Vec<String> = missed.map(told).collect();
        format!("the tolerance {tolerance:.1e} is missed by {}", missed.join(", "))
    }

    /// The larger of each residual of two answers.
    pub fn max(&self, other: &Self) -> Self {
        Self {
            stationarity: self.stationarity.max(other.stationarity),
            primal: self.primal.max(other.primal),
            dual: self.dual.max(other.dual),
            complementarity: self.complementarity.max(other.complementarity),
        }
    }

    fn named(&self) -> [(&'static str, f64); 4] {
        [
            ("stationarity", self.stationarity),
            ("primal", self.primal),
            ("dual", self.dual),
            ("complementarity", self.complementarity),
        ]
    }
}

impl fmt::Display for Kkt {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = self.named().map(|(name, value)| format!("{name} {value:.1e}"));
        f.write_str(&parts.join(", "))
    }
}

/// A residual over its scale; nothing over nothing is nothing.
fn relative(residual: f64, scale: f64) -> f64 {
    if residual == 0.0 { 0.0 } else { residual / scale }
}
