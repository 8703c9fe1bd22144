//! Conditioning: soft holes, slivers, near incompressibility, slender bodies.

mod cases;

use super::{Counts, StudyError, Verdict, statics::difference};
use crate::{
    contact::SOLVERS,
    evolution::{self, Accuracy, DiscreteProblem, Outcome, Phases, RunError},
    output::write_table,
    petsc::Session,
};
use cases::Case;
use serde::Serialize;
use std::{path::Path, time::Instant};

/// A reference whose own error is estimated to be larger is none.
const REFERENCE: f64 = 1e-4;

/// A solver's answer to a case.
#[derive(Debug, Serialize)]
struct Row {
    sweep: &'static str,
    case: &'static str,
    nx: usize,
    ny: usize,
    /// What the sweep varies: ζ of the hole, the smallest angle (°), ν, length over height.
    parameter: f64,
    /// KKT tolerance.
    tolerance: f64,
    solver: &'static str,
    iterations: Option<usize>,
    kkt: Option<f64>,
    /// Of u from the most exact of the other solvers, relative.
    difference: Option<f64>,
    /// The program's own estimate of this.
    estimate: Option<f64>,
    /// The largest difference that counts as right.
    agreement: f64,
    /// Error of the discretisation, relative, where an exact answer is known.
    error: Option<f64>,
    /// The largest one that counts as right.
    allowed: Option<f64>,
    /// The program's own estimate of the error, in the energy norm.
    energy_error: Option<f64>,
    notes: usize,
    seconds: f64,
    verdict: Verdict,
    /// The error, or the first note.
    message: Option<String>,
}

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut table = Vec::new();
    for case in cases::all() {
        fill(session, &case, &mut table)?;
        // Written after each case: what is measured is kept.
        write_table(&folder.join("conditioning.csv"), &table)?;
    }
    Ok(table.iter().map(|row| row.verdict).collect())
}

/// Solves a case with all solvers to all its tolerances, then judges the answers.
fn fill(session: &Session, case: &Case, table: &mut Vec<Row>) -> Result<(), StudyError> {
    let (first, mut answers) = (table.len(), Vec::new());
    for &tolerance in case.tolerances {
        let problem = case.problem(tolerance)?;
        for solver in SOLVERS {
            let (row, answer) = solve(session, case, &problem, solver)?;
            table.push(row);
            answers.push((solver, answer));
        }
    }
    for (row, (solver, answer)) in table[first..].iter_mut().zip(&answers) {
        let Some(answer) = answer else { continue };
        // An equal u is the active set's rescue by TAO: the same answer, no reference.
        let others = answers
            .iter()
            .filter(|(other, _)| other != solver)
            .filter_map(|(_, other)| other.as_ref())
            .filter(|other| other.last.state.u != answer.last.state.u);
        let best =
            others.min_by(|a, b| a.accuracy.displacement.total_cmp(&b.accuracy.displacement));
        if let Some(best) = best {
            row.difference = Some(difference(&answer.last.state.u, &best.last.state.u));
            // Where nothing was noted a reference that is itself less exact cannot tell more.
            if row.notes == 0 && best.accuracy.displacement <= REFERENCE {
                row.agreement = row.agreement.max(2.0 * best.accuracy.displacement);
            }
        }
        row.verdict = row.judge();
    }
    Ok(())
}

/// A row without its verdict, and the answer if there is one.
fn solve(
    session: &Session,
    case: &Case,
    problem: &DiscreteProblem,
    solver: &'static str,
) -> Result<(Row, Option<Outcome>), StudyError> {
    let mut row = Row::new(case, problem.tolerance, solver);
    let started = Instant::now();
    let solved = evolution::run(session, problem, solver, &Phases::default(), &mut |_| Ok(()));
    row.seconds = started.elapsed().as_secs_f64();
    match solved {
        Ok(outcome) => {
            let mut notes = problem.notes();
            notes.extend(outcome.accuracy.notes(problem.tolerance));
            row.notes = notes.len();
            row.message = notes.into_iter().next();
            row.iterations = Some(outcome.last.record.iterations);
            row.kkt = Some(outcome.kkt.worst());
            row.estimate = Some(outcome.accuracy.displacement);
            row.energy_error = Some(outcome.accuracy.energy);
            row.error = case.exact.as_ref().map(|exact| exact.error(problem, &outcome));
            Ok((row, Some(outcome)))
        }
        Err(failure @ RunError::Contact { .. }) => {
            row.message = Some(failure.to_string());
            Ok((row, None))
        }
        Err(other) => Err(other.into()),
    }
}

impl Row {
    fn new(case: &Case, tolerance: f64, solver: &'static str) -> Self {
        Self {
            sweep: case.sweep,
            case: case.name,
            nx: case.cells[0],
            ny: case.cells[1],
            parameter: case.parameter,
            tolerance,
            solver,
            iterations: None,
            kkt: None,
            difference: None,
            estimate: None,
            agreement: Accuracy::promised(tolerance),
            error: None,
            allowed: case.exact.as_ref().map(|exact| exact.allowed()),
            energy_error: None,
            notes: 0,
            seconds: 0.0,
            verdict: Verdict::Refused,
            message: None,
        }
    }

    /// Right: certified, in agreement with another solver, and as exact as the mesh should be.
    fn judge(&self) -> Verdict {
        let within = |value: Option<f64>, limit: f64| value.is_some_and(|value| value <= limit);
        let right = within(self.kkt, self.tolerance)
            && within(self.difference, self.agreement)
            && self.allowed.is_none_or(|allowed| within(self.error, allowed));
        match (right, self.notes) {
            (true, _) => Verdict::Correct,
            (false, 0) => Verdict::Wrong,
            (false, _) => Verdict::Refused,
        }
    }
}
