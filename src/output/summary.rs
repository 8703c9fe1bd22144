//! `summary.json`: the run in one object.

use super::{OutputError, write_whole};
use crate::contact::Kkt;
use serde::Serialize;
use std::{collections::BTreeMap, path::Path};

/// The keys of `summary.json`; values are those of the last accepted state unless said otherwise,
/// null where there is none because the first solve failed.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Name of the scene file without extension.
    pub scene: String,
    /// The scene's title.
    pub title: String,
    /// The contact solver that was asked for.
    pub solver: String,
    /// Ranks among which the mesh was divided.
    pub ranks: usize,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Accepted time steps after t = 0.
    pub steps: usize,
    /// Time of the last accepted state, s.
    pub end_time: Option<f64>,
    /// Time at which ζ_* was reached, s; null if it was not.
    pub stopped_at: Option<f64>,
    /// How far off `stopped_at` may be, s; null if ζ_* was not reached.
    pub stopped_uncertainty: Option<f64>,
    /// min ζ.
    pub zeta_min: Option<f64>,
    /// ∫ζ/|Ω|.
    pub zeta_mean: Option<f64>,
    /// Largest nodal |u|, m.
    pub displacement_max: Option<f64>,
    /// fᵀu, J per metre of thickness.
    pub work: Option<f64>,
    /// Σ nodal normal reactions of Γ_C, N per metre of thickness.
    pub contact_force: Option<f64>,
    /// Contact nodes that press on the foundation.
    pub active_nodes: Option<usize>,
    /// Nodes with a gap condition (prescribed ones not counted).
    pub contact_nodes: usize,
    /// Worst relative KKT residuals over all steps.
    pub kkt: Option<Kkt>,
    /// Wall time of the whole run, s.
    pub wall_seconds: f64,
    /// Wall time per time step, s.
    pub seconds_per_step: f64,
    /// Seconds spent in each phase.
    pub phases: BTreeMap<&'static str, f64>,
    /// The edges of Γ_C as segments [[x, y], [x, y]], m.
    pub contact_boundary: Vec<[[f64; 2]; 2]>,
    /// Unit vectors along which the body slides at their ends; [0, 0] at corners.
    pub contact_tangents: Vec<[[f64; 2]; 2]>,
    /// Opposite each of them the foundation, m: its segments meet at the nodes.
    pub foundation: Vec<[[f64; 2]; 2]>,
    /// What the program noticed and the user should know.
    pub notes: Vec<String>,
    /// Why the run ended early, if it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Summary {
    /// Writes `summary.json` into `folder`.
    pub fn write(&self, folder: &Path) -> Result<(), OutputError> {
        let path = folder.join("summary.json");
        let text = serde_json::to_string_pretty(self).map_err(|e| OutputError::new(&path, e))?;
        write_whole(&path, (text + "\n").as_bytes())
    }
}
