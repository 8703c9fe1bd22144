//! Map 7. Losing contact: bodies pulled off their foundation, resting on one point, about to tip over.

mod sweeps;

use super::{
    Counts, StudyError, Verdict,
    statics::{difference, solve},
};
use crate::{
    contact::{ContactReport, SOLVERS},
    evolution::{ContactPoint, DiscreteProblem, SetupError, State, Step},
    output,
    petsc::Session,
};
use serde::Serialize;
use std::path::Path;
use sweeps::{CELLS, CLAMPED, SWEEPS, Sweep};

/// KKT tolerance of the scenes (the default of the program).
const TOLERANCE: f64 = 1e-10;
/// How far two answers may differ, relative to the largest |u|: a residual at the tolerance
/// moves u by the condition number of K times as much.
const AGREEMENT: f64 = 1e-7;
/// How far contact forces may be from balancing the load, relative to its size: the tolerance
/// on a norm, summed over the nodes.
const BALANCE: f64 = 1e-8;

#[derive(Serialize)]
struct Row {
    sweep: &'static str,
    value: f64,
    solver: &'static str,
    outcome: &'static str,
    active: Option<usize>,
    iterations: Option<usize>,
    fallbacks: Option<usize>,
    kkt: Option<f64>,
    /// Largest error of force and moment balance; empty where Γ_D takes its share.
    unbalanced: Option<f64>,
    /// From the answer of another solver, or without contact of the linear solve.
    difference: Option<f64>,
    verdict: Verdict,
    message: Option<String>,
}

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut table = Vec::new();
    for sweep in &SWEEPS {
        let lifted = match sweep.side {
            CLAMPED => Some(Lifted::new(session, sweep)?),
            _ => None,
        };
        for &value in sweep.values {
            table.append(&mut rows(session, sweep, lifted.as_ref(), value)?);
        }
    }
    output::write_table(&folder.join("lost-contact.csv"), &table)?;
    Ok(table.iter().map(|row| row.verdict).collect())
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
        let (Step { state, .. }, _) = solve(session, &problem, SOLVERS[0], None)??;
        let mesh = &problem.body.mesh;
        let bottom = mesh.curves["bottom"].edges.iter().flatten();
        let deepest = bottom.map(|&node| -state.u[2 * node + 1]).fold(0.0, f64::max);
        let touch = sweep.gap.parse::<f64>().unwrap_or(f64::NAN) / deepest;
        Ok(Self { touch, u: state.u.iter().map(|u| touch * u).collect() })
    }
}

/// One value of the parameter: the refusal at setup, or the answer of each solver.
fn rows(
    session: &Session,
    sweep: &Sweep,
    lifted: Option<&Lifted>,
    value: f64,
) -> Result<Vec<Row>, StudyError> {
    let touch = lifted.map_or(f64::NAN, |lifted| lifted.touch);
    let load = (sweep.load)(value).replace("TOUCH", &format!("{touch:e}"));
    let problem = match sweep.problem(&load, true) {
        Ok(problem) => problem,
        Err(refusal @ SetupError::Driven { .. }) => {
            let message = Some(refusal.to_string());
            return Ok(vec![Row { outcome: "setup", message, ..Row::new(sweep, value, "all") }]);
        }
        Err(other) => return Err(other.into()),
    };
    let answers = SOLVERS.map(|solver| solve(session, &problem, solver, None));
    let [a, b, c] = answers;
    let answers = [a?, b?, c?];
    let open = lifted.filter(|_| value >= 0.0);
    let open = open.map(|l| l.u.iter().map(|u| u * (1.0 - value)).collect::<Vec<_>>());
    let row = |(i, solver): (usize, &&'static str)| {
        let mut row = Row::new(sweep, value, solver);
        match &answers[i] {
            Err(failure) => row.message = Some(failure.to_string()),
            Ok((step, report)) => {
                let others = answers.iter().enumerate().filter(|(j, _)| *j != i);
                let mut unique = others.filter_map(|(_, answer)| answer.as_ref().ok());
                let other =
                    unique.find(|(s, _)| s.unconstrained.is_none()).map(|(s, _)| &s.state.u);
                row.judge(&problem, sweep, step, report, open.as_ref().or(other));
            }
        }
        row
    };
    Ok(SOLVERS.iter().enumerate().map(row).collect())
}

impl Row {
    fn new(sweep: &Sweep, value: f64, solver: &'static str) -> Self {
        Self {
            sweep: sweep.name,
            value,
            solver,
            outcome: "failed",
            active: None,
            iterations: None,
            fallbacks: None,
            kkt: None,
            unbalanced: None,
            difference: None,
            verdict: Verdict::Refused,
            message: None,
        }
    }

    /// Judges an answer, which is certified: by balance where only contact carries the load, by
    /// `other` where there is but one answer, by its note where there are many.
    fn judge(
        &mut self,
        problem: &DiscreteProblem,
        sweep: &Sweep,
        Step { state, record, unconstrained, .. }: &Step,
        report: &ContactReport,
        other: Option<&Vec<f64>>,
    ) {
        self.active = Some(record.active_nodes);
        self.iterations = Some(report.iterations);
        self.fallbacks = Some(report.fallbacks);
        self.kkt = Some(record.kkt().worst());
        self.unbalanced = (sweep.side != CLAMPED).then(|| unbalanced(problem, state));
        let balanced = self.unbalanced.is_none_or(|error| error <= BALANCE);
        let many = sweep.many.is_some_and(|[from, to]| (from..=to).contains(&self.value));
        if unconstrained.is_none() {
            self.outcome = "certified";
            self.difference = other.map(|other| difference(&state.u, other));
        } else {
            self.outcome = "noted";
        }
        // The last node that holds the body presses with a share of about margin/h; p (g − u·ν)
        // within the tolerance then leaves its gap uncertain by the tolerance over that.
        let margin = sweep.many.map_or(f64::INFINITY, |[_, to]| (self.value - to).abs());
        let allowed = AGREEMENT.max(TOLERANCE / (margin * CELLS as f64));
        let agrees = self.difference.is_none_or(|difference| difference <= allowed);
        self.verdict = match (balanced && agrees, unconstrained.is_some(), many) {
            (false, _, _) | (true, false, true) => Verdict::Wrong,
            (true, true, false) => Verdict::Refused,
            (true, true, true) | (true, false, false) => Verdict::Correct,
        };
    }
}

/// The larger error of the balance of forces across the foundation and of moments, where the
/// body may turn, relative to the size of the load.
fn unbalanced(problem: &DiscreteProblem, state: &State) -> f64 {
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
    let turns = problem.motions.resisted() > 1;
    (if turns { force.abs().max(moment.abs()) } else { force.abs() }) / size
}
