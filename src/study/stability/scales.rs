//! Map 8. Units and gaps: the same answer whatever counts as large.

use super::{
    Counts, StudyError, Verdict,
    statics::{difference, solve},
};
use crate::{
    contact::SOLVERS,
    evolution::{self, DiscreteProblem, Phases, RunError, State},
    output,
    petsc::Session,
    scene::Scene,
    study::rectangle,
};
use serde::Serialize;
use std::path::Path;

/// How a body meets a uniform gap, and what its left side does.
const KINDS: [(&str, &str); 3] = [
    // Held on its left, bent over the gap.
    ("clamped", "displacement = [0, 0]"),
    // Falls through the gap before it deforms.
    ("falling", "symmetry = true"),
    // Held, pressed and pulled: the load passes zero at t = 1/2, as well as rounding allows.
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

#[derive(Serialize)]
struct Cell {
    kind: &'static str,
    solver: &'static str,
    stress: f64,
    length: f64,
    ratio: f64,
    active: Option<usize>,
    kkt: Option<f64>,
    difference: Option<f64>,
    allowed: f64,
    verdict: Verdict,
    message: Option<String>,
}

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut table = Vec::new();
    for ratio in RATIOS.map(|exponent| 10f64.powi(exponent)) {
        for (kind, support) in KINDS {
            sweep(session, (kind, support), ratio, &mut table)?;
        }
    }
    output::write_table(&folder.join("scales.csv"), &table)?;
    Ok(table.iter().map(|cell| cell.verdict).collect())
}

/// All solvers in all units, against the active set in SI units.
fn sweep(
    session: &Session,
    (kind, support): (&'static str, &'static str),
    ratio: f64,
    table: &mut Vec<Cell>,
) -> Result<(), StudyError> {
    // The size of displacements: of the clamped body without an obstacle, of the falling one on
    // the foundation, above its way.
    let size = match kind {
        "falling" => {
            largest(&last(session, &scene(kind, support, 1.0, 1.0, 0.0)?, SOLVERS[0])?.0.u)
        }
        _ => largest(&last(session, &scene("clamped", support, 1.0, 1.0, 1e3)?, SOLVERS[0])?.0.u),
    };
    let gap = ratio * size;
    let (exact, _) = last(session, &scene(kind, support, 1.0, 1.0, gap)?, SOLVERS[0])?;
    let deformation = match kind {
        "falling" => size,
        _ => largest(&exact.u),
    };
    let allowed = ALLOWED.0 + ALLOWED.1 * ratio;
    for solver in SOLVERS {
        for stress in STRESSES {
            for length in LENGTHS {
                let mut cell = Cell {
                    kind,
                    solver,
                    stress,
                    length,
                    ratio,
                    active: None,
                    kkt: None,
                    difference: None,
                    allowed,
                    verdict: Verdict::Refused,
                    message: None,
                };
                match last(session, &scene(kind, support, stress, length, gap)?, solver) {
                    Ok((state, kkt)) => {
                        let u: Vec<f64> = state.u.iter().map(|u| u / length).collect();
                        let apart = difference(&u, &exact.u) * largest(&exact.u) / deformation;
                        cell.active = Some(state.contact.iter().filter(|p| p.active).count());
                        (cell.kkt, cell.difference) = (Some(kkt), Some(apart));
                        let right = apart <= allowed;
                        cell.verdict = if right { Verdict::Correct } else { Verdict::Wrong };
                    }
                    Err(StudyError::Run(error @ RunError::Contact { .. })) => {
                        cell.message = Some(error.to_string());
                    }
                    Err(other) => return Err(other),
                }
                table.push(cell);
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
) -> Result<DiscreteProblem, StudyError> {
    let (young, pressure, gap) = (100.0 * stress, 0.02 * stress, gap * length);
    let (factor, time) = match kind {
        "swinging" => ("*sin(2*pi*t)", "time = { end = 0.75, step = 0.125 }"),
        _ => ("", ""),
    };
    let text = format!(
        r#"
mesh = {{ file = "case.msh" }}
material = {{ young = {young:e}, poisson = 0.3, plane = "stress" }}
{time}
boundary = [
    {{ name = "left", {support} }},
    {{ name = "bottom", gap = {gap:e} }},
    {{ name = "top", traction = [0, "-{pressure:e}*(0.5 + x/{length:e}){factor}"] }},
]"#
    );
    let scene = Scene::parse(&text, Path::new("scales.toml"), &[])?;
    Ok(DiscreteProblem::new(scene, rectangle(2.0 * length, length, 12, 6))?)
}

/// The last state and the worst residual.
fn last(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
) -> Result<(State, f64), StudyError> {
    if problem.scene().time.is_none() {
        let (step, _) = solve(session, problem, solver, None)??;
        return Ok((step.state, step.record.kkt().worst()));
    }
    let phases = Phases::default();
    let outcome = evolution::run(session, problem, solver, &phases, &mut |_| Ok(()))?;
    Ok((outcome.last.state, outcome.kkt.worst()))
}

fn largest(u: &[f64]) -> f64 {
    u.iter().fold(0.0, |m, v| m.max(v.abs()))
}
