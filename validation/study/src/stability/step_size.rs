//! Map 1: the time of failure against the step, on Example I with the printed data.

use super::{
    Table, Verdict,
    problems::{EXAMPLE_I, run, square},
    table::Row,
};
use crate::StudyError;
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, SetupError},
    petsc::Session,
};
use std::time::Instant;

/// The damage of Example I as printed.
const DAMAGE: &str = r#"
damage = { diffusion = 0.01, lambda_d = 0.1, lambda_u = 100, lambda_w = 0, strain_cap = 1000, threshold = 0.01, initial = 1 }
time = { end = 1, step = 0.1 }
"#;
const CELLS: [usize; 4] = [8, 16, 32, 64];
const STEPS: [f64; 10] = [0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4];
/// Tolerances of chosen steps.
const TOLERANCES: [f64; 5] = [0.1, 0.03, 0.01, 3e-3, 1e-3];

/// A row is correct if the failure time is right to the error bar stated with it.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for n in CELLS {
        let limit = limit(session, n)?;
        let row = Row::default().with("n", n);
        for k in STEPS {
            let row = row.clone().with("step", k);
            add(session, table, row, &[format!("time.step={k:e}")], (n, limit))?;
        }
        for tolerance in TOLERANCES {
            let set = ["time.step=auto".to_owned(), format!("time.tolerance={tolerance:e}")];
            let row = row.clone().with("tolerance", tolerance);
            add(session, table, row, &set, (n, limit))?;
        }
    }
    Ok(())
}

/// Example I on n × n cells.
fn example_i(n: usize, set: &[String]) -> Result<ObservedProblem, SetupError> {
    square(n, &format!("{DAMAGE}{EXAMPLE_I}"), set)
}

/// Runs to ζ_* on n × n cells with steps as `set` says; `limit` is the failure time as k → 0, s.
fn add(
    session: &Session,
    table: &mut Table,
    row: Row,
    set: &[String],
    (n, limit): (usize, f64),
) -> Result<(), StudyError> {
    let started = Instant::now();
    let problem = example_i(n, set)?;
    let outcome = run(session, &problem, SOLVERS[0])?;
    let last = &outcome.last.record;
    let (time, zeta_min, uncertainty) =
        outcome.stopped.map_or((last.time, last.zeta_min, 0.0), |stop| {
            (stop.time, stop.zeta_min, stop.uncertainty)
        });
    let row = row
        .with("steps", last.step)
        .with("rejected", outcome.rejected)
        .with("failure_time", time)
        .with("uncertainty", uncertainty)
        // Of the state that was not accepted.
        .with("overshoot", problem.threshold() - zeta_min)
        .with("seconds", started.elapsed().as_secs_f64())
        .with("reference", limit);
    table.push(row, Verdict::of_answer((time - limit).abs() <= uncertainty));
    Ok(())
}

/// The failure time as k → 0: the crossing of ζ_* is interpolated in two fine runs, and Euler's
/// error, of first order in k, extrapolated away.
fn limit(session: &Session, n: usize) -> Result<f64, StudyError> {
    let crossing = |k: f64| -> Result<f64, StudyError> {
        let problem = example_i(n, &[format!("time.step={k:e}")])?;
        let outcome = run(session, &problem, SOLVERS[0])?;
        let (record, level) = (outcome.last.record, problem.threshold());
        let below = outcome.stopped.map_or(f64::NAN, |stop| stop.zeta_min);
        Ok(record.time + k * (record.zeta_min - level) / (record.zeta_min - below))
    };
    let k = 4e-5;
    Ok(2.0 * crossing(0.5 * k)? - crossing(k)?)
}
