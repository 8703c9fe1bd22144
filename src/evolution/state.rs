//! A step: its fields and its figures.

use super::{ObservedProblem, State};
use crate::{
    contact::{ContactReport, Kkt},
    fem::{DamageCertificate, RigidMotion},
    observe::{Figure, FirstContact, Observation, Value},
};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A step with its certified answer.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Step {
    /// The fields.
    pub state: State,
    /// The first columns of a row of `history.csv`.
    pub record: StepRecord,
    /// The values of all figures, in the order of [`ObservedProblem::figures`].
    pub figures: Vec<Value>,
    /// The governing value of each figure in all steps so far; `None` for places.
    pub governing: Vec<Option<GoverningValue>>,
    /// The maximum Σ|·| of the loads and the internal forces so far, N per metre of thickness: the scale of resultants.
    pub forces: f64,
    /// Per foundation: its first contact.
    pub first_contact: Vec<FirstContact>,
    /// The effort of the contact solve; not in archives.
    #[serde(skip)]
    pub report: ContactReport,
    /// The strains at the quadrature points, until the damage source takes them.
    #[serde(skip)]
    pub(super) strains: Vec<Vector3<f64>>,
    /// The share of the strain energy that prescribed displacements and gaps cause, in [0, 1]; loads cause the rest.
    #[serde(skip)]
    pub(super) prescribed_share: f64,
    /// A rigid motion that the active nodes leave unconstrained, if there is one.
    pub unconstrained: Option<RigidMotion>,
    /// Was the damage solve skipped?
    pub skipped_damage_solve: bool,
}

/// The extreme of a figure over the steps of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GoverningValue {
    /// The largest value, for components in modulus, or the least ζ and σ₂.
    pub value: f64,
    /// Its place, m, if it is found at one.
    pub at: Option<[f64; 2]>,
    /// The time of the first step that has it, s.
    pub time: f64,
}

/// The first columns of a row of `history.csv`: the figures that every problem has, and the effort and accuracy of the step.
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
    /// Times another contact solver gave the answer.
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
    /// Sets the figures and the governing values that follow from the step before; `None` for the first one. Collective.
    pub(super) fn govern(&mut self, problem: &ObservedProblem, before: Option<&Self>) {
        let earlier = before.map(|step| &step.first_contact[..]);
        problem.set_first_contact(&mut self.figures, &mut self.first_contact, earlier);
        let governing = |(i, (figure, of)): (usize, (&Figure, &Value))| {
            let (before, time) = (before.and_then(|of| of.governing[i]), self.record.time);
            let own = GoverningValue { value: of.value, at: of.at, time };
            if figure.governs(of.value, before.map(|of| of.value)) { Some(own) } else { before }
        };
        let figures = problem.figures.iter().zip(&self.figures).enumerate();
        self.governing = figures.map(governing).collect();
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
    /// The record of the step n = `step`. Entries of the damage step are zero.
    pub(super) fn new(
        problem: &ObservedProblem,
        step: usize,
        state: &State,
        observation: &Observation,
        report: &ContactReport,
        kkt: &Kkt,
    ) -> Self {
        let points = state.contact.iter().filter(|point| point.active);
        let mut active: Vec<usize> = points.map(|point| point.node).collect();
        active.dedup();
        Self {
            step,
            time: state.time,
            zeta_min: observation.zeta_min.value,
            zeta_mean: observation.zeta_mean,
            displacement_max: observation.displacement_max.value,
            work: observation.work,
            contact_force: observation.contact_force,
            active_nodes: problem.body.comm().count(active.len()),
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
