//! Speed against accuracy: what a run costs and how far its answer is from the reference.

use super::{Grid, Norms, Reference, StudyError, front::Front, trial::Trial};
use crate::{
    contact::SOLVERS,
    evolution::{RunError, StepRecord},
    petsc::Session,
};
use serde::Serialize;

/// A choice of everything that trades seconds for accuracy.
#[derive(Debug, Clone, PartialEq)]
struct Choice {
    solver: &'static str,
    n: usize,
    grading: f64,
    steps: Steps,
    /// KKT tolerance.
    tolerance: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Steps {
    /// k, s.
    Uniform(f64),
    /// The tolerance on ζ of steps chosen by the program.
    Auto(f64),
}

impl Choice {
    fn trial(&self) -> Trial {
        let mut set = vec![format!("contact.tolerance={:e}", self.tolerance)];
        match self.steps {
            Steps::Uniform(k) => set.push(format!("time.step={k:e}")),
            Steps::Auto(tolerance) => {
                set.push("time.step=auto".to_owned());
                set.push(format!("time.tolerance={tolerance:e}"));
            }
        }
        let grid = Grid::square(self.n, self.grading);
        Trial { grid, solver: self.solver.to_owned(), set }
    }
}

/// Runs below this are made several times, s.
const SHORT: f64 = 1.0;
/// How often.
const PASSES: usize = 3;

/// What one cannot say without choosing: the shipped scene's mesh and step, the program's solver
/// and tolerance.
const DEFAULT: Choice = Choice {
    solver: SOLVERS[0],
    n: 32,
    grading: 4.0,
    steps: Steps::Uniform(0.01),
    tolerance: 1e-10,
};

/// The paper's mesh instead.
const UNIFORM: Choice = Choice { grading: 1.0, ..DEFAULT };

/// A run of the chart.
#[derive(Debug, Clone, Serialize)]
pub struct ChartRow {
    /// The contact solver.
    pub solver: String,
    /// Cells per side.
    pub n: usize,
    /// Widest over narrowest cell.
    pub grading: f64,
    /// k, s; empty where steps are chosen.
    pub step: Option<f64>,
    /// Tolerance of chosen steps.
    pub step_tolerance: Option<f64>,
    /// KKT tolerance asked for.
    pub tolerance: f64,
    /// Worst KKT residual found.
    pub kkt: f64,
    /// Time steps.
    pub steps: usize,
    /// Wall time of mesh, set-up and steps, s; of a short run the least of three.
    pub seconds: f64,
    /// Largest ‖ε(Δu)‖ + ‖Δζ‖ over time.
    pub sum: f64,
    /// Largest ‖ε(Δu)‖ over time.
    pub strain: f64,
    /// Largest |Δu| in H¹ over time.
    pub gradient: f64,
    /// Largest ‖Δζ‖ over time.
    pub zeta: f64,
    /// Largest |Δζ| in H¹ over time.
    pub zeta_gradient: f64,
    /// min ζ at the end, to know the run by.
    pub zeta_min: f64,
    /// Largest |u| at the end, m.
    pub displacement_max: f64,
    /// Whether this is what a user gets who chooses nothing.
    pub default: bool,
    /// Whether no run is both faster and more accurate, by `sum`; and the knee of these.
    pub front: bool,
    /// See `front`.
    pub knee: bool,
    /// The same by `zeta`.
    pub front_zeta: bool,
    /// The same by `zeta`.
    pub knee_zeta: bool,
    /// Why the run failed, if it did.
    pub error: Option<String>,
}

/// Runs the chart and marks its fronts; `done` is told how many of how many runs are finished.
///
/// # Errors
/// A run failed for which no contact solver is to blame.
pub fn chart(
    session: &Session,
    reference: &Reference,
    done: &mut dyn FnMut(usize, usize),
) -> Result<Vec<ChartRow>, StudyError> {
    let choices = choices(reference.plan.cells);
    // The first run of a process pays for what the others find ready.
    if let Some(choice) = choices.first() {
        choice.trial().run(session, &[], &mut |_| ())?;
    }
    let mut rows = Vec::new();
    for choice in &choices {
        done(rows.len(), PASSES * choices.len());
        rows.push(run(session, reference, choice)?);
    }
    // Passes over all, so that what else the machine does for a while slows no run each time.
    for pass in 1..PASSES {
        done(pass * choices.len(), PASSES * choices.len());
        for (row, choice) in rows.iter_mut().zip(&choices) {
            if row.seconds < SHORT {
                let again = choice.trial().run(session, &[], &mut |_| ())?;
                row.seconds = row.seconds.min(again.seconds);
            }
        }
    }
    mark(&mut rows);
    Ok(rows)
}

/// The runs, for a reference of `finest` cells a side: all must be coarser.
fn choices(finest: usize) -> Vec<Choice> {
    let mut choices = vec![DEFAULT];
    // Solvers, meshes and uniform steps.
    for solver in SOLVERS {
        for n in [8, 16, 32, 64, 128] {
            for k in [0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001] {
                // The other solvers show where they stand on smaller meshes.
                if solver == SOLVERS[0] || (n <= 64 && k >= 0.002) {
                    let steps = Steps::Uniform(k);
                    choices.push(Choice { solver, n, steps, ..UNIFORM });
                }
            }
        }
    }
    // Graded meshes.
    for grading in [2.0, 4.0, 8.0, 16.0, 32.0] {
        for n in [8, 16, 32, 64, 128] {
            for k in [0.1, 0.05, 0.02, 0.01, 0.005, 0.002] {
                choices.push(Choice { n, grading, steps: Steps::Uniform(k), ..DEFAULT });
            }
        }
    }
    // Chosen steps.
    for grading in [UNIFORM.grading, DEFAULT.grading] {
        for n in [8, 16, 32, 64, 128] {
            for tolerance in [1e-2, 3e-3, 1e-3, 2e-4, 5e-5] {
                choices.push(Choice { n, grading, steps: Steps::Auto(tolerance), ..DEFAULT });
            }
        }
    }
    // Loose tolerances.
    for tolerance in [1e-4, 1e-6, 1e-8] {
        for n in [16, 32, 64] {
            for solver in SOLVERS {
                choices.push(Choice { solver, n, tolerance, ..UNIFORM });
            }
            choices.push(Choice { n, tolerance, ..DEFAULT });
        }
    }
    let mut once: Vec<Choice> = Vec::new();
    for choice in choices.into_iter().filter(|choice| choice.n < finest) {
        if !once.contains(&choice) {
            once.push(choice);
        }
    }
    once
}

fn run(session: &Session, reference: &Reference, choice: &Choice) -> Result<ChartRow, StudyError> {
    let (step, step_tolerance) = match choice.steps {
        Steps::Uniform(k) => (Some(k), None),
        Steps::Auto(tolerance) => (None, Some(tolerance)),
    };
    let trial = choice.trial();
    let mut row = ChartRow {
        solver: choice.solver.to_owned(),
        n: choice.n,
        grading: choice.grading,
        step,
        step_tolerance,
        tolerance: choice.tolerance,
        kkt: f64::NAN,
        steps: 0,
        seconds: f64::NAN,
        sum: f64::NAN,
        strain: f64::NAN,
        gradient: f64::NAN,
        zeta: f64::NAN,
        zeta_gradient: f64::NAN,
        zeta_min: f64::NAN,
        displacement_max: f64::NAN,
        default: *choice == DEFAULT,
        front: false,
        knee: false,
        front_zeta: false,
        knee_zeta: false,
        error: None,
    };
    let trace = match trial.run(session, &reference.times, &mut |_| ()) {
        Ok(trace) => trace,
        Err(StudyError::Run(error @ RunError::Contact { .. })) => {
            row.error = Some(error.to_string());
            return Ok(row);
        }
        Err(other) => return Err(other),
    };
    let (error, sum, _) = reference.errors(&trial.grid, &trace.states);
    let StepRecord { step: steps, zeta_min, displacement_max, .. } = trace.last;
    let Norms { strain, gradient, zeta, zeta_gradient } = error;
    let (kkt, seconds) = (trace.kkt.worst(), trace.seconds);
    Ok(ChartRow {
        kkt,
        steps,
        seconds,
        sum,
        strain,
        gradient,
        zeta,
        zeta_gradient,
        zeta_min,
        displacement_max,
        ..row
    })
}

/// Marks the Pareto fronts and their knees.
fn mark(rows: &mut [ChartRow]) {
    let points = |error: fn(&ChartRow) -> f64| -> Vec<[f64; 2]> {
        rows.iter().map(|row| [row.seconds, error(row)]).collect()
    };
    let [sum, zeta] = [points(|row| row.sum), points(|row| row.zeta)];
    let [sum, zeta] = [Front::of(&sum), Front::of(&zeta)];
    for (i, row) in rows.iter_mut().enumerate() {
        (row.front, row.knee) = (sum.members.contains(&i), sum.knee == Some(i));
        (row.front_zeta, row.knee_zeta) = (zeta.members.contains(&i), zeta.knee == Some(i));
    }
}
