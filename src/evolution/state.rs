//! A step: its fields and its quantities of interest.

use super::{DiscreteProblem, State};
use crate::{
    contact::{ContactReport, Kkt},
    fem::{DamageCertificate, RigidMotion},
};
use serde::{Deserialize, Serialize};

/// A step with its certified answer.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Step {
    /// The fields.
    pub state: State,
    /// A row of `history.csv`.
    pub record: StepRecord,
    /// The rest of the row: [`DiscreteProblem::quantities`].
    pub quantities: Vec<f64>,
    /// The maximum Σ|·| of the loads and the internal forces so far, N per metre of thickness: the scale of resultants.
    pub forces: f64,
    /// The effort of the contact solve; not in archives.
    #[serde(skip)]
    pub report: ContactReport,
    /// A rigid motion that the active nodes leave unconstrained, if there is one.
    pub unconstrained: Option<RigidMotion>,
    /// Was the damage solve skipped?
    pub skipped_damage_solve: bool,
}

/// The quantities of interest of a step: a row of `history.csv`.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StepRecord {
    /// n, 0 for the state at t = 0.
    pub step: usize,
    /// t_n, s.
    pub time: f64,
    /// min ζ over the nodes: 1 sound, 0 broken.
    pub zeta_min: f64,
    /// Mean of ζ, ∫ζ/|Ω|.
    pub zeta_mean: f64,
    /// Maximum nodal |u|, m.
    pub displacement_max: f64,
    /// fᵀu, of the loads alone, J per metre of thickness.
    pub work: f64,
    /// Σ normal reactions of Γ_C (not their resultant), N per metre of thickness.
    pub contact_force: f64,
    /// Nodes of Γ_C in the active set.
    pub active_nodes: usize,
    /// Iterations of the contact solver.
    pub iterations: usize,
    /// Iterations of the linear solvers inside it.
    pub linear_iterations: usize,
    /// Factorisations, except by a preconditioner from PETSc options.
    pub factorisations: usize,
    /// Times the contact solver left its fast path.
    pub fallbacks: usize,
    /// Contraction per iteration of a fixed-point method; empty for others.
    pub contraction: Option<f64>,
    /// KKT residual, relative: unbalanced nodal forces.
    pub kkt_stationarity: f64,
    /// KKT residual, relative: penetration of nodes into the foundation.
    pub kkt_primal: f64,
    /// KKT residual, relative: contact forces that pull.
    pub kkt_dual: f64,
    /// KKT residual, relative: contact forces across an open gap.
    pub kkt_complementarity: f64,
    /// Residual of the damage system over its right-hand side.
    pub zeta_residual: f64,
    /// Upper bound of the error of ζ that this residual allows.
    pub zeta_error: f64,
    /// Wall time of the step, s: the last column.
    #[serde(skip)]
    pub seconds: f64,
}

impl Step {
    /// The values of all figures, in the order of [`DiscreteProblem::bars`].
    pub(crate) fn figures(&self) -> Vec<f64> {
        let record = &self.record;
        let of_record = [
            record.work,
            record.displacement_max,
            record.contact_force,
            record.zeta_min,
            record.zeta_mean,
        ];
        [&of_record[..], &self.quantities].concat()
    }

    /// Sets the accuracy of ζ_n; `None` means that the damage solve was skipped, so ζ_n is exact.
    pub(super) fn set_damage_certificate(&mut self, certificate: Option<DamageCertificate>) {
        self.skipped_damage_solve = certificate.is_none();
        let DamageCertificate { residual, error, .. } = certificate.unwrap_or_default();
        self.record.zeta_residual = residual;
        self.record.zeta_error = error;
    }
}

impl StepRecord {
    /// The record of the step n = `step` with the nodal loads `load`. Entries of the damage step are zero.
    pub(super) fn new(
        problem: &DiscreteProblem,
        step: usize,
        state: &State,
        load: &[f64],
        report: &ContactReport,
        kkt: &Kkt,
    ) -> Self {
        let points = || state.contact.iter().filter(|point| point.active);
        let mut active: Vec<usize> = points().map(|point| point.node).collect();
        active.dedup();
        let partition = &problem.body.nodes.partition;
        let comm = partition.comm();
        Self {
            step,
            time: state.time,
            zeta_min: problem.body.vertices.partition.min_max(&state.zeta).0,
            zeta_mean: problem.body.mean(&state.zeta),
            displacement_max: partition.max_norm(&state.u),
            work: partition.dot(load, &state.u, 2),
            // An empty sum is -0.0.
            contact_force: comm.total(points().map(|point| point.force).sum()) + 0.0,
            active_nodes: comm.count(active.len()),
            iterations: report.iterations,
            linear_iterations: report.linear_iterations,
            factorisations: report.factorisations,
            fallbacks: report.fallbacks,
            contraction: report.contraction,
            kkt_stationarity: kkt.stationarity,
            kkt_primal: kkt.primal,
            kkt_dual: kkt.dual,
            kkt_complementarity: kkt.complementarity,
            ..Self::default()
        }
    }

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
