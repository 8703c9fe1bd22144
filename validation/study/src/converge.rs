//! The paper's convergence study: errors on nested meshes and steps against the reference solution.

use super::{Embedding, Fields, Norms, Reference, StudyError, longest_edge, slope::slope};
use serde::Serialize;
use signorini::petsc::Session;

/// How many meshes the study has at most: the coarsest and its refinements.
const MESHES: usize = 5;
/// T/k: k = 0.02, 0.01, 0.005, 0.002, 0.001 s in Table 1.
const STEPS: [f64; 5] = [50.0, 100.0, 200.0, 500.0, 1000.0];

/// The scene of Table 1.
const PAPER: &str = "square-table1";
/// Table 1 of the paper ("Example I: Numerical errors obtained with different n and k"): a row for
/// n = 4, 8, 16, 32, 64, h = √2/n; a column for each k of [`STEPS`] with T = 1 s.
const TABLE_1: [[f64; 5]; 5] = [
    [0.03027, 0.02931, 0.02884, 0.02856, 0.02856],
    [0.01934, 0.01803, 0.01739, 0.01701, 0.01688],
    [0.01594, 0.01167, 0.01003, 0.009247, 0.008794],
    [0.007324, 0.005391, 0.004471, 0.003956, 0.003794],
    [0.005254, 0.003095, 0.002029, 0.001441, 0.001269],
];

/// A run of the study. The errors are largest over time; relative ones are divided by the largest
/// norm of the reference over time.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ErrorRow {
    /// How often the coarsest mesh is refined.
    pub refinements: usize,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// h, the longest edge, m.
    pub h: f64,
    /// k, s.
    pub k: f64,
    /// h + k.
    pub h_plus_k: f64,
    /// ‖u − u^hk‖_V + ‖ζ − ζ^hk‖_Y: the number of Table 1.
    pub sum: f64,
    /// What Table 1 prints for this h and k, if this is the paper's scene and it does.
    pub printed: Option<f64>,
    /// |I^h u − u^hk| in H¹, I^h u the reference at the nodes of the mesh, + ‖ζ − ζ^hk‖: the
    /// error of u as a program sees it that compares nodal values on the coarse mesh.
    pub nodal: f64,
    /// When the sum is largest, s.
    pub sum_at: f64,
    /// ‖ε(u − u^hk)‖ in L².
    pub strain: f64,
    /// |u − u^hk| in H¹.
    pub gradient: f64,
    /// ‖ζ − ζ^hk‖ in L².
    pub zeta: f64,
    /// |ζ − ζ^hk| in H¹.
    pub zeta_gradient: f64,
    /// Relative to ‖ε(u)‖.
    pub strain_relative: f64,
    /// Relative to |u|.
    pub gradient_relative: f64,
    /// Relative to ‖ζ‖.
    pub zeta_relative: f64,
    /// Relative to |ζ|.
    pub zeta_gradient_relative: f64,
    /// Least ζ at the end.
    pub zeta_min: f64,
    /// Wall time of the run, s.
    pub seconds: f64,
}

