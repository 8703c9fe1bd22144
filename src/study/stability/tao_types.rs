//! Map 4. TAO's types.

use super::{
    Counts, StudyError, Verdict,
    penalty::D40,
    statics::{difference, problem, solve},
};
use crate::{
    contact::{ContactError, TAO_TYPES},
    evolution::RunError,
    output,
    petsc::Session,
};
use serde::Serialize;
use std::{path::Path, time::Instant};

/// A beam clamped left over a gap that opens, pressed down in the middle, lifted at its tip.
const BEAM: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = "0.005*x" },
    { name = "top", traction = [0, "-max(0, 1 - abs(x - 1.5)) + 0.3*max(0, x - 3)"] },
]
"#;
/// Example I's square without its damage.
const SQUARE: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = 0 },
    { name = "right", traction = [-10, -10] },
]
"#;
/// Half of a block that only contact holds up.
const BLOCK: &str = r#"
boundary = [
    { name = "left", symmetry = true },
    { name = "bottom", gap = 0 },
    { name = "top", traction = [0, "-6*max(0, 1 - 2*x) + 0.5*x"] },
]
"#;

/// Name, text, and rectangle of each scene.
type Case = (&'static str, &'static str, (f64, f64, usize, usize));
const SCENES: [Case; 4] = [
    ("d40", D40, (1.0, 1.0, 32, 32)),
    ("beam", BEAM, (4.0, 1.0, 64, 16)),
    ("square", SQUARE, (1.0, 1.0, 32, 32)),
    ("block", BLOCK, (1.0, 1.0, 32, 32)),
];
const TOLERANCES: [f64; 3] = [1e-6, 1e-8, 1e-10];
/// How far a certified answer may be from the active set's, in tolerances: the conditioning.
const CONDITIONING: f64 = 1e3;

#[derive(Serialize)]
struct Cell {
    r#type: &'static str,
    scene: &'static str,
    tolerance: f64,
    outcome: &'static str,
    claimed: usize,
    iterations: Option<usize>,
    linear_iterations: Option<usize>,
    kkt: Option<f64>,
    difference: Option<f64>,
    seconds: f64,
    verdict: Verdict,
    message: Option<String>,
}

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut table = Vec::new();
    for (scene, text, size) in SCENES {
        let exact = problem(text, &[], size)?;
        let (reference, _) = solve(session, &exact, "active-set", None)??;
        for kind in TAO_TYPES {
            for tolerance in TOLERANCES {
                let problem = problem(text, &[format!("contact.tolerance={tolerance:e}")], size)?;
                let started = Instant::now();
                let answer = solve(session, &problem, &format!("tao:{kind}"), None)?;
                let mut cell = Cell {
                    r#type: kind,
                    scene,
                    tolerance,
                    outcome: "failed",
                    claimed: 0,
                    iterations: None,
                    linear_iterations: None,
                    kkt: None,
                    difference: None,
                    seconds: started.elapsed().as_secs_f64(),
                    verdict: Verdict::Refused,
                    message: None,
                };
                match answer {
                    Ok((step, report)) => {
                        let apart = difference(&step.state.u, &reference.state.u);
                        cell.outcome = "certified";
                        cell.claimed = report.false_claims;
                        cell.iterations = Some(report.iterations);
                        cell.linear_iterations = Some(report.linear_iterations);
                        cell.difference = Some(apart);
                        cell.verdict = match apart <= CONDITIONING * tolerance {
                            true => Verdict::Correct,
                            false => Verdict::Wrong,
                        };
                    }
                    Err(failure) => cell.refused(&failure),
                }
                table.push(cell);
            }
        }
        // Written after each scene: what is measured is kept.
        output::write_table(&folder.join("tao-types.csv"), &table)?;
    }
    Ok(table.iter().map(|cell| cell.verdict).collect())
}

impl Cell {
    fn refused(&mut self, failure: &RunError) {
        self.message = Some(failure.to_string());
        let RunError::Contact { source, .. } = failure else { return };
        match &**source {
            ContactError::NotConverged { report, residuals, .. } => {
                self.outcome = if report.false_claims > 0 { "claimed" } else { "stalled" };
                self.claimed = report.false_claims;
                self.iterations = Some(report.iterations);
                self.linear_iterations = Some(report.linear_iterations);
                self.kkt = Some(residuals.worst());
            }
            ContactError::NotCertified { residuals, .. } => {
                self.outcome = "uncertified";
                self.kkt = Some(residuals.worst());
            }
            _ => {}
        }
    }
}
