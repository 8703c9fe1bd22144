//! The reference solution of the convergence study: the paper's "exact solution", computed once.

use super::{
    Embedding, Fields, Grid, Norms, ReferenceError, StudyError,
    store::{self, Label},
    trial::{END, SCENE, Trial},
};
use crate::{contact::SOLVERS, evolution::StepRecord, fem::Body, petsc::Session};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// How fine a reference is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Cells per side, n.
    pub cells: usize,
    /// Grading of the grid as of `geo/square.geo`; 1: uniform.
    pub grading: f64,
    /// k, s.
    pub step: f64,
}

/// The states kept are this far apart, s: the times that all k of the paper's grid have in common.
const SPACING: f64 = 0.02;

/// A reference solution.
#[derive(Debug)]
pub struct Reference {
    /// What it was computed with.
    pub plan: Plan,
    /// Times of the states, s.
    pub times: Vec<f64>,
    /// The states.
    pub states: Vec<Fields>,
    /// Its mesh.
    pub body: Body,
    /// The largest norms of the states.
    pub size: Norms,
}

impl Plan {
    /// Refuses a plan whose steps do not meet the times of the states.
    ///
    /// # Errors
    /// It is such a plan.
    pub fn check(&self) -> Result<(), ReferenceError> {
        let steps = SPACING / self.step;
        let meets = steps.is_finite() && steps > 0.5 && (steps - steps.round()).abs() < 1e-6;
        match (self.cells, meets) {
            (2.., true) if self.grading > 0.0 => Ok(()),
            (2.., true) => Err(ReferenceError::Plan("the grading must be positive".to_owned())),
            (2.., false) => Err(ReferenceError::Plan(format!(
                "the step {} must divide {SPACING}, the distance of the states compared",
                self.step
            ))),
            _ => Err(ReferenceError::Plan("the reference needs at least 2 cells a side".into())),
        }
    }

    /// Where the reference of this plan is kept in `folder`.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let Self { cells, grading, step } = self;
        let graded = if *grading == 1.0 { String::new() } else { format!("-grading{grading}") };
        folder.join(format!("square-mild-n{cells}{graded}-k{step:e}.states"))
    }

    /// Computes the states of this plan and keeps them in `folder`; `accepted` sees every step.
    ///
    /// # Errors
    /// The plan makes no sense, the run failed, or its states cannot be written.
    pub fn compute(
        &self,
        session: &Session,
        folder: &Path,
        accepted: &mut dyn FnMut(&StepRecord),
    ) -> Result<(), StudyError> {
        self.check()?;
        let trace = self.trial().run(session, &times(), accepted)?;
        store::write(&self.path(folder), &self.label(), &trace.states)?;
        Ok(())
    }

    /// Reads the states of this plan from `folder`.
    ///
    /// # Errors
    /// There are none, they belong to another scene or mesh, or the file is damaged.
    pub fn load(&self, folder: &Path) -> Result<Reference, ReferenceError> {
        self.check()?;
        let states = store::read(&self.path(folder), &self.label())?;
        let body = Body::new(self.grid().mesh());
        // The norms of a field are those of its difference from zero, on any grid.
        let cell = Embedding::new(&body, &Grid::square(1, 1.0));
        let norms = |state| cell.difference(state, &Fields::zero(4));
        let size = states.iter().map(norms).fold(Norms::default(), |a, b| a.max(&b));
        Ok(Reference { plan: *self, times: times(), states, body, size })
    }

    fn grid(&self) -> Grid {
        Grid::square(self.cells, self.grading)
    }

    fn trial(&self) -> Trial {
        Trial {
            grid: self.grid(),
            solver: SOLVERS[0].to_owned(),
            set: vec![format!("time.step={:e}", self.step), "contact.tolerance=1e-10".to_owned()],
        }
    }

    /// The hash of everything the states depend on. Comments in the scene are not among it.
    fn label(&self) -> Label {
        let trial = self.trial();
        // Text that is no TOML is refused before anything is kept.
        let mut scene = SCENE.parse::<toml::Table>().unwrap_or_default();
        // The study brings its own meshes.
        scene.remove("mesh");
        let scene = scene.to_string();
        let mesh = trial.grid.mesh();
        let mut hash = Sha256::new();
        for text in [&scene, &trial.solver, &trial.set.join(" ")] {
            hash.update(text);
            hash.update([0]);
        }
        mesh.nodes.iter().flatten().for_each(|x| hash.update(x.to_le_bytes()));
        mesh.triangles.iter().flatten().for_each(|&n| hash.update((n as u64).to_le_bytes()));
        times().iter().for_each(|t| hash.update(t.to_le_bytes()));
        Label {
            hash: hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect(),
            states: times().len(),
            nodes: mesh.nodes.len(),
        }
    }
}

impl Reference {
    /// The largest errors over the times of `states`, which belong to the nodes of `grid`, each
    /// time all norms; and the largest ‖Δu‖_V + ‖Δζ‖_Y with the time it is reached at.
    pub fn errors(&self, grid: &Grid, states: &[Fields]) -> (Norms, f64, f64) {
        let embedding = Embedding::new(&self.body, grid);
        let (mut worst, mut sum, mut at) = (Norms::default(), 0.0, 0.0);
        for ((time, exact), state) in self.times.iter().zip(&self.states).zip(states) {
            let norms = embedding.difference(exact, state);
            worst = worst.max(&norms);
            if norms.sum() > sum {
                (sum, at) = (norms.sum(), *time);
            }
        }
        (worst, sum, at)
    }
}

/// The times of the states, s: 0, 0.02, …, 1.
fn times() -> Vec<f64> {
    let count = (END / SPACING).round();
    (0..=count as usize).map(|j| END * j as f64 / count).collect()
}
