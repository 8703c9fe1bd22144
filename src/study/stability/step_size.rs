//! Map 1: the time of failure against the step, on Example I with the printed data.

use super::{Counts, StudyError, Verdict};
use crate::{
    contact::SOLVERS,
    evolution::{self, DiscreteProblem, Phases, Stop},
    output::write_table,
    petsc::Session,
    scene::Scene,
    study::rectangle,
};
use serde::Serialize;
use std::{path::Path, time::Instant};

/// Example I of the paper as printed.
const SCENE: &str = r#"
mesh = { file = "square.msh" }
material = { young = 80, poisson = 0.3, plane = "stress" }
damage = { diffusion = 0.01, lambda_d = 0.1, lambda_u = 100, lambda_w = 0, strain_cap = 1000, threshold = 0.01, initial = 1 }
time = { end = 1, step = 0.1 }
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "right", traction = [-10, -10] },
    { name = "bottom", gap = 0 },
]
"#;
const CELLS: [usize; 4] = [8, 16, 32, 64];
const STEPS: [f64; 10] = [0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4];
const TOLERANCES: [f64; 5] = [0.1, 0.03, 0.01, 3e-3, 1e-3];

/// A run of the map.
#[derive(Debug, Serialize)]
struct Row {
    n: usize,
    /// k, s; empty where steps are chosen.
    step: Option<f64>,
    /// The tolerance of chosen steps.
    tolerance: Option<f64>,
    steps: usize,
    undone: usize,
    failure_time: f64,
    uncertainty: f64,
    /// ζ_* − min ζ of the state that was not accepted.
    overshoot: f64,
    seconds: f64,
    /// The failure time as k → 0.
    reference: f64,
    verdict: Verdict,
}

/// Makes the map: a row is correct if the failure time is right to the error bar stated with it.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut rows = Vec::new();
    for n in CELLS {
        let mut of_mesh = Vec::new();
        for k in STEPS {
            of_mesh.push(fail(session, n, &[format!("time.step={k:e}")], Some(k), None)?);
        }
        for tolerance in TOLERANCES {
            let set = ["time.step=auto".to_owned(), format!("time.tolerance={tolerance:e}")];
            of_mesh.push(fail(session, n, &set, None, Some(tolerance))?);
        }
        let reference = limit(session, n)?;
        for row in &mut of_mesh {
            row.reference = reference;
            let off = (row.failure_time - reference).abs();
            row.verdict = match off <= row.uncertainty {
                true => Verdict::Correct,
                false => Verdict::Wrong,
            };
        }
        rows.append(&mut of_mesh);
    }
    write_table(&folder.join("step-size.csv"), &rows)?;
    Ok(rows.iter().map(|row| row.verdict).collect())
}

/// Runs to ζ_* with the settings `set`.
fn fail(
    session: &Session,
    n: usize,
    set: &[String],
    step: Option<f64>,
    tolerance: Option<f64>,
) -> Result<Row, StudyError> {
    let started = Instant::now();
    let scene = Scene::parse(SCENE, Path::new("square.toml"), set)?;
    let problem = DiscreteProblem::new(scene, rectangle(1.0, 1.0, n, n))?;
    let outcome =
        evolution::run(session, &problem, SOLVERS[0], &Phases::default(), &mut |_| Ok(()))?;
    let missed =
        Stop { time: f64::NAN, zeta_min: f64::NAN, least_admissible: f64::NAN, uncertainty: 0.0 };
    let stop = outcome.stopped.unwrap_or(missed);
    Ok(Row {
        n,
        step,
        tolerance,
        steps: outcome.last.record.step,
        undone: outcome.undone,
        failure_time: stop.time,
        uncertainty: stop.uncertainty,
        overshoot: problem.threshold() - stop.zeta_min,
        seconds: started.elapsed().as_secs_f64(),
        reference: f64::NAN,
        verdict: Verdict::Wrong,
    })
}

/// The failure time as k → 0: the crossing of ζ_* is interpolated in two fine runs, and Euler's
/// error, of first order in k, extrapolated away.
fn limit(session: &Session, n: usize) -> Result<f64, StudyError> {
    let crossing = |k: f64| -> Result<f64, StudyError> {
        let scene = Scene::parse(SCENE, Path::new("square.toml"), &[format!("time.step={k:e}")])?;
        let problem = DiscreteProblem::new(scene, rectangle(1.0, 1.0, n, n))?;
        let outcome =
            evolution::run(session, &problem, SOLVERS[0], &Phases::default(), &mut |_| Ok(()))?;
        let (record, level) = (outcome.last.record, problem.threshold());
        let below = outcome.stopped.map_or(f64::NAN, |stop| stop.zeta_min);
        Ok(record.time + k * (record.zeta_min - level) / (record.zeta_min - below))
    };
    let k = 4e-5;
    Ok(2.0 * crossing(0.5 * k)? - crossing(k)?)
}
