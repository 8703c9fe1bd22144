//! Conditioning: soft holes, slivers, near incompressibility, slender bodies.

mod cases;

use super::{
    Table, Verdict,
    problems::{difference, run},
    table::Row,
};
use crate::StudyError;
use cases::Case;
use signorini::{
    contact::SOLVERS,
    evolution::{Accuracy, ObservedProblem, Outcome, RunError},
    petsc::Session,
};
use std::time::Instant;

/// A reference whose own error is estimated to be larger is none.
const REFERENCE: f64 = 1e-4;

/// What a solver said of a case to a tolerance.
struct Attempt {
    tolerance: f64,
    solver: &'static str,
    seconds: f64,
    /// The answer, or why there is none.
    outcome: Result<Outcome, String>,
    notes: Vec<String>,
    /// Error of the discretisation, relative, where an exact answer is known.
    error: Option<f64>,
}

/// A row is correct if its answer is certified, agrees with another solver's, and is as exact as
/// the mesh should be.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for case in cases::all() {
        let mut attempts = Vec::new();
        for &tolerance in case.tolerances {
            let problem = case.problem(tolerance)?;
            for solver in SOLVERS {
                attempts.push(attempt(session, &case, &problem, solver)?);
            }
        }
        attempts.iter().for_each(|attempt| add(&case, attempt, &attempts, table));
        table.write()?;
    }
    Ok(())
}

fn attempt(
    session: &Session,
    case: &Case,
    problem: &ObservedProblem,
    solver: &'static str,
) -> Result<Attempt, StudyError> {
    let started = Instant::now();
    let solved = run(session, problem, solver);
    let seconds = started.elapsed().as_secs_f64();
    let (mut notes, mut error) = (Vec::new(), None);
    let outcome = match solved {
        Ok(outcome) => {
            notes = problem.notes();
            notes.extend(outcome.accuracy.notes(problem.tolerance));
            error = case.exact.as_ref().map(|exact| exact.error(problem, &outcome));
            Ok(outcome)
        }
        Err(failure @ RunError::Contact { .. }) => Err(failure.to_string()),
        Err(other) => return Err(other.into()),
    };
    Ok(Attempt { tolerance: problem.tolerance, solver, seconds, outcome, notes, error })
}

/// Judges one of all the `attempts` at a case.
fn add(case: &Case, attempt: &Attempt, attempts: &[Attempt], table: &mut Table) {
    let Attempt { tolerance, solver, seconds, ref notes, error, .. } = *attempt;
    let allowed = case.exact.as_ref().map(|exact| exact.allowed());
    let row = Row::default()
        .with("sweep", case.sweep)
        .with("case", case.name)
        .with("nx", case.cells[0])
        .with("ny", case.cells[1])
        // What the sweep varies: ζ of the hole, the smallest angle (°), ν, length over height.
        .with("parameter", case.parameter)
        .with("tolerance", tolerance)
        .with("solver", solver)
        .with("allowed", allowed)
        .with("notes", notes.len())
        .with("seconds", seconds);
    let mut agreement = Accuracy::promised(tolerance);
    let outcome = match &attempt.outcome {
        Ok(outcome) => outcome,
        Err(message) => {
            return table.push_refused(row.with("agreement", agreement), message);
        }
    };
    let reference = most_exact_other(attempt, outcome, attempts);
    let apart = reference.map(|best| difference(&outcome.last.state.u, &best.last.state.u));
    if let Some(best) = reference.map(|best| best.accuracy.displacement)
        && notes.is_empty()
        && best <= REFERENCE
    {
        // Where nothing was noted a reference that is itself less exact cannot tell more.
        agreement = agreement.max(2.0 * best);
    }
    let row = row
        .with("iterations", outcome.last.record.iterations)
        .with("kkt", outcome.kkt.worst())
        // From the most exact of the other solvers, and how far it may be.
        .with("difference", apart)
        .with("agreement", agreement)
        // The program's own estimates of this, and of the error in the energy norm.
        .with("estimate", outcome.accuracy.displacement)
        .with("energy_error", outcome.accuracy.energy)
        .with("error", error)
        .with("message", notes.first());
    let within = |value: Option<f64>, limit: f64| value.is_some_and(|value| value <= limit);
    let right = outcome.kkt.worst() <= tolerance
        && within(apart, agreement)
        && allowed.is_none_or(|allowed| within(error, allowed));
    let verdict = match (right, notes.is_empty()) {
        (false, false) => Verdict::Refused,
        (right, _) => Verdict::of_answer(right),
    };
    table.push(row, verdict);
}

/// The answer of another solver whose u is estimated to be the most exact. An equal u is the
/// active set's rescue by TAO: the same answer, no reference.
fn most_exact_other<'a>(
    attempt: &Attempt,
    outcome: &Outcome,
    attempts: &'a [Attempt],
) -> Option<&'a Outcome> {
    let others = attempts.iter().filter(|other| other.solver != attempt.solver);
    let answers = others.filter_map(|other| other.outcome.as_ref().ok());
    let different = answers.filter(|other| other.last.state.u != outcome.last.state.u);
    different.min_by(|a, b| a.accuracy.displacement.total_cmp(&b.accuracy.displacement))
}