/// An error measure: its name, its value, and the same of the reference's norms.
pub type Measure = (&'static str, fn(&ErrorRow) -> f64, fn(&Norms) -> f64);

/// The measures of the study, that of Corollary 7 first.
pub const MEASURES: [Measure; 6] = [
    ("‖ε(Δu)‖ + ‖Δζ‖ in L² (Corollary 7)", |row| row.sum, Norms::sum),
    ("|Δu| in H¹ at the nodes + ‖Δζ‖ in L²", |row| row.nodal, |size| size.gradient + size.zeta),
    ("‖ε(Δu)‖ in L²", |row| row.strain, |size| size.strain),
    ("|Δu| in H¹", |row| row.gradient, |size| size.gradient),
    ("‖Δζ‖ in L²", |row| row.zeta, |size| size.zeta),
    ("|Δζ| in H¹", |row| row.zeta_gradient, |size| size.zeta_gradient),
];

/// The runs of the study.
#[derive(Debug)]
pub struct Convergence {
    /// A row per run, mesh by mesh.
    pub rows: Vec<ErrorRow>,
}

/// Runs all meshes coarser than that of `reference`, five at most, with steps not shorter than its
/// own; `done` is told how many of how many runs are finished.
///
/// # Errors
/// There are no such meshes and steps; a run failed, or stopped at ζ_*.
pub fn converge(
    session: &Session,
    reference: &Reference,
    done: &mut dyn FnMut(usize, usize),
) -> Result<Convergence, StudyError> {
    let spec = &reference.spec;
    let steps = STEPS.map(|count| spec.end / count);
    let pairs = (0..spec.refinements.min(MESHES)).flat_map(|j| steps.map(|k| (j, k)));
    let pairs: Vec<_> = pairs.filter(|(_, k)| *k > 0.999 * spec.step).collect();
    if pairs.is_empty() {
        let problem = "no mesh and step of the study is coarser than this reference";
        return Err(StudyError::Unsuitable(problem.to_owned()));
    }
    let mut rows = Vec::new();
    for &(refinements, k) in &pairs {
        done(rows.len(), pairs.len());
        rows.push(run(session, reference, refinements, k)?);
    }
    Ok(Convergence { rows })
}

fn run(
    session: &Session,
    reference: &Reference,
    refinements: usize,
    k: f64,
) -> Result<ErrorRow, StudyError> {
    let run = reference.spec.run(refinements, k);
    let history = run.run(session, &reference.times, &mut |_| ())?;
    let (error, sum, sum_at) = reference.errors(&history.body, &history.states);
    let Norms { strain, gradient, zeta, zeta_gradient } = error;
    let (size, h) = (&reference.size, longest_edge(&history.body.mesh));
    let nodes = history.body.mesh.nodes.len();
    // Refinement keeps the numbers of the nodes.
    let at_nodes = |exact: &Fields| Fields {
        u: exact.u[..2 * nodes].to_vec(),
        zeta: exact.zeta[..nodes].to_vec(),
    };
    let own = Embedding::new(&history.body, &history.body);
    let pairs = reference.states.iter().zip(&history.states);
    let nodal = pairs.map(|(exact, state)| own.difference(&at_nodes(exact), state).gradient);
    Ok(ErrorRow {
        refinements,
        nodes,
        h,
        k,
        h_plus_k: h + k,
        sum,
        printed: printed(h, k).filter(|_| reference.spec.scene.name == PAPER),
        nodal: nodal.fold(zeta, |largest, gradient| largest.max(gradient + zeta)),
        sum_at,
        strain,
        gradient,
        zeta,
        zeta_gradient,
        strain_relative: strain / size.strain,
        gradient_relative: gradient / size.gradient,
        zeta_relative: zeta / size.zeta,
        zeta_gradient_relative: zeta_gradient / size.zeta_gradient,
        zeta_min: history.last.zeta_min,
        seconds: history.seconds,
    })
}

/// The number of Table 1 for h and k.
fn printed(h: f64, k: f64) -> Option<f64> {
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
    let n = (0..MESHES).find(|&j| near(h, 2.0_f64.sqrt() / (4 << j) as f64))?;
    let column = STEPS.iter().position(|count| near(k, 1.0 / count))?;
    Some(TABLE_1[n][column])
}

impl Convergence {
    /// h of the meshes, falling, m.
    pub fn meshes(&self) -> Vec<f64> {
        let mut meshes: Vec<_> = self.rows.iter().map(|row| row.h).collect();
        meshes.dedup();
        meshes
    }

    /// k of the rows, falling, s.
    pub fn steps(&self) -> Vec<f64> {
        self.rows.iter().filter(|row| row.refinements == 0).map(|row| row.k).collect()
    }

    /// The order p of an error ~ (h + k)^p, fitted to the rows that have this error.
    pub fn order(&self, measure: impl Fn(&ErrorRow) -> Option<f64>) -> f64 {
        let error = |row| measure(row).map(|error| (row.h_plus_k.ln(), error.ln()));
        slope(self.rows.iter().filter_map(error))
    }

    /// The order p of an error ~ h^p, fitted to the rows of the least k.
    pub fn order_in_h(&self, measure: fn(&ErrorRow) -> f64) -> f64 {
        let least = self.rows.iter().map(|row| row.k).fold(f64::INFINITY, f64::min);
        let rows = self.rows.iter().filter(|row| row.k == least);
        slope(rows.map(|row| (row.h.ln(), measure(row).ln())))
    }

    /// How much the error grows with k, per s, on the finest mesh: there h hides it least.
    pub fn growth_in_k(&self, measure: fn(&ErrorRow) -> f64) -> f64 {
        let finest = self.rows.iter().map(|row| row.refinements).max();
        let rows = self.rows.iter().filter(|row| Some(row.refinements) == finest);
        slope(rows.map(|row| (row.k, measure(row))))
    }
}
