//! Map 3. Penalty-duality: ω against λω.

use super::{
    Counts, StudyError, Verdict,
    statics::{self, difference, problem},
};
use crate::{output, petsc::Session};
use serde::Serialize;
use std::path::Path;

/// Square clamped left, pressed down on the left half of its top and pulled up on the right.
pub(super) const D40: &str = r#"
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = 0 },
    { name = "top", traction = [0, "-15 + 25*max(-1, min(1, 1e6*(x - 0.5)))"] },
]
"#;
/// A horizontal soft band whose stiffness is 1/contrast.
const BAND: &str = r#"
damage = { diffusion = 1, lambda_d = 0, lambda_u = 0, lambda_w = 0, strain_cap = 1, threshold = 1e-6, initial = "SOFT + (1 - SOFT)*min(1, max(0, 8*abs(y - 0.5) - 1))" }
"#;

/// Answers agree when they differ by less, relative to the largest |u|.
const AGREEMENT: f64 = 1e-8;

#[derive(Serialize)]
struct Cell {
    h: f64,
    contrast: f64,
    omega: f64,
    omega_over_auto: f64,
    lambda_omega: f64,
    accelerate: bool,
    iterations: usize,
    converged: bool,
    contraction: Option<f64>,
    difference: Option<f64>,
    verdict: Verdict,
}

/// One mesh and stiffness, and the parameters to try there.
struct Sweep {
    cells: usize,
    contrast: f64,
    cap: usize,
    /// Powers of ten of ω/ω_auto.
    decades: &'static [f64],
    lambdas: &'static [f64],
}

const WIDE: [f64; 9] = [-3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0];
const FEW: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
const LAMBDAS: [f64; 7] = [0.1, 0.3, 0.45, 0.5, 0.55, 0.7, 0.9];
const SIDES: [f64; 3] = [0.3, 0.5, 0.7];

const fn sweep(
    cells: usize,
    contrast: f64,
    cap: usize,
    decades: &'static [f64],
    lambdas: &'static [f64],
) -> Sweep {
    Sweep { cells, contrast, cap, decades, lambdas }
}

const SWEEPS: [Sweep; 8] = [
    sweep(16, 1.0, 1000, &WIDE, &LAMBDAS),
    sweep(32, 1.0, 500, &WIDE, &SIDES),
    sweep(64, 1.0, 300, &FEW, &[0.5]),
    sweep(128, 1.0, 100, &[-1.0, 0.0, 1.0], &[0.5]),
    sweep(32, 1e1, 300, &FEW, &[0.5]),
    sweep(32, 1e2, 300, &FEW, &[0.5]),
    sweep(32, 1e3, 300, &FEW, &[0.5]),
    sweep(32, 1e4, 300, &FEW, &[0.5]),
];

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let mut table = Vec::new();
    for sweep in &SWEEPS {
        fill(session, sweep, &mut table)?;
        // Written after each sweep: what is measured is kept.
        output::write_table(&folder.join("penalty-duality.csv"), &table)?;
    }
    Ok(table.iter().map(|cell| cell.verdict).collect())
}

fn fill(session: &Session, sweep: &Sweep, table: &mut Vec<Cell>) -> Result<(), StudyError> {
    let solve = |solver: &str, keys: &[String]| {
        let overrides: Vec<String> =
            keys.iter().map(|key| format!("contact.penalty_duality.{key}")).collect();
        let text = match sweep.contrast {
            1.0 => D40.to_owned(),
            contrast => D40.to_owned() + &BAND.replace("SOFT", &(1.0 / contrast).to_string()),
        };
        let problem = problem(&text, &overrides, (1.0, 1.0, sweep.cells, sweep.cells))?;
        statics::solve(session, &problem, solver, None)
    };
    let (reference, _) = solve("active-set", &[])??;
    let (_, found) = solve("penalty-duality", &[])??;
    let automatic = found.omega.unwrap_or(f64::NAN);
    for accelerate in [false, true] {
        for &lambda_omega in sweep.lambdas {
            for &decade in sweep.decades {
                let omega = automatic * 10f64.powf(decade);
                let keys = [
                    format!("omega={omega:e}"),
                    format!("lambda_omega={lambda_omega}"),
                    format!("accelerate={accelerate}"),
                    format!("iterations={}", sweep.cap),
                ];
                let answer = solve("penalty-duality", &keys)?;
                let mut cell = Cell {
                    h: 1.0 / sweep.cells as f64,
                    contrast: sweep.contrast,
                    omega,
                    omega_over_auto: 10f64.powf(decade),
                    lambda_omega,
                    accelerate,
                    iterations: sweep.cap,
                    converged: false,
                    contraction: None,
                    difference: None,
                    verdict: Verdict::Refused,
                };
                if let Ok((step, report)) = answer {
                    let difference = difference(&step.state.u, &reference.state.u);
                    cell.converged = true;
                    cell.iterations = report.iterations;
                    cell.contraction = report.contraction;
                    cell.difference = Some(difference);
                    cell.verdict = match difference <= AGREEMENT {
                        true => Verdict::Correct,
                        false => Verdict::Wrong,
                    };
                }
                table.push(cell);
            }
        }
    }
    Ok(())
}
