//! Map 8. Units and gaps: the same answer whatever counts as large.

use super::{
    Table, Verdict,
    problems::{self, difference, largest, run, solve},
    table::Row,
};
use crate::StudyError;
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, RunError, SetupError, State},
    mesh::Mesh,
    petsc::Session,
};

/// How a body meets a uniform gap, and what its left side does.
const KINDS: [(&str, &str); 3] = [
    // Clamped on its left, bent over the gap.
    ("clamped", "displacement = [0, 0]"),
    // Falls through the gap before it deforms.
    ("falling", "symmetry = true"),
    // Clamped, pressed and pulled: the load passes zero at t = 1/2, as well as rounding allows.
    ("swinging", "displacement = [0, 0]"),
];
/// Factors of stresses and of lengths.
const STRESSES: [f64; 3] = [1e-9, 1.0, 1e9];
const LENGTHS: [f64; 3] = [1e-3, 1.0, 1e3];
/// log₁₀ of the gap over the largest displacement without obstacle and gap.
const RATIOS: std::ops::RangeInclusive<i32> = -6..=9;
/// Largest difference of a right answer, and how much of it a wide gap adds: the digits of u that
/// it takes.
const ALLOWED: (f64, f64) = (1e-8, 1e-14);

/// A row is correct if the answer is that of the active set in SI units.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for ratio in RATIOS.map(|exponent| 10f64.powi(exponent)) {
        for (kind, support) in KINDS {
            add(session, kind, support, ratio, table)?;
        }
    }
    Ok(())
}

/// All solvers in all units.
fn add(
    session: &Session,
    kind: &'static str,
    support: &'static str,
    ratio: f64,
    table: &mut Table,
) -> Result<(), StudyError> {
    let si = |kind: &str, gap: f64| -> Result<State, StudyError> {
        Ok(last(session, &scene(kind, support, 1.0, 1.0, gap)?, SOLVERS[0])?.0)
    };
    // The size of displacements: of the clamped body without an obstacle, of the falling one on
    // the foundation, above its way.
    let size = match kind {
        "falling" => largest(&si(kind, 0.0)?.u),
        _ => largest(&si("clamped", 1e3)?.u),
    };
    let gap = ratio * size;
    let exact = si(kind, gap)?;
    let deformation = match kind {
        "falling" => size,
        _ => largest(&exact.u),
    };
    let allowed = ALLOWED.0 + ALLOWED.1 * ratio;
    for solver in SOLVERS {
        for stress in STRESSES {
            for length in LENGTHS {
                let row = Row::default()
                    .with("kind", kind)
                    .with("solver", solver)
                    .with("stress", stress)
                    .with("length", length)
                    .with("ratio", ratio)
                    .with("allowed", allowed);
                match last(session, &scene(kind, support, stress, length, gap)?, solver) {
                    Ok((state, kkt)) => {
                        let u: Vec<f64> = state.u.iter().map(|u| u / length).collect();
                        let apart = difference(&u, &exact.u) * largest(&exact.u) / deformation;
                        let active = state.contact.iter().filter(|point| point.active).count();
                        let row =
                            row.with("active", active).with("kkt", kkt).with("difference", apart);
                        table.push(row, Verdict::of_answer(apart <= allowed));
                    }
                    Err(StudyError::Run(error @ RunError::Contact { .. })) => {
                        table.push_refused(row, error);
                    }
                    Err(other) => return Err(other),
                }
            }
        }
    }
    Ok(())
}

/// A block of 2 × 1 lengths, with stresses and lengths in the given units.
fn scene(
    kind: &str,
    support: &str,
    stress: f64,
    length: f64,
    gap: f64,
) -> Result<ObservedProblem, SetupError> {
    let (young, pressure, gap) = (100.0 * stress, 0.02 * stress, gap * length);
    let (factor, time) = match kind {
        "swinging" => ("*sin(2*pi*t)", "time = { end = 0.75, step = 0.125 }"),
        _ => ("", ""),
    };
    let text = format!(
        r#"
{time}
boundary = [
    {{ name = "left", {support} }},
    {{ name = "bottom", gap = {gap:e} }},
    {{ name = "top", traction = [0, "-{pressure:e}*(0.5 + x/{length:e}){factor}"] }},
]"#
    );
    let mesh = Mesh::rectangle(2.0 * length, length, 12, 6);
    problems::problem(mesh, &text, &[format!("material.young={young:e}")])
}

/// The last state and the worst residual.
fn last(
    session: &Session,
    problem: &ObservedProblem,
    solver: &str,
) -> Result<(State, f64), StudyError> {
    if problem.scene().time.is_none() {
        let step = solve(session, problem, solver, None)??;
        return Ok((step.state, step.record.kkt().worst()));
    }
    let outcome = run(session, problem, solver)?;
    Ok((outcome.last.state, outcome.kkt.worst()))
}
