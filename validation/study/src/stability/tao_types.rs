//! Map 4. TAO's types.

use super::{
    Table, Verdict,
    problems::{EXAMPLE_I, PRESSED_AND_LIFTED, difference, problem, solve},
    table::Row,
};
use crate::StudyError;
use signorini::{
    contact::{ContactError, TAO_TYPES},
    evolution::RunError,
    mesh::Mesh,
    petsc::Session,
};
use std::time::Instant;

/// A beam clamped left over a gap that opens, pressed down in the middle, lifted at its tip.
const BEAM: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = "0.005*x" },
    { name = "top", traction = [0, "-max(0, 1 - abs(x - 1.5)) + 0.3*max(0, x - 3)"] },
]
"#;
/// Half of a block that only contact supports.
const BLOCK: &str = r#"
boundary = [
    { name = "left", symmetry = true },
    { name = "bottom", gap = 0 },
    { name = "top", traction = [0, "-6*max(0, 1 - 2*x) + 0.5*x"] },
]
"#;

/// Name, text, and rectangle (width, height, cells along each) of a scene.
type Case = (&'static str, &'static str, (f64, f64, usize, usize));
const SCENES: [Case; 4] = [
    ("d40", PRESSED_AND_LIFTED, (1.0, 1.0, 32, 32)),
    ("beam", BEAM, (4.0, 1.0, 64, 16)),
    ("square", EXAMPLE_I, (1.0, 1.0, 32, 32)),
    ("block", BLOCK, (1.0, 1.0, 32, 32)),
];
const TOLERANCES: [f64; 3] = [1e-6, 1e-8, 1e-10];
/// How far a certified answer may be from the active set's, in tolerances: the conditioning.
const CONDITIONING: f64 = 1e3;

/// A row is correct if the answer is that of the active set.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for (name, text, (width, height, nx, ny)) in SCENES {
        let mesh = Mesh::rectangle(width, height, nx, ny);
        let exact = problem(mesh.clone(), text, &[])?;
        let reference = solve(session, &exact, "active-set", None)??;
        for kind in TAO_TYPES {
            for tolerance in TOLERANCES {
                let set = [format!("contact.tolerance={tolerance:e}")];
                let problem = problem(mesh.clone(), text, &set)?;
                let started = Instant::now();
                let answer = solve(session, &problem, &format!("tao:{kind}"), None)?;
                let row = Row::default()
                    .with("type", kind)
                    .with("scene", name)
                    .with("tolerance", tolerance)
                    .with("seconds", started.elapsed().as_secs_f64());
                let step = match answer {
                    Ok(step) => step,
                    Err(failure) => {
                        table.push(refused(row, &failure), Verdict::Refused);
                        continue;
                    }
                };
                let apart = difference(&step.state.u, &reference.state.u);
                let row = row
                    .with("outcome", "certified")
                    .with("claimed", step.report.false_claims)
                    .with("iterations", step.report.iterations)
                    .with("linear_iterations", step.report.linear_iterations)
                    .with("difference", apart);
                table.push(row, Verdict::of_answer(apart <= CONDITIONING * tolerance));
            }
        }
        table.write()?;
    }
    Ok(())
}

/// The row of a problem that TAO did not solve; `claimed` is how often it said that it did.
fn refused(row: Row, failure: &RunError) -> Row {
    let row = row.with("message", failure.to_string());
    let RunError::Contact { source, .. } = failure else { return row.with("claimed", 0) };
    match &**source {
        ContactError::NotConverged { report, residuals, .. } => row
            .with("outcome", if report.false_claims > 0 { "claimed" } else { "stalled" })
            .with("claimed", report.false_claims)
            .with("iterations", report.iterations)
            .with("linear_iterations", report.linear_iterations)
            .with("kkt", residuals.worst()),
        ContactError::NotCertified { residuals, .. } => {
            row.with("outcome", "uncertified").with("claimed", 0).with("kkt", residuals.worst())
        }
        _ => row.with("outcome", "failed").with("claimed", 0),
    }
}
