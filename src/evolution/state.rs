//! An accepted step: its fields and its figures.

use crate::contact::{ContactPoint, Kkt, RigidMotion};
use serde::Serialize;

/// An accepted step.
#[derive(Debug, Clone)]
pub struct Step {
    /// The fields.
    pub state: State,
    /// A row of `history.csv`.
    pub record: StepRecord,
    /// A motion that no pressing node holds, if there is one.
    pub unheld: Option<RigidMotion>,
}

/// The fields of an accepted step.
#[derive(Debug, Clone)]
pub struct State {
    /// t, s.
    pub time: f64,
    /// Displacements (u_x, u_y) in turn, m.
    pub u: Vec<f64>,
    /// ζ at the nodes.
    pub zeta: Vec<f64>,
    /// Mean of η_*(ζ) on each triangle: what multiplies the stiffness there.
    pub zeta_mean: Vec<f64>,
    /// The nodes of Γ_C that carry a gap condition; two entries at a corner.
    pub contact: Vec<ContactPoint>,
}

/// The figures of a step: a row of `history.csv`.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct StepRecord {
    /// n.
    pub step: usize,
    /// t_n, s.
    pub time: f64,
    /// min ζ.
    pub zeta_min: f64,
    /// ∫ζ/|Ω|.
    pub zeta_mean: f64,
    /// Largest nodal |u|, m.
    pub displacement_max: f64,
    /// fᵀu, J per metre of thickness.
    pub work: f64,
    /// Σ normal reactions, N per metre of thickness.
    pub contact_force: f64,
    /// Contact nodes that press.
    pub active_nodes: usize,
    /// Iterations of the contact solver.
    pub iterations: usize,
    /// Iterations of the linear solvers inside it.
    pub linear_iterations: usize,
    /// Factorisations (not those of a preconditioner chosen by PETSc options).
    pub factorisations: usize,
    /// Times it left its fast path.
    pub fallbacks: usize,
    /// Contraction per iteration of a fixed-point method; empty for others.
    pub contraction: Option<f64>,
    /// Relative KKT residuals.
    pub kkt_stationarity: f64,
    /// See [`Kkt`].
    pub kkt_primal: f64,
    /// See [`Kkt`].
    pub kkt_dual: f64,
    /// See [`Kkt`].
    pub kkt_complementarity: f64,
    /// Residual of the damage system over its right-hand side.
    pub zeta_residual: f64,
    /// Upper bound of the error of ζ that this residual allows.
    pub zeta_error: f64,
    /// Wall time of the step, s.
    pub seconds: f64,
}

impl StepRecord {
    /// The step's KKT residuals.
    pub fn kkt(&self) -> Kkt {
        Kkt {
            stationarity: self.kkt_stationarity,
            primal: self.kkt_primal,
            dual: self.kkt_dual,
            complementarity: self.kkt_complementarity,
        }
    }
}
