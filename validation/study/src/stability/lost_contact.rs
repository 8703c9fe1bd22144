//! Map 7. Losing contact: bodies pulled off their foundation, resting on one point, about to tip over.

mod sweeps;

use super::{
    Table, Verdict,
    problems::{difference, solve},
    table::Row,
};
use crate::StudyError;
use signorini::{
    contact::SOLVERS,
    evolution::{ContactPoint, ObservedProblem, SetupError, State, Step},
    petsc::Session,
};
use sweeps::{CELLS, CLAMPED, SWEEPS, Sweep};

/// KKT tolerance of the scenes (the default of the program).
const TOLERANCE: f64 = 1e-10;
/// How far two answers may differ, relative to the largest |u|: a residual at the tolerance
/// moves u by the condition number of K times as much.
const AGREEMENT: f64 = 1e-7;
/// How far contact forces may be from balancing the load, relative to its size: the tolerance
/// on a norm, summed over the nodes.
const BALANCE: f64 = 1e-8;

/// A row is correct if its answer is certified, balances the load, and is the only one or noted as
/// one of many.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for sweep in &SWEEPS {
        let lifted = match sweep.side {
            CLAMPED => Some(Lifted::new(session, sweep)?),
            _ => None,
        };
        for &value in sweep.values {
            add(session, sweep, lifted.as_ref(), value, table)?;
        }
    }
    Ok(())
}

/// The clamped square that does not touch: u is proportional to the load.
struct Lifted {
    /// The load at which the first node touches, and u there.
    touch: f64,
    u: Vec<f64>,
}

impl Lifted {
    fn new(session: &Session, sweep: &Sweep) -> Result<Self, StudyError> {
        let problem = sweep.problem("-1", false)?;
        let Step { state, .. } = solve(session, &problem, SOLVERS[0], None)??;
        let mesh = &problem.body.mesh;
        let bottom = mesh.curves["bottom"].edges.iter().flatten();
        let deepest = bottom.map(|&node| -state.u[2 * node + 1]).fold(0.0, f64::max);
        let touch = sweep.gap.parse::<f64>().unwrap_or(f64::NAN) / deepest;
        Ok(Self { touch, u: state.u.iter().map(|u| touch * u).collect() })
    }
}

/// One value of the parameter: the refusal at setup, or the answer of each solver.
fn add(
    session: &Session,
    sweep: &Sweep,
    lifted: Option<&Lifted>,
    value: f64,
    table: &mut Table,
) -> Result<(), StudyError> {
    let row = |solver: &str| {
        Row::default().with("sweep", sweep.name).with("value", value).with("solver", solver)
    };
    let touch = lifted.map_or(f64::NAN, |lifted| lifted.touch);
    let load = (sweep.load)(value).replace("TOUCH", &format!("{touch:e}"));
    let problem = match sweep.problem(&load, true) {
        Ok(problem) => problem,
        Err(refusal @ SetupError::Driven { .. }) => {
            table.push_refused(row("all").with("outcome", "setup"), refusal);
            return Ok(());
        }
        Err(other) => return Err(other.into()),
    };
    let mut answers = Vec::new();
    for solver in SOLVERS {
        answers.push(solve(session, &problem, solver, None)?);
    }
    let open = lifted.filter(|_| value >= 0.0);
    let open = open.map(|l| l.u.iter().map(|u| u * (1.0 - value)).collect::<Vec<_>>());
    for (i, solver) in SOLVERS.into_iter().enumerate() {
        match &answers[i] {
            Err(failure) => table.push_refused(row(solver).with("outcome", "failed"), failure),
            Ok(answer) => {
                let others = answers.iter().enumerate().filter(|(j, _)| *j != i);
                let mut unique = others.filter_map(|(_, answer)| answer.as_ref().ok());
                let other = unique.find(|s| s.unconstrained.is_none()).map(|s| &s.state.u);
                let other = open.as_ref().or(other);
                let (row, verdict) =
                    classified(row(solver), &problem, (sweep, value), answer, other);
                table.push(row, verdict);
            }
        }
    }
    Ok(())
}

/// Judges an answer, which is certified: by balance where only contact carries the load, by
/// `other` (the answer of another solver, or without contact of the linear solve) where there is
/// but one answer, by its note where there are many.
fn classified(
    row: Row,
    problem: &ObservedProblem,
    (sweep, value): (&Sweep, f64),
    Step { state, record, report, unconstrained, .. }: &Step,
    other: Option<&Vec<f64>>,
) -> (Row, Verdict) {
    // Empty where Γ_D takes its share.
    let unbalanced = (sweep.side != CLAMPED).then(|| unbalanced(problem, state));
    let balanced = unbalanced.is_none_or(|error| error <= BALANCE);
    let many = sweep.many.is_some_and(|[from, to]| (from..=to).contains(&value));
    let noted = unconstrained.is_some();
    let apart = other.filter(|_| !noted).map(|other| difference(&state.u, other));
    // The last node that supports the body presses with a share of about margin/h; p (g − u·ν)
    // within the tolerance then leaves its gap uncertain by the tolerance over that.
    let margin = sweep.many.map_or(f64::INFINITY, |[_, to]| (value - to).abs());
    let allowed = AGREEMENT.max(TOLERANCE / (margin * CELLS as f64));
    let agrees = apart.is_none_or(|apart| apart <= allowed);
    let row = row
        .with("outcome", if noted { "noted" } else { "certified" })
        .with("active", record.active_nodes)
        .with("iterations", report.iterations)
        .with("fallbacks", report.fallbacks)
        .with("kkt", record.kkt().worst())
        .with("unbalanced", unbalanced)
        .with("difference", apart);
    let verdict = match (balanced && agrees, noted, many) {
        (false, _, _) | (true, false, true) => Verdict::Wrong,
        (true, true, false) => Verdict::Refused,
        (true, true, true) | (true, false, false) => Verdict::Correct,
    };
    (row, verdict)
}

/// The larger error of the balance of forces across the foundation and of moments, where the
/// body may turn, relative to the size of the load.
fn unbalanced(problem: &ObservedProblem, state: &State) -> f64 {
    let nodes = &problem.body.mesh.nodes;
    let load = problem.loads.at(&problem.body, state.time);
    let size: f64 = load.chunks(2).map(|f| f[0].hypot(f[1])).sum();
    // The normal of the foundation is −e_y: contact pushes up.
    let up = |point: &ContactPoint| (nodes[point.node], [0.0, point.force]);
    let contact = state.contact.iter().map(up);
    let load = nodes.iter().zip(load.chunks(2)).map(|(x, f)| (*x, [f[0], f[1]]));
    let (mut force, mut moment) = (0.0, 0.0);
    for ([x, y], [fx, fy]) in load.chain(contact) {
        force += fy;
        moment += x * fy - y * fx;
    }
    let turns = problem.motions.resisted.len() > 1;
    (if turns { force.abs().max(moment.abs()) } else { force.abs() }) / size
}
