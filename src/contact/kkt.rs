//! The Karush–Kuhn–Tucker residuals of an answer.

use crate::maximum;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The scales of relative residuals: the largest forces and displacements of the run so far. With them a load
/// that passes zero, or a gap much wider than a displacement, does not change the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// F: the largest ‖·‖₂ of the nodal loads and of the internal forces, N per metre of thickness.
    pub force: f64,
    /// U: the largest displacement of a node relative to the rigid motion of the body, m.
    pub displacement: f64,
}

impl Scales {
    /// ‖·‖₂ of forces over F.
    pub(super) fn of_force(self, force: f64) -> f64 {
        relative(force, self.force)
    }

    /// A displacement over U.
    pub(super) fn of_displacement(self, displacement: f64) -> f64 {
        relative(displacement, self.displacement)
    }

    /// The natural residual min(p/F, (g − u·ν)/U) of a force p > 0 across an open gap. It does not depend on
    /// the sizes of gap and load (Facchinei and Pang, Finite-Dimensional Variational Inequalities and
    /// Complementarity Problems I, section 1.5.1: the min function).
    pub fn natural(self, force: f64, gap: f64) -> f64 {
        let [force, gap] = [force, gap].map(|value| maximum(value, 0.0));
        -maximum(-self.of_force(force), -self.of_displacement(gap))
    }
}

/// Relative KKT residuals of u. The multiplier p of a gap condition is the contact force that follows from u.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Kkt {
    /// ‖the part of f − Ku that no support can carry‖₂ / F.
    pub stationarity: f64,
    /// max (u·ν − g)₊ / U.
    pub primal: f64,
    /// ‖(−p)₊‖₂ / F: contact forces that pull.
    pub dual: f64,
    /// max min(p/F, (g − u·ν)/U) over the gap conditions.
    pub complementarity: f64,
}

impl Kkt {
    /// The residuals of an answer that cannot be certified.
    pub const UNKNOWN: Self = Self {
        stationarity: f64::NAN,
        primal: f64::NAN,
        dual: f64::NAN,
        complementarity: f64::NAN,
    };

    /// The largest of the four; NaN if any is.
    pub fn worst(&self) -> f64 {
        self.named().into_iter().fold(0.0, |worst, (_, value)| maximum(worst, value))
    }

    /// Are all at most `tolerance`? False for NaN.
    pub fn within(&self, tolerance: f64) -> bool {
        self.worst() <= tolerance
    }

    /// The residuals above `tolerance`, and by what factor they exceed it.
    pub fn missed(&self, tolerance: f64) -> String {
        let missed =
            self.named().into_iter().filter(|(_, value)| value.is_nan() || *value > tolerance);
        let text = |(name, value)| {
            format!("{name} {value:.1e}, {:.1e} times too large", value / tolerance)
        };
        let missed: Vec<String> = missed.map(text).collect();
        format!("the tolerance {tolerance:.1e} is missed by {}", missed.join("; "))
    }

    /// The larger of each residual of two answers; NaN if one is.
    pub fn max(&self, other: &Self) -> Self {
        Self {
            stationarity: maximum(self.stationarity, other.stationarity),
            primal: maximum(self.primal, other.primal),
            dual: maximum(self.dual, other.dual),
            complementarity: maximum(self.complementarity, other.complementarity),
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
        let parts = self.named().map(|(name, value)| match value {
            0.0 => format!("{name} 0"),
            _ => format!("{name} {value:.1e}"),
        });
        f.write_str(&parts.join(", "))
    }
}

/// A residual over its scale, where 0/0 is 0.
fn relative(residual: f64, scale: f64) -> f64 {
    if residual == 0.0 { 0.0 } else { residual / scale }
}
