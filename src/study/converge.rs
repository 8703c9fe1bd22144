//! The paper's convergence study: errors on its grid of n and k against the reference solution.

use super::{
    Grid, Norms, Reference, StudyError,
    trial::{END, Trial},
};
use crate::{contact::SOLVERS, petsc::Session};
use serde::Serialize;

/// n of Table 1.
const CELLS: [usize; 5] = [4, 8, 16, 32, 64];
/// k of Table 1, s.
const STEPS: [f64; 5] = [0.02, 0.01, 0.005, 0.002, 0.001];

/// A run of the study. The errors are largest over time; relative ones are divided by the largest
/// norm of the reference over time.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ErrorRow {
    /// n.
    pub n: usize,
    /// k, s.
    pub k: f64,
    /// h + k with h = √2/n.
    pub h_plus_k: f64,
    /// ‖u − u^hk‖_V + ‖ζ − ζ^hk‖_Y: the number of Table 1.
    pub sum: f64,
    /// When it is largest, s.
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
    /// Wall time of the run, s.
    pub seconds: f64,
}

/// An error measure: its name, its value, and the same of the reference's norms.
pub type Measure = (&'static str, fn(&ErrorRow) -> f64, fn(&Norms) -> f64);

/// The measures of the study, the paper's first.
pub const MEASURES: [Measure; 5] = [
    ("‖ε(Δu)‖ + ‖Δζ‖ in L² (Table 1)", |row| row.sum, Norms::sum),
    ("‖ε(Δu)‖ in L²", |row| row.strain, |size| size.strain),
    ("|Δu| in H¹", |row| row.gradient, |size| size.gradient),
    ("‖Δζ‖ in L²", |row| row.zeta, |size| size.zeta),
    ("|Δζ| in H¹", |row| row.zeta_gradient, |size| size.zeta_gradient),
];

/// The runs of the study.
#[derive(Debug)]
pub struct Convergence {
    /// A row per run, n by n.
    pub rows: Vec<ErrorRow>,
}

/// Runs the part of the paper's grid that is coarser than `reference` and nested in it; `done`
/// is told how many of how many runs are finished.
///
/// # Errors
/// A run failed.
pub fn converge(
    session: &Session,
    reference: &Reference,
    done: &mut dyn FnMut(usize, usize),
) -> Result<Convergence, StudyError> {
    let plan = reference.plan;
    let nested = |n: &usize| *n < plan.cells && plan.cells.is_multiple_of(*n);
    let cells = CELLS.into_iter().filter(nested);
    let pairs = cells.flat_map(|n| STEPS.map(|k| (n, k))).filter(|(_, k)| *k > 1.001 * plan.step);
    let pairs: Vec<_> = pairs.collect();
    let mut rows = Vec::new();
    for &(n, k) in &pairs {
        done(rows.len(), pairs.len());
        rows.push(run(session, reference, n, k)?);
    }
    Ok(Convergence { rows })
}

fn run(session: &Session, reference: &Reference, n: usize, k: f64) -> Result<ErrorRow, StudyError> {
    let trial = Trial {
        grid: Grid::square(n, 1.0),
        solver: SOLVERS[0].to_owned(),
        set: vec![format!("time.step={k:e}"), format!("time.end={END}")],
    };
    let trace = trial.run(session, &reference.times, &mut |_| ())?;
    let (error, sum, sum_at) = reference.errors(&trial.grid, &trace.states);
    let Norms { strain, gradient, zeta, zeta_gradient } = error;
    let size = &reference.size;
    Ok(ErrorRow {
        n,
        k,
        h_plus_k: 2.0_f64.sqrt() / n as f64 + k,
        sum,
        sum_at,
        strain,
        gradient,
        zeta,
        zeta_gradient,
        strain_relative: strain / size.strain,
        gradient_relative: gradient / size.gradient,
        zeta_relative: zeta / size.zeta,
        zeta_gradient_relative: zeta_gradient / size.zeta_gradient,
        seconds: trace.seconds,
    })
}

impl Convergence {
    /// n of the rows, rising.
    pub fn cells(&self) -> Vec<usize> {
        let mut cells: Vec<_> = self.rows.iter().map(|row| row.n).collect();
        cells.dedup();
        cells
    }

    /// k of the rows, falling, s.
    pub fn steps(&self) -> Vec<f64> {
        let first = self.rows.first().map(|row| row.n);
        self.rows.iter().filter(|row| Some(row.n) == first).map(|row| row.k).collect()
    }

    /// The order p of an error ~ (h + k)^p, fitted to all rows.
    pub fn order(&self, measure: fn(&ErrorRow) -> f64) -> f64 {
        slope(self.rows.iter().map(|row| (row.h_plus_k.ln(), measure(row).ln())))
    }

    /// The order p of an error ~ h^p, fitted to the rows of the least k.
    pub fn order_in_h(&self, measure: fn(&ErrorRow) -> f64) -> f64 {
        let least = self.rows.iter().map(|row| row.k).fold(f64::INFINITY, f64::min);
        let rows = self.rows.iter().filter(|row| row.k == least);
        slope(rows.map(|row| (-(row.n as f64).ln(), measure(row).ln())))
    }

    /// How much the error grows with k, per s, at the largest n: there h hides it least.
    pub fn growth_in_k(&self, measure: fn(&ErrorRow) -> f64) -> f64 {
        let most = self.rows.iter().map(|row| row.n).max();
        let rows = self.rows.iter().filter(|row| Some(row.n) == most);
        slope(rows.map(|row| (row.k, measure(row))))
    }
}

/// The slope of y over x by least squares.
fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let points: Vec<_> = points.collect();
    let mean =
        |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xy, mut xx) = (0.0, 0.0);
    for point in &points {
        xy += (point.0 - x) * (point.1 - y);
        xx += (point.0 - x) * (point.0 - x);
    }
    xy / xx
}
